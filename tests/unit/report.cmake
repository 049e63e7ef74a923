find_package(nlohmann_json REQUIRED)

ravencal_test(NAME report_reduce_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/report_reduce_test.cpp
  LIBS ravencal_report LABELS unit)
ravencal_test(NAME report_page_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/report_page_test.cpp ${CMAKE_CURRENT_LIST_DIR}/report_sample.cpp
  LIBS ravencal_report nlohmann_json::nlohmann_json LABELS unit)
ravencal_test(NAME report_browser_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/report_browser_test.cpp ${CMAKE_CURRENT_LIST_DIR}/browser.cpp
          ${CMAKE_CURRENT_LIST_DIR}/report_sample.cpp
  LIBS ravencal_report LABELS unit SLOW)

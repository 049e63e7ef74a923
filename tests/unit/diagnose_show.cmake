ravencal_test(NAME diagnose_show_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_show_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_improved_test.cpp ${CMAKE_CURRENT_LIST_DIR}/browser.cpp
  LIBS ravencal_diagnose ravencal_simulation ravencal_trajectory fmt::fmt LABELS unit promise SLOW)
target_include_directories(diagnose_show_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_page_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_page_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_page_sample.cpp
          ${CMAKE_CURRENT_LIST_DIR}/browser.cpp
  LIBS ravencal_diagnose nlohmann_json::nlohmann_json fmt::fmt LABELS unit promise SLOW TOGETHER DiagnosisPage)

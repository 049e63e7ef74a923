find_package(nlohmann_json REQUIRED)

ravencal_test(NAME compare_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/compare_test.cpp ${CMAKE_CURRENT_LIST_DIR}/recommend_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/browser.cpp
  LIBS ravencal_compare nlohmann_json::nlohmann_json LABELS unit SLOW)

find_package(nlohmann_json REQUIRED)
ravencal_test(NAME core_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/catalogue_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/isolated_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/known_words_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/median_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/partial_file_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/side_by_side_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/toml_table_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/whole_file_test.cpp
  LIBS ravencal::toml Eigen3::Eigen nlohmann_json::nlohmann_json LABELS unit)

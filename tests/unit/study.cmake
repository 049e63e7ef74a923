ravencal_test(NAME study_table_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/study_table_test.cpp ${CMAKE_CURRENT_LIST_DIR}/browser.cpp
  LIBS ravencal_study_table ravencal_report nlohmann_json::nlohmann_json LABELS unit)
ravencal_test(NAME study_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/study_arm.cpp ${CMAKE_CURRENT_LIST_DIR}/study_errors_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/study_files_test.cpp ${CMAKE_CURRENT_LIST_DIR}/study_findings_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/study_jobs_test.cpp
  LIBS ravencal_study nlohmann_json::nlohmann_json fmt::fmt LABELS unit SLOW)
ravencal_test(NAME study_command_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/study_command_test.cpp ${CMAKE_CURRENT_LIST_DIR}/study_arm.cpp
          ${CMAKE_CURRENT_LIST_DIR}/browser.cpp
  LIBS ravencal_learn fmt::fmt LABELS unit SLOW)
target_compile_definitions(study_command_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(study_command_test ravencal)

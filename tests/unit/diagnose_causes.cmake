ravencal_test(NAME diagnose_causes_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_causes_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal_diagnose LABELS unit promise)
target_include_directories(diagnose_causes_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_program_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_program_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal::record fmt::fmt LABELS unit promise SLOW)
target_include_directories(diagnose_program_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_compile_definitions(diagnose_program_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(diagnose_program_test ravencal)
ravencal_test(NAME suggest_program_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/suggest_program_test.cpp
  LIBS ravencal_trajectory nlohmann_json::nlohmann_json fmt::fmt LABELS unit promise SLOW)
target_include_directories(suggest_program_test PRIVATE ${PROJECT_SOURCE_DIR}/tools/recording)
target_compile_definitions(suggest_program_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(suggest_program_test ravencal)
ravencal_test(NAME diagnose_twin_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_twin_test.cpp
  LIBS nlohmann_json::nlohmann_json fmt::fmt LABELS unit)
target_compile_definitions(diagnose_twin_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(diagnose_twin_test ravencal)

# The command as a user runs it.
ravencal_test(NAME convert_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/convert_test.cpp ${CMAKE_CURRENT_LIST_DIR}/convert_loop_test.cpp
  LIBS ravencal_learn nlohmann_json::nlohmann_json fmt::fmt LABELS unit SLOW)
target_compile_definitions(convert_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(convert_test ravencal)

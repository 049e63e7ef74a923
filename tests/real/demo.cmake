ravencal_test(NAME demo_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/demo_test.cpp
  LIBS fmt::fmt nlohmann_json::nlohmann_json LABELS e2e COST 10)
target_compile_definitions(demo_test PRIVATE
  RAVENCAL_PROGRAM_DIR="$<TARGET_FILE_DIR:ravencal>"
  RAVENCAL_DRIVER_DIR="$<TARGET_FILE_DIR:ravencal-encoders>" RAVENCAL_PLUGIN="$<TARGET_FILE:ravencal_plugin>")
add_dependencies(demo_test ravencal ravencal-encoders ravencal_plugin)

# tests/rt/plugin.cmake defines the rig.
ravencal_test(NAME rezero_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/rezero_test.cpp
  LIBS ravencal_rezero ravencal_test_rig LABELS unit)
find_package(nlohmann_json REQUIRED)
ravencal_test(NAME rezero_twin_test COST 30 SOURCES ${CMAKE_CURRENT_LIST_DIR}/rezero_twin_test.cpp
  LIBS ravencal::record fmt::fmt nlohmann_json::nlohmann_json LABELS tool TOGETHER RezeroTwin)
target_compile_definitions(rezero_twin_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>"
  RAVENCAL_ENCODERS="" RAVENCAL_PLUGIN_PATH="$<TARGET_FILE:ravencal_plugin>")
add_dependencies(rezero_twin_test ravencal ravencal_plugin)

# The plugin as a host sees it: everything through dlopen and the C ABI.
add_library(ravencal_test_rig STATIC ${CMAKE_CURRENT_LIST_DIR}/rig.cpp)
target_include_directories(ravencal_test_rig PUBLIC
  ${PROJECT_SOURCE_DIR}/tools ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(ravencal_test_rig PUBLIC
  RAVENCAL_PLUGIN_PATH="$<TARGET_FILE:ravencal_plugin>")
target_link_libraries(ravencal_test_rig PUBLIC ravencal_plugin_host ravencal::model GTest::gtest
  PRIVATE ravencal_warnings)
add_dependencies(ravencal_test_rig ravencal_plugin)

ravencal_test(NAME plugin_envelope_test
  SOURCES ${PROJECT_SOURCE_DIR}/tests/unit/plugin_envelope_test.cpp
  LIBS ravencal_test_rig LABELS rt)

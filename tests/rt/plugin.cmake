find_package(Threads REQUIRED)
find_package(nlohmann_json REQUIRED)

# The plugin as a host sees it: everything through dlopen and the C ABI.
add_library(ravencal_test_rig STATIC ${CMAKE_CURRENT_LIST_DIR}/rig.cpp
  ${CMAKE_CURRENT_LIST_DIR}/witness.cpp)
target_include_directories(ravencal_test_rig PUBLIC
  ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/tools ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(ravencal_test_rig PUBLIC
  RAVENCAL_PLUGIN_PATH="$<TARGET_FILE:ravencal_plugin>")
target_link_libraries(ravencal_test_rig PUBLIC ravencal_plugin_host ravencal::model GTest::gtest
  PRIVATE ravencal_warnings fmt::fmt)
add_dependencies(ravencal_test_rig ravencal_plugin)

ravencal_test(NAME plugin_envelope_test
  SOURCES ${PROJECT_SOURCE_DIR}/tests/unit/plugin_envelope_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_pedal_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_press_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_mode_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_weights_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_counters_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_distance_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_time_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/unit/plugin_homing_constant_test.cpp
  LIBS ravencal_test_rig LABELS rt)
if(NOT RAVENCAL_SANITIZED)  # sanitizers interpose malloc and locks themselves, and call the system
  ravencal_test(NAME plugin_real_time_test
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/real_time_test.cpp ${CMAKE_CURRENT_LIST_DIR}/alarm.cpp
            ${CMAKE_CURRENT_LIST_DIR}/system_call_alarm.cpp
    LIBS ravencal_test_rig ${CMAKE_DL_LIBS} LABELS rt)
  ravencal_test(NAME plugin_swap_test
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/swap_test.cpp ${CMAKE_CURRENT_LIST_DIR}/instruction_count.cpp
            ${CMAKE_CURRENT_LIST_DIR}/system_call_alarm.cpp
    LIBS ravencal_test_rig Threads::Threads LABELS rt)
  # Loaded libraries must find the interposed functions in the program.
  set_target_properties(plugin_real_time_test PROPERTIES ENABLE_EXPORTS ON)
endif()
ravencal_test(NAME plugin_parity_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/parity_test.cpp ${CMAKE_CURRENT_LIST_DIR}/float_mode_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/system_call_alarm.cpp
          ${CMAKE_CURRENT_LIST_DIR}/means_test.cpp
  LIBS ravencal_test_rig ravencal_blob_sample LABELS rt)
ravencal_test(NAME plugin_property_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/envelope_property_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_pair_property_test.cpp ${CMAKE_CURRENT_LIST_DIR}/press_property_test.cpp
  LIBS ravencal_test_rig ravencal::physics rapidcheck Threads::Threads LABELS rt)
ravencal_test(NAME plugin_host_test SOURCES ${PROJECT_SOURCE_DIR}/tests/unit/plugin_host_test.cpp
  LIBS ravencal_test_rig ravencal_host nlohmann_json::nlohmann_json LABELS rt)
ravencal_test(NAME plugin_latch_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/latch_test.cpp
  LIBS ravencal_test_rig ravencal_host ravencal_simulation LABELS rt)
ravencal_test(NAME plugin_twin_control_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/twin_control_test.cpp
  LIBS ravencal_test_rig ravencal::physics LABELS rt)
ravencal_test(NAME plugin_soak_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/soak_test.cpp
  LIBS ravencal_test_rig ravencal::physics LABELS rt)

# plugin.cmake defines the rig.
ravencal_test(NAME plugin_telemetry_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/telemetry_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/telemetry_readers_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/telemetry_flight_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/telemetry_owner_test.cpp
    ${PROJECT_SOURCE_DIR}/tests/unit/telemetry_segment.cpp
  LIBS ravencal_test_rig ravencal_host ravencal_monitor Threads::Threads LABELS rt)
ravencal_test(NAME plugin_lifecycle_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/lifecycle_test.cpp
    ${PROJECT_SOURCE_DIR}/tests/unit/telemetry_segment.cpp
  LIBS ravencal_test_rig ravencal_monitor LABELS rt)
ravencal_test(NAME plugin_control_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/control_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/control_program_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/control_request_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/rezero_program_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/instruction_count.cpp
    ${PROJECT_SOURCE_DIR}/tests/unit/telemetry_segment.cpp
  LIBS ravencal_test_rig ravencal_control ravencal_monitor Threads::Threads LABELS rt)
target_compile_definitions(plugin_control_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(plugin_control_test ravencal)

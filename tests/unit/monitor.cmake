# tests/rt/plugin.cmake defines the rig.
ravencal_test(NAME monitor_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/monitor_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/telemetry_reader_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/telemetry_segment.cpp
  LIBS ravencal_monitor ravencal_test_rig nlohmann_json::nlohmann_json Threads::Threads LABELS unit)

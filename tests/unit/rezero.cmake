# tests/rt/plugin.cmake defines the rig.
ravencal_test(NAME rezero_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/rezero_test.cpp
  LIBS ravencal_rezero ravencal_test_rig LABELS unit)

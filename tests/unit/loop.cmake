ravencal_test(NAME loop_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/loop_gain_test.cpp ${CMAKE_CURRENT_LIST_DIR}/loop_margins_test.cpp
  LIBS ravencal_loop LABELS unit)

ravencal_test(NAME follow_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/follow_test.cpp
  LIBS ravencal_simulation ravencal::record LABELS unit SLOW)

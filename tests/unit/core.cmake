ravencal_test(NAME core_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/catalogue_test.cpp
  LIBS ravencal::core LABELS unit)

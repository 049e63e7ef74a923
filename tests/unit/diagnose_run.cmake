ravencal_test(NAME diagnose_run_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_run_test.cpp
  LIBS ravencal_diagnose LABELS unit)

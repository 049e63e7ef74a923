ravencal_test(NAME diagnose_plots_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_plots_test.cpp
  LIBS ravencal_diagnose LABELS unit)

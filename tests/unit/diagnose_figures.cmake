ravencal_test(NAME diagnose_figures_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_figures_test.cpp
  LIBS ravencal_diagnose LABELS unit)

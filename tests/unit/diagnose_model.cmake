ravencal_test(NAME diagnose_model_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_model_test.cpp
  LIBS ravencal_diagnose_model LABELS unit)

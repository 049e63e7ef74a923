ravencal_test(NAME study_table_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/study_table_test.cpp
  LIBS ravencal_study_table LABELS unit)

ravencal_test(NAME diagnose_coupled_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_coupled_test.cpp
  LIBS ravencal_diagnose LABELS unit promise SLOW)
target_include_directories(diagnose_coupled_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})

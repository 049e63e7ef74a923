ravencal_test(NAME diagnose_rests_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_rests_test.cpp
  LIBS ravencal_diagnose LABELS unit)
target_include_directories(diagnose_rests_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})

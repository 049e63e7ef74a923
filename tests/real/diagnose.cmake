ravencal_test(NAME diagnose_real_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_real_test.cpp
  LIBS ravencal_diagnose LABELS real)
ravencal_test(NAME improved_real_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/improved_real_test.cpp
  LIBS ravencal_diagnose ravencal_simulation LABELS real)

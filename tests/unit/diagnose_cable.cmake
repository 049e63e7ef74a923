ravencal_test(NAME diagnose_cable_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_cable_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm.cpp
  LIBS ravencal_diagnose LABELS unit promise SLOW)
target_include_directories(diagnose_cable_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})

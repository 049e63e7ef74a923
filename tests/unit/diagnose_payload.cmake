ravencal_test(NAME diagnose_payload_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_payload_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm.cpp
  LIBS ravencal_diagnose LABELS unit inside SLOW)
target_include_directories(diagnose_payload_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})

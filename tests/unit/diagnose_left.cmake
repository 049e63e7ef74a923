ravencal_test(NAME diagnose_left_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_left_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal_diagnose fmt::fmt LABELS unit promise)
target_include_directories(diagnose_left_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})

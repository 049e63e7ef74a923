ravencal_test(NAME physics_real_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/physics_real_test.cpp
  LIBS ravencal::physics LABELS real)

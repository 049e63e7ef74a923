ravencal_test(NAME architecture_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/architecture_test.cpp
  LIBS fmt::fmt LABELS unit)

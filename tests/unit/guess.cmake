ravencal_test(NAME guess_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/guess_test.cpp ${CMAKE_CURRENT_LIST_DIR}/guess_names_test.cpp ${CMAKE_CURRENT_LIST_DIR}/guess_clock_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/guess_wraps_test.cpp
  LIBS ravencal_guess ravencal_exchange ravencal::record fmt::fmt LABELS unit)

ravencal_test(NAME choice_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/choice_test.cpp
  LIBS ravencal_choice fmt::fmt LABELS unit SLOW)
ravencal_test(NAME choice_held_out_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/choice_held_out_test.cpp
  LIBS ravencal_choice fmt::fmt LABELS unit SLOW)
ravencal_test(NAME choice_draws_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/choice_draws_test.cpp
  LIBS ravencal_choice fmt::fmt LABELS unit SLOW)

ravencal_test(NAME rezero_rows_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/rezero_rows_test.cpp
  LIBS ravencal_choice ravencal_rezero ravencal::record ravencal::model fmt::fmt LABELS real)

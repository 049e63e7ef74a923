ravencal_test(NAME methods_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/methods_sample.cpp
    ${CMAKE_CURRENT_LIST_DIR}/methods_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/methods_contract_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/methods_recurrent_test.cpp
  LIBS ravencal_methods fmt::fmt LABELS unit SLOW)

ravencal_test(NAME encoder_property_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/encoder_decoder_property_test.cpp
  LIBS ravencal::quadrature rapidcheck LABELS property)

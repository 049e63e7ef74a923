ravencal_test(NAME report_property_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/report_property_test.cpp
  LIBS ravencal_report rapidcheck LABELS property)

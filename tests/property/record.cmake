ravencal_test(NAME record_property_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/record/recording_property_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/csv_property_test.cpp
  LIBS ravencal::record rapidcheck fmt::fmt LABELS property)

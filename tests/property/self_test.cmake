ravencal_test(NAME self_test_property_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/self_test_property_test.cpp
  LIBS ravencal_conversion ravencal_choice ravencal_test_rig ravencal_blob_sample LABELS property)

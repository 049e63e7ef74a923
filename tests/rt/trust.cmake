ravencal_test(NAME plugin_trust_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/trust_test.cpp ${CMAKE_CURRENT_LIST_DIR}/trust_acl_test.cpp
  LIBS ravencal_test_rig ravencal_blob_sample ravencal_signing LABELS rt)

ravencal_test(NAME signing_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/signing_test.cpp
  LIBS ravencal_blob_sample ravencal_signing fmt::fmt LABELS unit)
target_compile_definitions(signing_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(signing_test ravencal)

find_package(rapidcheck REQUIRED)

ravencal_test(NAME kernels_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/kernels_test.cpp
  LIBS ravencal::kernels ravencal::model rapidcheck LABELS property)

ravencal_test(NAME compact_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/compact_test.cpp
  LIBS ravencal::model LABELS unit)

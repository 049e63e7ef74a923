if(NOT TARGET ravencal_kernels)
  add_subdirectory(${CMAKE_CURRENT_LIST_DIR}/../../rt_plugin/kernels ${PROJECT_BINARY_DIR}/rt_plugin/kernels)
endif()
find_package(rapidcheck REQUIRED)

ravencal_test(NAME kernels_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/kernels_test.cpp
  LIBS ravencal::kernels ravencal::kernels_pack rapidcheck LABELS property)

ravencal_test(NAME compact_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/compact_test.cpp
  LIBS ravencal::model LABELS unit)

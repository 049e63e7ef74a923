find_package(rapidcheck REQUIRED)

ravencal_test(NAME kernels_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/kernels_test.cpp ${CMAKE_CURRENT_LIST_DIR}/kernels_gru_test.cpp
  LIBS ravencal::kernels ravencal::model rapidcheck LABELS property)

ravencal_test(NAME compact_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/compact_test.cpp
  LIBS ravencal::model LABELS unit)

ravencal_test(NAME kernels_memory_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/kernels_memory_test.cpp ${PROJECT_SOURCE_DIR}/rt_plugin/blob_memory.cpp
          ${PROJECT_SOURCE_DIR}/rt_plugin/file_access.cpp
  LIBS ravencal::kernels LABELS unit)
target_include_directories(kernels_memory_test PRIVATE ${PROJECT_SOURCE_DIR})

get_target_property(eigen_folder Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
add_test(NAME Kernels.TheNeonBuildKeepsItsPromisesInAnEmulator
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/kernels_cross_test ${CMAKE_CURRENT_BINARY_DIR}/aarch64 ${eigen_folder})
set_tests_properties(Kernels.TheNeonBuildKeepsItsPromisesInAnEmulator PROPERTIES
  LABELS property TIMEOUT ${RAVENCAL_HANG_S} SKIP_RETURN_CODE 77)

ravencal_test(NAME kernels_plugin_gru_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/kernels_plugin_gru_test.cpp
  LIBS ravencal_test_rig ravencal::kernels LABELS rt)

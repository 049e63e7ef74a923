# bench_step is a program to run by hand, not a test. Peers that are not installed are skipped with
# a message. What stands for "as fast as this machine can" gets this machine's instruction set.
set(bench_step_native
  ${CMAKE_CURRENT_LIST_DIR}/step_bound.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_eigen.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp)
find_package(CLI11 REQUIRED)
# What the test of the checks shares with the benchmark.
set(bench_step_checked
  ${CMAKE_CURRENT_LIST_DIR}/step_bound.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_maximum.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_plugin.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_torch.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_reference.cpp)
add_executable(bench_step EXCLUDE_FROM_ALL
  ${bench_step_checked}
  ${CMAKE_CURRENT_LIST_DIR}/bench_step.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_calls.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_settings.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_onnx.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_eigen.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp
  ${PROJECT_SOURCE_DIR}/tests/rt/alarm.cpp)
target_include_directories(bench_step PRIVATE ${PROJECT_SOURCE_DIR}/tests ${PROJECT_SOURCE_DIR})
target_link_libraries(bench_step PRIVATE ravencal::kernels ravencal::model ravencal_test_rig
  nlohmann_json::nlohmann_json CLI11::CLI11 GTest::gtest Eigen3::Eigen fmt::fmt)
target_compile_options(bench_step PRIVATE -Wno-psabi)
set_source_files_properties(${bench_step_native}
  PROPERTIES COMPILE_OPTIONS "-O3;-march=native;-w" COMPILE_DEFINITIONS "EIGEN_STACK_ALLOCATION_LIMIT=0")

ravencal_test(NAME bench_step_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/step_test.cpp ${bench_step_checked}
  LIBS ravencal::kernels ravencal::model ravencal_test_rig fmt::fmt LABELS unit)

# Off by default: LibTorch's package file talks a lot and looks for half a system.
option(RAVENCAL_BENCH_PEERS "Look for LibTorch, ONNX Runtime and RTNeural, for bench_step to compare with" OFF)
if(RAVENCAL_BENCH_PEERS)
  find_package(Torch QUIET)
  find_path(RTNEURAL_INCLUDE_DIR RTNeural/RTNeural.h)
  find_path(ONNXRUNTIME_INCLUDE_DIR onnxruntime_c_api.h PATH_SUFFIXES onnxruntime)
  find_library(ONNXRUNTIME_LIBRARY NAMES onnxruntime libonnxruntime.so.1)
endif()
if(Torch_FOUND)
  target_link_libraries(bench_step PRIVATE ${TORCH_LIBRARIES} ${CMAKE_DL_LIBS})
  target_link_libraries(bench_step_test PRIVATE ${TORCH_LIBRARIES} ${CMAKE_DL_LIBS})
  set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/step_peer_torch.cpp
    PROPERTIES COMPILE_DEFINITIONS RAVENCAL_BENCH_TORCH COMPILE_OPTIONS "-w")
endif()
if(ONNXRUNTIME_INCLUDE_DIR AND ONNXRUNTIME_LIBRARY)
  find_package(ONNX REQUIRED CONFIG)
  find_package(Protobuf REQUIRED)
  target_include_directories(bench_step PRIVATE ${ONNXRUNTIME_INCLUDE_DIR})
  target_link_libraries(bench_step PRIVATE ${ONNXRUNTIME_LIBRARY} onnx_proto protobuf::libprotobuf)
  set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/step_peer_onnx.cpp
    PROPERTIES COMPILE_DEFINITIONS RAVENCAL_BENCH_ONNX_RUNTIME COMPILE_OPTIONS "-w")
endif()
if(RTNEURAL_INCLUDE_DIR)
  target_include_directories(bench_step PRIVATE ${RTNEURAL_INCLUDE_DIR})
  set_property(SOURCE ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp APPEND
    PROPERTY COMPILE_DEFINITIONS RAVENCAL_BENCH_RTNEURAL RTNEURAL_USE_EIGEN=1
                                 RTNEURAL_DEFAULT_ALIGNMENT=32)
endif()

# bench_step is a program to run by hand, not a test. Peers that are not installed are skipped with
# a message. Eigen and the peers that are compiled here get this machine's instruction set.
add_executable(bench_step EXCLUDE_FROM_ALL
  ${CMAKE_CURRENT_LIST_DIR}/bench_step.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_plugin.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_eigen.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_torch.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp)
target_include_directories(bench_step PRIVATE ${CMAKE_CURRENT_LIST_DIR}/.. ${CMAKE_CURRENT_LIST_DIR}/../..)
target_link_libraries(bench_step PRIVATE ravencal::kernels ravencal::model ravencal_test_rig GTest::gtest Eigen3::Eigen fmt::fmt)
target_compile_options(bench_step PRIVATE -Wno-psabi)
set_source_files_properties(
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_eigen.cpp ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp
  PROPERTIES COMPILE_OPTIONS "-O3;-march=native;-w" COMPILE_DEFINITIONS "EIGEN_STACK_ALLOCATION_LIMIT=0")

# Off by default: LibTorch's package file talks a lot and looks for half a system.
option(RAVENCAL_BENCH_PEERS "Look for LibTorch and RTNeural, for bench_step to compare with" OFF)
if(RAVENCAL_BENCH_PEERS)
  find_package(Torch QUIET)
  find_path(RTNEURAL_INCLUDE_DIR RTNeural/RTNeural.h)
endif()
if(Torch_FOUND)
  target_link_libraries(bench_step PRIVATE ${TORCH_LIBRARIES})
  set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/step_peer_torch.cpp
    PROPERTIES COMPILE_DEFINITIONS RAVENCAL_BENCH_TORCH COMPILE_OPTIONS "-w")
endif()
if(RTNEURAL_INCLUDE_DIR)
  target_include_directories(bench_step PRIVATE ${RTNEURAL_INCLUDE_DIR})
  set_property(SOURCE ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp APPEND
    PROPERTY COMPILE_DEFINITIONS RAVENCAL_BENCH_RTNEURAL RTNEURAL_USE_EIGEN=1
                                 RTNEURAL_DEFAULT_ALIGNMENT=32)
endif()

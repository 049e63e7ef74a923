# bench_step is a program to run by hand, not a test. Peers that are not installed are skipped with
# a message. Eigen and the peers that are compiled here get this machine's instruction set.
add_executable(bench_step EXCLUDE_FROM_ALL
  ${CMAKE_CURRENT_LIST_DIR}/bench_step.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_eigen.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_torch.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_onnxruntime.cpp)
target_include_directories(bench_step PRIVATE ${CMAKE_CURRENT_LIST_DIR}/.. ${CMAKE_CURRENT_LIST_DIR}/../..)
target_link_libraries(bench_step PRIVATE ravencal::kernels ravencal::kernels_pack Eigen3::Eigen fmt::fmt)
target_compile_options(bench_step PRIVATE -Wno-psabi)
set_source_files_properties(
  ${CMAKE_CURRENT_LIST_DIR}/step_peer_eigen.cpp ${CMAKE_CURRENT_LIST_DIR}/step_peer_rtneural.cpp
  PROPERTIES COMPILE_OPTIONS "-O3;-march=native;-w" COMPILE_DEFINITIONS "EIGEN_STACK_ALLOCATION_LIMIT=0")

find_package(Torch QUIET)
if(Torch_FOUND)
  target_link_libraries(bench_step PRIVATE ${TORCH_LIBRARIES})
  set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/step_peer_torch.cpp
    PROPERTIES COMPILE_DEFINITIONS RAVENCAL_BENCH_TORCH COMPILE_OPTIONS "-w")
endif()

# Prints figures for README; not a test, because no time decides pass or fail.
add_library(ravencal_step_peer STATIC ${CMAKE_CURRENT_LIST_DIR}/step_peer.cpp)
target_include_directories(ravencal_step_peer PUBLIC ${PROJECT_SOURCE_DIR}/tests)
target_link_libraries(ravencal_step_peer PRIVATE ravencal_warnings Eigen3::Eigen)
# Its own Eigen, compiled for this machine: see rt_plugin/kernel_unit.cpp for why it is renamed. The
# exclusions are gcc 12's false alarms inside AVX-512 headers and fixed loops of Eigen.
target_compile_definitions(ravencal_step_peer PRIVATE Eigen=Eigen_peer)
target_compile_options(ravencal_step_peer PRIVATE -O3 -DNDEBUG -march=native
  $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)

add_executable(step_bench ${CMAKE_CURRENT_LIST_DIR}/step_bench.cpp)
target_link_libraries(step_bench PRIVATE
  ravencal_step_peer ravencal_test_rig fmt::fmt GTest::gtest ravencal_warnings)

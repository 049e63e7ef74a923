add_executable(physics_bench ${CMAKE_CURRENT_LIST_DIR}/physics_bench.cpp)
target_link_libraries(physics_bench PRIVATE ravencal::physics fmt::fmt ravencal_warnings)

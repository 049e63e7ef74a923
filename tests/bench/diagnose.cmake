find_package(CLI11 REQUIRED)
add_executable(diagnose_bench EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/diagnose_bench.cpp)
target_link_libraries(diagnose_bench PRIVATE CLI11::CLI11 fmt::fmt ravencal_warnings)

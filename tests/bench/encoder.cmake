# Run by hand: encoder_bench
add_executable(encoder_bench ${CMAKE_CURRENT_LIST_DIR}/encoder_bench.cpp)
target_link_libraries(encoder_bench PRIVATE ravencal::encoder_recording fmt::fmt ravencal_warnings)

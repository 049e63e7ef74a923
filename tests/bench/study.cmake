add_executable(study_bench ${CMAKE_CURRENT_LIST_DIR}/study_bench.cpp)
target_link_libraries(study_bench PRIVATE ravencal_learn ravencal_warnings)

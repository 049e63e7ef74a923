add_executable(train_bench ${CMAKE_CURRENT_LIST_DIR}/train_bench.cpp)
target_include_directories(train_bench PRIVATE ${PROJECT_SOURCE_DIR}/tools)
target_link_libraries(train_bench PRIVATE ravencal_learn ravencal_warnings)

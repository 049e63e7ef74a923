add_executable(learn_tip_error ${CMAKE_CURRENT_LIST_DIR}/learn_tip_error.cpp)
target_include_directories(learn_tip_error PRIVATE ${PROJECT_SOURCE_DIR}/tools)
target_link_libraries(learn_tip_error PRIVATE ravencal_learn fmt::fmt ravencal_warnings)

ravencal_test(NAME real_rows_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/real_rows_test.cpp
  LIBS fmt::fmt nlohmann_json::nlohmann_json LABELS real)
target_compile_definitions(real_rows_test PRIVATE
  RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>" RAVENCAL_TIP_ERROR="$<TARGET_FILE:learn_tip_error>")
add_dependencies(real_rows_test ravencal learn_tip_error)

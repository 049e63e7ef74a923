add_executable(learn_tip_error ${CMAKE_CURRENT_LIST_DIR}/learn_tip_error.cpp)
target_include_directories(learn_tip_error PRIVATE ${PROJECT_SOURCE_DIR}/tools)
target_link_libraries(learn_tip_error PRIVATE ravencal_learn fmt::fmt ravencal_warnings)

# The rows of README, with the shipped program: each figure must stay below what is known to be
# reachable without a network (offset, coupling and play fitted by hand).
if(EXISTS ${RAVENCAL_DATA_DIR}/dvrk_berkeley AND EXISTS ${RAVENCAL_DATA_DIR}/dvrk_jhu_tracker)
  add_test(NAME RealRows.TrainAndTestOnRealArms
    COMMAND ${CMAKE_CURRENT_LIST_DIR}/real_rows.sh $<TARGET_FILE:ravencal>
      $<TARGET_FILE:learn_tip_error> ${RAVENCAL_DATA_DIR} ${CMAKE_CURRENT_BINARY_DIR}/real_rows)
  set_tests_properties(RealRows.TrainAndTestOnRealArms PROPERTIES LABELS real TIMEOUT 600)
endif()

add_test(NAME RunTests.CountsEveryEndThatATestCanHave COMMAND ${CMAKE_CURRENT_LIST_DIR}/run_tests_test)
set_tests_properties(RunTests.CountsEveryEndThatATestCanHave PROPERTIES LABELS unit TIMEOUT ${RAVENCAL_HANG_S})

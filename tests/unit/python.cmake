# `import ravencal` as a user has it.
if(TARGET ravencal_python)
  set(python_environment "PYTHONPATH=$<TARGET_FILE_DIR:ravencal_python>/..;PYTHONDONTWRITEBYTECODE=1;RAVENCAL_PROGRAM=$<TARGET_FILE:ravencal>;RAVENCAL_SOURCE_DIR=${PROJECT_SOURCE_DIR}")
  add_test(NAME Python.TheModuleDoesWhatTheProgramDoes
    COMMAND ${Python_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/python_test.py -v)
  add_test(NAME Python.TheExampleRuns
    COMMAND ${Python_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/python/example.py ${PROJECT_SOURCE_DIR}/tools/plants/raven2.toml)
else()
  foreach(test Python.TheModuleDoesWhatTheProgramDoes Python.TheExampleRuns)
    add_test(NAME ${test} COMMAND ${CMAKE_COMMAND} -E echo "SKIP: this build has no Python module")
  endforeach()
endif()
set_tests_properties(Python.TheModuleDoesWhatTheProgramDoes Python.TheExampleRuns PROPERTIES
  LABELS unit TIMEOUT ${RAVENCAL_HANG_S} ENVIRONMENT "${python_environment}" SKIP_REGULAR_EXPRESSION "^SKIP: ")

# `import ravencal` as a user has it.
set(python_missing "this build has no Python module")
if(TARGET ravencal_python)
  set(python_missing)
  execute_process(COMMAND ${Python_EXECUTABLE} -c "import numpy" RESULT_VARIABLE failed ERROR_QUIET)
  if(failed)
    set(python_missing "${Python_EXECUTABLE} has no NumPy (python3-numpy)")
  endif()
endif()
if(NOT python_missing)
  set(python_environment "PYTHONPATH=$<TARGET_FILE_DIR:ravencal_python>/..;PYTHONDONTWRITEBYTECODE=1;RAVENCAL_PROGRAM=$<TARGET_FILE:ravencal>;RAVENCAL_SOURCE_DIR=${PROJECT_SOURCE_DIR}")
  add_test(NAME Python.TheModuleDoesWhatTheProgramDoes
    COMMAND ${Python_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/python_test.py -v)
  add_test(NAME Python.TheExampleRuns
    COMMAND ${Python_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/python/example.py ${PROJECT_SOURCE_DIR}/tools/plants/raven2.toml)
else()
  foreach(test Python.TheModuleDoesWhatTheProgramDoes Python.TheExampleRuns)
    add_test(NAME ${test} COMMAND ${CMAKE_COMMAND} -E echo "SKIP: ${python_missing}")
  endforeach()
endif()
set_tests_properties(Python.TheModuleDoesWhatTheProgramDoes Python.TheExampleRuns PROPERTIES
  LABELS unit PROCESSORS 2 TIMEOUT ${RAVENCAL_HANG_S} ENVIRONMENT "${python_environment}" SKIP_REGULAR_EXPRESSION "^SKIP: ")

# What commands do to files: outputs over inputs, devices, numbers that are none, kills.
ravencal_test(NAME files_command_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/files_command_test.cpp
  LIBS fmt::fmt LABELS tool TOGETHER FilesOfACommand)
ravencal_test(NAME kill_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/kill_test.cpp
  LIBS ravencal_cli fmt::fmt LABELS tool COST 10 TOGETHER Files/KilledCommand StoppedCommand)
foreach(test files_command_test kill_test)
  target_compile_definitions(${test} PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>"
    RAVENCAL_ENCODERS="$<TARGET_FILE:ravencal-encoders>")
  add_dependencies(${test} ravencal ravencal-encoders)
endforeach()

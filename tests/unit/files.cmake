# What commands do to files: outputs over inputs, devices, numbers that are none, messages that nobody hears, kills.
ravencal_test(NAME files_command_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/files_command_test.cpp
  LIBS fmt::fmt LABELS tool TOGETHER FilesOfACommand)
ravencal_test(NAME messages_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/messages_test.cpp
  LIBS ravencal::core fmt::fmt LABELS tool COST 10 TOGETHER Messages)
ravencal_test(NAME kill_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/kill_test.cpp
  LIBS ravencal_cli fmt::fmt LABELS tool COST 10 TOGETHER Files/KilledCommand StoppedCommand)
ravencal_test(NAME outputs_command_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/outputs_command_test.cpp
  LIBS fmt::fmt LABELS tool COST 10 TOGETHER OutputsOfEveryCommand)
target_compile_definitions(outputs_command_test PRIVATE RAVENCAL_PLUGIN="$<TARGET_FILE:ravencal_plugin>")
add_dependencies(outputs_command_test ravencal_plugin)
foreach(test files_command_test messages_test kill_test outputs_command_test)
  target_compile_definitions(${test} PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>"
    RAVENCAL_ENCODERS="$<TARGET_FILE:ravencal-encoders>")
  add_dependencies(${test} ravencal ravencal-encoders)
endforeach()
target_compile_definitions(messages_test PRIVATE RAVENCAL_PLUGIN="$<TARGET_FILE:ravencal_plugin>")
add_dependencies(messages_test ravencal_plugin)

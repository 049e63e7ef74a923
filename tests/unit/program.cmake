ravencal_test(NAME program_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/program_test.cpp
  LIBS ravencal::record LABELS unit SLOW)
target_compile_definitions(program_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>"
  RAVENCAL_ENCODERS="$<TARGET_FILE:ravencal-encoders>")
add_dependencies(program_test ravencal ravencal-encoders)

ravencal_test(NAME plausible_program_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/plausible_program_test.cpp
  LIBS ravencal::record fmt::fmt LABELS unit SLOW)
target_compile_definitions(plausible_program_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>"
  RAVENCAL_ENCODERS="$<TARGET_FILE:ravencal-encoders>")
add_dependencies(plausible_program_test ravencal ravencal-encoders)

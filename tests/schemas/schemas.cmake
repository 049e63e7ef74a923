# Documents for other programs keep to their JSON Schemas.
add_test(NAME Schemas.TheProgramWritesWhatTheSchemasSay
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/schema_test $<TARGET_FILE:ravencal> ${PROJECT_SOURCE_DIR})
set_tests_properties(Schemas.TheProgramWritesWhatTheSchemasSay
  PROPERTIES LABELS tool TIMEOUT ${RAVENCAL_HANG_S} PROCESSORS 2 SKIP_RETURN_CODE 77)

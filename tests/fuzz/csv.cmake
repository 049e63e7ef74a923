ravencal_test(NAME csv_replay_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/csv_replay_test.cpp ${CMAKE_CURRENT_LIST_DIR}/csv_input.cpp
  LIBS ravencal::record LABELS replay)

if(RAVENCAL_FUZZ)
  # The reader itself is compiled again, because only instrumented code guides the fuzzer.
  get_target_property(record_sources ravencal_record SOURCES)
  list(TRANSFORM record_sources PREPEND ${PROJECT_SOURCE_DIR}/shared/record/)
  add_executable(csv_fuzz ${CMAKE_CURRENT_LIST_DIR}/csv_fuzz.cpp
    ${CMAKE_CURRENT_LIST_DIR}/csv_input.cpp ${record_sources})
  target_compile_options(csv_fuzz PRIVATE -fsanitize=fuzzer,address,undefined
    -fno-sanitize-recover=all)
  target_link_options(csv_fuzz PRIVATE -fsanitize=fuzzer,address,undefined)
  target_link_libraries(csv_fuzz PRIVATE ravencal::record SQLite::SQLite3
    ravencal::toml FastFloat::fast_float nlohmann_json::nlohmann_json Threads::Threads)
endif()

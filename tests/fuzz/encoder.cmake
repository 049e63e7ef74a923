ravencal_test(NAME encoder_replay_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/encoder_replay_test.cpp ${CMAKE_CURRENT_LIST_DIR}/encoder_input.cpp
  LIBS ravencal::encoder_recording LABELS replay)

if(RAVENCAL_FUZZ)
  # Compiled again, because only instrumented code guides the fuzzer.
  set(reader ${PROJECT_SOURCE_DIR}/quadrature_reader)
  add_executable(encoder_fuzz ${CMAKE_CURRENT_LIST_DIR}/encoder_fuzz.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_input.cpp
    ${reader}/config.cpp ${reader}/config_sources.cpp ${reader}/reading.cpp ${reader}/decoder.cpp
    ${reader}/glitch_filter.cpp ${reader}/index_check.cpp ${reader}/count_track.cpp ${reader}/axis.cpp
    ${reader}/sources/can_decoder.cpp ${reader}/sources/can_link.cpp ${reader}/sources/count_follower.cpp
    ${reader}/sources/replay.cpp)
  target_compile_options(encoder_fuzz PRIVATE -fsanitize=fuzzer,address,undefined
    -fno-sanitize-recover=all)
  target_link_options(encoder_fuzz PRIVATE -fsanitize=fuzzer,address,undefined)
  target_link_libraries(encoder_fuzz PRIVATE ravencal::encoder_recording ravencal::toml)
endif()

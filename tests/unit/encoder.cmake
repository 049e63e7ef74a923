ravencal_test(NAME encoder_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/encoder_axis_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_homing_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_parts_test.cpp
  LIBS ravencal::quadrature LABELS unit)
ravencal_test(NAME encoder_recording_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/encoder_can_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_config_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_counter_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_gpio_source_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_reader_thread_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_recorder_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_replay_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_setup_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_sorter_test.cpp
  LIBS ravencal::encoder_recording fmt::fmt LABELS unit)
ravencal_test(NAME encoder_failure_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/encoder_failure_test.cpp
  LIBS ravencal::encoder_recording LABELS unit SLOW)
ravencal_test(NAME encoder_program_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/encoder_program_test.cpp
  LIBS ravencal::encoder_recording nlohmann_json::nlohmann_json fmt::fmt LABELS unit SLOW)
target_compile_definitions(encoder_program_test PRIVATE RAVENCAL_ENCODERS="$<TARGET_FILE:ravencal-encoders>")
add_dependencies(encoder_program_test ravencal-encoders)

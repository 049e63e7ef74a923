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
    ${CMAKE_CURRENT_LIST_DIR}/encoder_recorder_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/encoder_sorter_test.cpp
  LIBS ravencal::encoder_recording fmt::fmt LABELS unit)
ravencal_test(NAME encoder_alignment_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/encoder_alignment_test.cpp
  LIBS ravencal::alignment LABELS unit)
ravencal_test(NAME encoder_failure_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/encoder_failure_test.cpp
  LIBS ravencal::encoder_recording LABELS unit)

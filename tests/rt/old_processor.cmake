# A processor without AVX: the plugin must choose its baseline kernels, and correct as on any other.
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64" AND NOT RAVENCAL_SANITIZED)
  add_executable(one_avx_instruction ${CMAKE_CURRENT_LIST_DIR}/avx.cpp)
  add_test(NAME OldProcessor.WithoutAvxRunsThePlugin
    COMMAND ${CMAKE_CURRENT_LIST_DIR}/old_processor_test
      $<TARGET_FILE:one_avx_instruction> $<TARGET_FILE:plugin_lifecycle_test>
      $<TARGET_FILE:plugin_parity_test>)
  set_tests_properties(OldProcessor.WithoutAvxRunsThePlugin PROPERTIES
    LABELS rt TIMEOUT ${RAVENCAL_HANG_S} SKIP_RETURN_CODE 77)
endif()

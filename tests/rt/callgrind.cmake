# The number of instructions of one step, counted by valgrind's callgrind: exact, whatever else the
# machine does.
find_path(CALLGRIND_INCLUDE_DIR valgrind/callgrind.h)
if(CALLGRIND_INCLUDE_DIR AND NOT RAVENCAL_SANITIZED AND CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  add_executable(callgrind_steps ${CMAKE_CURRENT_LIST_DIR}/callgrind_steps.cpp)
  target_include_directories(callgrind_steps PRIVATE ${CALLGRIND_INCLUDE_DIR})
  target_link_libraries(callgrind_steps PRIVATE ravencal_test_rig ravencal::kernels ravencal_warnings)
  ravencal_test(NAME callgrind_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/callgrind_test.cpp
    LIBS ravencal::core LABELS rt)
  target_compile_definitions(callgrind_test PRIVATE
    RAVENCAL_CALLGRIND_STEPS="$<TARGET_FILE:callgrind_steps>"
    RAVENCAL_GATED=$<AND:$<CXX_COMPILER_ID:GNU>,$<CONFIG:Release>>)
  add_dependencies(callgrind_test callgrind_steps)
endif()

# The control loop with the plugin on a real-time and on an ordinary kernel, in turns with cyclictest.
add_executable(rt_weights ${CMAKE_CURRENT_LIST_DIR}/rt_weights.cpp)
target_link_libraries(rt_weights PRIVATE ravencal_test_rig ravencal_warnings)
set(vm_rt_bin ${CMAKE_CURRENT_BINARY_DIR}/vm_rt_bin)
set(vm_rt_files)
foreach(program ravencal ravencal_plugin rt_weights)
  add_custom_command(OUTPUT ${vm_rt_bin}/${program}
    COMMAND ${CMAKE_COMMAND} -E copy $<TARGET_FILE:${program}> ${vm_rt_bin}/${program}
    DEPENDS ${program})
  list(APPEND vm_rt_files ${vm_rt_bin}/${program})
endforeach()
add_custom_target(vm_rt_programs ALL DEPENDS ${vm_rt_files})

function(vm_rt_test name flavour)
  add_test(NAME Vm.${name} COMMAND ${CMAKE_COMMAND} -E env RAVENCAL_VM_FLAVOUR=${flavour}
    ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/vm_test short ${vm_rt_bin} "-i 2" rt_loop.sh)
  set_tests_properties(Vm.${name} PROPERTIES LABELS vm TIMEOUT ${RAVENCAL_HANG_S} SKIP_RETURN_CODE 77 RESOURCE_LOCK vm COST 100)
endfunction()
vm_rt_test(LoopRunsBesideCyclictestOnARealTimeKernel rt)
vm_rt_test(LoopRunsBesideCyclictestOnAnOrdinaryKernel generic)

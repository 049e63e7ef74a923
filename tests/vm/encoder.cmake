# The encoders' path through real kernel interfaces, in an emulated machine (see vm_test).
add_executable(gpio_sim_driver ${CMAKE_CURRENT_LIST_DIR}/gpio_sim_driver.cpp)
add_executable(can_sender ${CMAKE_CURRENT_LIST_DIR}/can_sender.cpp)
set(vm_bin ${CMAKE_CURRENT_BINARY_DIR}/vm_bin)
foreach(program ravencal-encoders gpio_sim_driver can_sender)
  add_custom_command(OUTPUT ${vm_bin}/${program}
    COMMAND ${CMAKE_COMMAND} -E copy $<TARGET_FILE:${program}> ${vm_bin}/${program}
    DEPENDS ${program})
  list(APPEND vm_programs ${vm_bin}/${program})
endforeach()
add_custom_target(vm_programs ALL DEPENDS ${vm_programs})

if(gpiod_VERSION VERSION_GREATER_EQUAL 2.0)
  set(gpiod_generation v2)
else()
  set(gpiod_generation v1)
endif()
function(vm_test name options)
  add_test(NAME Vm.${name} COMMAND ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/vm_test ${vm_bin} "${options}" ${ARGN})
  # One guest at a time: two would take both cores of a small machine.
  set_tests_properties(Vm.${name} PROPERTIES LABELS vm TIMEOUT 600 SKIP_RETURN_CODE 77 RESOURCE_LOCK vm)
endfunction()
vm_test(EncodersCountEveryEdgeOfGpioLinesAndFindOutEveryLoss "-i 2 -M gpio-sim" gpio.sh ${gpiod_generation})
vm_test(EncodersCountEveryFrameOfACanBusAndFindOutEveryFault "-i 2 -M vcan" can.sh)
vm_test(UdevRulesGiveNamesGroupAndModeAndRefuseOutsiders "-u -M gpio-sim" udev.sh)
if(gpiod_generation STREQUAL v1)
  add_test(NAME Vm.EncodersThroughLibgpiod2CountTheirLossesExactly
    COMMAND ${CMAKE_CURRENT_LIST_DIR}/gpiod2_test ${vm_bin})
  set_tests_properties(Vm.EncodersThroughLibgpiod2CountTheirLossesExactly PROPERTIES
    LABELS vm TIMEOUT 900 SKIP_RETURN_CODE 77 RESOURCE_LOCK vm)
endif()

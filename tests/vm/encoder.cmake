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

# Tests of SET "short" run in tools/run test, those of SET "long" in tools/run test-vm only.
function(vm_test name set runner options)
  add_test(NAME Vm.${name}
    COMMAND ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/${runner} ${set} ${vm_bin} "${options}" ${ARGN})
  # A sweep takes up to an hour by itself.
  math(EXPR limit_s "10 * ${RAVENCAL_HANG_S}")
  # One guest at a time: two would take both cores of a small machine.
  set_tests_properties(Vm.${name} PROPERTIES
    LABELS vm TIMEOUT ${limit_s} SKIP_RETURN_CODE 77 RESOURCE_LOCK vm COST 100)
endfunction()
if(gpiod_VERSION VERSION_GREATER_EQUAL 2.0)
  vm_test(EncodersCountEveryEdgeOfGpioLinesAndTheirLossesExactly short vm_test "-i 2 -M gpio-sim" gpio.sh v2)
else()
  vm_test(EncodersCountEveryEdgeOfGpioLinesAndFindOutEveryLoss short vm_test "-i 2 -M gpio-sim" gpio.sh v1)
  vm_test(EncodersThroughLibgpiod2CountTheirLossesExactly short gpiod2_test "-i 2 -M gpio-sim" gpio.sh v2)
  vm_test(EncodersKeepUpWithEveryRateOfEdgesAndGpiomonBesideThem long gpiod2_test
    "-i 2 -M gpio-sim" gpio_sweep.sh)
endif()
vm_test(EncodersCountEveryFrameOfACanBusAndFindOutEveryFault short vm_test "-i 2 -M vcan" can.sh)
vm_test(EncodersKeepUpWithEveryRateOfFramesForTenMinutes long vm_test "-i 2 -M vcan" can_sweep.sh 10)
vm_test(EncodersReadCounterChips short vm_test "-i 2 -M counter-sim" counter.sh)
vm_test(UdevRulesGiveNamesGroupAndModeAndRefuseOutsiders short vm_test "-u -M gpio-sim" udev.sh)

# Documented chains of commands, drawn by seed: thirty here, a thousand by tests/chains/run. What diagnose makes of
# recordings of the very plant is counted and decides nothing, nor do the time of a command and int8's loss of accuracy.
# A sanitizer needs more memory than a chain may have.
if(NOT RAVENCAL_SANITIZED)
  foreach(first 1 11 21)
    add_test(NAME Chains.OfDocumentedCommandsHoldFromSeed${first}
      COMMAND ${CMAKE_CURRENT_LIST_DIR}/run --build ${CMAKE_BINARY_DIR} --out ${CMAKE_CURRENT_BINARY_DIR}/chains_${first}
        --fresh --seed ${first} --chains 10 --jobs 1 --data ${RAVENCAL_DATA_DIR} --wait-s 3000
        --tolerate "named,harm,unexplained,int8 refused,worse,time")
    set_tests_properties(Chains.OfDocumentedCommandsHoldFromSeed${first} PROPERTIES LABELS tool TIMEOUT ${RAVENCAL_HANG_S} COST 200)
  endforeach()
endif()

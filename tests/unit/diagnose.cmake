find_package(nlohmann_json REQUIRED)
# CONTRIBUTING.md says what the labels promise and inside mean.
ravencal_test(NAME diagnose_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_constant_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_followed_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_kept_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_settling_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_suggest_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm.cpp
  LIBS ravencal_diagnose nlohmann_json::nlohmann_json fmt::fmt LABELS unit promise SLOW)
ravencal_test(NAME diagnose_inside_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_across_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_effects_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_gates_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_location_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_numbers_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_posterior_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_repetition_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_rest_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_search_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_steps_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal_diagnose nlohmann_json::nlohmann_json fmt::fmt LABELS unit inside SLOW)
foreach(program diagnose_test diagnose_inside_test)
  target_include_directories(${program} PRIVATE ${CMAKE_CURRENT_LIST_DIR})
  set_target_properties(${program} PROPERTIES UNITY_BUILD OFF)  # its sources name diagnose() and the namespace
endforeach()

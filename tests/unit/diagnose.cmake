find_package(nlohmann_json REQUIRED)
# CONTRIBUTING.md says what the labels promise and inside mean.
ravencal_test(NAME diagnose_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_constant_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_followed_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_settling_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_suggest_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm.cpp
  LIBS ravencal_diagnose nlohmann_json::nlohmann_json fmt::fmt LABELS unit promise SLOW)
ravencal_test(NAME diagnose_inside_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_numbers_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_repetition_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_fit_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm.cpp
  LIBS ravencal_diagnose LABELS unit inside)
target_include_directories(diagnose_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
set_target_properties(diagnose_test PROPERTIES UNITY_BUILD OFF)  # its sources name diagnose() and the namespace

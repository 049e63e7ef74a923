ravencal_test(NAME prove_generator_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/prove_mechanics_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_effects_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_cases_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_other_world_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_beyond_test.cpp
  LIBS ravencal_prove_generator ravencal::physics ravencal::record nlohmann_json::nlohmann_json LABELS unit SLOW)
ravencal_test(NAME prove_proof_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/prove_proof_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_one_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_others_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_reliability_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/prove_worlds_test.cpp ${CMAKE_CURRENT_LIST_DIR}/browser.cpp
  LIBS ravencal_prove fmt::fmt nlohmann_json::nlohmann_json LABELS unit SLOW)
ravencal_test(NAME prove_controls_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/prove_controls_test.cpp
  LIBS ravencal_prove_generator ravencal_diagnose LABELS unit SLOW)

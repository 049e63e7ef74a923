ravencal_test(NAME diagnose_model_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_model_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_statements_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal_diagnose LABELS unit)
ravencal_test(NAME diagnose_explain_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_explain_test.cpp
  LIBS ravencal_diagnose LABELS unit)
target_include_directories(diagnose_model_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_include_directories(diagnose_explain_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_words_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_words_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_sentences_test.cpp
  LIBS ravencal_diagnose nlohmann_json::nlohmann_json fmt::fmt LABELS unit)
ravencal_test(NAME diagnose_tracks_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_tracks_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_simulated_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal_diagnose fmt::fmt LABELS unit)
target_include_directories(diagnose_tracks_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_stretches_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_stretches_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal_diagnose LABELS unit)
target_include_directories(diagnose_stretches_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_two_estimates_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_two_estimates_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm.cpp
  LIBS ravencal_diagnose fmt::fmt LABELS unit SLOW)
target_include_directories(diagnose_two_estimates_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_pulses_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_pulses_test.cpp
  LIBS ravencal_diagnose LABELS unit)

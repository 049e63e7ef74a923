find_package(nlohmann_json REQUIRED)
ravencal_test(NAME diagnose_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_across_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_gates_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_arm_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_kept_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_effects_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_followed_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_location_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_posterior_test.cpp
         ${CMAKE_CURRENT_LIST_DIR}/diagnose_search_test.cpp
         ${CMAKE_CURRENT_LIST_DIR}/diagnose_settling_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_suggest_test.cpp
  LIBS ravencal_diagnose fmt::fmt LABELS unit)
target_include_directories(diagnose_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_link_libraries(diagnose_test PRIVATE nlohmann_json::nlohmann_json)
set_target_properties(diagnose_test PROPERTIES UNITY_BUILD OFF)  # its sources name diagnose() and the namespace

ravencal_test(NAME diagnose_drive_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_drive_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_command_test.cpp ${CMAKE_CURRENT_LIST_DIR}/diagnose_factor_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_offset_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/diagnose_generator.cpp
  LIBS ravencal_diagnose LABELS unit inside)
target_include_directories(diagnose_drive_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_friction_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_friction_test.cpp
  LIBS ravencal_diagnose LABELS unit inside)
target_include_directories(diagnose_friction_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
ravencal_test(NAME diagnose_interval_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_interval_test.cpp
  LIBS ravencal_diagnose LABELS unit inside)

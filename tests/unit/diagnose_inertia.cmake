ravencal_test(NAME diagnose_inertia_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_inertia_test.cpp
  LIBS ravencal_diagnose fmt::fmt ${MUJOCO} LABELS unit promise SLOW)
target_include_directories(diagnose_inertia_test PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_include_directories(diagnose_inertia_test SYSTEM PRIVATE ${MUJOCO_INCLUDE_DIR})

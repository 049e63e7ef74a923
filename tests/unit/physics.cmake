ravencal_test(NAME physics_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/physics_effects_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/physics_plant_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/physics_plant_writer_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/physics_arm_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/physics_branch_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/physics_predict_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/rigid_bodies_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/physics_twin_test.cpp
  LIBS ravencal::physics LABELS unit)
ravencal_test(NAME robot_model_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/robot_model_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_frames_test.cpp ${CMAKE_CURRENT_LIST_DIR}/robot_words_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_writer_test.cpp
  LIBS ravencal::physics fmt::fmt ${MUJOCO} ${CMAKE_DL_LIBS} LABELS unit)
target_include_directories(robot_model_test SYSTEM PRIVATE ${MUJOCO_INCLUDE_DIR})
ravencal_test(NAME trajectory_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/trajectory_test.cpp ${CMAKE_CURRENT_LIST_DIR}/any_arm_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/simulation_test.cpp
  LIBS ravencal_simulation ravencal_trajectory ravencal::record LABELS unit)
ravencal_test(NAME robot_improved_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/robot_improved_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_servo_test.cpp
  LIBS ravencal::physics nlohmann_json::nlohmann_json fmt::fmt ${MUJOCO} LABELS unit promise SLOW)
target_include_directories(robot_improved_test SYSTEM PRIVATE ${MUJOCO_INCLUDE_DIR})
target_compile_definitions(robot_improved_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(robot_improved_test ravencal)

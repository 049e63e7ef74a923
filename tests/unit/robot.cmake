# The follower of `ravencal run` and the virtual controller, without ROS.
ravencal_test(NAME robot_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/follower_test.cpp ${CMAKE_CURRENT_LIST_DIR}/robot_controller_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_loop_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_recorder_test.cpp ${CMAKE_CURRENT_LIST_DIR}/robot_plan_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_messages_test.cpp
  LIBS ravencal_robot ravencal_ros_messages ravencal_test_rig nlohmann_json::nlohmann_json rapidcheck rapidcheck_gtest LABELS unit SLOW)

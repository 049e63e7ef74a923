# The follower of `ravencal run` and the virtual controller, without ROS.
ravencal_test(NAME robot_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/follower_test.cpp ${CMAKE_CURRENT_LIST_DIR}/robot_controller_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_recorder_test.cpp
  LIBS ravencal_robot ravencal_test_rig LABELS unit)

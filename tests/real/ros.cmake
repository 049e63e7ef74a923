# On a real master, where Debian's ROS 1 is installed; says why it is skipped elsewhere.
ravencal_test(NAME ros_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/ros_test.cpp
  LIBS ravencal_ros_rig ravencal::record fmt::fmt LABELS real COST 10)
target_compile_definitions(ros_test PRIVATE
  RAVENCAL_ENCODERS="$<TARGET_FILE:ravencal-encoders>" RAVENCAL_ROS_ROBOT="$<TARGET_FILE_DIR:ros_test>/ros_robot")
add_dependencies(ros_test ravencal-encoders)
if(RAVENCAL_ROS AND ROSCPP_INCLUDE_DIR AND ROSCPP_LIBRARY)
  add_executable(ros_robot ${CMAKE_CURRENT_LIST_DIR}/ros_robot.cpp)
  target_include_directories(ros_robot SYSTEM PRIVATE ${ROSCPP_INCLUDE_DIR})
  target_link_libraries(ros_robot PRIVATE ravencal::record fmt::fmt ${ROSCPP_LIBRARY} rosconsole
    roscpp_serialization rostime cpp_common boost_thread ravencal_warnings)
  add_dependencies(ros_test ros_robot)
endif()

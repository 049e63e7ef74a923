# On a real master, where Debian's ROS 1 is installed; says why it is skipped elsewhere.
add_library(ravencal_ros_rig STATIC ${CMAKE_CURRENT_LIST_DIR}/ros_rig.cpp)
target_include_directories(ravencal_ros_rig PUBLIC ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(ravencal_ros_rig PUBLIC
  RAVENCAL_ROS_PROGRAM="${PROJECT_BINARY_DIR}/tools/ravencal-ros"
  RAVENCAL_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
target_link_libraries(ravencal_ros_rig PUBLIC GTest::gtest fmt::fmt PRIVATE ravencal_warnings)

ravencal_test(NAME ros_run_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/ros_run_test.cpp
  LIBS ravencal_ros_rig ravencal::record LABELS e2e COST 10)
ravencal_test(NAME ros_robot_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/ros_robot_test.cpp
  LIBS ravencal_ros_rig ravencal_test_rig LABELS e2e COST 10)
foreach(program ros_run_test ros_robot_test)
  add_dependencies(${program} ravencal ravencal_plugin)
  if(TARGET ravencal-ros)
    add_dependencies(${program} ravencal-ros)
  endif()
endforeach()

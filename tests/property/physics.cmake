ravencal_test(NAME physics_property_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/physics_property_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/physics_plant_property_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/robot_writer_property_test.cpp
  LIBS ravencal::physics ravencal_trajectory rapidcheck fmt::fmt LABELS property)

ravencal_test(NAME road_property_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/road_merge_property_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/road_axis_property_test.cpp
  LIBS ravencal::alignment ravencal::quadrature rapidcheck LABELS property SLOW)

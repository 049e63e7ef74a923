# The road from edge to label: bags, and the twin's edges through driver and merge.
find_package(OpenSSL REQUIRED)
ravencal_test(NAME bag_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/bag_message_test.cpp ${CMAKE_CURRENT_LIST_DIR}/bag_test.cpp
  LIBS ravencal::record fmt::fmt OpenSSL::Crypto LABELS unit)
ravencal_test(NAME road_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/road_test.cpp
  LIBS ravencal_simulation ravencal::encoder_recording ravencal::alignment fmt::fmt LABELS unit SLOW TOGETHER Road)

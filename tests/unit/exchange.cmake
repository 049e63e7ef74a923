ravencal_test(NAME exchange_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/exchange_test.cpp
  LIBS ravencal_exchange ravencal::record PkgConfig::HDF5 PkgConfig::MATIO fmt::fmt LABELS unit SLOW)
target_compile_definitions(exchange_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(exchange_test ravencal)

ravencal_test(NAME exchange_table_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/exchange_table_test.cpp ${CMAKE_CURRENT_LIST_DIR}/exchange_errors_test.cpp
  LIBS ravencal_exchange ravencal::record fmt::fmt LABELS unit)
target_compile_definitions(exchange_table_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(exchange_table_test ravencal)

find_package(SQLite3 REQUIRED)
ravencal_test(NAME exchange_ros2_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/exchange_ros2_test.cpp ${CMAKE_CURRENT_LIST_DIR}/exchange_joints_test.cpp
  LIBS ravencal_exchange ravencal::record SQLite::SQLite3 fmt::fmt LABELS unit)

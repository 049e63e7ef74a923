ravencal_test(NAME exchange_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/exchange_test.cpp
  LIBS ravencal_exchange ravencal::record PkgConfig::HDF5 PkgConfig::MATIO fmt::fmt LABELS unit SLOW)
target_compile_definitions(exchange_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(exchange_test ravencal)

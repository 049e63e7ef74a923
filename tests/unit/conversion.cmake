# Models from elsewhere: tests/golden/models.
find_package(Protobuf REQUIRED)

ravencal_test(NAME conversion_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/conversion_test.cpp ${CMAKE_CURRENT_LIST_DIR}/conversion_fold_test.cpp ${CMAKE_CURRENT_LIST_DIR}/conversion_keras_fold_test.cpp
  LIBS ravencal_conversion ravencal_exchange onnx_proto protobuf::libprotobuf PkgConfig::HDF5 nlohmann_json::nlohmann_json fmt::fmt LABELS unit)
ravencal_test(NAME conversion_plugin_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/conversion_plugin_test.cpp
  LIBS ravencal_conversion ravencal_test_rig nlohmann_json::nlohmann_json LABELS rt)
ravencal_test(NAME convert_foreign_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/convert_foreign_test.cpp
  LIBS ravencal_conversion ravencal_exchange PkgConfig::HDF5 nlohmann_json::nlohmann_json fmt::fmt LABELS unit SLOW)
target_compile_definitions(convert_foreign_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(convert_foreign_test ravencal)

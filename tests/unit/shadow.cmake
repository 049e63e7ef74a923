find_package(nlohmann_json REQUIRED)

ravencal_test(NAME shadow_operation_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/shadow_operation_test.cpp
  LIBS ravencal_shadow nlohmann_json::nlohmann_json LABELS unit)

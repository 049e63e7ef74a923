ravencal_test(NAME conceal_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/conceal_test.cpp
  LIBS ravencal_conceal nlohmann_json::nlohmann_json LABELS unit)

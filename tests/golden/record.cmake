find_package(SQLite3 REQUIRED)
find_package(nlohmann_json REQUIRED)

ravencal_test(NAME record_golden_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/record/recording_golden_test.cpp
  LIBS ravencal::record SQLite::SQLite3 nlohmann_json::nlohmann_json LABELS unit)

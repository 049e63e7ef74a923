ravencal_test(NAME diagnose_real_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_real_test.cpp
  LIBS ravencal_diagnose LABELS real)
ravencal_test(NAME improved_real_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/improved_real_test.cpp
  LIBS ravencal_diagnose ravencal_simulation LABELS real)
ravencal_test(NAME diagnose_rows_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_rows_test.cpp
  LIBS fmt::fmt nlohmann_json::nlohmann_json LABELS real)
target_compile_definitions(diagnose_rows_test PRIVATE
  RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(diagnose_rows_test ravencal)

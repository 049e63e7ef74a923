ravencal_test(NAME improved_real_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/improved_real_test.cpp
  LIBS ravencal_diagnose ravencal_simulation LABELS real promise)
ravencal_test(NAME diagnose_rows_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/diagnose_rows_test.cpp
  LIBS ravencal::physics fmt::fmt nlohmann_json::nlohmann_json LABELS real promise COST 10)
target_compile_definitions(diagnose_rows_test PRIVATE
  RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>")
add_dependencies(diagnose_rows_test ravencal)
ravencal_test(NAME worlds_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/worlds_test.cpp
  LIBS fmt::fmt nlohmann_json::nlohmann_json LABELS real promise COST 10)
target_compile_definitions(worlds_test PRIVATE
  RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>" RAVENCAL_WORLDS_DIR="${RAVENCAL_WORLDS_DIR}")
add_dependencies(worlds_test ravencal)

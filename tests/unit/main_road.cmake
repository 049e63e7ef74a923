# The main road as users type it: trajectory, simulate, train, evaluate, convert, host; export and import.
ravencal_test(NAME main_road_test COST 40
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/main_road_test.cpp ${CMAKE_CURRENT_LIST_DIR}/main_road_words_test.cpp
  LIBS fmt::fmt nlohmann_json::nlohmann_json LABELS tool TOGETHER MainRoad MainRoadWords)
target_compile_definitions(main_road_test PRIVATE RAVENCAL_PROGRAM="$<TARGET_FILE:ravencal>"
  RAVENCAL_ENCODERS="$<TARGET_FILE:ravencal-encoders>" RAVENCAL_PLUGIN_PATH="$<TARGET_FILE:ravencal_plugin>")
add_dependencies(main_road_test ravencal ravencal-encoders ravencal_plugin)

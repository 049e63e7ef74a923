find_package(nlohmann_json REQUIRED)
add_library(ravencal_blob_sample STATIC ${CMAKE_CURRENT_LIST_DIR}/blob_sample.cpp)
target_include_directories(ravencal_blob_sample PUBLIC ${PROJECT_SOURCE_DIR}/tests)
target_compile_definitions(ravencal_blob_sample PRIVATE RAVENCAL_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
target_link_libraries(ravencal_blob_sample PUBLIC ravencal::model PRIVATE ravencal_warnings)

ravencal_test(NAME blob_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/blob_test.cpp ${CMAKE_CURRENT_LIST_DIR}/blob_appended_test.cpp ${CMAKE_CURRENT_LIST_DIR}/blob_means_test.cpp ${CMAKE_CURRENT_LIST_DIR}/blob_packed_test.cpp
              ${CMAKE_CURRENT_LIST_DIR}/blob_travel_test.cpp
  LIBS ravencal_blob_sample nlohmann_json::nlohmann_json LABELS unit)
ravencal_test(NAME trust_region_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/trust_region_test.cpp
  LIBS ravencal_blob_sample LABELS unit)
ravencal_test(NAME feature_state_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/feature_state_test.cpp
              ${CMAKE_CURRENT_LIST_DIR}/travel_mean_test.cpp
  LIBS ravencal::model LABELS unit)
ravencal_test(NAME layers_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/layers_test.cpp
  LIBS ravencal::model LABELS unit)
ravencal_test(NAME blob_replay_test
  SOURCES ${PROJECT_SOURCE_DIR}/tests/fuzz/blob_replay_test.cpp
          ${PROJECT_SOURCE_DIR}/tests/fuzz/blob_fuzz.cpp
  LIBS ravencal_blob_sample LABELS replay)

if(RAVENCAL_FUZZ)
  # The reader itself is compiled again, because only instrumented code guides the fuzzer.
  file(GLOB fuzzed_sources ${PROJECT_SOURCE_DIR}/shared/model/blob_*.cpp
    ${PROJECT_SOURCE_DIR}/shared/model/packed_*.cpp)
  add_executable(blob_fuzz ${PROJECT_SOURCE_DIR}/tests/fuzz/blob_fuzz.cpp
    ${CMAKE_CURRENT_LIST_DIR}/blob_sample.cpp ${fuzzed_sources})
  target_include_directories(blob_fuzz PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(blob_fuzz PRIVATE RAVENCAL_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_compile_options(blob_fuzz PRIVATE -fsanitize=fuzzer,address,undefined
    -fno-sanitize-recover=all)
  target_link_options(blob_fuzz PRIVATE -fsanitize=fuzzer,address,undefined)
  target_link_libraries(blob_fuzz PRIVATE ravencal::model nlohmann_json::nlohmann_json)
endif()

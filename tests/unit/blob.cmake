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

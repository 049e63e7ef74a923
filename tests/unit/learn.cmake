find_package(nlohmann_json REQUIRED)

ravencal_test(NAME learn_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/learn/reference.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/trainer_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/train_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/ensemble_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/simulated_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/origin_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/coordinates_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/shared_seeds_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/loop_noise_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/expectation_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/motion_range_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/onnx_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/thread_pool_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/learn/isa_symbols_test.cpp
  LIBS ravencal_learn nlohmann_json::nlohmann_json onnx LABELS unit SLOW)
target_compile_definitions(learn_test PRIVATE
  "RAVENCAL_KERNEL_OBJECTS=\"$<JOIN:$<TARGET_OBJECTS:ravencal_learn>,|>\"")

ravencal_test(NAME model_features_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/model_features_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/../property/model_features_property_test.cpp
  LIBS ravencal::model rapidcheck LABELS unit property)

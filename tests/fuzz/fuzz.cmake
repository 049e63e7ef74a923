# Harnesses of the parsers and the replay of what they found: inputs.hpp says what each promises.
find_package(SQLite3 REQUIRED)
set(fuzz_folder ${CMAKE_CURRENT_LIST_DIR})
add_library(ravencal_fuzz_inputs STATIC ${fuzz_folder}/inputs.cpp)
target_include_directories(ravencal_fuzz_inputs PUBLIC ${PROJECT_SOURCE_DIR}/tests)
target_link_libraries(ravencal_fuzz_inputs PUBLIC ravencal::core PRIVATE ravencal_warnings)

# ravencal_parser(NAME LIBS...): NAME_input.cpp for the replay and, in the preset fuzz (where the
# libraries are instrumented, too), the harness NAME_fuzz.
function(ravencal_parser name)
  add_library(ravencal_fuzz_${name} STATIC ${fuzz_folder}/${name}_input.cpp)
  target_link_libraries(ravencal_fuzz_${name} PUBLIC ravencal_fuzz_inputs ${ARGN}
    PRIVATE ravencal_warnings)
  set_property(GLOBAL APPEND PROPERTY ravencal_parsers ravencal_fuzz_${name})
  if(RAVENCAL_FUZZ)
    add_executable(${name}_fuzz ${fuzz_folder}/harness.cpp)
    target_compile_definitions(${name}_fuzz PRIVATE RAVENCAL_FUZZ_TRY=try_${name})
    target_link_options(${name}_fuzz PRIVATE -fsanitize=fuzzer)
    target_link_libraries(${name}_fuzz PRIVATE ravencal_fuzz_${name})
  endif()
endfunction()

add_library(ravencal_fuzz_networks STATIC ${fuzz_folder}/network_promises.cpp)
target_link_libraries(ravencal_fuzz_networks PUBLIC ravencal_fuzz_inputs ravencal_conversion
  PRIVATE ravencal_warnings)

ravencal_parser(bag ravencal::record)
ravencal_parser(blob ravencal_blob_sample)
ravencal_parser(csv ravencal::record)
ravencal_parser(encoder ravencal::encoder_recording)
ravencal_parser(json ravencal_conversion)
ravencal_parser(keras ravencal_fuzz_networks)
ravencal_parser(mcap ravencal_exchange)
ravencal_parser(npz ravencal_exchange PkgConfig::LIBZIP)
ravencal_parser(onnx ravencal_fuzz_networks)
ravencal_parser(plant ravencal::physics)
ravencal_parser(profile ravencal::record)
ravencal_parser(recording ravencal::record SQLite::SQLite3)
ravencal_parser(robot ravencal::physics)
ravencal_parser(telemetry ravencal_monitor)

get_property(parsers GLOBAL PROPERTY ravencal_parsers)
ravencal_test(NAME replay_test SOURCES ${fuzz_folder}/replay_test.cpp LIBS ${parsers} LABELS replay)

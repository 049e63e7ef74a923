# The adapter for the controller, compiled into a controller in miniature: both branches, as gnu++98
# (the controllers' age) and as C++17.
# The code blocks of the integration's README, each after a comment that names it.
set(readme ${PROJECT_SOURCE_DIR}/rt_plugin/integration/README.md)
set(readme_folder ${CMAKE_CURRENT_BINARY_DIR}/readme)
file(WRITE ${readme_folder}/DS0.h "#include \"unit/integration_structures.hpp\"\n")
file(WRITE ${readme_folder}/ravencal/controller.hpp "#include \"rt_plugin/integration/controller.hpp\"\n")
set(readme_blocks "")
foreach(block header_main header_crtk arms_main arms_crtk open observe_main observe_crtk correct_main
        correct_crtk uncorrect)
  add_custom_command(OUTPUT ${readme_folder}/readme_${block}.inc
    COMMAND awk "/^<!-- compiled: ${block} -->/{f=1;next} f&&/^```cpp/{p=1;next} p&&/^```/{exit} p{print;n++} END{exit n?0:1}"
      ${readme} > ${readme_folder}/readme_${block}.inc
    DEPENDS ${readme} VERBATIM)
  list(APPEND readme_blocks ${readme_folder}/readme_${block}.inc)
endforeach()
add_custom_target(ravencal_readme_blocks DEPENDS ${readme_blocks})
set(controller_builds "")
foreach(branch main crtk)
  foreach(standard 98 17)
    set(build ravencal_controller_${branch}_${standard})
    add_library(${build} OBJECT ${CMAKE_CURRENT_LIST_DIR}/integration_controller.cpp
      ${CMAKE_CURRENT_LIST_DIR}/integration_readme.cpp)
    add_dependencies(${build} ravencal_readme_blocks)
    target_include_directories(${build} PRIVATE ${readme_folder})
    set_target_properties(${build} PROPERTIES UNITY_BUILD OFF CXX_STANDARD ${standard} CXX_EXTENSIONS ON)
    target_include_directories(${build} PRIVATE
      ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/tests ${PROJECT_SOURCE_DIR}/rt_plugin/include)
    target_compile_definitions(${build} PRIVATE RAVENCAL_ENTRY=controller_${branch}_${standard}
      $<$<STREQUAL:${branch},crtk>:RAVENCAL_CRTK>)
    target_link_libraries(${build} PRIVATE ravencal_warnings)
    list(APPEND controller_builds ${build})
  endforeach()
endforeach()
ravencal_test(NAME integration_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/integration_test.cpp ${CMAKE_CURRENT_LIST_DIR}/integration_motion_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/integration_press_test.cpp ${CMAKE_CURRENT_LIST_DIR}/integration_client_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/integration_press_property_test.cpp
  LIBS ravencal_test_rig ravencal::physics rapidcheck ${controller_builds} ${CMAKE_DL_LIBS} LABELS rt)

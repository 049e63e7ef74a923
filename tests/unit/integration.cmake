# The adapter for the controller, compiled into a controller in miniature: both branches, as gnu++98
# (the controllers' age) and as C++17.
set(controller_builds "")
foreach(branch main crtk)
  foreach(standard 98 17)
    set(build ravencal_controller_${branch}_${standard})
    add_library(${build} OBJECT ${CMAKE_CURRENT_LIST_DIR}/integration_controller.cpp)
    set_target_properties(${build} PROPERTIES CXX_STANDARD ${standard} CXX_EXTENSIONS ON)
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
  LIBS ravencal_test_rig ravencal::physics ${controller_builds} ${CMAKE_DL_LIBS} LABELS rt)

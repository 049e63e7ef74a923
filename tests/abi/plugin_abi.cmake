# The header, compiled by itself in the standards of its hosts, pedantically.
add_library(ravencal_header_c90 OBJECT ${CMAKE_CURRENT_LIST_DIR}/header_c90.c)
set_target_properties(ravencal_header_c90 PROPERTIES C_STANDARD 90 C_EXTENSIONS OFF)
foreach(standard 98 20)
  add_library(ravencal_header_cxx${standard} OBJECT ${CMAKE_CURRENT_LIST_DIR}/header_cxx.cpp)
  set_target_properties(ravencal_header_cxx${standard} PROPERTIES CXX_STANDARD ${standard})
  target_compile_definitions(ravencal_header_cxx${standard} PRIVATE
    RAVENCAL_STANDARD=header_in_cxx${standard})
endforeach()
set(header_objects ravencal_header_c90 ravencal_header_cxx98 ravencal_header_cxx20)
foreach(object IN LISTS header_objects)
  target_include_directories(${object} PRIVATE ${PROJECT_SOURCE_DIR}/rt_plugin/include)
  target_compile_options(${object} PRIVATE -Wall -Wextra -pedantic-errors -Werror)
endforeach()

set(kernel_objects "portable=$<TARGET_OBJECTS:ravencal_forward_portable>")
foreach(isa avx2 avx2_vnni avx512 avx512_vnni)
  if(TARGET ravencal_forward_${isa})
    string(APPEND kernel_objects "|${isa}=$<TARGET_OBJECTS:ravencal_forward_${isa}>")
  endif()
endforeach()
# What the tests of the shared object must find out about a library that breaks their rules.
add_library(ravencal_rule_breaker SHARED ${CMAKE_CURRENT_LIST_DIR}/rule_breaker.cpp)

ravencal_test(NAME plugin_abi_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/abi_test.cpp
  LIBS ravencal_test_rig ravencal::physics ${header_objects} LABELS abi)
add_dependencies(plugin_abi_test ravencal_rule_breaker)
target_compile_definitions(plugin_abi_test PRIVATE
  RAVENCAL_RULE_BREAKER="$<TARGET_FILE:ravencal_rule_breaker>"
  RAVENCAL_KERNEL_OBJECTS="${kernel_objects}")

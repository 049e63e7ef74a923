# Joins the CommonJS modules MODULES (names without "vega-", separated by spaces, each after those
# it requires) of FOLDER into the one script OUT, which calls define_module(name, body) for each.
separate_arguments(MODULES)
file(WRITE ${OUT}.partial "")
foreach(module IN LISTS MODULES)
  file(READ ${FOLDER}/vega-${module}.min.js source)
  # A source map is a second file, which a page that stands alone has not got.
  string(REGEX REPLACE "\n//# sourceMappingURL=[^\n]*" "" source "${source}")
  foreach(terminator "</script" "<!--")
    string(FIND "${source}" "${terminator}" position)
    if(NOT position EQUAL -1)
      message(FATAL_ERROR "vega-${module}.min.js contains ${terminator}: it cannot stand in a page")
    endif()
  endforeach()
  file(APPEND ${OUT}.partial
    "define_module(\"vega-${module}\",function(exports,module,require){${source}\n});\n")
endforeach()
file(RENAME ${OUT}.partial ${OUT})

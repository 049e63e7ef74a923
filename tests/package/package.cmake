# What others install: the plugin by find_package, documentation, Debian packages.
set(package_tests ${CMAKE_CURRENT_LIST_DIR})
add_test(NAME Package.AHostOfTenLinesFindsThePluginThatWasInstalled
  COMMAND ${package_tests}/install_test ${PROJECT_BINARY_DIR} ${PROJECT_VERSION})
add_test(NAME Package.EveryCommandHasAManPageAndCompletion
  COMMAND ${package_tests}/documentation_test ${PROJECT_SOURCE_DIR} $<TARGET_FILE:ravencal> $<TARGET_FILE:ravencal-encoders>)
add_test(NAME Package.ThePublicHeadersAreDocumentedWithoutAWarning
  COMMAND ${package_tests}/doxygen_test ${PROJECT_SOURCE_DIR})
add_test(NAME Package.LintianFindsNoFaultInThePackages
  COMMAND ${package_tests}/lintian_test ${PROJECT_BINARY_DIR})
add_test(NAME Package.EveryCxxFileIsFormatted
  COMMAND ${package_tests}/format_test ${PROJECT_SOURCE_DIR})
add_test(NAME Package.EveryLinkOfADocumentLeadsSomewhere
  COMMAND ${package_tests}/links_test ${PROJECT_SOURCE_DIR})
add_test(NAME Package.TheDemoRunsInAFreshDebian
  COMMAND ${package_tests}/chroot_test ${PROJECT_BINARY_DIR})
set_tests_properties(
  Package.AHostOfTenLinesFindsThePluginThatWasInstalled Package.EveryCommandHasAManPageAndCompletion
  Package.ThePublicHeadersAreDocumentedWithoutAWarning Package.LintianFindsNoFaultInThePackages
  Package.EveryCxxFileIsFormatted Package.EveryLinkOfADocumentLeadsSomewhere
  PROPERTIES LABELS package TIMEOUT ${RAVENCAL_HANG_S} SKIP_RETURN_CODE 77)
set_tests_properties(Package.TheDemoRunsInAFreshDebian
  PROPERTIES LABELS package-chroot TIMEOUT ${RAVENCAL_HANG_S} SKIP_RETURN_CODE 77)

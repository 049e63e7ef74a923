# The commands of the documents, as a reader copies them. A sanitizer makes minutes of them hours.
set(documents_tests ${CMAKE_CURRENT_LIST_DIR})
if(NOT RAVENCAL_SANITIZED)
  add_test(NAME Documents.DoWhatTheySay
    COMMAND ${documents_tests}/documents_test ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR} ${RAVENCAL_DATA_DIR})
  set_tests_properties(Documents.DoWhatTheySay
    PROPERTIES LABELS package TIMEOUT ${RAVENCAL_HANG_S} PROCESSORS 2 COST 200)
endif()
add_test(NAME Documents.WhatIsFalseIsSeen COMMAND ${documents_tests}/self_test)
set_tests_properties(Documents.WhatIsFalseIsSeen PROPERTIES LABELS package TIMEOUT ${RAVENCAL_HANG_S})

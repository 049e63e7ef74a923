find_package(SQLite3 REQUIRED)

ravencal_test(NAME record_test
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/record/reader_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/writer_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/killed_writer_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/log_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/disk_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/hostile_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/profile_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/csv_load_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/csv_errors_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/csv_dialect_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/csv_export_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/stamps_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/plausibility_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/unwrap_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/summary_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/time_range_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/record/real_data_test.cpp
  LIBS ravencal::record SQLite::SQLite3 fmt::fmt LABELS unit)

ravencal_test(NAME alignment_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/record/alignment_test.cpp
  LIBS ravencal::alignment LABELS unit)

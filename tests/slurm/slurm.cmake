add_test(NAME Slurm.AStudyRunsAsAnArrayAndAKilledTaskCostsItsOwnJobOnly
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/study_test $<TARGET_FILE:ravencal>
    ${PROJECT_SOURCE_DIR}/tools/plants/raven2.toml ${PROJECT_SOURCE_DIR}/tools/calibration/slurm/study.sbatch)
set_tests_properties(Slurm.AStudyRunsAsAnArrayAndAKilledTaskCostsItsOwnJobOnly PROPERTIES
  LABELS unit TIMEOUT ${RAVENCAL_HANG_S} SKIP_RETURN_CODE 77 COST 10)
add_test(NAME Slurm.PartsOfAProofShareAFolderAndTheLastOneScores
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/proof_test $<TARGET_FILE:ravencal> ${PROJECT_SOURCE_DIR}/tools/prove/prove.sbatch)
set_tests_properties(Slurm.PartsOfAProofShareAFolderAndTheLastOneScores PROPERTIES
  LABELS unit TIMEOUT ${RAVENCAL_HANG_S} SKIP_RETURN_CODE 77 COST 10)

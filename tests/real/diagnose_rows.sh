#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# The rows of `ravencal diagnose` on real recordings: what each shipped plant leaves out is fitted on
# one part of a set, the figures are of the other.
#   diagnose_rows.sh RAVENCAL DATA_DIR OUT_DIR [SET...]
# SETs: emps bam_xl330 raven2_uiuc raven2_uw dvrk_berkeley dvrk_jhu_tracker davinci_tool4_friction
# davinci_tool4_gearbox davinci_tool4_jaw double_pendulum laas_cogging laas_cogging_places
# laas_cogging_speed so101; all by default. so101 takes minutes.
# OUT_DIR/SET/report.html shows the reasons.
set -euo pipefail
if (($# < 3)); then
  sed -n '5,10s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi
ravencal=$1 data=$2 out=$3
shift 3
tools=$(cd "$(dirname "$0")/../../tools" && pwd)
mkdir -p "$out"

# SET FILES... -- OPTIONS...: files are those of the set's own folder
diagnose() {
  local set=$1 folder=$1 files=() status=0
  if [[ $set == davinci_tool4_* ]]; then folder=davinci_tool4; fi
  local plant=$set
  if [[ $set == laas_cogging* ]]; then folder=laas_cogging plant=laas_cogging; fi
  shift
  while [[ $1 != -- ]]; do files+=("$data/$folder/$1"); shift; done
  shift
  echo "$set"
  "$ravencal" diagnose "${files[@]}" --plant "$tools/plants/$plant.toml" --out "$out/$set" \
    --placebo 0 "$@" >"$out/$set.txt" || status=$?
  if ((status > 1)); then return "$status"; fi
  cat "$out/$set.txt"
}
row() {
  local set=$1 profile=$tools/profiles/$1.toml kind
  case $set in
    emps) diagnose "$set" emps_train.csv -- --profile "$profile" \
      --held-out "$data/$set/emps_test_pulses.csv" ;;
    bam_xl330)
      local train=() test=()
      for kind in lift_and_drop sin_sin sin_time_square up_and_down; do
        train+=("xl330_kp"{100,200,800}"_$kind.csv")
        test+=("$data/$set/xl330_kp400_$kind.csv")
      done
      diagnose "$set" "${train[@]}" -- --profile "$profile" --held-out "${test[@]}" ;;
    raven2_uiuc) diagnose "$set" raven2_joint123.csv -- --profile "$profile" --held-out-from 11.65 ;;
    raven2_uw) diagnose "$set" raven2_uw_track.csv -- --profile "$profile" --held-out-from 55 ;;
    dvrk_berkeley) diagnose "$set" train_random.csv -- --profile "$profile" \
      --held-out "$data/$set/train_peg.csv" ;;
    dvrk_jhu_tracker) diagnose "$set" dwell_means.csv -- \
      --profile "$tools/profiles/${set}_three_depths.toml" --held-out "$data/$set/dwell_means.csv" \
      --held-out-profile "$tools/profiles/${set}_other_depths.toml" ;;
    davinci_tool4_*)
      local train=() test=()
      for kind in 010 030 050 070 090 100; do train+=("train_f"{01,03}"_load$kind.csv"); done
      for kind in 020 040 060 080; do test+=("$data/davinci_tool4/test_f"{02,04}"_load$kind.csv"); done
      diagnose "$set" "${train[@]}" -- --profile "$profile" --held-out "${test[@]}" ;;
    double_pendulum) diagnose "$set" train_run{00,02,04}.csv -- --profile "$profile" \
      --held-out "$data/$set"/test_run{03,11,12}.csv ;;
    laas_cogging) diagnose "$set" hold_map.csv -- --profile "$profile" ;;
    laas_cogging_places) diagnose "$set" map_there.csv map_back.csv -- --profile "$profile" ;;
    laas_cogging_speed) diagnose "$set" speed_flag0.csv -- \
      --profile "$tools/profiles/laas_cogging.toml" ;;
    so101) diagnose "$set" velocity_ramp.csv trapezoidal_profile.csv multisine.csv \
      workspace_sweep.csv -- --profile "$profile" --held-out "$data/$set/step_response.csv" ;;
    *) echo "diagnose_rows.sh: there is no set $set" >&2; return 2 ;;
  esac
}

(($# > 0)) || set -- emps bam_xl330 raven2_uiuc raven2_uw dvrk_berkeley dvrk_jhu_tracker \
  davinci_tool4_{friction,gearbox,jaw} double_pendulum laas_cogging{,_places,_speed} so101
for name; do row "$name"; done

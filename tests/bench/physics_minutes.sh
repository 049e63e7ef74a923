#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# What `train --physics` is worth: RMSE on unseen motion against minutes of zig-zag, without a load
# and under 500 g never trained on, with and without the physics that `diagnose` found in the same
# minutes. Mean of three seeds.
#   physics_minutes.sh RAVENCAL OUT_DIR
# The robot is the twin of tools/plants/raven2.toml. The plant that is diagnosed has published
# numbers only: an effect marked [TUNED] takes the number that [SIM] says, or is left out. Robot and
# physics share one simulator, so the figures are those of a plant whose kind of physics is known.
set -euo pipefail
if (($# != 2)); then
  sed -n '4,10s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi
ravencal=$1 out=$2
robot=$(cd "$(dirname "$0")/../.." && pwd)/tools/plants/raven2.toml
network=(--features light --hidden 128,64,32 --epochs 60 --batch 256 --learning-rate 1e-3)
mkdir -p "$out"
cd "$out"

awk 'BEGIN { RS = ""; ORS = "\n\n"; FS = "\n" }
  { block = ""; effect = /\[\[joint\.effect\]\]/; keep = 1
    for (i = 1; i <= NF; ++i) {
      line = $i
      if (effect && line ~ /\[TUNED\]/ && line !~ /damping/) {
        if (match(line, /\[SIM\] says [0-9]+(\.[0-9]+)?/))
          sub(/= [0-9.]+/, "= " substr(line, RSTART + 11, RLENGTH - 11), line)
        else keep = 0
      }
      block = block (i > 1 ? "\n" : "") line
    }
    if (keep) print block }' "$robot" >published.toml

record() { # NAME TRAJECTORY SEED PAYLOAD, each after a homing of its own
  "$ravencal" simulate --plant "$robot" --trajectory "$2" --seed "$3" --homing-seed "$3" --payload-g "$4" \
    --force --out "$1.db" >/dev/null 2>&1
}
rmse_of() { # MODEL RECORDING: of each joint, deg deg mm
  "$ravencal" evaluate "$1" "$2" | awk '$2 == "deg" || $2 == "mm" { printf "%s ", $8 }'
}

"$ravencal" trajectory zigzag --sparsity 1/4 --out zigzag.csv >/dev/null
"$ravencal" trajectory sinusoid --duration-s 300 --seed 7 --out test.csv >/dev/null
record test_0g test.csv 111 0
record test_500g test.csv 112 500

printf '%-8s %-7s %-8s  %8s %8s %10s\n' minutes load physics shoulder elbow insertion
samples=$(($(wc -l <zigzag.csv) - 1))
for sixths in 1 2 4 6; do
  head -n $((1 + samples * sixths / 6)) zigzag.csv >part.csv
  record train part.csv 11 0
  "$ravencal" diagnose train.db --plant published.toml --out "diagnosis_$sixths" --placebo 0 \
    >/dev/null 2>&1
  for physics in without with; do
    use=()
    [ $physics = with ] && use=(--physics "diagnosis_$sixths/plant_improved.toml")
    : >0g.txt && : >500g.txt
    for seed in 3 13 23; do
      # The twin does not run every plant that diagnose may write; such a row has no figures.
      "$ravencal" train train.db "${network[@]}" --seed $seed "${use[@]}" --force --out model.onnx >train.log 2>&1 ||
        { echo "$sixths of 6, $physics: $(tail -n 1 train.log)"; continue 2; }
      for load in 0g 500g; do rmse_of model.onnx "test_$load.db" >>$load.txt && echo >>$load.txt; done
    done
    for load in 0g 500g; do
      awk -v m="$(awk "BEGIN { print $samples * $sixths / 36000 }")" -v l=$load -v p=$physics \
        '{ a += $1; b += $2; c += $3 } END { printf "%-8.2f %-7s %-8s  %8.3f %8.3f %10.3f\n", m, l, p, a / NR, b / NR, c / NR }' $load.txt
    done
  done
done

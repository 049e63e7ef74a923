#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Two acts. Calibrate, on the digital twin: from zig-zags to corrected joints in the running 1 kHz
# loop. Diagnose: `ravencal prove --one` hides an effect in a robot of its own laws and looks for it.
# Called by tools/run demo, which builds and puts `ravencal` and `ravencal-encoders` in the PATH,
# and by ravencal-demo of the packages.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
plant=$root/tools/plants/raven2.toml
out=out/demo
plugin=
figures=
acts="calibrate diagnose"
network=(--features light-open --hidden 128,64,32 --epochs 120)
test_s=300
live_ticks=20000
seed=$(od -An -N3 -tu4 /dev/urandom | tr -d ' ')

usage() {
  cat <<'END'
usage: demo.sh [--plugin LIB] [--out DIR] [--seed N] [--act calibrate|diagnose] [--figures DIR] [--paper]
  --plugin  libravencal_plugin.so, which act one runs in the 1 kHz loop
  --out     folder for all files (out/demo); emptied if an earlier demo made it
  --seed    of the effect that act two hides; without it a fresh one is drawn
  --act     one act only
  --figures folder for three drawings of both acts (needs nodejs): README's are
            demo.sh --plugin LIB --seed 1 --figures tools/report/figures
  --paper   act one with the paper's network and all of its 600 epochs (hours)
END
}

while [ $# -gt 0 ]; do
  case $1 in
    --plugin) plugin=$2; shift 2 ;;
    --out) out=$2; shift 2 ;;
    --seed) seed=$2; shift 2 ;;
    --act) acts=$2; shift 2 ;;
    --figures) figures=$2; shift 2 ;;
    --paper)
      network=(--features paper112 --hidden 600,500,400 --epochs 600)
      test_s=1200
      shift
      ;;
    -h | --help) usage; exit 0 ;;
    *) echo "demo: unknown argument '$1'" >&2; exit 2 ;;
  esac
done

# Only a folder that an earlier demo made is emptied.
if [ -e "$out" ] && [ ! -e "$out/.ravencal_demo" ] && [ -n "$(ls -A "$out")" ]; then
  echo "demo: --out $out holds other files; name an empty or new folder" >&2
  exit 2
fi
rm -rf "$out"
mkdir -p "$out"
touch "$out/.ravencal_demo"
started=$SECONDS
step() { echo; echo "[$((SECONDS - started)) s] $*"; }

# Runs a command and shows what it said only if it fails.
quietly() { # LOG COMMAND...
  local log=$1
  shift
  "$@" >"$log" 2>&1 || { cat "$log" >&2; return 3; }
}

# A function with each group of four arguments, on all cores.
on_all_cores() { # FUNCTION ARGUMENTS...
  local function=$1
  shift
  export -f "${function?}"
  printf '%s\0' "$@" | xargs -0 -P "$(nproc)" -n 4 bash -euo pipefail -c "$function \"\$@\"" _
}
export root plant

# ---------------------------------------------------------------- act one

# One recording as a robot evening makes it: the robot's states and every edge of the external
# encoders, each on its own clock; the encoder driver homes from the edges; the merge puts the truth
# beside the states. Edges are stamped where they happen, so there is no delay to take out. Each
# recording has a run seed and a homing of its own, so that no test shares what wanders, or the constant
# that a homing leaves, with the training.
make_recording() { # NAME TRAJECTORY PAYLOAD SEED
  ravencal simulate --plant "$plant" --trajectory "$2" --payload-g "$3" --seed "$4" \
    --homing-seed "$4" --out "$1.robot.db" --edges "$1.edges.db"
  ravencal-encoders --config "$root/quadrature_reader/encoders.toml" --replay "$1.edges.db" --home --out "$1.truth.db"
  ravencal merge "$1.robot.db" "$1.truth.db" --clock wall --delay-ms 0 --out "$1.db"
  rm "$1.robot.db" "$1.truth.db" "$1.edges.db"
}

make_recordings() {
  local jobs=() payload sparsity use name number=1
  for payload in 0 500; do
    for sparsity in 1/2 1/3 1/4 1/5 1/6; do
      name=zigzag_${sparsity/\//_}
      [ -e "$out/$name.csv" ] || ravencal trajectory zigzag --sparsity "$sparsity" --out "$out/$name.csv" >/dev/null
      jobs+=("$out/train_${payload}g_$name" "$out/$name.csv" "$payload" "$number")
      number=$((number + 1))
    done
    # Motion never trained on: random targets and speeds, another seed. One recording chooses the
    # best epoch, the other is only ever tested on.
    for use in validate test; do
      name=${use}_${payload}g
      ravencal trajectory sinusoid --duration-s "$test_s" --seed "$((100 + number))" --out "$out/$name.csv" >/dev/null
      jobs+=("$out/$name" "$out/$name.csv" "$payload" "$((100 + number))")
      number=$((number + 1))
    done
  done
  quietly "$out/recordings.log" on_all_cores make_recording "${jobs[@]}"
}

label_of() { if [ "$1" = 0 ]; then echo unloaded; else echo "$1 g"; fi; }

learn() { # PAYLOAD
  ravencal train "$out"/train_"$1"g_*.db --validate "$out/validate_$1g.db" "${network[@]}" \
    --seed 3 --out "$out/model_$1g.onnx" --report "$out/train_$1g.html"
  ravencal convert "$out/model_$1g.onnx" --out "$out/weights_$1g.blob" --check "$out/validate_$1g.db"
  ravencal evaluate "$out/model_$1g.onnx" "$out/test_$1g.db" \
    --json "$out/evaluate_$1g.json" --report "$out/report_$1g.html" >"$out/evaluate_$1g.txt"
}

run_live() { # PAYLOAD
  ravencal host --plugin "$plugin" --weights "$out/weights_$1g.blob" --plant "$plant" \
    --trajectory "$out/test_$1g.csv" --payload-g "$1" --seed "$((200 + $1))" \
    --homing-seed "$((200 + $1))" --ticks "$live_ticks" --json "$out/host_$1g.json" >"$out/host_$1g.txt" 2>&1
}

act_calibrate() {
  local payload loops=() loop failed=0
  step "act one, calibrate: zig-zags at five sparsities, unloaded and with 500 g, each homed anew: states and encoder edges of the twin, labels by the driver, $(nproc) at a time"
  make_recordings
  for payload in 0 500; do
    step "train, pack and evaluate, $(label_of "$payload")"
    learn "$payload"
  done
  # A loop works a fiftieth of its millisecond: two of them leave each other alone.
  step "the plugin in the running 1 kHz loop, unloaded and with 500 g, for $((live_ticks / 1000)) s"
  for payload in 0 500; do
    run_live "$payload" &
    loops+=($!)
  done
  for loop in "${loops[@]}"; do wait "$loop" || failed=$?; done
  for payload in 0 500; do
    echo
    echo "$(label_of "$payload"):"
    cat "$out/host_${payload}g.txt"
  done
  [ "$failed" -eq 0 ] || exit "$failed"
}

# ---------------------------------------------------------------- act two

act_diagnose() {
  step "act two, diagnose: one effect is hidden in a generated robot, seed $seed (--seed $seed hides it again)"
  ravencal prove --one "$seed" --duration-s 120 --held-out-s 60 --out "$out/one" >"$out/one.txt" || [ $? -eq 1 ]
}

# ---------------------------------------------------------------- the end

show_calibrate() {
  local payload
  for payload in 0 500; do
    echo
    echo "act one, $(label_of "$payload"), on unseen random motion of the twin, homed apart from the training, the network's own correction (above: as the plugin applied it in the loop, homed apart as well):"
    cat "$out/evaluate_${payload}g.txt"
  done
}

show_diagnose() {
  echo
  echo "act two, seed $seed, what was hidden and what was found:"
  cat "$out/one.txt"
  echo "(One case: a demonstration. The laws that moved the robot share no code with diagnose; \`ravencal prove\` counts many cases.)"
}

pages_calibrate() { echo "$out/report_0g.html"; echo "$out/report_500g.html"; }
pages_diagnose() { echo "$out/one/diagnosis/report.html"; }

for act in $acts; do "act_$act"; done
[ -z "$figures" ] || node "$root/tools/report/figures/draw.js" "$out" "$figures"
step "done"
for act in $acts; do "show_$act"; done
echo
echo "pages:"
for act in $acts; do "pages_$act"; done

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# The main job on the digital twin, from zig-zags to corrected joints in the running 1 kHz loop.
# Called by tools/run demo, which builds and puts `ravencal` and `ravencal-encoders` in the PATH, and by
# ravencal-demo of the packages.
set -euo pipefail

usage() {
  cat <<'END'
usage: ravencal-demo [--paper] [--out DIR]   calibrate the digital twin, print table and report

--paper runs the paper's network and all of its 600 epochs (hours); without it a light network.
Results go to out/demo, or to DIR.
END
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
plant=$root/tools/plants/raven2.toml
out=out/demo
plugin=
network=(--features light-open --hidden 128,64,32 --epochs 120)
test_s=300
live_ticks=20000

while [ $# -gt 0 ]; do
  case $1 in
    --plugin) plugin=$2; shift 2 ;;
    --out) out=$2; shift 2 ;;
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

# One recording as a robot evening makes it: the robot's states and every edge of the external
# encoders, each on its own clock; the encoder driver homes from the edges; the merge puts the truth
# beside the states. Edges are stamped where they happen, so there is no delay to take out.
make_recording() { # NAME TRAJECTORY PAYLOAD SEED
  ravencal simulate --plant "$plant" --trajectory "$2" --payload-g "$3" --seed "$4" \
    --out "$1.robot.db" --edges "$1.edges.db"
  ravencal-encoders --config "$root/quadrature_reader/encoders.toml" --replay "$1.edges.db" --home --out "$1.truth.db"
  ravencal merge "$1.robot.db" "$1.truth.db" --clock wall --delay-ms 0 --out "$1.db"
  rm "$1.robot.db" "$1.truth.db" "$1.edges.db"
}
export -f make_recording
export root plant

step "zig-zags at five sparsities, unloaded and with 500 g: states and encoder edges of the twin, labels by the driver, $(nproc) at a time"
jobs=()
seed=1
for payload in 0 500; do
  for sparsity in 1/2 1/3 1/4 1/5 1/6; do
    name=zigzag_${sparsity/\//_}
    [ -e "$out/$name.csv" ] || ravencal trajectory zigzag --sparsity "$sparsity" --out "$out/$name.csv" >/dev/null
    jobs+=("$out/train_${payload}g_$name" "$out/$name.csv" "$payload" "$seed")
    seed=$((seed + 1))
  done
  # Motion never trained on: random targets and speeds, another seed. One recording chooses the best
  # epoch, the other is only ever tested on.
  for use in validate test; do
    name=${use}_${payload}g
    ravencal trajectory sinusoid --duration-s "$test_s" --seed "$((100 + seed))" --out "$out/$name.csv" >/dev/null
    jobs+=("$out/$name" "$out/$name.csv" "$payload" "$((100 + seed))")
    seed=$((seed + 1))
  done
done
printf '%s\0' "${jobs[@]}" | xargs -0 -P "$(nproc)" -n 4 bash -euo pipefail -c 'make_recording "$@"' _ >"$out/recordings.log" 2>&1 ||
  { cat "$out/recordings.log" >&2; exit 3; }

for payload in 0 500; do
  label=$([ "$payload" = 0 ] && echo unloaded || echo "500 g")
  step "train, $label"
  ravencal train "$out"/train_"${payload}"g_*.db --validate "$out/validate_${payload}g.db" "${network[@]}" \
    --seed 3 --out "$out/model_${payload}g.onnx" --report "$out/train_${payload}g.html"
  ravencal convert "$out/model_${payload}g.onnx" --out "$out/weights_${payload}g.blob" --check "$out/validate_${payload}g.db"

  step "evaluate on unseen random motion, $label"
  ravencal evaluate "$out/model_${payload}g.onnx" "$out/test_${payload}g.db" \
    --json "$out/evaluate_${payload}g.json" --report "$out/report_${payload}g.html"

  step "the plugin in the running 1 kHz loop, $label"
  ravencal host --plugin "$plugin" --weights "$out/weights_${payload}g.blob" --plant "$plant" \
    --trajectory "$out/test_${payload}g.csv" --payload-g "$payload" --seed "$((200 + payload))" \
    --ticks "$live_ticks" --json "$out/host_${payload}g.json"
done

step "done; reports: $out/report_0g.html $out/report_500g.html"

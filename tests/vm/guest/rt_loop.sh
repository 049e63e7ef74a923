# SPDX-License-Identifier: Apache-2.0
#
# rt_loop.sh KERNEL: `ravencal host` at 1 kHz beside a load of processor, memory and forks, after
# cyclictest with the same priority and period beside the same load. Times are guest time: 4 ns an
# instruction, so the figures compare kernels and loops; they are no machine's microseconds.
# Wants RAVENCAL_BIN (ravencal, ravencal_plugin, rt_weights) and RAVENCAL_SOURCE.
kernel=$1
seconds=4
failures=0
work=$(mktemp -d)
cd "$work" || exit 1
# Under -i, idle guest time is skipped while the host fetches files: have them here beforehand.
cp "$RAVENCAL_BIN"/{ravencal,ravencal_plugin,rt_weights} "$RAVENCAL_SOURCE/tools/plants/raven2.toml" \
  "$(command -v cyclictest)" "$(command -v stress-ng)" .
./rt_weights weights.blob || exit 1

check() { # DESCRIPTION ACTUAL OPERATOR EXPECTED
  if [ "$2" "$3" "$4" ]; then
    echo "ok: $1: $2"
  else
    echo "FAILED: $1: $2, expected $3 $4"
    failures=$((failures + 1))
  fi
}
run_host() { # NAME TICKS
  ./ravencal host --plugin ./ravencal_plugin --weights weights.blob --plant raven2.toml --seed 1 \
    --ticks "$2" --step-budget-us 0 --json "$1.json" >"$1.log" 2>&1
}
# number JSON_FILE PATH...: a number of a JSON file
number() {
  python3 -c 'import json, sys
value = json.load(open(sys.argv[1]))
for key in sys.argv[2:]: value = value[key]
print(value if isinstance(value, str) else round(value))' "$@"
}
# quantile HISTOGRAM SHARE: of cyclictest's -h output, in us
quantile() {
  awk -v share="$2" '!/^#/ && NF == 2 { count[$1 + 0] = $2; total += $2 }
    END { for (us = 0; us < 100000; us++) { seen += count[us]; if (seen >= share * total) { print us; exit } } }' "$1"
}

run_host warm-up 200 || { cat warm-up.log; exit 1; }
echo "kernel $(uname -r), real-time: $(cat /sys/kernel/realtime 2>/dev/null || echo 0)"
check "instruction set" "$(number warm-up.json plugin isa)" = AVX2

./stress-ng --cpu 1 --vm 1 --vm-bytes 32M --fork 1 --quiet &
load=$!
sleep 1
./cyclictest -m -p 80 -i 1000 -h 20000 -q -D "$seconds" >cyclictest.txt
run_host host $((seconds * 1000))
status=$?
kill "$load"; wait "$load" 2>/dev/null
check "the host's exit status" "$status" -eq 0 || cat host.log
cat host.json >host.txt
for share in 0.5 0.99 1; do echo "cyclictest, quantile $share: $(quantile cyclictest.txt $share) us"; done
cat host.log

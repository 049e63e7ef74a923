# SPDX-License-Identifier: Apache-2.0
#
# rt_loop.sh KERNEL: `ravencal host` at 1 kHz beside a load of processor, memory and forks, after
# cyclictest with the same priority and period beside the same load. Times are guest time: 4 ns an
# instruction, so the figures compare kernels and loops; they are no machine's microseconds.
# Wants RAVENCAL_BIN (ravencal, ravencal_plugin, rt_weights) and RAVENCAL_SOURCE.
kernel=$1
seconds=3
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
# figure NAME [KEY]: a number of host.json
figure() {
  local inner=${2:+'\{[^}]*"'$2'":'}
  tr -d ' \n' <host.json | sed -E "s/.*\"$1\":$inner([0-9]+).*/\1/"
}
# quantile SHARE: of cyclictest's histogram, in ns
quantile() {
  awk -v share="$1" '!/^#/ && NF == 2 { us = $1 + 0; count[us] = $2; total += $2; if (us > last) last = us }
    END { for (us = 0; us <= last; us++) { seen += count[us]; if (seen >= share * total) break }
          print us * 1000 }' cyclictest.txt
}

run_host warm-up 200
[ $? -le 1 ] || { cat warm-up.log; exit 1; }
echo "kernel $(uname -r), real-time: $(cat /sys/kernel/realtime 2>/dev/null || echo 0)"
check "AVX2 code is chosen where there is no AVX-512" "$(grep -c 'AVX2 code' warm-up.log)" -eq 1

./stress-ng --cpu 1 --vm 1 --vm-bytes 32M --fork 1 --quiet &
load=$!
sleep 1
./cyclictest -m -p 80 -i 1000 -h 20000 -q -D "$seconds" >cyclictest.txt
run_host host $((seconds * 1000))
status=$?
kill "$load"; wait "$load" 2>/dev/null
[ "$status" -le 1 ] || cat host.log
check "exit status of the host (1: the made-up weights were doubted)" "$status" -le 1
check "real-time scheduling" "$(grep -c 'SCHED_FIFO, memory locked' host.log)" -eq 1

printf '%-22s%10s%10s%10s\n' ns p50 p99 max
printf '%-22s%10d%10d%10d\n' "cyclictest wake-up" "$(quantile 0.5)" "$(quantile 0.99)" "$(quantile 1)"
for name in wakeup step cycle; do
  printf '%-22s%10d%10d%10d\n' "host $name" "$(figure ${name}_ns p50)" \
    "$(figure ${name}_ns p99)" "$(figure ${name}_ns max)"
done
echo "late cycles: $(figure overruns)"

# On an ordinary kernel the load comes first (up to 15 ms): its figures are there to compare.
if [ "$kernel" = rt ]; then
  # One wake-up in three thousand compares who was unlucky, not the loops.
  check "wake-up, p99.9, ns" "$(figure wakeup_ns p999)" -le "$(($(quantile 0.999) + 10000))"
  # The step itself: all but interrupts is the same every time.
  check "step, p99 - p50, ns" \
    "$(($(figure step_ns p99) - $(figure step_ns p50)))" -le 20000
  check "late cycles" "$(figure overruns)" -eq 0
fi
[ "$failures" = 0 ] && echo "all checks passed" || echo "$failures checks failed"
exit $((failures > 0))

# SPDX-License-Identifier: Apache-2.0
#
# rt_loop.sh: `ravencal host` at 1 kHz beside a load of processor, memory and forks, in turns with
# cyclictest of the same priority and period beside the same load. Times are guest time: 4 ns an
# instruction, so the figures compare kernels and loops; they are no machine's microseconds. They are
# printed as ratios to cyclictest and decide nothing: a busy machine delays the guest as a whole.
# RAVENCAL_LONG: two rounds.
# Wants RAVENCAL_BIN (ravencal, ravencal_plugin, rt_weights) and RAVENCAL_SOURCE.
rounds=${RAVENCAL_LONG:+2}
rounds=${rounds:-1}
seconds=1
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
# figure ROUND NAME [KEY]: a number of the host's JSON
figure() {
  local inner=${3:+'\{[^}]*"'$3'":'}
  tr -d ' \n' <"host$1.json" | sed -E "s/.*\"$2\":$inner([0-9]+).*/\1/"
}
# quantile ROUND SHARE: of cyclictest's histogram, in ns
quantile() {
  awk -v share="$2" '!/^#/ && NF == 2 { us = $1 + 0; count[us] = $2; total += $2; if (us > last) last = us }
    END { for (us = 0; us <= last; us++) { seen += count[us]; if (seen >= share * total) break }
          print us * 1000 }' "cyclictest$1.txt"
}

run_host warm-up 200
[ $? -le 1 ] || { cat warm-up.log; exit 1; }
echo "kernel $(uname -r), real-time: $(cat /sys/kernel/realtime 2>/dev/null || echo 0)"
check "AVX2 code is chosen where there is no AVX-512" "$(grep -c 'AVX2 code' warm-up.log)" -eq 1

./stress-ng --cpu 1 --vm 1 --vm-bytes 32M --fork 1 --quiet &
load=$!
sleep 1
for round in $(seq $rounds); do
  ./cyclictest -m -p 80 -i 1000 -h 20000 -q -D "$seconds" >"cyclictest$round.txt"
  run_host "host$round" $((seconds * 1000))
  status=$?
  [ "$status" -le 1 ] || cat "host$round.log"
  check "exit status of the host (1: the made-up weights were doubted)" "$status" -le 1
  check "real-time scheduling" "$(grep -c 'SCHED_FIFO, memory locked' "host$round.log")" -eq 1
  check "ticks" "$(figure "$round" ticks)" -eq $((seconds * 1000))
done
kill "$load"; wait "$load" 2>/dev/null

printf '%5s %-22s%10s%10s%10s\n' round ns p50 p99 max
for round in $(seq $rounds); do
  printf '%5d %-22s%10d%10d%10d\n' "$round" "cyclictest wake-up" "$(quantile "$round" 0.5)" \
    "$(quantile "$round" 0.99)" "$(quantile "$round" 1)"
  for name in wakeup step cycle; do
    printf '%5d %-22s%10d%10d%10d\n' "$round" "host $name" "$(figure "$round" ${name}_ns p50)" \
      "$(figure "$round" ${name}_ns p99)" "$(figure "$round" ${name}_ns max)"
  done
  awk -v host="$(figure "$round" wakeup_ns p99)" -v peer="$(quantile "$round" 0.99)" \
    -v late="$(figure "$round" overruns)" \
    'BEGIN { printf "      wake-up p99, host / cyclictest: %.2f; late cycles: %d\n", host / peer, late }'
done

[ "$failures" = 0 ] && echo "all checks passed" || echo "$failures checks failed"
exit $((failures > 0))

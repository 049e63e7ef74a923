# SPDX-License-Identifier: Apache-2.0
#
# In the guest: edge rates up to what the simulated lines can do, through ravencal-encoders with
# libgpiod 1 (RAVENCAL_BIN1) and 2 (RAVENCAL_BIN), and through gpiomon of both. One table; fails if
# ravencal-encoders lost an edge at a sustained rate, or lost one silently at any.
. "$RAVENCAL_SOURCE/tests/vm/guest/lib.sh"
cp "$RAVENCAL_BIN1/ravencal-encoders" encoders1
cp "$RAVENCAL_BIN/ravencal-encoders" encoders2
cp "$(command -v gpiomon)" gpiomon1
cp "$RAVENCAL_GPIOD2/usr/bin/gpiomon" gpiomon2
cp "$RAVENCAL_GPIOD2"/usr/lib/x86_64-linux-gnu/libgpiod.so.3* .
gpio_sim_up raven-encoders SH_A SH_B
printf '[[source]]\nname = "board"\nkind = "gpio"\nchip = "/dev/encoders"\n' >sweep.toml
encoder shoulder board 'line_a = "SH_A"' 'line_b = "SH_B"' >>sweep.toml
edges=4000 # a multiple of four: the lines end where they began

drive() { # RATE PID: sets reached, cpu (of the reader, per edge)
  local before
  before=$(cpu_us "$2")
  reached=$(./gpio_sim_driver "$sim" 0 "$1" $edges | sed -E 's/.*rate ([0-9]+)/\1/')
  sleep 0.3
  cpu=$((($(cpu_us "$2") - before) * 10 / edges))
}
row() { printf '%-28s %8s %8s %7s %7s %6s %7s %6s\n' "$@"; }
result() { # READER RATE SEEN TOLD
  row "$1" "${2/#0/max}" "$reached" $edges "$3" "$4" $((edges - $3 - $4)) "$((cpu / 10)).$((cpu % 10))"
}
ours() { # LABEL PROGRAM RATE
  encoders=./$2
  start_recorder sweep
  drive "$3" "$recorder"
  stop_recorder
  local seen told
  seen=$(json_of_joint edges shoulder)
  told=$(total_of edges_lost)
  result "$1" "$3" "$seen" "$told"
  rm -f sweep.db*
  [ $((seen + told)) -eq $edges ] && [ "$told" -eq 0 ] || failures=$((failures + 1))
}
gpiomon_of() { # LABEL RATE COMMAND...
  local label=$1 rate=$2
  shift 2
  "$@" >mon.txt 2>mon.err &
  local monitor=$!
  sleep 0.5
  drive "$rate" $monitor
  kill -TERM $monitor # in the background SIGINT is ignored
  wait $monitor
  result "$label" "$rate" "$(grep -cE 'RISING|FALLING|rising|falling' mon.txt)" 0
}

row reader asked reached driven seen told silent us/edge
for rate in 1000 4000 8000 0; do
  ours "ravencal-encoders, libgpiod 1" encoders1 $rate
  ours "ravencal-encoders, libgpiod 2" encoders2 $rate
  gpiomon_of "gpiomon 1.6" $rate ./gpiomon1 "${chip##*/}" 0 1
  LD_LIBRARY_PATH=. gpiomon_of "gpiomon 2.1" $rate ./gpiomon2 -c "$chip" 0 1
done
[ -s mon.err ] && cat mon.err
finish

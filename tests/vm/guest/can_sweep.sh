# SPDX-License-Identifier: Apache-2.0
#
# In the guest: frame rates up to what the virtual bus can do, through ravencal-encoders and
# candump, then the bus full for a long time.
#   can_sweep.sh GUEST_MINUTES
. "$RAVENCAL_SOURCE/tests/vm/guest/lib.sh"
minutes=$1
cp "$(command -v candump)" .
ip link add can-raven type vcan
ip link set can-raven txqueuelen 1000 up
printf '[[source]]\nname = "bus"\nkind = "can"\ninterface = "can-raven"\n' >sweep.toml
encoder shoulder bus 'canopen_node = 5' 'max_counts_per_s = 0' >>sweep.toml
row() { printf '%-20s %8s %8s %9s %9s %6s %7s %8s\n' "$@"; }

send() { # RATE FRAMES PID: sets reached, cpu
  local before
  before=$(cpu_us "$3")
  reached=$(./can_sender can-raven 5 "$1" "$2" | sed -E 's/.*rate ([0-9]+)/\1/')
  sleep 0.3
  cpu=$((($(cpu_us "$3") - before) * 10 / $2))
}
result() { # READER RATE FRAMES SEEN TOLD
  row "$1" "${2/#0/max}" "$reached" "$3" "$4" "$5" $(($3 - $4 - $5)) "$((cpu / 10)).$((cpu % 10))"
}
ours() { # RATE FRAMES
  start_recorder sweep
  send "$1" "$2" "$recorder"
  stop_recorder
  local seen told
  seen=$(json_of_joint edges shoulder)
  told=$(total_of edges_lost)
  result ravencal-encoders "$1" "$2" "$seen" "$told"
  rm -f sweep.db*
  [ "$seen" -eq "$2" ] && [ "$told" -eq 0 ] || failures=$((failures + 1))
}
candump_of() { # RATE FRAMES
  ./candump -d -L can-raven >dump.txt 2>dump.err &
  local dump=$!
  sleep 0.5
  send "$1" "$2" $dump
  kill -INT $dump
  wait $dump
  result candump "$1" "$2" "$(grep -c 185# dump.txt)" \
    "$(sed -nE 's/.*DROPCOUNT: dropped ([0-9]+).*/\1/p' dump.txt dump.err | awk '{n += $1} END {print n + 0}')"
}

row reader asked reached sent seen told silent us/frame
for rate in 1000 5000 10000 20000 0; do
  ours $rate 20000
  candump_of $rate 20000
done
# As fast as it goes, about 10 000 frames/s here; a 1 Mbit/s bus carries 12 600 of 4 bytes.
if [ "$minutes" -gt 0 ]; then
  ours 0 $((minutes * 600000))
  echo "a full bus for $((minutes * 600000 / reached)) s of guest time"
fi
finish

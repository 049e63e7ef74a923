# SPDX-License-Identifier: Apache-2.0
#
# In the guest: the kernel's own GPIO path, from simulated lines to the recording.
#   gpio.sh v1|v2     the libgpiod that ravencal-encoders was built with
. "$RAVENCAL_SOURCE/tests/vm/guest/lib.sh"
version=$1
gpio_sim_up raven-encoders SH_A SH_B EL_A EL_B
source_table() { printf '[[source]]\nname = "board"\nkind = "gpio"\nchip = "/dev/encoders"\n%s\n' "$1"; }
two_joints() {
  source_table "$1"
  encoder shoulder board 'line_a = "SH_A"' 'line_b = "SH_B"'
  encoder elbow board 'line_a = "EL_A"' 'line_b = "EL_B"'
}

echo "== known motion, both directions, three rates"
two_joints >motion.toml
start_recorder motion
for rate in 1000 5000 0; do
  ./gpio_sim_driver "$sim" 0 $rate 3000 -1000
  ./gpio_sim_driver "$sim" 2 $rate -500 100
done
stop_recorder
check "exit status" "$status" -eq 0
check "shoulder's counts" "$(json_of_joint counts shoulder)" -eq 6000
check "elbow's counts" "$(json_of_joint counts elbow)" -eq -1200
check "shoulder's edges" "$(json_of_joint edges shoulder)" -eq 12000
check "losses" "$(sql "select count(*) from event where kind <> 'clock_offset'")" -eq 0
check "rows without truth" "$(sql 'select count(*) from sample where "shoulder.joint_truth" is null')" -eq 0
check "last count in the recording" "$(sql 'select cast("shoulder.counts" as integer) from sample order by t_ns desc limit 1')" -eq 6000

# A cycle has four counts; every run starts where the lines are.
lagging_reader() { # NAME EXTRA_SOURCE_KEYS: stops the reader for 50 ms in a motion at 4000 edges/s
  two_joints "$2" >"$1.toml"
  start_recorder "$1"
  ./gpio_sim_driver -p "$recorder:2000:50" "$sim" 0 4000 8000
  stop_recorder
  lost_events=$(sql "select count(*) from event where kind = 'edges_lost'")
  lost_edges=$(total_of edges_lost)
  seen_edges=$(json_of_joint edges shoulder)
}

echo "== reader stopped for 50 ms"
lagging_reader lag ""
if [ "$version" = v1 ]; then
  check "the loss is found out" "$lost_events" -ge 1
  check "exit status" "$status" -eq 4
  check "edges seen" "$seen_edges" -lt 8000
  check "the position is withheld afterwards" "$(sql 'select count(*) from sample where t_ns > (select max(t_ns) from sample) - 100000000 and "shoulder.joint_truth" is not null')" -eq 0
  check "the other joint is not touched" "$(sql 'select count(*) from sample where "elbow.joint_truth" is null')" -eq 0
else
  check "a queue of 1024 edges loses nothing" "$lost_events" -eq 0
  check "counts" "$(json_of_joint counts shoulder)" -eq 8000
  lagging_reader lag16 "event_buffer_size = 16"
  check "the loss is found out" "$lost_events" -ge 1
  check "edges seen + edges lost" "$((seen_edges + lost_edges))" -eq 8000
  check "counts, bridged in steady motion" "$(json_of_joint counts shoulder)" -eq 8000
  check "exit status" "$status" -eq 4
fi

echo "== set-up check at a terminal, with joints moved by hand"
two_joints >setup.toml
: >said.txt
script -qefc "$encoders --config setup.toml --check-setup" said.txt </dev/null >terminal.txt 2>&1 &
setup=$!
wiggle() { # FIRST_LINE COUNTS JOINT: moves when the program asks for it
  for _ in $(seq 100); do
    grep -q "'$3': move it" said.txt && break
    sleep 0.1
  done
  ./gpio_sim_driver "$sim" "$1" 1000 "$2" >driven
}
wiggle 0 400 shoulder
wiggle 2 -400 elbow
wait $setup
check "exit status" $? -eq 4
check "a joint that counts up" "$(grep -c "joint 'shoulder': +[0-9]* counts, sign +1 is right" said.txt)" -eq 1
check "a joint that counts down" "$(grep -c "joint 'elbow': -[0-9]* counts with sign +1.*set sign = -1" said.txt)" -eq 1

echo "== chip unplugged and back"
two_joints >unplug.toml
start_recorder unplug
./gpio_sim_driver "$sim" 0 1000 400
sleep 0.1 # what the kernel still holds at that moment goes with the chip
gpio_sim_unplug raven-encoders
sleep 2.5
gpio_sim_plug raven-encoders
sleep 1.5
./gpio_sim_driver "$sim" 0 1000 400
stop_recorder
check "exit status" "$status" -eq 4
check "outage recorded" "$(sql "select count(*) from event where kind = 'outage'")" -ge 1
check "recovery recorded" "$(sql "select count(*) from event where kind = 'recovered'")" -ge 1
check "moved after the return" "$(json_of_joint edges shoulder)" -eq 800
check "file" "$(sql 'pragma integrity_check')" = ok
finish

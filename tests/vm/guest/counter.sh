# SPDX-License-Identifier: Apache-2.0
#
# In the guest: the kernel's counter subsystem with a simulated chip (counter_sim.c), which counts
# what is written to it.
. "$RAVENCAL_SOURCE/tests/vm/guest/lib.sh"
chip=/sys/bus/counter/devices/counter0
count() { echo "$1" >$chip/count0/count; }
counter_table() {
  printf '[[source]]\nname = "chip"\nkind = "counter"\ncounter = "/dev/counter0"\n%s\n' "$1"
  encoder shoulder chip 'count = 0'
}
move() { # FROM TO: one count each
  local n
  for n in $(seq "$1" "$2"); do count "$n"; done
}

echo "== a driver that reports every change"
counter_table >events.toml
count 4294967290
start_recorder events
for n in 4294967291 4294967292 4294967293 4294967294 4294967295; do count $n; done
move 0 500
stop_recorder
check "exit status" "$status" -eq 0
check "counts across the wrap of 32 bits" "$(json_of_joint counts shoulder)" -eq $((4294967296 + 500))
check "one reading per change" "$(json_of_joint edges shoulder)" -ge 506
check "losses" "$(json_of_joint losses shoulder)" -eq 0
check "rows without truth" "$(sql 'select count(*) from sample where "shoulder.joint_truth" is null')" -eq 0

echo "== more changes than the kernel queues, while the reader is stopped"
counter_table >lag.toml
start_recorder lag
kill -STOP "$recorder"
move 501 2000
kill -CONT "$recorder"
sleep 0.5
stop_recorder
check "exit status" "$status" -eq 4
check "the loss is found out" "$(sql "select count(*) from event where kind = 'edges_lost'")" -ge 1
check "counts" "$(json_of_joint counts shoulder)" -eq 2000

echo "== a driver that can only be asked"
echo 0 >/sys/module/counter_sim/parameters/events
counter_table 'poll_hz = 500' >poll.toml
start_recorder poll
move 2001 2500
sleep 0.1
stop_recorder
check "exit status" "$status" -eq 0
check "counts" "$(json_of_joint counts shoulder)" -eq 2500
counter_table 'mode = "events"' >refused.toml
"$encoders" --config refused.toml --out refused.db 2>refused.log
check "events asked for and not there" $? -eq 4
check "with the remedy" "$(grep -c 'mode = "poll"' refused.log)" -eq 1

echo "== chip unplugged and back"
counter_table >unplug.toml
start_recorder unplug
echo counter-sim >/sys/bus/platform/drivers/counter-sim/unbind
sleep 1
echo counter-sim >/sys/bus/platform/drivers/counter-sim/bind
sleep 1.5
stop_recorder
check "exit status" "$status" -eq 4
check "outage recorded" "$(sql "select count(*) from event where kind = 'outage'")" -ge 1
check "recovery recorded" "$(sql "select count(*) from event where kind = 'recovered'")" -ge 1
finish

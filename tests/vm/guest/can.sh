# SPDX-License-Identifier: Apache-2.0
#
# In the guest: SocketCAN over a virtual interface.
. "$RAVENCAL_SOURCE/tests/vm/guest/lib.sh"
ip link add can-raven type vcan
ip link set can-raven txqueuelen 1000 up
printf '[[source]]\nname = "bus"\nkind = "can"\ninterface = "can-raven"\nposition_timeout_ms = 300\n' >source
bus() {
  cat source
  encoder shoulder bus 'canopen_node = 5'
  encoder elbow bus 'can_id = 0x1F334455' 'byte_offset = 1' 'byte_count = 2' 'counter_bits = 16' 'big_endian = true'
}

echo "== positions, a free layout, a node that falls silent, one that begins again"
bus >states.toml
start_recorder states
./can_sender can-raven 5 1000 1000 4294967000
cansend can-raven 1F334455#00FFF0
cansend can-raven 1F334455#000010
sleep 0.6
cansend can-raven 705#00
cansend can-raven 185#0500000000000000
cansend can-raven 185#06000000
stop_recorder
check "exit status" "$status" -eq 4
# 1000 counts across the wrap of 32 bits; the restart goes on from there: 5 stands for the same count.
check "counts across the wrap" "$(json_of_joint counts shoulder)" -eq $((4294967000 + 999 + 1))
check "free layout across its wrap" "$(json_of_joint counts elbow)" -eq 65552
check "silence recorded" "$(sql "select count(*) from event where kind = 'outage' and detail like '%node_silent%'")" -ge 1
check "restart recorded" "$(sql "select count(*) from event where kind = 'device_restarted'")" -eq 1

echo "== saturated interface"
bus >flood.toml
start_recorder flood
./can_sender can-raven 5 0 100000
stop_recorder
check "frames counted" "$(json_of_joint edges shoulder)" -eq 100000
check "frames lost" "$(sql "select count(*) from event where kind = 'edges_lost'")" -eq 0

echo "== reader stopped until its socket is full"
printf '[[source]]\nname = "bus"\nkind = "can"\ninterface = "can-raven"\n' >full.toml
encoder shoulder bus 'canopen_node = 5' 'max_counts_per_s = 0' >>full.toml
start_recorder full
./can_sender can-raven 5 0 100 >sent
kill -STOP "$recorder"
./can_sender can-raven 5 0 30000 100 >sent
kill -CONT "$recorder"
sleep 0.5
stop_recorder
seen=$(json_of_joint edges shoulder)
check "exit status" "$status" -eq 4
check "frames lost" "$(total_of edges_lost)" -gt 0
check "frames seen + frames lost" "$((seen + $(total_of edges_lost)))" -eq 30100

echo "== a corrupt frame, FD frames, SYNC and start of the node, time stamps"
printf '[[source]]\nname = "bus"\nkind = "can"\ninterface = "can-raven"\nsync_period_ms = 10\nstart_nodes = true\n' >more.toml
encoder shoulder bus 'canopen_node = 5' >>more.toml
encoder elbow bus 'can_id = 0x123' 'byte_offset = 44' >>more.toml
candump -L can-raven >bus.txt &
dump=$!
start_recorder more
./can_sender can-raven 5 1000 200
cansend can-raven 185#0000004000000000
./can_sender can-raven 5 1000 200 200
cansend can-raven "123##1$(printf '%088d' 0)78563412"
cansend can-raven 705#00
sleep 1
stop_recorder
kill $dump
check "exit status" "$status" -eq 4
check "the corrupt frame is an event" "$(sql "select count(*) from event where kind = 'edges_lost' and detail like '%implausible_count%'")" -eq 1
check "and no jump" "$(json_of_joint counts shoulder)" -eq 399
check "counts of an FD frame" "$(json_of_joint counts elbow)" -eq $((0x12345678))
check "SYNC frames in a second and more" "$(grep -c ' 080#' bus.txt)" -ge 100
check "start of the node, at the beginning and after its boot-up" "$(grep -c ' 000#0105' bus.txt)" -eq 2
check "the kernel's time stamps" "$(sql "select count(*) from event where detail like '%stamps_kernel%' and kind = 'notice'")" -ge 1

echo "== interface down and up"
bus >down.toml
start_recorder down
./can_sender can-raven 5 1000 100
ip link set can-raven down
sleep 1
ip link set can-raven up
sleep 1
./can_sender can-raven 5 1000 100 100
stop_recorder
check "exit status" "$status" -eq 4
check "outage recorded" "$(sql "select count(*) from event where kind = 'outage' and detail like '%device_gone%'")" -ge 1
check "counts go on" "$(json_of_joint counts shoulder)" -eq 199

echo "== a bus that goes off, by a real CAN driver (slcan) over a pseudo terminal"
modprobe slcan
mkfifo adapter
python3 - <<'PTY' >pty.txt 2>pty.err &
import os, pty, sys
master, slave = pty.openpty()
print(os.ttyname(slave), flush=True)
for line in open("adapter"):
    os.write(master, line.rstrip("\n").encode() + b"\r")
PTY
exec 8>adapter
while [ ! -s pty.txt ]; do sleep 0.1; done
slcand -o -s8 "$(cat pty.txt)" can-serial >slcand.txt 2>&1
for _ in $(seq 50); do ip link show can-serial >link.txt 2>&1 && break; sleep 0.1; done
ip link set can-serial up
printf '[[source]]\nname = "bus"\nkind = "can"\ninterface = "can-serial"\n' >serial.toml
encoder shoulder bus 'canopen_node = 5' >>serial.toml
start_recorder serial
adapter() { echo "$1" >&8; sleep 0.1; }
adapter t185464000000
adapter sw096000
adapter sb000255
adapter t185466000000
stop_recorder
sql "select kind, detail from event where detail like '%bus_%'"
check "exit status" "$status" -eq 4
check "counts from the serial adapter" "$(json_of_joint counts shoulder)" -eq 102
check "warning of the controller" "$(sql "select count(*) from event where kind = 'notice' and detail like '%bus_error%'")" -ge 1
check "bus-off" "$(sql "select count(*) from event where kind = 'outage' and detail like '%bus_off%'")" -eq 1
"$encoders" --config serial.toml --check-setup >setup.txt </dev/null
cat setup.txt
check "the set-up check finds the bus off" "$(grep -c 'BAD.*BUS-OFF' setup.txt)" -eq 1
check "and that it stays so" "$(grep -c 'note.*does not come back by itself' setup.txt)" -eq 1
exec 8>&-
kill "$(pidof slcand)" %+ 2>kill.err
finish

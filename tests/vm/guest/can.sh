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
finish

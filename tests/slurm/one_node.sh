# SPDX-License-Identifier: Apache-2.0
#
# Sourced: a Slurm of one node, this machine, for as long as the shell lives. Its configuration,
# key, state, sockets and logs lie in one folder; nothing outside it is read or written, and its
# daemons end with the shell.
#
#   start_one_node DIR   exports SLURM_CONF; on failure prints why and returns 1

one_node_pids=()

stop_one_node() {
  local pid
  for pid in "${one_node_pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  for pid in "${one_node_pids[@]}"; do
    for _ in $(seq 600); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
    kill -9 "$pid" 2>/dev/null || true
  done
  one_node_pids=()
}

# A port of 127.0.0.1 that nobody listens on now, below those that the kernel gives to clients.
free_port() {
  local port
  while true; do
    port=$((20000 + RANDOM % 12000))
    (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return; }
  done
}

start_munge() {
  local dir=$1
  head -c 1024 /dev/urandom >"$dir/munge.key"
  chmod 600 "$dir/munge.key"
  munged --foreground --force --key-file="$dir/munge.key" --socket="$dir/munge.socket" \
    --pid-file="$dir/munged.pid" --log-file="$dir/munged.log" --seed-file="$dir/munge.seed" \
    >"$dir/munged.out" 2>&1 &
  one_node_pids+=($!)
  for _ in $(seq 6000); do [ -S "$dir/munge.socket" ] && return 0; sleep 0.1; done
  echo "munged did not start: $(tail -n 1 "$dir/munged.out")"
  return 1
}

write_configuration() {
  local dir=$1 host
  host=$(hostname -s)
  cat >"$dir/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$dir/munge.socket
CredType=cred/munge
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
ReturnToService=2
MailProg=/bin/true
KillWait=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=64000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
  printf 'CgroupPlugin=cgroup/v1\nConstrainCores=no\n' >"$dir/cgroup.conf"
}

# Both daemons run, and the node takes jobs; false as soon as one of them has ended. sinfo waits 10 s for
# a controller that does not answer.
node_is_idle() { # CONTROLLER_PID NODE_PID
  for _ in $(seq 100); do
    kill -0 "$1" 2>/dev/null && kill -0 "$2" 2>/dev/null || return 1
    [ "$(timeout 60 sinfo -h -o %T 2>/dev/null)" = idle ] && return 0
    sleep 0.2
  done
  return 1
}

start_one_node() {
  local dir=$1 controller node
  mkdir -p "$dir/state" "$dir/spool"
  chmod 755 "$dir"
  start_munge "$dir" || return 1
  export SLURM_CONF=$dir/slurm.conf
  for _ in 1 2 3; do
    write_configuration "$dir"
    slurmctld -D -f "$SLURM_CONF" >"$dir/slurmctld.out" 2>&1 &
    controller=$!
    slurmd -D -f "$SLURM_CONF" >"$dir/slurmd.out" 2>&1 &
    node=$!
    one_node_pids+=("$controller" "$node")
    node_is_idle "$controller" "$node" && return 0
    kill "$controller" "$node" 2>/dev/null
    wait "$controller" "$node" 2>/dev/null
  done
  echo "Slurm's node did not become idle: $(tail -qn 1 "$dir/slurmctld.log" "$dir/slurmd.log" 2>&1 | tr '\n' ' ')"
  return 1
}

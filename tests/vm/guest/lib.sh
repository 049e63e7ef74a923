# SPDX-License-Identifier: Apache-2.0
#
# Sourced by the guest scripts: simulated chips, a recorder in the background, checks.
# Wants RAVENCAL_BIN (folder with ravencal-encoders, gpio_sim_driver, can_sender).
failures=0
work=$(mktemp -d)
cd "$work" || exit 1
# Under -i, idle guest time is skipped while the host fetches files: have them here beforehand.
cp "$RAVENCAL_BIN"/{ravencal-encoders,gpio_sim_driver,can_sender} "$(command -v sqlite3)" .
encoders=$work/ravencal-encoders
{
  "$encoders" --version
  ./sqlite3 :memory: 'select 1'
  sleep 0
  echo x | sed -E s/x/y/ | tail -1
} >warm-up

# check DESCRIPTION ACTUAL OPERATOR EXPECTED   (operators of test(1))
check() {
  if [ "$2" "$3" "$4" ]; then
    echo "ok: $1: $2"
  else
    echo "FAILED: $1: $2, expected $3 $4"
    failures=$((failures + 1))
  fi
}

# gpio_sim_up LABEL LINE_NAME...: makes a simulated chip; sets chip (/dev/...) and sim (folder of
# the sim_gpioN attributes).
gpio_sim_up() {
  local label=$1 line=0 name
  shift
  local config=/sys/kernel/config/gpio-sim/$label
  mkdir -p "$config/bank0"
  echo $# >"$config/bank0/num_lines"
  echo "$label" >"$config/bank0/label"
  for name in "$@"; do
    mkdir "$config/bank0/line$line"
    echo "$name" >"$config/bank0/line$line/name"
    line=$((line + 1))
  done
  gpio_sim_plug "$label"
}
# gpio_sim_plug LABEL: (re-)creates the chip, maybe under another number; /dev/encoders points to it
gpio_sim_plug() {
  local config=/sys/kernel/config/gpio-sim/$1 chip_name
  echo 1 >"$config/live"
  chip_name=$(cat "$config/bank0/chip_name")
  chip=/dev/$chip_name
  sim=/sys/devices/platform/$(cat "$config/dev_name")/$chip_name
  ln -sfn "$chip" /dev/encoders
}
gpio_sim_unplug() {
  echo 0 >"/sys/kernel/config/gpio-sim/$1/live"
  rm -f /dev/encoders
}

# encoder JOINT SOURCE LINES...: one [[encoder]] table
encoder() {
  local joint=$1 source=$2
  shift 2
  printf '[[encoder]]\njoint = "%s"\nsource = "%s"\ncounts_per_rev = 80000\nzero_counts = 0\n' "$joint" "$source"
  printf '%s\n' "$@"
}

# start_recorder NAME [ARGUMENTS]: records NAME.toml into NAME.db until stop_recorder, which sets
# status (exit code) and last (the line of JSON that it prints at the end).
start_recorder() {
  name=$1
  shift
  "$encoders" --config "$name.toml" --out "$name.db" --json "$@" >"$name.json" 2>"$name.log" &
  recorder=$!
  for _ in $(seq 100); do
    [ -s "$name.json" ] && return
    sleep 0.1
  done
  echo "FAILED: the recorder did not start"; cat "$name.log"; exit 1
}
stop_recorder() {
  sleep 0.2 # longer than anything is on its way
  kill -INT "$recorder"
  wait "$recorder"
  status=$?
  last=$(tail -1 "$name.json")
}
sql() { ./sqlite3 "$name.db" "$1"; }
# total_of KIND: sum of the amounts in the recording's events of a kind
total_of() { sql "select coalesce(sum(json_extract(detail, '\$.amount')), 0) from event where kind = '$1'"; }
# json_of_joint KEY JOINT: a number from the last status
json_of_joint() { sed -E "s/.*\"joint\":\"$2\"[^}]*\"$1\":(-?[0-9.e+]+).*/\1/" <<<"$last"; }

# cpu_us PID: time that all threads of a process have run, in microseconds
cpu_us() { cat "/proc/$1"/task/*/schedstat | awk '{ns += $1} END {printf "%d", ns / 1000}'; }

finish() {
  [ "$failures" = 0 ] && echo "all checks passed" || echo "$failures checks failed"
  exit $((failures > 0))
}

# SPDX-License-Identifier: Apache-2.0
#
# In the guest, with systemd-udevd: names, groups and modes of the shipped rules, which device they
# stay with, and who is refused; the unit and the network file as systemd reads them.
. "$RAVENCAL_SOURCE/tests/vm/guest/lib.sh"
groupadd --system ravencal
useradd --no-create-home outsider
useradd --no-create-home --groups ravencal insider
chmod 755 "$work"
as() { su "$1" -s /bin/sh -c "$2" </dev/null 2>&1; }

# Two chips of one kind; ours is the second. It is named as the README says: by its own device.
gpio_sim_up other X_A X_B
other_chip=$chip
gpio_sim_up raven-encoders SH_A SH_B
identity=$(cat /sys/kernel/config/gpio-sim/raven-encoders/dev_name)
gpio_sim_unplug other
gpio_sim_unplug raven-encoders
mkdir -p /run/udev/rules.d
sed "s/KERNELS==\"gpio-sim.\*\"/KERNELS==\"$identity\"/" "$RAVENCAL_SOURCE/udev/60-ravencal.rules" >/run/udev/rules.d/60-ravencal.rules
udevadm control --reload

echo "== names, groups, modes"
gpio_sim_plug other
gpio_sim_plug raven-encoders
first_chip=$chip
ip link add vcan0 type vcan
ip link add vcan-raven type vcan
modprobe counter-sim
udevadm settle
check "name of the chip" "$(readlink -f /dev/ravencal/encoders)" = "$chip"
check "group and mode" "$(stat -c '%G %a' "$chip")" = "ravencal 660"
check "the other chip is left alone" "$(stat -c '%G' "$other_chip")" = root
check "name of the interface" "$(ip -o link show can-raven | wc -l)" -eq 1
check "the other interface is left alone" "$(ip -o link show vcan0 | wc -l)" -eq 1
check "name of the counter" "$(readlink -f /dev/ravencal/counter)" = /dev/counter0
check "its group and mode" "$(stat -c '%G %a' /dev/counter0)" = "ravencal 660"
check "classes that the unit allows" "$(grep -cE ' (gpiochip|counter)$' /proc/devices)" -eq 2

echo "== who may"
printf '[[source]]\nname = "board"\nkind = "gpio"\nchip = "/dev/ravencal/encoders"\n' >setup.toml
encoder shoulder board 'line_a = "SH_A"' 'line_b = "SH_B"' >>setup.toml
printf '[[source]]\nname = "chip"\nkind = "counter"\ncounter = "/dev/ravencal/counter"\n' >counter.toml
encoder shoulder chip >>counter.toml
as outsider "$encoders --config $work/setup.toml --check-setup" >outsider.txt
check "an outsider is refused" $? -eq 4
check "with the remedy" "$(grep -c 'usermod -aG ravencal' outsider.txt)" -eq 1
as outsider "$encoders --config $work/setup.toml --out /tmp/outsider.db" >outsider.txt
check "and cannot record" $? -eq 4
as outsider "$encoders --config $work/counter.toml --out /tmp/outsider.db" >outsider.txt
check "nor read the counter" "$(grep -c 'Permission denied' outsider.txt)" -eq 1
as insider "$encoders --config $work/setup.toml --check-setup" >insider.txt
check "a member of the group may" $? -eq 0
cat insider.txt
as insider "$encoders --config $work/counter.toml --check-setup" >counter.txt
check "the counter too" $? -eq 0

echo "== another order of probing"
gpio_sim_unplug raven-encoders
gpio_sim_unplug other
udevadm settle
check "the name goes with the chip" "$([ -e /dev/ravencal/encoders ] && echo there || echo gone)" = gone
gpio_sim_plug raven-encoders
ours=$chip
gpio_sim_plug other
udevadm settle
check "our chip has another number now" "$ours" != "$first_chip"
check "and its name" "$(readlink -f /dev/ravencal/encoders)" = "$ours"

echo "== unit and network file"
cp "$RAVENCAL_SOURCE/udev/ravencal-encoders.service" .
systemd-analyze verify ./ravencal-encoders.service >verify.txt 2>&1
check "systemd-analyze verify" $? -eq 0
check "and nothing to say" "$(grep -c ravencal verify.txt)" -eq 0
systemd-analyze security --offline=true --threshold=20 ./ravencal-encoders.service >security.txt 2>&1
check "systemd-analyze security, exposure at most 2.0" $? -eq 0
tail -1 security.txt
mkdir -p /run/systemd/network /run/systemd/netif/{links,leases,lldp}
cp "$RAVENCAL_SOURCE/udev/70-can-raven.network" /run/systemd/network/
ip link show can-raven >link.txt
check "the interface is down" "$(grep -c 'state DOWN' link.txt)" -eq 1
SYSTEMD_LOG_LEVEL=debug SYSTEMD_LOG_TARGET=console /lib/systemd/systemd-networkd >networkd.txt 2>&1 &
networkd=$!
for _ in $(seq 60); do
  sleep 0.5
  grep -q 'can-raven: Link UP' networkd.txt && break
done
kill $networkd
check "networkd takes the file for the interface" "$(grep -c 'can-raven: Configuring with .*70-can-raven.network' networkd.txt)" -eq 1
check "brings it up" "$(ip link show can-raven | grep -c '[<,]UP[,>]')" -eq 1
check "and understands all of it" "$(grep -cE '70-can-raven.network:[0-9]+' networkd.txt)" -eq 0
finish

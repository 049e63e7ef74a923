# SPDX-License-Identifier: Apache-2.0
#
# In the guest, with systemd-udevd: names, groups and modes of the shipped rules, and who is refused.
. "$RAVENCAL_SOURCE/tests/vm/guest/lib.sh"
groupadd --system ravencal
useradd --no-create-home outsider
useradd --no-create-home --groups ravencal insider
mkdir -p /run/udev/rules.d
cp "$RAVENCAL_SOURCE/udev/60-ravencal.rules" /run/udev/rules.d/
udevadm control --reload
gpio_sim_up raven-encoders SH_A SH_B
ip link add vcan-raven type vcan
udevadm settle
check "name of the chip" "$(readlink -f /dev/ravencal/encoders)" = "$chip"
check "group and mode" "$(stat -c '%G %a' "$chip")" = "ravencal 660"
check "name of the interface" "$(ip -o link show can-raven | wc -l)" -eq 1
printf '[[source]]\nname = "board"\nkind = "gpio"\nchip = "/dev/ravencal/encoders"\n' >setup.toml
encoder shoulder board 'line_a = "SH_A"' 'line_b = "SH_B"' >>setup.toml
chmod 755 "$work"
su outsider -s /bin/sh -c "$encoders --config $work/setup.toml --check-setup" >outsider.txt </dev/null
check "an outsider is refused" $? -eq 4
check "with the remedy" "$(grep -c 'usermod -aG ravencal' outsider.txt)" -eq 1
su insider -s /bin/sh -c "$encoders --config $work/setup.toml --check-setup" >insider.txt </dev/null
check "a member of the group may" $? -eq 0
cat insider.txt
gpio_sim_unplug raven-encoders
udevadm settle
check "the name goes with the chip" "$([ -e /dev/ravencal/encoders ] && echo there || echo gone)" = gone
finish

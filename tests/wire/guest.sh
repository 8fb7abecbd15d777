#!/usr/bin/env bash
# Runs as the virtual machine's first program, as root: the model behind the virtual host controller, and its clients.
top=$(cd "$(dirname "$0")/../.." && pwd)
rig="$top/target/outside/wire"
bin="$top/target/release"
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C
mkdir -p /out /run
mount -t tmpfs tmpfs /run
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 out /out
exec > /out/log 2>&1
value() { sed -n "s/.*$1=\([0-9]*\).*/\1/p" /proc/cmdline; }
load() {
    LD_LIBRARY_PATH="$rig/root/usr/lib/x86_64-linux-gnu:$rig/root/lib/x86_64-linux-gnu" \
        "$rig/root/sbin/modprobe" -d "$rig/kern" "$@"
}
said() { tee -a /out/result; }

load vhci-hcd || echo "WIRE kinect1 FAIL: no virtual host controller" | said
frames=$(value wire_frames)
"$bin/examples/wire_kinect1" serve & server=$!
for _ in $(seq 50); do grep -q 02ae /sys/bus/usb/devices/*/idProduct && break; sleep 0.2; done
"$bin/toile" devices
# A few frames more than are checked: a take ends by time.
seconds=$(awk "BEGIN { print ($frames + 10) / 30 }")
"$bin/toile" capture --subject /run/wire --layer body --device kinect1 --seconds "$seconds"
kill $server
wait $server
if ! "$bin/examples/wire_kinect1" check /run/wire/takes/00-body.mcap "$frames" > /run/check; then
    [ -s /run/check ] || echo "WIRE kinect1 FAIL: no take" > /run/check
fi
said < /run/check
"$bin/examples/wire_kinect1" cycles "$(value wire_cycles)" > /run/cycles || echo "WIRE kinect1 unplug FAIL" >> /run/cycles
said < /run/cycles
sync
echo o > /proc/sysrq-trigger
sleep 10

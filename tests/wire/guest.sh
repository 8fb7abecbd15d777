#!/usr/bin/env bash
# Runs as the virtual machine's first program, as root: models behind the virtual host controller, and their clients.
top=$(cd "$(dirname "$0")/../.." && pwd)
rig="$top/target/outside/wire"
bin="$top/target/release"
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C
mkdir -p /out /run
mount -t tmpfs tmpfs /run
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 out /out
exec > /out/log 2>&1
value() { sed -n "s/.*$1=\([0-9]*\).*/\1/p" /proc/cmdline; }
libraries="$rig/root/usr/lib/x86_64-linux-gnu:$rig/root/lib/x86_64-linux-gnu"
load() { LD_LIBRARY_PATH="$libraries" "$rig/root/sbin/modprobe" -d "$rig/kern" "$@"; }
said() { tee -a /out/result; }
# A client's line: PASS with what it said, or FAIL.
verdict() { # name, true where it streamed, what it said
    if [ "$2" = yes ]; then echo "FIDELITY $1 PASS ($3)"; else echo "FIDELITY $1 FAIL: $3"; fi | said
}
serve() { # example, product id, words
    local example=$1 product=$2
    shift 2
    # The model waits for its client, not the other way round: one processor has to do for both.
    nice -n 19 "$bin/examples/$example" serve "$@" & server=$!
    for _ in $(seq 100); do grep -q "$product" /sys/bus/usb/devices/*/idProduct && return; sleep 0.2; done
}
gone() {
    kill $server
    wait $server
    for _ in $(seq 100); do grep -q "$1" /sys/bus/usb/devices/*/idProduct || return; sleep 0.2; done
}

# Our own program records from a model, and every frame is compared with what the model sent.
record() { # name, device, example and words of its check
    local name=$1
    "$bin/toile" devices
    # A few frames more than are checked: a take ends by time.
    local seconds
    seconds=$(awk "BEGIN { print ($frames + 10) / 30 }")
    "$bin/toile" capture --subject "/run/$1" --layer body --device "$2" --seconds "$seconds"
    shift 2
    if ! "$@" > /run/check; then
        grep -q FAIL /run/check || echo "WIRE $name FAIL: no take" > /run/check
    fi
    said < /run/check
}

load vhci-hcd || echo "WIRE FAIL: no virtual host controller" | said
load uvcvideo || echo "WIRE FAIL: no uvcvideo" | said
frames=$(value wire_frames)

serve wire_kinect1 02ae
record kinect1 kinect1 "$bin/examples/wire_kinect1" check /run/kinect1/takes/00-body.mcap "$frames"
. "$top/tests/wire/fidelity-kinect1.sh"
"$bin/examples/wire_kinect1" cycles "$(value wire_cycles)" > /run/cycles || echo "WIRE kinect1 unplug FAIL" >> /run/cycles
said < /run/cycles

for wire in bulk isochronous; do
    serve wire_realsense 0b07 $wire
    sleep 2
    name=realsense-$wire
    record $name realsense "$bin/examples/wire_realsense" check $name "/run/$name/takes/00-body.mcap" "$frames"
    [ $wire = bulk ] || . "$top/tests/wire/fidelity-d435.sh"
    gone 0b07
    "$bin/examples/wire_realsense" first $wire > /run/first || echo "WIRE $name first frame FAIL" >> /run/first
    said < /run/first
done
"$bin/examples/wire_realsense" cycles "$(value wire_cycles)" > /run/cycles || echo "WIRE realsense unplug FAIL" >> /run/cycles
said < /run/cycles
sync
echo o > /proc/sysrq-trigger
sleep 10

#!/usr/bin/env bash
# Runs as the virtual machine's first program, as root: simulated devices behind the virtual host controller, and their clients.
# Lines of the checks go to /out/result, takes to /out for the host to compare, all else to /out/log.
top=$(cd "$(dirname "$0")/../.." && pwd)
rig="$top/target/outside/wire"
bin="$top/target/release"
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C
mkdir -p /out /run
mount -t tmpfs tmpfs /run
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 out /out
exec > /out/log 2>&1
value() { sed -n "s/.*$1=\([^ ]*\).*/\1/p" /proc/cmdline; }
libraries="$rig/root/usr/lib/x86_64-linux-gnu:$rig/root/lib/x86_64-linux-gnu"
load() { LD_LIBRARY_PATH="$libraries" "$rig/root/sbin/modprobe" -d "$rig/kern" "$@"; }
said() { tee -a /out/result; }
# True once a condition holds, false when that takes too long.
until_true() { # a minute's worth of looks
    for _ in $(seq 300); do "$@" && return; sleep 0.2; done
    echo "in vain: $*"
    return 1
}
# Milliseconds for a fixed loop: how fast this machine is now.
loop_ms() {
    local from=${EPOCHREALTIME/./}
    for ((i = 0; i < 20000; i++)); do :; done
    echo $(((${EPOCHREALTIME/./} - from) / 1000))
}
# A check that did not pass: FAIL, or SKIPPED where it came late on a machine so slow that this proves nothing.
failed() { # status as of `timeout`, why
    local ms=0
    case "$1 $2" in 124* | 137* | *" takes "*) ms=$(loop_ms) ;; esac
    if [ "$ms" -lt $slow_ms ]; then echo "FAIL: $2"; else echo "SKIPPED: too slow a machine, $ms ms for a loop of $slow_ms: $2"; fi
}
# A program of ours: PASS with what it said, or FAIL with why.
report() { # name, program and words
    local name=$1 words
    shift
    echo "== $name, $(cut -d' ' -f1 /proc/uptime) s after the boot"
    if words=$(timeout -k 30 300 "$@" 2>&1); then echo "WIRE $name PASS $words"; else echo "WIRE $name $(failed $? "$words")"; fi |
        tr '\n' ' ' | sed 's/ *$/\n/' | said
}
# A client's line: PASS with what it said, or FAIL.
verdict() { # name, status: 0 where it streamed, 124 where that came late; what it said
    if [ "$2" = 0 ]; then echo "FIDELITY $1 PASS ($3)"; else echo "FIDELITY $1 $(failed "$2" "$3")"; fi | said
}
is_plugged() { grep -q "$1" /sys/bus/usb/devices/*/idProduct; }
is_unplugged() { ! is_plugged "$1"; }
has_nodes() { [ "$(find /dev -name 'video*' | wc -l)" -ge "$1" ]; }
serve() { # product id, video nodes, program and words
    local product=$1 nodes=$2
    shift 2
    # The model waits for its client, not the other way round: the processors have to do for both.
    nice -n 19 "$@" & server=$!
    until_true is_plugged "$product" && until_true has_nodes "$nodes"
}
gone() { # product id
    kill $server
    wait $server
    until_true is_unplugged "$1"
}
# More frames than are checked: a take ends by time, and lost frames are not a fault while they are reported.
seconds_of() { awk "BEGIN { print ($1 + $2) / 30 }"; } # frames, more
# Our own program records from a model; the host compares the take with what the model sent.
record() { # name, device, seconds of its clock
    echo "== $1, $(cut -d' ' -f1 /proc/uptime) s after the boot"
    timeout -k 30 900 "$bin/toile" capture --subject "/run/$1" --layer body --device "$2" --seconds "$3" > "/run/$1.said" 2>&1
    local status=$?
    tail -5 "/run/$1.said"
    # A take that was cut off is not compared.
    { [ $status -lt 124 ] && cp "/run/$1/takes/00-body.mcap" "/out/$1.mcap"; } ||
        echo "WIRE $1 $(failed $status "no take: $(tail -1 "/run/$1.said")")" | said
    rm -rf "/run/$1"
}
wanted() { case ",$(value wire_only)," in ,, | *",$1,"*) return 0 ;; *) return 1 ;; esac }

load vhci-hcd || echo "WIRE FAIL: no virtual host controller" | said
load uvcvideo || echo "WIRE FAIL: no uvcvideo" | said
frames=$(value wire_frames)
cycles=$(value wire_cycles)
# Below this the first frame, say, has the time that it needs.
slow_ms=1500
echo "== a loop of $(loop_ms) ms"

if wanted kinect1; then
    serve 02ae 0 "$bin/examples/wire_kinect1" serve
    "$bin/toile" devices
    record kinect1 kinect1 "$(seconds_of "$frames" 30)"
    . "$top/tests/wire/fidelity-kinect1.sh"
    report "kinect1 first frame" "$bin/examples/wire_kinect1" first
    report "kinect1 unplug" "$bin/examples/wire_kinect1" cycles "$cycles"
fi

if wanted realsense; then
    for wire in bulk isochronous; do
        serve 0b07 6 "$bin/examples/wire_realsense" serve $wire
        record realsense-$wire realsense "$(seconds_of "$frames" 30)"
        [ $wire = bulk ] || . "$top/tests/wire/fidelity-d435.sh"
        gone 0b07
        report "realsense-$wire first frame" "$bin/examples/wire_realsense" first $wire
    done
    report "realsense unplug" "$bin/examples/wire_realsense" cycles "$cycles"
fi

if wanted stereo; then
    serve 9750 2 "$bin/examples/wire_stereo" serve "$rig/stereo"
    record stereo "stereo:$rig/stereo/stereo.toml" 40
    gone 9750
fi

# Last and alone: its packets cost an emulated processor more than all else here, and pictures of cameras that wait for
# nobody would be lost beside it.
if wanted kinect2; then
    serve 02c4 0 "$bin/examples/wire_kinect2" serve "$rig/kinect2-images"
    record kinect2 kinect2 "$(seconds_of "$(value wire_kinect2)" 5)"
    gone 02c4
    report "kinect2 unplug" "$bin/examples/wire_kinect2" cycles "$rig/kinect2-images" "$(value wire_kinect2_cycles)"
fi

echo "== end, $(cut -d' ' -f1 /proc/uptime) s after the boot"
sync
echo o > /proc/sysrq-trigger
sleep 10

#!/usr/bin/env bash
# The wire tier: one boot of a small virtual machine, in which simulated devices are behind the kernel's own virtual USB host
# controller and the unmodified `toile capture` records from them, through libusb and through V4L2. Then clients that we
# did not write stream from the same devices: the fidelity gate. Its requirements are downloaded once into
# target/outside/wire/ and kept (rig.sh). Prints a line for each check: WIRE kinect1 PASS 100/100, FIDELITY
# freenect-camtest PASS, or SKIPPED and why: what the machine lacks, time included, is not a fault.
set -euo pipefail
export LC_ALL=C
cd "$(dirname "$0")/../.."
here="$PWD/tests/wire"
rig="$PWD/target/outside/wire"
frames=${WIRE_FRAMES:-100}
cycles=${WIRE_CYCLES:-10}
limit=${WIRE_SECONDS:-1500}
# The Kinect v2's packets cost an emulated processor 2.5 s a frame.
kinect2_frames=${WIRE_KINECT2_FRAMES:-100}
kinect2_cycles=${WIRE_KINECT2_CYCLES:-2}
examples="$PWD/target/release/examples"
checks=("WIRE kinect1" "FIDELITY freenect-camtest" "FIDELITY gspca_kinect" "WIRE kinect1 first frame" "WIRE kinect1 unplug"
    "WIRE kinect2" "WIRE kinect2 unplug" "WIRE stereo" "WIRE realsense-bulk"
    "WIRE realsense-bulk first frame" "WIRE realsense-isochronous" "FIDELITY pyrealsense2"
    "WIRE realsense-isochronous first frame" "WIRE realsense unplug")

skip() {
    local check
    for check in "${checks[@]}"; do echo "$check SKIPPED: $1"; done
    exit 0
}

[ "$(uname -sm)" = "Linux x86_64" ] || skip "the virtual machine is made for Linux on x86-64"
[ "$(id -u)" = 0 ] || skip "only root may read the host's files from within the virtual machine"
for tool in apt-get apt-cache dpkg; do
    command -v "$tool" > /dev/null || skip "there is no $tool: this is not Debian"
done
awk '$1 == "MemAvailable:" { exit $2 < 4e6 }' /proc/meminfo || skip "the virtual machine needs 4 GB of free memory"

# Runs an unpacked program with its own libraries.
unpacked() { LD_LIBRARY_PATH="$rig/root/usr/lib/x86_64-linux-gnu:$rig/root/lib/x86_64-linux-gnu" "$@"; }

# A take from the virtual machine beside what the model sent, compared here, where that takes no time.
compare() { # name, frames, program and words
    local name=$1 count=$2 words
    shift 2
    [ -e "$rig/out/$name.mcap" ] || return 0
    if words=$("$@" "$rig/out/$name.mcap" "$count" 2>&1); then
        echo "WIRE $name PASS $words" >> "$rig/out/result"
        rm "$rig/out/$name.mcap"
    else
        echo "WIRE $name FAIL: $words" >> "$rig/out/result"
    fi
}

# Whether a check must have a line: all, or with WIRE_ONLY those of its devices.
wanted() { # check
    local name=${1#* }
    case ",${WIRE_ONLY:-}," in ,, | *",${name%%[ -]*},"*) ;; *) return 1 ;; esac
}

# The line of each check in their order, and how long it all took; fails where one failed or has none.
report() { # status of the virtual machine
    local check
    local without="FAIL: the virtual machine ended before it; see $rig/out/"
    # As `timeout` says it.
    case $1 in 124 | 137) without="SKIPPED: not done within $limit s (WIRE_SECONDS)" ;; esac
    touch "$rig/out/result"
    for check in "${checks[@]}"; do
        grep "^$check \(PASS\|FAIL\|SKIPPED\)" "$rig/out/result" || ! wanted "$check" || echo "$check $without"
    done | tee "$rig/out/lines"
    grep "^WIRE FAIL" "$rig/out/result" || true
    echo "WIRE took $((SECONDS - start)) s"
    ! grep -q FAIL "$rig/out/lines" "$rig/out/result"
}

boot() {
    local kinect2="wire_kinect2=$kinect2_frames wire_kinect2_cycles=$kinect2_cycles"
    rm -rf "$rig/out" && mkdir -p "$rig/out"
    # Before other work, where that may be asked for: limits of time hold for what others leave of the processors. A
    # session has a share of its own (autogroup of Linux' sched(7)), within which alone `nice` counts.
    unpacked timeout -k 30 "$limit" setsid --wait bash -c \
        'echo -10 2> /dev/null > /proc/self/autogroup; exec nice -n -10 "$@"' session "$rig/root/usr/bin/qemu-system-x86_64" -L "$rig/root/usr/share/qemu" \
        -L "$rig/root/usr/share/seabios" -M q35 -accel tcg,thread=multi -cpu max,la57=off,-erms,-fsrm -smp 2 -m 3072 -nodefaults \
        -no-user-config -display none -no-reboot -serial "file:$rig/out/console" -monitor none \
        -kernel "$rig/vmlinuz" -initrd "$rig/initrd.img" \
        -append "console=ttyS0 panic=-1 quiet mitigations=off nokaslr tsc=reliable no_timer_check usbcore.usbfs_memory_mb=64 wire_frames=$frames wire_cycles=$cycles wire_only=${WIRE_ONLY:-} $kinect2" \
        -fsdev local,id=host,path=/,security_model=none,readonly=on,multidevs=remap \
        -device virtio-9p-pci,fsdev=host,mount_tag=host \
        -fsdev "local,id=out,path=$rig/out,security_model=none" -device virtio-9p-pci,fsdev=out,mount_tag=out
}

bash scripts/cargo.sh build --release --locked --package toile-studio --quiet
words=()
for driver in kinect1 kinect2 realsense stereo; do words+=(--package toile-driver-$driver --example wire_$driver); done
bash scripts/cargo.sh build --release --locked --quiet "${words[@]}"
why=$(bash tests/wire/rig.sh 2>&1) || skip "${why##*$'\n'}"
"$examples/wire_kinect2" write "$rig/kinect2-images"
"$examples/wire_stereo" write "$rig/stereo"
start=$SECONDS
boot && status=0 || status=$?
compare kinect1 "$frames" "$examples/wire_kinect1" check
compare kinect2 "$kinect2_frames" "$examples/wire_kinect2" check "$rig/kinect2-images"
compare stereo 20 "$examples/wire_stereo" check "$rig/stereo"
compare realsense-bulk "$frames" "$examples/wire_realsense" check
compare realsense-isochronous "$frames" "$examples/wire_realsense" check
report "$status"

#!/usr/bin/env bash
# The wire tier: one boot of a small virtual machine, in which device models sit behind the kernel's own virtual USB host
# controller and the unmodified `toile capture` records from them, through libusb and through V4L2. Then clients that we
# did not write stream from the same models: the fidelity gate. What it needs is downloaded once into
# target/outside/wire/ and kept. Prints a line for each check: WIRE kinect1 PASS 100/100, FIDELITY freenect-camtest PASS,
# or SKIPPED and why.
set -euo pipefail
cd "$(dirname "$0")/../.."
here="$PWD/tests/wire"
rig="$PWD/target/outside/wire"
frames=${WIRE_FRAMES:-100}
cycles=${WIRE_CYCLES:-10}
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

# A package and everything that it needs to run, by name.
closure() {
    apt-cache depends --recurse --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces \
        --no-enhances "$@" | grep '^[a-z0-9]' | sort -u
}

download() {
    mkdir -p "$rig/debs" && cd "$rig/debs"
    timeout 120 apt-get update -qq > /dev/null 2>&1 || true
    local kernel
    kernel=$(apt-cache depends linux-image-amd64 2> /dev/null | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -1)
    [ -n "$kernel" ] || return 1
    timeout 300 apt-get download -qq "$kernel" busybox-static kmod qemu-system-x86 qemu-system-common qemu-system-data seabios \
        > /dev/null 2>&1 || return 1
    local package
    for package in $(closure qemu-system-x86 kmod | grep -E '^(lib|zlib1g$)'); do
        # Names of virtual packages cannot be downloaded; qemu says so if one was needed.
        timeout 60 apt-get download -qq "$package" > /dev/null 2>&1 || true
    done
}

# Clients of the fidelity gate: libfreenect's test, and librealsense for this python. Without them their lines say so.
clients() {
    local deb
    if [ ! -x "$rig/root/usr/bin/freenect-camtest" ]; then
        (cd "$rig/debs" && timeout 120 apt-get download -qq libfreenect-bin libfreenect0.5 libusb-1.0-0 > /dev/null 2>&1) || true
        for deb in "$rig"/debs/libfreenect*.deb "$rig"/debs/libusb*.deb; do
            [ ! -e "$deb" ] || dpkg -x "$deb" "$rig/root"
        done
    fi
    if [ ! -d "$rig/python/pyrealsense2" ]; then
        timeout 120 python3 -m pip download --no-deps -q -d "$rig/wheels" pyrealsense2 > /dev/null 2>&1 &&
            python3 -m zipfile -e "$rig"/wheels/pyrealsense2*.whl "$rig/python" > /dev/null 2>&1 || true
    fi
}

# Unpacked beside, never installed: installing qemu would remove other packages.
unpack() {
    local deb
    mkdir -p "$rig/root" "$rig/kern"
    for deb in "$rig"/debs/*.deb; do
        case $deb in
            */linux-image*) dpkg -x "$deb" "$rig/kern" ;;
            *) dpkg -x "$deb" "$rig/root" ;;
        esac
    done
    # kmod's links are absolute, which only holds where it is installed.
    local name
    for name in modprobe depmod insmod; do ln -sfn ../bin/kmod "$rig/root/sbin/$name"; done
    unpacked "$rig/root/sbin/depmod" -b "$rig/kern" "$release"
}

# Runs an unpacked program with its own libraries.
unpacked() { LD_LIBRARY_PATH="$rig/root/usr/lib/x86_64-linux-gnu:$rig/root/lib/x86_64-linux-gnu" "$@"; }

# busybox, the modules for the host's files over 9p, and an init that changes over to them.
make_initrd() {
    local tree module order=""
    tree=$(mktemp -d)
    mkdir -p "$tree"/{bin,mods,proc,sys,dev,new,ro,rw}
    cp "$rig/root/bin/busybox" "$tree/bin/"
    for name in sh mount insmod mkdir switch_root; do ln -s busybox "$tree/bin/$name"; done
    for module in $(for m in virtio_pci 9pnet_virtio 9p overlay; do
        unpacked "$rig/root/sbin/modprobe" -d "$rig/kern" -S "$release" --show-depends "$m" | sed -n 's/^insmod \([^ ]*\).*/\1/p'
    done); do
        [ -e "$tree/mods/$(basename "$module")" ] || order="$order $(basename "$module")"
        cp "$module" "$tree/mods/"
    done
    sed -e "s#@ORDER@#$order#" -e "s#@HERE@#$here#" "$here/init.sh" > "$tree/init"
    chmod +x "$tree/init"
    (cd "$tree" && find . | "$rig/root/bin/busybox" cpio -o -H newc 2> /dev/null | gzip -1) > "$rig/initrd.img"
    rm -r "$tree"
}

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

# The line of each check in their order, and how long it all took; fails where one failed or has none.
report() {
    local check
    touch "$rig/out/result"
    for check in "${checks[@]}"; do
        [ -z "${WIRE_ONLY:-}" ] || grep -q "^$check \(PASS\|FAIL\|SKIPPED\)" "$rig/out/result" || continue
        grep "^$check \(PASS\|FAIL\|SKIPPED\)" "$rig/out/result" ||
            echo "$check FAIL: the virtual machine ended before it; see $rig/out/"
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
    unpacked timeout "${WIRE_SECONDS:-1500}" setsid --wait bash -c \
        'echo -10 2> /dev/null > /proc/self/autogroup; exec nice -n -10 "$@"' session "$rig/root/usr/bin/qemu-system-x86_64" -L "$rig/root/usr/share/qemu" \
        -L "$rig/root/usr/share/seabios" -M q35 -accel tcg,thread=multi -cpu max,la57=off,-erms,-fsrm -smp 2 -m 3072 -nodefaults \
        -no-user-config -display none -no-reboot -serial "file:$rig/out/console" -monitor none \
        -kernel "$rig/kern/boot/vmlinuz-$release" -initrd "$rig/initrd.img" \
        -append "console=ttyS0 panic=-1 quiet mitigations=off nokaslr tsc=reliable no_timer_check usbcore.usbfs_memory_mb=64 wire_frames=$frames wire_cycles=$cycles wire_only=${WIRE_ONLY:-} $kinect2" \
        -fsdev local,id=host,path=/,security_model=none,readonly=on,multidevs=remap \
        -device virtio-9p-pci,fsdev=host,mount_tag=host \
        -fsdev "local,id=out,path=$rig/out,security_model=none" -device virtio-9p-pci,fsdev=out,mount_tag=out || true
}

bash scripts/cargo.sh build --release --locked --package toile-studio --quiet
words=()
for driver in kinect1 kinect2 realsense stereo; do words+=(--package toile-driver-$driver --example wire_$driver); done
bash scripts/cargo.sh build --release --locked --quiet "${words[@]}"
ls "$rig"/debs/linux-image*.deb "$rig"/debs/qemu-system-x86_*.deb > /dev/null 2>&1 || (download) ||
    skip "Debian's kernel and qemu cannot be downloaded (no network?)"
release=$(basename "$(ls "$rig"/debs/linux-image-*.deb | tail -1)" | sed 's/^linux-image-\([^_]*\)_.*/\1/')
[ -e "$rig/kern/lib/modules/$release/modules.dep" ] || unpack
clients
make_initrd
"$examples/wire_kinect2" write "$rig/kinect2-images"
"$examples/wire_stereo" write "$rig/stereo"
start=$SECONDS
boot
compare kinect1 "$frames" "$examples/wire_kinect1" check
compare kinect2 "$kinect2_frames" "$examples/wire_kinect2" check "$rig/kinect2-images"
compare stereo 20 "$examples/wire_stereo" check "$rig/stereo"
compare realsense-bulk "$frames" "$examples/wire_realsense" check
compare realsense-isochronous "$frames" "$examples/wire_realsense" check
report

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

skip() {
    local check
    for check in "WIRE kinect1" "WIRE realsense-bulk" "WIRE realsense-isochronous" "FIDELITY freenect-camtest" \
        "FIDELITY gspca_kinect" "FIDELITY pyrealsense2"; do
        echo "$check SKIPPED: $1"
    done
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
    apt-get update -qq > /dev/null 2>&1 || true
    local kernel
    kernel=$(apt-cache depends linux-image-amd64 2> /dev/null | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -1)
    [ -n "$kernel" ] || return 1
    apt-get download -qq "$kernel" busybox-static kmod qemu-system-x86 qemu-system-common qemu-system-data seabios \
        > /dev/null 2>&1 || return 1
    local package
    for package in $(closure qemu-system-x86 kmod | grep -E '^(lib|zlib1g$)'); do
        # Names of virtual packages cannot be downloaded; qemu says so if one was needed.
        apt-get download -qq "$package" > /dev/null 2>&1 || true
    done
}

# Clients of the fidelity gate: libfreenect's test, and librealsense for this python. Without them their lines say so.
clients() {
    local deb
    if [ ! -x "$rig/root/usr/bin/freenect-camtest" ]; then
        (cd "$rig/debs" && apt-get download -qq libfreenect-bin libfreenect0.5 libusb-1.0-0 > /dev/null 2>&1) || true
        for deb in "$rig"/debs/libfreenect*.deb "$rig"/debs/libusb*.deb; do
            [ ! -e "$deb" ] || dpkg -x "$deb" "$rig/root"
        done
    fi
    if [ ! -d "$rig/python/pyrealsense2" ]; then
        python3 -m pip download --no-deps -q -d "$rig/wheels" pyrealsense2 > /dev/null 2>&1 &&
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

boot() {
    rm -rf "$rig/out" && mkdir -p "$rig/out"
    unpacked timeout "${WIRE_SECONDS:-1500}" "$rig/root/usr/bin/qemu-system-x86_64" -L "$rig/root/usr/share/qemu" \
        -L "$rig/root/usr/share/seabios" -M q35 -accel tcg,thread=multi -cpu max,la57=off -smp 2 -m 3072 -nodefaults \
        -no-user-config -display none -no-reboot -serial "file:$rig/out/console" -monitor none \
        -kernel "$rig/kern/boot/vmlinuz-$release" -initrd "$rig/initrd.img" \
        -append "console=ttyS0 panic=-1 quiet mitigations=off nokaslr tsc=reliable no_timer_check wire_frames=$frames wire_cycles=$cycles" \
        -fsdev local,id=host,path=/,security_model=none,readonly=on,multidevs=remap \
        -device virtio-9p-pci,fsdev=host,mount_tag=host \
        -fsdev "local,id=out,path=$rig/out,security_model=none" -device virtio-9p-pci,fsdev=out,mount_tag=out || true
}

bash scripts/cargo.sh build --release --locked --package toile-studio --quiet
bash scripts/cargo.sh build --release --locked --package toile-driver-kinect1 --example wire_kinect1 --quiet
bash scripts/cargo.sh build --release --locked --package toile-driver-realsense --example wire_realsense --quiet
ls "$rig"/debs/linux-image*.deb "$rig"/debs/qemu-system-x86_*.deb > /dev/null 2>&1 || (download) ||
    skip "Debian's kernel and qemu cannot be downloaded (no network?)"
release=$(basename "$(ls "$rig"/debs/linux-image-*.deb | tail -1)" | sed 's/^linux-image-\([^_]*\)_.*/\1/')
[ -e "$rig/kern/lib/modules/$release/modules.dep" ] || unpack
clients
make_initrd
boot
grep -hE '^(WIRE|FIDELITY)' "$rig/out/result" 2> /dev/null || echo "WIRE FAIL: the virtual machine ended early; see $rig/out/"
! grep -q FAIL "$rig/out/result" && [ -s "$rig/out/result" ]

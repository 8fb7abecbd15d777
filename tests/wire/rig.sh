#!/usr/bin/env bash
# Part of wire.sh: fetches, once, what the virtual machine is made of into target/outside/wire/ (a kernel, qemu, their
# libraries, clients of the fidelity gate) and makes its first file system. Where that fails the last line says why. To
# fetch anew, remove that folder.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
rig=$(cd "$here/../.." && pwd)/target/outside/wire
mkdir -p "$rig/debs" "$rig/root" "$rig/kern"
# Limit of all downloads together, seconds; those of the clients may take as long again.
limit=600

fail() { echo "$1" >&2; exit 1; }

# Runs a download, but not past the limit.
within() {
    local left=$((limit - SECONDS))
    [ $left -gt 0 ] && timeout -k 30 $left "$@" > /dev/null 2>&1
}

# A package and everything that it needs to run, by name.
closure() {
    apt-cache depends --recurse --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces \
        --no-enhances "$@" | grep '^[a-z0-9]' | sort -u
}

download() {
    cd "$rig/debs"
    within apt-get update -qq || true
    local kernel package
    kernel=$(apt-cache depends linux-image-amd64 2> /dev/null | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -1)
    [ -n "$kernel" ] || fail "apt knows no linux-image-amd64: there is no network, or this is not Debian"
    within apt-get download -qq "$kernel" busybox-static kmod qemu-system-x86 qemu-system-common qemu-system-data seabios ||
        fail "Debian's kernel and qemu cannot be downloaded (no network?)"
    for package in $(closure qemu-system-x86 kmod | grep -E '^(lib|zlib1g$)'); do
        # Names of virtual packages cannot be downloaded; qemu says so if one was needed.
        within apt-get download -qq "$package" || true
    done
    [ "$SECONDS" -lt $limit ] || fail "downloading Debian's packages takes more than $limit s"
    # Clients: libfreenect's test, and librealsense for this python. Without them their lines say so.
    limit=$((SECONDS + limit))
    within apt-get download -qq libfreenect-bin libfreenect0.5 libusb-1.0-0 || true
    within python3 -m pip download --no-deps -q -d "$rig/wheels" pyrealsense2 &&
        python3 -m zipfile -e "$rig"/wheels/pyrealsense2*.whl "$rig/python" || true
    echo "${kernel#linux-image-}" > "$rig/fetched"
}

# Unpacked beside, never installed: installing qemu would remove other packages.
unpack() {
    local deb name
    for deb in "$rig"/debs/*.deb; do
        case $deb in
            */linux-image*) dpkg -x "$deb" "$rig/kern" ;;
            *) dpkg -x "$deb" "$rig/root" ;;
        esac
    done
    # Newer packages have all under usr, and what they installed in is linked to it.
    for name in root/bin root/sbin root/lib kern/lib; do
        [ -e "$rig/$name" ] || ln -s "usr/$(basename $name)" "$rig/$name"
    done
    mkdir -p "$rig/root/usr/sbin"
    # kmod's links are absolute, which only holds where it is installed.
    for name in modprobe depmod insmod; do ln -sfn ../bin/kmod "$rig/root/sbin/$name"; done
    unpacked "$rig/root/sbin/depmod" -b "$rig/kern" "$release"
    unpacked "$rig/root/usr/bin/qemu-system-x86_64" --version > /dev/null
    echo "$release" > "$rig/unpacked"
}

# Runs an unpacked program with its own libraries.
unpacked() { LD_LIBRARY_PATH="$rig/root/usr/lib/x86_64-linux-gnu:$rig/root/lib/x86_64-linux-gnu" "$@"; }

# busybox, the modules for the host's files over 9p, and an init that changes over to them.
make_initrd() {
    local tree module name order=""
    tree=$(mktemp -d)
    mkdir -p "$tree"/{bin,mods,proc,sys,dev,new,ro,rw}
    cp "$rig/root/bin/busybox" "$tree/bin/"
    for name in sh mount insmod mkdir switch_root; do ln -s busybox "$tree/bin/$name"; done
    for module in $(for name in virtio_pci 9pnet_virtio 9p overlay; do
        unpacked "$rig/root/sbin/modprobe" -d "$rig/kern" -S "$release" --show-depends "$name" | sed -n 's/^insmod \([^ ]*\).*/\1/p'
    done); do
        [ -e "$tree/mods/$(basename "$module")" ] || order="$order $(basename "$module")"
        cp "$module" "$tree/mods/"
    done
    [ -n "$order" ] || fail "the kernel's modules for the host's files are not found"
    sed -e "s#@ORDER@#$order#" -e "s#@HERE@#$here#" "$here/init.sh" > "$tree/init"
    chmod +x "$tree/init"
    (cd "$tree" && find . | "$rig/root/bin/busybox" cpio -o -H newc 2> /dev/null | gzip -1) > "$rig/initrd.img"
    rm -r "$tree"
}

# A download that was cut short has no mark, and is done again.
[ -e "$rig/fetched" ] || (download)
release=$(cat "$rig/fetched")
[ -e "$rig/unpacked" ] || unpack
make_initrd
ln -sfn "kern/boot/vmlinuz-$release" "$rig/vmlinuz"

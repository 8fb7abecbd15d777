#!/bin/sh
# First program of the virtual machine: the host's files read-only under a layer in memory, then guest.sh.
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
for module in @ORDER@; do insmod "/mods/$module"; done
mount -t tmpfs tmpfs /rw; mkdir -p /rw/u /rw/w
mount -t 9p -o trans=virtio,version=9p2000.L,ro,msize=262144,cache=loose host /ro
mount -t overlay -o lowerdir=/ro,upperdir=/rw/u,workdir=/rw/w overlay /new
mount --move /proc /new/proc; mount --move /sys /new/sys; mount --move /dev /new/dev
exec switch_root /new /bin/bash @HERE@/guest.sh

# Part of guest.sh: clients of the Kinect v1 that we did not write.

# libfreenect's own test prints a line for each depth and video frame.
if [ -x "$rig/root/usr/bin/freenect-camtest" ]; then
    LD_LIBRARY_PATH="$libraries" timeout -k 30 120 "$rig/root/usr/bin/freenect-camtest" > /run/camtest 2>&1 & client=$!
    for _ in $(seq 100); do
        [ "$(grep -c 'depth frame' /run/camtest)" -ge 10 ] && [ "$(grep -c 'video frame' /run/camtest)" -ge 10 ] && break
        sleep 1
    done
    kill -INT $client
    wait $client
    depth=$(grep -c 'depth frame' /run/camtest) video=$(grep -c 'video frame' /run/camtest)
    lost=$(grep -ci 'lost' /run/camtest)
    tail -5 /run/camtest
    [ "$depth" -ge 10 ] && [ "$video" -ge 10 ] && streamed=0 || streamed=124
    verdict freenect-camtest $streamed "$depth depth and $video video frames, $lost reports of lost packets"
else
    echo "FIDELITY freenect-camtest SKIPPED: libfreenect-bin cannot be downloaded" | said
fi

# The kernel's own driver for its colour camera: a video node whose pictures are compared with what the model sent.
gone 02ae
if load gspca_kinect; then
    serve 02ae 1 "$bin/examples/wire_kinect1" serve
    if said_by=$("$bin/examples/wire_kinect1" gspca "$(find /dev -name 'video*' | head -1)" 10 2>&1); then streamed=0; else streamed=1; fi
    verdict gspca_kinect $streamed "$said_by"
    gone 02ae
    load -r gspca_kinect
else
    echo "FIDELITY gspca_kinect SKIPPED: the kernel has no such module" | said
fi

# Part of guest.sh: librealsense, from PyPI's pyrealsense2, streams from the D435 model.
if [ -d "$rig/python/pyrealsense2" ] && command -v python3 > /dev/null; then
    said_by=$(PYTHONPATH="$rig/python" LD_LIBRARY_PATH="$libraries" timeout -k 30 200 python3 "$top/tests/wire/d435.py" 2>&1)
    verdict pyrealsense2 $? "$(echo "$said_by" | tail -3 | tr '\n' ' ')"
else
    echo "FIDELITY pyrealsense2 SKIPPED: PyPI's wheel or python3 cannot be had" | said
fi

"""A batch on a Ray cluster of two nodes in one box: a worker is killed, a node is killed, the driver is killed and started again."""

import os
import signal
import subprocess
import sys
import tempfile
import time

import psutil
from ray.cluster_utils import Cluster

from common import TOILE, TOP, assert_same, copy_takes, small_subject, toile

SUBJECTS = ["person-0", "person-1"]
OBJECTS = 80 << 20


def main():
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    # Workers that are there before they are needed, and what they need for Ray's own services, cost seconds and are not used here.
    os.environ.setdefault("RAY_prestart_worker_first_driver", "0")
    os.environ["PYTHONPATH"] = os.path.join(TOP, "batch")
    with tempfile.TemporaryDirectory() as folder:
        recorded, alone = small_subject(folder)
        archive = os.path.join(folder, "archive")
        for subject in SUBJECTS:
            copy_takes(recorded, os.path.join(archive, subject))
        node = {"num_cpus": 1, "object_store_memory": OBJECTS}
        cluster = Cluster(initialize_head=True, head_node_args={**node, "include_dashboard": False})
        driver = None
        try:
            second = cluster.add_node(**node)
            words = ["batch", archive, "--engine", "ray", "--address", cluster.address, "--python", sys.executable]

            # The first driver: a worker dies, and then itself.
            driver = subprocess.Popen([TOILE, *words, "--quiet"], stdout=subprocess.DEVNULL)
            kill_worker()
            for child in [*psutil.Process(driver.pid).children(recursive=True), driver]:
                child.kill()
            driver.wait()
            done = sum(os.path.exists(os.path.join(archive, subject, "report.html")) for subject in SUBJECTS)
            assert done < len(SUBJECTS), "the driver was killed too late for a trial"

            # The second one: a whole node dies.
            driver = subprocess.Popen([TOILE, *words, "--json"], stdout=subprocess.PIPE, text=True)
            wait_for_process()
            cluster.remove_node(second, allow_graceful=False)
            # However long it takes: batch.sh ends the trial when its time is over.
            out, _ = driver.communicate()
            assert driver.returncode == 0, out
        finally:
            if driver is not None and driver.poll() is None:
                driver.kill()
            cluster.shutdown()
        for subject in SUBJECTS:
            assert_same(os.path.join(archive, subject), alone)
        answer, _ = toile("batch", archive, "--dry-run")
        assert answer["results"]["due"] == 0, answer
        answer, code = toile("catalog", archive)
        assert code == 0 and len(answer["results"]["table"]["rows"]) == len(SUBJECTS)
    print(f"ray: {len(SUBJECTS)} subjects on two nodes; worker, driver and node were killed: same bytes as local")


def processes():
    """Processes of toile that Ray's workers started, with the worker of each."""
    for process in psutil.process_iter(["cmdline"]):
        words = process.info["cmdline"] or []
        if len(words) > 1 and words[0] == TOILE and words[1] == "process":
            yield process


def wait_for_process():
    for _ in range(600):
        found = next(processes(), None)
        if found is not None:
            return found
        time.sleep(0.1)
    raise AssertionError("no task began within a minute")


def kill_worker():
    """Kills a worker of Ray in the middle of its task; its process of toile ends with it."""
    for _ in range(20):
        process = wait_for_process()
        try:
            worker = process.parent()
            worker.send_signal(signal.SIGKILL)
        except (psutil.NoSuchProcess, AttributeError):
            continue
        for _ in range(50):
            if not process.is_running() or process.status() == psutil.STATUS_ZOMBIE:
                return
            time.sleep(0.1)
        raise AssertionError("the process outlived its worker")


if __name__ == "__main__":
    sys.exit(main())

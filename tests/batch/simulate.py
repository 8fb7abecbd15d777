#!/usr/bin/env python3
"""A simulation of reprocessing a large archive: which part is the bottleneck, how long it takes, and what it costs.

    python3 tests/batch/simulate.py [--sessions 1000000] [--cores 2048]

The figures in FIGURES are measured (docs/scale.md says how); the prices are list prices of a large provider, to be replaced by one's
own. Subjects arrive at a cluster whose nodes fetch, compute and upload; a share of the nodes is lost every hour and takes its
running subjects with it. Each node is simulated by its three resources: processors, network, and what the store allows.
"""
import argparse
import heapq
import random

FIGURES = {
    "cpu_seconds": 37.0,        # a subject of four takes of 100 frames (docs/guide/engineer.md)
    "spread": 0.25,             # standard deviation of the same over the mean: takes of other lengths
    "memory_gb": 0.25,          # peak
    "take_gb": 0.025,          # takes of that subject, as Kinect-like noise makes them
    "result_gb": 0.049,        # build/, avatar and page; point caches of motions come on top
    "files": 62,                # of which each is a request when it is fetched or written
    "plan_ms": 0.17,            # planning a subject of one take in a folder, processor time
}
PRICES = {
    "core_hour": 0.02,          # a preemptible core with 4 GB
    "gb_month": 0.023,          # object storage
    "gb_month_cold": 0.004,
    "get_million": 0.4,
    "put_million": 5.0,
}
NODE_CORES, NODE_GBIT, LOST_A_HOUR = 32, 10.0, 0.02
RETRY_SECONDS = 30.0            # measured: Ray moves a task from a dead node after 26 s


def simulate(sessions, cores, seed=1):
    """Hours until the last of `sessions` subjects is done, and the share of work that was done twice."""
    random_ = random.Random(seed)
    nodes = max(1, cores // NODE_CORES)
    seconds_of_network = (FIGURES["take_gb"] + FIGURES["result_gb"]) * 8 / NODE_GBIT
    # A sample of subjects stands for all: each of the sample's stands for `weight`.
    sample = min(sessions, 40 * nodes * NODE_CORES)
    weight = sessions / sample
    free = [(0.0, node, core) for node in range(nodes) for core in range(NODE_CORES)]
    heapq.heapify(free)
    network = [0.0] * nodes
    lost, busy, end = 0.0, 0.0, 0.0
    for _ in range(sample):
        work = max(5.0, random_.gauss(FIGURES["cpu_seconds"], FIGURES["spread"] * FIGURES["cpu_seconds"]))
        while True:
            at, node, core = heapq.heappop(free)
            # Fetching and uploading of all cores of a node share its network.
            network[node] = max(network[node], at) + seconds_of_network
            done = max(at + work, network[node])
            busy += work
            if random_.random() < 1 - (1 - LOST_A_HOUR) ** ((done - at) / 3600):
                lost += work / 2
                heapq.heappush(free, (at + work / 2 + RETRY_SECONDS, node, core))
                continue
            heapq.heappush(free, (done, node, core))
            end = max(end, done)
            break
    return weight * end / 3600, lost / busy


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=1_000_000)
    parser.add_argument("--cores", type=int, nargs="+", default=[256, 2048, 16384])
    arguments = parser.parse_args()
    n = arguments.sessions
    f, p = FIGURES, PRICES
    print(f"{n} sessions: {n * f['cpu_seconds'] / 3600:.0f} core hours, {n * f['take_gb'] / 1000:.0f} TB of takes, "
          f"{n * f['result_gb'] / 1000:.0f} TB of results")
    print("cores   hours   gbit/s of the store   requests/s   twice")
    for cores in arguments.cores:
        hours, twice = simulate(n, cores)
        gbit = n * (f["take_gb"] + f["result_gb"]) * 8 / (hours * 3600)
        print(f"{cores:6d} {hours:7.1f} {gbit:21.1f} {n * f['files'] / (hours * 3600):12.0f} {100 * twice:6.2f} %")
    compute = n * f["cpu_seconds"] / 3600 * p["core_hour"]
    requests = n * f["files"] / 2e6 * (p["get_million"] + p["put_million"])
    print(f"once through: {compute:.0f} for processors, {requests:.0f} for requests; a month of storage: "
          f"{n * (f['take_gb'] + f['result_gb']) * p['gb_month']:.0f}, or {n * (f['take_gb'] * p['gb_month_cold'] + f['result_gb'] * p['gb_month']):.0f} with takes kept cold")
    print(f"planning: {n * f['plan_ms'] / 1000 / 60:.0f} processor minutes, one small file a subject; in a bucket {n // 1000 * f['files']} listings and {n} manifests")


if __name__ == "__main__":
    main()

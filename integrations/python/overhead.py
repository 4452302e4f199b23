"""The times of single questions and of a batch: python overhead.py SCAN.nm.

Compare with those of `cargo run --release -p nearmiss-c --example overhead -- SCAN.nm`.
"""

import sys
import time

import numpy as np

import nearmiss

CALLS, ROUNDS, POSES = 2000, 51, 100_000


def median(call):
    """The time of a call in nanoseconds."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        for _ in range(CALLS):
            call()
        times.append((time.perf_counter() - start) * 1e9 / CALLS)
    return sorted(times)[ROUNDS // 2]


scan = nearmiss.read(sys.argv[1])
for distance in (30.0, 0.3):
    pose = nearmiss.pose(translation=[distance, 0, 0])
    print(f"{distance} apart: {median(lambda: scan.collide(scan, pose)):.0f} ns")

i = np.arange(POSES)
steps = [0.618033988749, 0.754877666247, 0.569840290998]
poses = nearmiss.pose(translation=0.3 * (i[:, None] * steps % 1) - 0.15)
for _ in range(5):
    start = time.perf_counter()
    scan.collide_each(scan, poses)
    print(f"batch of {POSES} matrices: {(time.perf_counter() - start) * 1e3:.1f} ms")

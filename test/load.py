# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""How busy the machine is while something is timed, and how fast: to be read beside clocks."""

import os
import time

import numpy as np

SIZE, TIMES = 400, 20
SLEEP = 1e-3


def yardstick():
    """
    Return how long a fixed piece of arithmetic takes here and now [ms], and a sleep of 1 ms.

    The median each. The first tells of the processor, shared or slow; the second is as long as
    whoever wants to run waits for it, beyond the 1 ms.
    """
    a = np.linspace(0.0, 1.0, SIZE * SIZE).reshape(SIZE, SIZE)
    work, slept = np.empty(TIMES), np.empty(TIMES)
    for k in range(TIMES):
        begin = time.perf_counter()
        np.sort(a, axis=None)
        np.cumsum(a)
        work[k] = time.perf_counter() - begin
        begin = time.perf_counter()
        time.sleep(SLEEP)
        slept[k] = time.perf_counter() - begin
    return {'arithmetic_ms': 1e3 * float(np.median(work)),
            'sleep_of_1_ms': 1e3 * float(np.median(slept))}


def machine():
    """Return what there is to be read of the machine now: its load, its cores, the yardstick."""
    return {'load': os.getloadavg()[0], 'cores': os.cpu_count(), **yardstick()}


def told(seen):
    """Return in words what `machine` has said several times, each the median."""
    load, cores, work, slept = (
        float(np.median([each[key] for each in seen]))
        for key in ('load', 'cores', 'arithmetic_ms', 'sleep_of_1_ms'))
    return (f'load {load:.1f} on {cores:.0f} cores, yardstick {work:.2f} ms, a sleep of 1 ms '
            f'takes {slept:.2f}')

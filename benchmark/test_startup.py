# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
How long from the command to the first step of the trainer's flight.

A process of its own each time: Python, imports, lattice, trim, one step. Cold with nothing
compiled, as at the first run on a machine; warm with what that run has left, the middle of five.
Clocks are printed, and written to `results/startup.json`; asserted is twice what is asked.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from report import holds, keep

ASKED = {'cold': ('<=', 60.0), 'warm': ('<=', 3.0)}
"""Wall clock [s]."""
ROOT = Path(__file__).resolve().parents[1]
START = """
from poststall_sim import definition, simulation
trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
flight = simulation.start(trainer, airspeed=15.0, altitude=300.0)
flight.step(flight.trim)
print(flight.snapshot.status.name)
"""


def start_up(cache):
    """Return the wall clock of a start with a folder of compiled kernels [s]."""
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, '-c', START], cwd=ROOT, text=True, check=True, capture_output=True,
        env={**os.environ, 'NUMBA_CACHE_DIR': str(cache), 'PYTHONPATH': str(ROOT)})
    taken = time.monotonic() - begin
    assert done.stdout.strip() == 'CONVERGED'
    return taken


def test_start_up_cold_and_warm(tmp_path, capsys):
    measured = {'cold': start_up(tmp_path)}
    warm = [start_up(tmp_path) for _ in range(5)]
    measured['warm'] = float(np.median(warm))
    with capsys.disabled():
        print()
        for key, asked in ASKED.items():
            print(f'start-up {key:5}{measured[key]:7.2f} s, asked {asked[0]} {asked[1]:g} s: '
                  + ('ok' if holds(asked, measured[key]) else 'NOT'))
    keep('startup', ASKED, seconds=measured, warm_runs=warm)
    for key, asked in ASKED.items():
        assert holds(asked, measured[key], slack=2.0), key

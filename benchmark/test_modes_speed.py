# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What modes cost: twelve of a wing of 40 strips x 4 panels with 60 rows, and a sweep of the trainer.

CPU time of one thread, printed and written to `results/modes.json` beside what is asked. The sweep
is what `poststall modes trainer --decambering all` does from 1 to 25 deg: trims, linear systems
with the trainer's own 33 strips x 4 panels and all rows of its wake, and their modes.
"""

import math
import sys
import time
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

import wings
from report import holds, keep

from poststall_sim.aero import solver
from poststall_sim.aero.model import Onset, Settings, build
from poststall_sim.frames import body_to_geometry, velocity_from_flow_angles
from poststall_sim.stability import bodies, flight, linear, motion
from poststall_sim.stability.motion import Decambering

ASKED = {'12 modes, 40 x 4 x 60 [s]': ('<=', 1.0), 'largest residual': ('<=', 1e-10),
         'sweep of the trainer, 1 to 25 deg, three models [s]': ('<=', 60.0)}
SPEED, ALPHA = 25.0, math.radians(8.0)


def twelve_modes():
    """Return the CPU time of the modes alone, the system being there, and their residual."""
    wing = wings.rectangular(8, 40, wings.shipped('naca4415_re3e6'))
    model = build(wing, Settings(wake_length=14.9))
    velocity_B = velocity_from_flow_angles(SPEED, ALPHA, 0.0)
    onset = Onset(body_to_geometry(-velocity_B), np.zeros(3))
    aero = solver.steady(model, onset, np.zeros(0), density=wings.DENSITY)
    flow = linear.linearise(model, onset, np.zeros(0), aero, density=wings.DENSITY,
                            dt=0.25 / SPEED, rows=60)
    body = bodies.free_body(wing, velocity_B=velocity_B, pitch=ALPHA, throttle=0.0,
                            density=1.225)
    system = motion.assemble(flow, body, (), Decambering.VARIABLE, model.settings.lag)
    assert len(flow.wake) == 60 and flow.wake.shape[1:] == (160, 40)
    times = []
    for _ in range(3):
        start = time.thread_time()
        found = motion.spectrum(system, 12)
        times.append(time.thread_time() - start)
    return float(np.median(times)), float(found.residual.max())


def sweep():
    """Return the CPU time of a sweep, and of how many modes."""
    model = build(wings.shipped_aircraft('trainer'))
    start, modes = time.thread_time(), 0
    for found in flight.modes_along(
            model, flight.trims_along(model, np.radians(range(1, 26)), altitude=300.0),
            altitude=300.0, decamberings=tuple(Decambering)):
        modes += sum(len(each.modes) for each in found)
    return time.thread_time() - start, modes


@pytest.mark.timeout(600)
def test_time_of_modes(capsys):
    """Print and keep the times; fail where one is more than twice what is asked."""
    twelve, residual = twelve_modes()
    took, modes = sweep()
    measured = dict(zip(ASKED, (twelve, residual, took)))
    with capsys.disabled():
        print(f'\nmodes, CPU time of one thread ({modes} modes in the sweep)')
        for key, value in measured.items():
            print(f'  {key:54s} {value:9.2g}   asked {" ".join(map(str, ASKED[key]))}'
                  + ('  ok' if holds(ASKED[key], value) else '  NOT'))
    keep('modes', ASKED, figures=measured, modes=modes)
    assert modes > 25 * 3 * 5
    for key, value in measured.items():
        assert holds(ASKED[key], value, slack=2.0), key

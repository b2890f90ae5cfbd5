# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What turbulence costs a step of the trainer, over a step in calm air.

475 panels, edges and strips and 14 rows of the wake feel 16 x 14 waves each: 0.1 ms for the
waves, and twice as much for carrying the wake and for what calls them. Both
flights move their controls, so that both iterate; they take turns, thread CPU time, medians.
"""

import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

import wings
from report import holds, keep

from poststall_sim import simulation
from poststall_sim.state import Controls
from poststall_sim.turbulence import Severity, Spectrum, intensity, military
from poststall_sim.weather import CALM

ROUNDS, STEPS = 15, 60
ASKED = {'rough / calm': ('<=', 1.5)}


def moved(flight, i):
    """Take a step with elevator and aileron moving."""
    deflections = flight.trim.deflections.copy()
    deflections[:2] += 0.02 * np.array([math.cos(0.2 * i), math.sin(0.3 * i)])
    flight.step(Controls(deflections, flight.trim.throttle))


def test_turbulence_costs_less_than_half_a_step():
    flight = simulation.start(wings.shipped_aircraft('trainer'), airspeed=15.0, altitude=100.0)
    vertical = intensity(Severity.LIGHT, 100.0)
    air = {'calm': CALM, 'rough': replace(CALM, turbulence=military(
        Spectrum.DRYDEN, vertical, altitude=100.0))}
    taken = {name: [] for name in air}
    for _ in range(ROUNDS):
        for name, weather in air.items():
            flight.weather = weather
            flight.reset(0)
            for i in range(10):
                moved(flight, i)
            begin = time.thread_time()
            for i in range(STEPS):
                moved(flight, i)
            taken[name].append((time.thread_time() - begin) / STEPS)
    clock = {name: 1e6 * float(np.median(each)) for name, each in taken.items()}
    ratio = clock['rough'] / clock['calm']
    print(f'calm {clock["calm"]:.0f} us, rough {clock["rough"]:.0f} us a step: {ratio:.2f}')
    keep('turbulence', ASKED, step_us=clock, ratio=ratio)
    assert holds(ASKED['rough / calm'], ratio, slack=1.2)

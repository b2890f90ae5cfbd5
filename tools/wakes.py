# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A tail in the wake of its wing: what a free wake changes, for docs/figures.md.

The aircraft `wing_tail` with exact angles, four panels along the chord and the non-local closure,
each angle of attack marched until the wake is long past the tail. Angles are in degrees here.
"""

import math
from functools import cache
from pathlib import Path

import numpy as np

from poststall_sim import definition, polar
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.model import Model
from poststall_sim.aero.wake import Placement, Shape
from poststall_sim.frames import body_to_geometry, rotation
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw

ALPHAS = np.arange(0.0, 41.0, 4.0)
SPEED, DENSITY = 1.0, 1.0
CHORDS = 30.0
"""Marched at each angle; the tail is at 7.5."""


def model(shape: Shape) -> Model:
    """Return the wing and tail with a wake of a shape that reaches well behind the tail."""
    aircraft = definition.aircraft(definition.find(definition.Kind.AIRCRAFT, 'wing_tail'))
    return models.build(aircraft, models.Settings(wake=shape, free_rows=80))


@cache
def lifts(shape: Shape) -> np.ndarray:
    """Return CL of wing and of tail, each by its own area, (angles, 2)."""
    chosen = model(shape)
    dt = 0.25 / SPEED
    found = []
    for alpha in np.radians(ALPHAS):
        onset = polar.onset(chosen, polar.Condition(alpha), SPEED)
        # Level flight north, nose up by alpha: the CG goes straight on.
        turn = rotation(np.array([math.cos(0.5 * alpha), 0.0, math.sin(0.5 * alpha), 0.0])) \
            @ np.diag(body_to_geometry(np.ones(3)))
        arm = turn @ np.array(chosen.aircraft.mass.cg_G)
        controls = np.zeros(len(chosen.aircraft.controls))
        flow, result = solver.start(
            chosen, onset, Placement(-arm, turn), controls, density=DENSITY, dt=dt)
        for i in range(1, round(CHORDS / 0.25) + 1):
            place = Placement(np.array([i * SPEED * dt, 0.0, 0.0]) - arm, turn)
            flow, result = solver.advance(chosen, flow, onset, place, controls, density=DENSITY,
                                          dt=dt, drift_N=np.zeros(3))
        found.append([polar.surface_lift(chosen, result.strips.cl, name)
                      for name in ('wing', 'tail')])
    return np.array(found)


def figure_wakes(file: Path) -> None:
    """Draw lift of wing and tail with a prescribed and with a free wake, and the difference."""
    looks = ((Shape.PRESCRIBED, style.ATTACHED, '-'), (Shape.FREE, style.STALLED, (0, (5, 2))))
    draw(file, [Panel(Kind.SURFACE, title, tuple(
        Curve(shape.value, ALPHAS, lifts(shape)[:, i], colour=colour, line=line)
        for shape, colour, line in looks), limits=(0.0, 40.0, None, None))
        for i, title in enumerate(('Wing', 'Tail'))], height=3.2)


def table_wakes() -> str:
    """Return the numbers of the figure as a table."""
    plain, free = lifts(Shape.PRESCRIBED), lifts(Shape.FREE)
    rows = [
        f'| {alpha:.0f} | {plain[i, 0]:.4f} | {free[i, 0] - plain[i, 0]:+.4f} | {plain[i, 1]:.4f} '
        f'| {free[i, 1] - plain[i, 1]:+.4f} |' for i, alpha in enumerate(ALPHAS)]
    return '\n'.join([
        '| alpha [deg] | CL wing | free wake | CL tail | free wake |', '|---|---|---|---|---|',
        *rows])

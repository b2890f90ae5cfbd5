# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flow of a steady motion with the wake that it leaves behind: a helix where the body turns.

`solver.steady` has straight wakes. A body whose velocity and rates stay what they are in its own
axes moves on a screw, and its wake lies along it: the flow is marched along that path, without the
rigid body, until the wake it began with has gone and the loads have settled.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from poststall_sim.aero import solver
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.solver import AeroResult, FlowState
from poststall_sim.aero.wake import Placement
from poststall_sim.frames import FloatArray

LENGTHS = 3
"""Lengths of its wake that a flow is marched; what is left of its beginning, see the tests."""
STILL = np.zeros(3)


def march(model: Model, onset: Onset, placement: Placement, deflections: FloatArray, *,
          density: float, dt: float, delta0: FloatArray | None = None,
          angles: FloatArray | None = None) -> tuple[FlowState, AeroResult]:
    """
    Return the flow that has come along the steady motion of an onset, and its loads.

    placement : where it arrives; delta0, angles : see `solver.start`. The air is still: a wind
    carries body and wake alike.
    """
    steps = LENGTHS * model.wake_rows(solver.first_row(model, onset, dt))
    flow, result = solver.start(
        model, onset, _along(model, onset, placement, -steps * dt), deflections, density=density,
        dt=dt, delta0=delta0, angles=angles)
    for k in range(1 - steps, 1):
        place = _along(model, onset, placement, k * dt)
        flow, result = solver.advance(model, flow, onset, place, deflections, density=density,
                                      dt=dt, drift_N=STILL, angles=angles)
    return flow, result


def _along(model: Model, onset: Onset, placement: Placement, time: float) -> Placement:
    """Return where the geometry axes are a time [s] after a placement in a steady motion."""
    cg_G, rates = np.array(model.aircraft.mass.cg_G), onset.rates_G
    rate = float(np.linalg.norm(rates))
    turned = Rotation.from_rotvec(rates * time).as_matrix()
    gone = -onset.velocity_G * time
    if rate > 0.0:
        axis, angle = rates / rate, rate * time
        across = np.cross(axis, gone)
        # The integral of Rodrigues' formula over the time, (1 - cos)/angle without cancellation.
        gone = gone + 0.5 * angle * np.sinc(0.5 * angle / math.pi) ** 2 * across \
            + (1.0 - np.sinc(angle / math.pi)) * np.cross(axis, across)
    rotation_NG = placement.rotation_NG @ turned
    centre_N = placement.to_inertial(cg_G) + placement.rotation_NG @ gone
    return Placement(centre_N - rotation_NG @ cg_G, rotation_NG)

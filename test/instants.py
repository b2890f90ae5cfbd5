# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Snapshots made by hand, with a different number everywhere, and scenario files, for tests."""

import numpy as np

from poststall_sim import topics
from poststall_sim.atmosphere import Air
from poststall_sim.frames import quaternion_from_euler
from poststall_sim.state import BodyState, Controls, EngineReadings, Snapshot, Status, Strips


def a_snapshot(*, euler_deg=(0.0, 0.0, 0.0), time_ns=1_500_000_000, strips=4, **changes):
    """Return an instant with a different number everywhere, at a given roll, pitch, yaw."""
    body = BodyState(
        position_N=np.array([10.0, 20.0, -30.0]), velocity_B=np.array([15.0, 1.0, 2.0]),
        rates_B=np.array([0.1, 0.2, 0.3]),
        q_NB=quaternion_from_euler(*np.radians(euler_deg)))
    n = np.arange(1.0, strips + 1.0)
    values = {
        'time_ns': time_ns, 'body': body,
        'controls': Controls(np.array([0.01, -0.05, 0.02]), 0.4),
        'control_rates': Controls(np.array([0.1, 0.2, -0.3]), 0.5),
        'commanded': Controls(np.array([0.03, -0.06, 0.04]), 0.45),
        'angles': np.array([-0.01, 0.015, -0.05, 0.02]),
        'angle_rates': np.array([-0.1, 0.15, 0.2, -0.3]),
        'velocity_air_B': np.array([14.0, 0.5, 1.5]), 'airspeed': 14.1, 'alpha': 0.107,
        'beta': 0.035, 'acceleration_B': np.array([0.4, 0.5, 0.6]),
        'rate_change_B': np.array([0.7, 0.8, 0.9]), 'load_factor': 1.05,
        'force_B': np.array([-5.0, 0.25, -90.0]), 'moment_B': np.array([1.0, 2.0, 3.0]),
        'thrust_B': np.array([8.0, 0.0, 0.0]), 'thrust_moment_B': np.array([0.0, 0.1, 0.0]),
        'engines': EngineReadings(
            speed=np.array([600.0]), charge=np.array([0.8]), axial=np.array([14.0]),
            thrust=np.array([8.0]), torque=np.array([0.15]), voltage=np.array([11.5]),
            current=np.array([12.0]), failed=np.array([0.0])),
        'wind_N': np.array([5.0, 0.0, 0.0]), 'air': Air(1.2, 1.5e-5, 100965.0, 290.0),
        'strips': Strips(alpha=0.1 * n, cl=0.5 * n, cd=0.01 * n, cm=-0.02 * n, delta=-0.03 * n,
                         circulation=2.0 * n, residual=1e-7 * n, stalled=n > 2),
        'iterations': 3, 'max_residual': 1e-7, 'status': Status.CONVERGED}
    return Snapshot(**{**values, **changes})


def a_layout(strips=4, **changes):
    values = {
        'control_names': ('aileron', 'elevator', 'rudder'),
        'movable_names': ('aileron_right', 'aileron_left', 'elevator', 'rudder'), 'engines': True,
        'strip_names': tuple(f'wing_{i + 1}' for i in range(strips)),
        'strip_place': np.column_stack([
            np.full(strips, 0.1), np.linspace(1.0, -1.0, strips), np.full(strips, 0.2)]),
        'strip_chord': np.full(strips, 0.4),
        'strip_cl_max': np.full(strips, 1.4),
        'limits': ((-0.3, 0.3),) * 3}
    return topics.Layout(**{**values, **changes})


def a_scenario(path, control, points_deg):
    """Write a scenario of 2 s that moves one control, and return its path."""
    path.write_text(f"""
name: {path.stem}
duration_s: 2.0
initial: {{airspeed_m_s: 15.0, altitude_m: 300.0}}
channels:
  {control}: {{relative: true, points_deg: {points_deg}}}
""")
    return path

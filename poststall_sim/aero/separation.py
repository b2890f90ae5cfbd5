# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
How separation follows the flow in time: at once, or late.

The dissertation reads the section's static curve at every instant. Real flow separates and
reattaches late, and a pitching wing shows it in a loop of its lift. Beyond the dissertation:

* LAG: decambering goes to what the closure asks for with one time constant;
* GOMAN_KHRABROV: the share of the attached lift that separation leaves is a state of its own,

      tau_1 d(share)/dt + share = share_0(alpha - tau_2 d(alpha)/dt),

  share_0 from the static curve: onset and reattachment come late with the rate of the motion,
  tau_2, and what is left relaxes, tau_1 (Goman & Khrabrov, J. Aircraft 31(5), 1994, where the
  state is the place of the separation point; here it is the lift that it leaves, so that any
  curve is followed exactly once the flow is steady).

Times are in chords travelled. Lift alone is late: drag and moment are the static ones at the
section's angle.
"""

import enum
import math

import numpy as np
from numba import njit

from poststall_sim.aero.decambering import (
    EXACT,
    faded_mean,
    mean_angles,
    potential_angle,
    wrap,
)
from poststall_sim.aero.flaps import looked_up
from poststall_sim.frames import FloatArray

MOST_LEAD = math.radians(30.0)
"""tau_2 d(alpha)/dt is held within this: at no airspeed a chord takes for ever."""
NO_LIFT = math.sin(math.radians(0.05))
"""Attached lift below which the share of it is that of its slope."""


class Separation(enum.Enum):
    """How separation follows the flow in time."""

    QUASI_STEADY = 'quasi_steady'
    LAG = 'lag'
    GOMAN_KHRABROV = 'goman_khrabrov'


@njit(**EXACT)
def static_share(strips, curves, polar_index, angle, share):
    """
    Fill `share` (n,) of the attached lift 2 pi sin(angle - alpha_0L) that the curves have.

    strips (16, n) : see `operating_points`; angle : (n,) [rad]. NaN where a strip fades into
    strip theory or has no flow: it stays with its static curve.
    """
    for j in range(angle.size):
        if strips[3, j] < 1.0 or strips[7, j] == 0.0:
            share[j] = math.nan
            continue
        looked_at, gain = looked_up(j, angle[j], strips)
        phi, rate = potential_angle(curves[polar_index[j]], looked_at, False)
        attached = math.sin(angle[j] - strips[5, j])
        share[j] = rate * gain if abs(attached) < NO_LIFT else math.sin(phi) / attached


def relaxed(share: FloatArray, strips: FloatArray, mean: FloatArray, angle: FloatArray,
            curves: FloatArray, polar_index: np.ndarray, dt: float,
            times: tuple[float, float]) -> FloatArray:
    """
    Return the share (n,) of attached lift one step later.

    share, mean, angle (n,) : of the step before: the share, NaN where the static curve held, the
    angles at which that is read, `geometric_angle`; dt [s]; times : tau_1, tau_2 [chords].
    """
    chords = np.maximum(strips[10] * dt / strips[2], 1e-9)
    turned = wrap(geometric_angle(strips) - angle)
    lead = np.clip(times[1] * turned / chords, -MOST_LEAD, MOST_LEAD)
    asked, now = np.empty_like(share), np.empty_like(share)
    static_share(strips, curves, polar_index, mean - lead, asked)
    static_share(strips, curves, polar_index, mean, now)
    before = np.where(np.isnan(share), now, share)
    return before + (1.0 - np.exp(-chords / times[0])) * (asked - before)


def geometric_angle(strips: FloatArray) -> FloatArray:
    """Return the angle (n,) of the onset to each chord [rad]."""
    return np.arctan2(strips[1], strips[0])


def mean_angle(strips: FloatArray, mean: FloatArray, delta: FloatArray,
               alpha: FloatArray) -> FloatArray:
    """Return the angles (n,) at which the sections' curves are read; mean : see `averaging`."""
    weights, angles = np.empty_like(mean), np.empty_like(alpha)
    faded_mean(strips, mean, weights)
    mean_angles(delta, strips, alpha, weights, angles)
    return angles

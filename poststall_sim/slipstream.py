# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What propellers do to the air that strips stand in.

The stream goes straight along the line of thrust, whatever the angle of attack. Momentum theory
gives the increment w at the disc, a cylinder of vortices how it grows along the axis, continuity
the tube, and the moment of momentum its turning:

    T = 2 rho A (V + w) w,              w(x) = w (1 + x / sqrt(x^2 + R^2)),
    (V + w(x)) r(x)^2 = (V + w) R^2,
    Q = rho (V + w) (pi R^4 / 2) Omega, Omega(x) r(x)^2 = Omega R^2

V is the airspeed along the thrust, no less than 0; the air turns as a solid body with the
propeller, and not before the disc. (Glauert, Airplane Propellers, in Durand, Aerodynamic Theory
IV, 1935, div. L, ch. II and III; McCormick, Aerodynamics, Aeronautics and Flight Mechanics, 2nd
ed., 1995, ch. 6)

A strip that the tube covers in part feels that share of the increment. The shed wake does not
drift with the stream.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

from poststall_sim.aero.lattice import Lattice
from poststall_sim.aircraft import Aircraft
from poststall_sim.engines import Propeller
from poststall_sim.frames import FloatArray
from poststall_sim.state import EngineReadings

Gust = Callable[[FloatArray], FloatArray]
"""Velocity of the air (k, 3) [m/s] at arms (k, 3) from the centre of gravity, both in G."""
LEAST_SHARE = -1.0 / 3.0
"""A propeller that brakes slows the air by no more of V: there a turbine takes the most, and a
little further on momentum theory ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """
    One slipstream in G: from a disc at arm_G (3,) along aft_G (3,), of a radius [m].

    along : the airspeed V [m/s]; induced : w [m/s]; turning : Omega behind the disc, about aft_G
    [rad/s]; width : of the strips it washes [m].
    """

    arm_G: FloatArray
    aft_G: FloatArray
    radius: float
    along: float
    induced: float
    turning: float
    width: float

    def at(self, arm_G: FloatArray) -> FloatArray:
        """Return what the air has more (k, 3) [m/s] at arms (k, 3) from the centre of gravity."""
        out = np.empty(arm_G.shape)
        _at(arm_G, self.arm_G, self.aft_G, self.radius, self.along, self.induced, self.turning,
            self.width, out)
        return out


@njit(cache=True, nogil=True)
def _at(arm, disc, aft, radius, along, induced, turning, width, out):
    """Fill `out` (k, 3) with what a stream adds at arms (k, 3); the rest as in `Stream`."""
    for i in range(arm.shape[0]):
        x, y, z = arm[i, 0] - disc[0], arm[i, 1] - disc[1], arm[i, 2] - disc[2]
        behind = x * aft[0] + y * aft[1] + z * aft[2]
        x, y, z = x - behind * aft[0], y - behind * aft[1], z - behind * aft[2]
        more = induced * (1.0 + behind / math.hypot(behind, radius))
        tube = radius * math.sqrt((along + induced) / max(along + more, 1e-9))
        distance = math.sqrt(x * x + y * y + z * z)
        covered = min(distance + 0.5 * width, tube) - max(distance - 0.5 * width, -tube)
        share = min(max(covered / width, 0.0), 1.0)
        turned = share * turning * (radius / tube) ** 2 if behind > 0.0 else 0.0
        out[i, 0] = share * more * aft[0] + turned * (aft[1] * z - aft[2] * y)
        out[i, 1] = share * more * aft[1] + turned * (aft[2] * x - aft[0] * z)
        out[i, 2] = share * more * aft[2] + turned * (aft[0] * y - aft[1] * x)


def induced_velocity(thrust: float, along: float, density: float, radius: float) -> float:
    """Return w [m/s] at the disc for a thrust [N] at an airspeed V [m/s] along it."""
    loading = thrust / (2.0 * density * math.pi * radius ** 2)
    inside = max(0.25 * along * along + loading, 0.0)
    return max(math.sqrt(inside) - 0.5 * along, LEAST_SHARE * along)


def streams(aircraft: Aircraft, lattice: Lattice, readings: EngineReadings,
            density: float) -> list[Stream]:
    """Return the slipstreams of an aircraft's propellers as they turn now."""
    found = []
    for i, engine in enumerate(aircraft.engines):
        if not (isinstance(engine, Propeller) and engine.slipstream):
            continue
        radius = 0.5 * engine.diameter
        place, aft = np.array(engine.position_G), -np.array(engine.direction_G)
        along = max(float(readings.axial[i]), 0.0)
        induced = induced_velocity(float(readings.thrust[i]), along, density, radius)
        if along + induced <= 0.0:
            continue   # it stands, or pulls air from behind
        turning = 0.0
        if engine.swirl:
            # Clockwise from behind is about the thrust, against the stream.
            turning = -engine.rotation.value * 2.0 * float(readings.torque[i]) / (
                density * math.pi * radius ** 4 * (along + induced))
        found.append(Stream(
            arm_G=place - np.array(aircraft.mass.cg_G), aft_G=aft, radius=radius, along=along,
            induced=induced, turning=turning, width=_width(lattice, place, aft, radius)))
    return found


def _width(lattice: Lattice, place_G: FloatArray, aft_G: FloatArray, radius: float) -> float:
    """Return the mean width of the strips near a stream [m], of all where none is near."""
    arm = lattice.quarter_chord - place_G
    behind = arm @ aft_G
    near = (np.linalg.norm(arm - behind[:, None] * aft_G, axis=1) < 2.0 * radius) & (behind > 0.0)
    return float(lattice.strip_width[near if near.any() else slice(None)].mean())


def blown(found: list[Stream], gust: Gust | None = None) -> Gust | None:
    """Return what slipstreams add to a gust, or to calm air; None where that is nothing."""
    if not found:
        return gust

    def everything(arm_G: FloatArray) -> FloatArray:
        total = np.zeros(arm_G.shape) if gust is None else gust(arm_G)
        for stream in found:
            total = total + stream.at(arm_G)
        return total
    return everything

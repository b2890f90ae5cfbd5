# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The coefficients of a propeller from its blades: momentum and blade elements, annulus by annulus.

The lift of the elements and the momentum of their annulus, with Prandtl's tip factor F, give one
equation for the circulation:

    Gamma = W c cl(beta - phi) / 2 = 4 pi r F v_t / B

W = (W_a, W_t) is the flow at the blade, phi = atan(W_a / W_t), and the induced velocity v is
square to it. With tan(psi0) = V / (Omega r) and U = hypot(V, Omega r) all of it hangs on one
angle psi, at rest and in the stream alike:

    phi = (psi0 + psi) / 2,   W = U cos((psi - psi0) / 2),   v_t = U (cos psi0 - cos psi) / 2

(Glauert, Airplane Propellers, in Durand, Aerodynamic Theory IV, 1935, div. L, ch. VI and VII; the
angle: Drela, QPROP Formulation, MIT, 2006)

Left out: the hub, what turning does to a section's stall, Reynolds and Mach numbers other than
those of the curves.
"""

import math
from dataclasses import dataclass

import numpy as np

from poststall_sim.engines import Coefficients
from poststall_sim.frames import FloatArray
from poststall_sim.records import ConfigError, read_only, require_positive

ELEMENTS = 40
RATIOS = 49
"""Rows of the table that is made."""
_BISECTIONS = 60
_LAST_THRUST = -0.3
"""The table ends where the thrust is this much of that at rest, or the angle wraps."""


@dataclass(frozen=True, slots=True, eq=False)
class Blades:
    """
    The blades of a propeller and the curves of their section.

    radius, chord (k,) [m] and angle (k,) [rad] against the disc, from the root to the tip, which
    is the last; alpha (m,) [rad] rising, cl, cd (m,).
    """

    count: int
    radius: FloatArray
    chord: FloatArray
    angle: FloatArray
    alpha: FloatArray
    cl: FloatArray
    cd: FloatArray

    def __post_init__(self) -> None:
        """Refuse blades that are none."""
        for key in ('radius', 'chord', 'angle', 'alpha', 'cl', 'cd'):
            object.__setattr__(self, key, read_only(getattr(self, key)))
        if self.radius.size < 2 or not (np.diff(self.radius) > 0.0).all():
            raise ConfigError('blades need at least 2 stations, their radius rising')
        require_positive('radius of the first station', float(self.radius[0]), 'm')
        if not (self.chord > 0.0).all():
            raise ConfigError('chord must be above 0 m at every station of a blade')
        if not ((self.angle > -0.5 * math.pi) & (self.angle < 0.5 * math.pi)).all():
            raise ConfigError('angle must be within -90 to 90 deg at every station of a blade')
        near = (np.abs(self.alpha) < math.radians(25.0))[:-1]
        if not (near & (self.cl[:-1] < 0.0) & (self.cl[1:] >= 0.0)).any():
            raise ConfigError('the section of the blades must have an angle of no lift within '
                              '25 deg')

    @property
    def zero_lift(self) -> float:
        """Angle of attack without lift [rad]."""
        near = np.abs(self.alpha[:-1]) < math.radians(25.0)
        i = np.flatnonzero(near & (self.cl[:-1] < 0.0) & (self.cl[1:] >= 0.0))[0]
        share = self.cl[i] / (self.cl[i] - self.cl[i + 1])
        return float(self.alpha[i] + share * (self.alpha[i + 1] - self.alpha[i]))


def constant_pitch(pitch: float, radius: FloatArray) -> FloatArray:
    """Return the angles (k,) [rad] of blades that go a pitch [m] ahead in a turn, unslipped."""
    return np.arctan2(pitch, 2.0 * math.pi * np.asarray(radius))


def coefficients(blades: Blades) -> Coefficients:
    """
    Return the table of a propeller, from rest to past the advance ratio at which it brakes.

    Raises `ConfigError` for blades that do not pull.
    """
    tip = float(blades.radius[-1])
    pitch = 2.0 * math.pi * 0.75 * tip * math.tan(
        float(np.interp(0.75 * tip, blades.radius, blades.angle)) - blades.zero_lift)
    ratio = np.linspace(0.0, max(1.4 * pitch / (2.0 * tip), 0.2), RATIOS)
    thrust, power = at_ratios(blades, ratio)
    if not thrust[0] > 0.0:
        raise ConfigError(f'the blades must pull at rest, their CT there is {thrust[0]:.3g}')
    braking = np.flatnonzero(thrust < _LAST_THRUST * thrust[0])
    end = max(int(braking[0]) + 1, 3) if braking.size else ratio.size
    return Coefficients(ratio[:end], thrust[:end], power[:end])


def at_ratios(blades: Blades, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return CT and CP (k,) at advance ratios (k,), none below 0."""
    root, tip = float(blades.radius[0]), float(blades.radius[-1])
    edges = np.linspace(root, tip, ELEMENTS + 1)
    r = 0.5 * (edges[1:] + edges[:-1])
    chord = np.interp(r, blades.radius, blades.chord)
    beta = np.interp(r, blades.radius, blades.angle)
    # One turn in 2 pi seconds in air of density 1: Omega = 1, n = 1/(2 pi).
    along = np.asarray(ratio)[:, None] * 2.0 * tip / (2.0 * math.pi)
    start, speed = np.arctan2(along, r), np.hypot(along, r)

    def flow(psi: FloatArray) -> tuple[FloatArray, ...]:
        phi = 0.5 * (start + psi)
        swirl = 0.5 * speed * (np.cos(start) - np.cos(psi))
        return phi, speed * np.cos(0.5 * (psi - start)), swirl

    def missing(psi: FloatArray) -> FloatArray:
        phi, w, swirl = flow(psi)
        wake = np.maximum(np.abs(r / tip * np.tan(phi)), 1e-9)
        factor = 2.0 / math.pi * np.arccos(np.exp(-0.5 * blades.count * (1.0 - r / tip) / wake))
        lift = np.interp(beta - phi, blades.alpha, blades.cl)
        return 4.0 * math.pi * r * factor * swirl / blades.count - 0.5 * w * chord * lift

    # Between no induced velocity and no lift; beyond -psi0 the annulus no longer flows.
    other = np.clip(2.0 * (beta - blades.zero_lift) - start, -0.999 * start, math.pi - start)
    low, high = np.minimum(start, other), np.maximum(start, other)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        above = missing(middle) > 0.0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    phi, w, _ = flow(0.5 * (low + high))
    lift = np.interp(beta - phi, blades.alpha, blades.cl)
    drag = np.interp(beta - phi, blades.alpha, blades.cd)
    strength = 0.5 * blades.count * w ** 2 * chord * (edges[1:] - edges[:-1])
    pull = np.sum(strength * (lift * np.cos(phi) - drag * np.sin(phi)), axis=1)
    turn = np.sum(strength * (lift * np.sin(phi) + drag * np.cos(phi)) * r, axis=1)
    n, diameter = 1.0 / (2.0 * math.pi), 2.0 * tip
    return pull / (n ** 2 * diameter ** 4), turn / (n ** 3 * diameter ** 5)

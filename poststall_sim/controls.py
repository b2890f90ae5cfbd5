# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The definition of controls: what they move, how far and how fast. Angles in radians.

A control is what is commanded; a movable part is what turns. Effectors of several controls that
name the same part of a surface move that part together: its angle is the sum of their gains
times the controls' deflections, within its stops (elevons, flaperons, V-tails).
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim.actuators import IDEAL, Actuator
from poststall_sim.frames import FloatArray
from poststall_sim.records import ConfigError

ACROSS = 1e-3
"""A hinge axis with less than this along the span turns nothing, and has no sense to go by."""


@dataclass(frozen=True, slots=True)
class Effector:
    """
    The part of a surface that a control moves.

    span : from, to as shares of the (half) span, 0 at the root or left end, 1 at the tip.
    side : +1 starboard half, -1 port half, 0 both. hinge : share of the chord, 0 for an
    all-moving surface. hinge_axis : what the part turns about, in geometry axes, on the right side
    of a symmetric surface, of any length and either sense; None for the hinge line itself.
    gain : deflection per control deflection (mixing), signed; stops : the angles between which the
    part can turn [rad], infinite where the control's limits will do.
    """

    surface: str
    span: tuple[float, float] = (0.0, 1.0)
    side: int = 0
    hinge: float = 0.75
    gain: float = 1.0
    stops: tuple[float, float] = (-math.inf, math.inf)
    hinge_axis: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        """Refuse spans and hinges outside the surface."""
        low, high = self.span
        if not 0.0 <= low < high <= 1.0:
            raise ConfigError(f'span must satisfy 0 <= from < to <= 1, got {self.span}')
        if not 0.0 <= self.hinge < 1.0:
            raise ConfigError(f'hinge must lie in 0 <= hinge < 1 of the chord, got {self.hinge}')
        if self.hinge_axis is not None and not 0.0 < math.hypot(*self.hinge_axis) < math.inf:
            raise ConfigError('hinge_axis must be three finite numbers that are not all 0, got '
                              f'{", ".join(f"{x:g}" for x in self.hinge_axis)}')
        if not math.isfinite(self.gain) or self.gain == 0.0:
            raise ConfigError(f'gain must be a finite number other than 0, got {self.gain}')
        low, high = self.stops
        if not low <= 0.0 <= high or not low < high:
            raise ConfigError('stops must satisfy low <= 0 <= high, got '
                              f'{math.degrees(low):g} to {math.degrees(high):g} deg')


@dataclass(frozen=True, slots=True)
class Control:
    """A control by name, its limits [rad], the effectors that it moves, and what drives it."""

    name: str
    limits: tuple[float, float]
    effectors: tuple[Effector, ...]
    actuator: Actuator = IDEAL

    def __post_init__(self) -> None:
        """Refuse limits that do not hold the neutral position between them."""
        low, high = self.limits
        if not (low <= 0.0 <= high and low < high and max(-low, high) <= math.pi / 2):
            raise ConfigError(
                f'control {self.name}: limits must satisfy low <= 0 <= high within +-90 deg, '
                f'got {math.degrees(low):g} to {math.degrees(high):g} deg')
        if not self.effectors:
            raise ConfigError(f'control {self.name}: moves nothing, it needs an effector')

    def reversed(self) -> 'Control':
        """Return it with the other sign: what was a positive deflection is a negative one."""
        low, high = self.limits
        return replace(self, limits=(-high, -low), effectors=tuple(
            replace(each, gain=-each.gain) for each in self.effectors))


SIDES = {1: 'right', -1: 'left'}


@dataclass(frozen=True, slots=True)
class Movable:
    """
    A part of a surface that turns as one: the right half of an elevator, an elevon.

    names : by each control that moves it, the first is its own. surface, span, side, hinge,
    hinge_axis : as of `Effector`, but on a symmetric surface side is never 0. stops : see
    `Effector`; travel : how far its controls take it within them [rad].
    """

    names: tuple[str, ...]
    surface: str
    span: tuple[float, float]
    side: int
    hinge: float
    hinge_axis: tuple[float, float, float] | None
    stops: tuple[float, float]
    travel: tuple[float, float]

    @property
    def name(self) -> str:
        """Return its own name."""
        return self.names[0]


def movables(controls: tuple[Control, ...],
             symmetric: Collection[str]) -> tuple[tuple[Movable, ...], FloatArray]:
    """
    Return the parts (k) that controls move, and their angles (k, c) per unit deflection.

    symmetric : the surfaces of two halves; these turn as parts of their own.
    """
    found: dict[tuple, dict[int, list[Effector]]] = {}
    for c, control in enumerate(controls):
        for effector in control.effectors:
            sides = (0,) if effector.surface not in symmetric else \
                (effector.side,) if effector.side else (1, -1)
            for side in sides:
                key = effector.surface, effector.span, side, effector.hinge, \
                    effector.hinge_axis
                found.setdefault(key, {}).setdefault(c, []).append(effector)
    mixing = np.zeros((len(found), len(controls)))
    for row, movers in zip(mixing, found.values()):
        for c, effectors in movers.items():
            row[c] = sum(effector.gain for effector in effectors)
    mixing.setflags(write=False)
    names = _names(controls, found)
    parts = []
    for row, (key, movers) in zip(mixing, found.items()):
        both = [effector.stops for effectors in movers.values() for effector in effectors]
        stops = max(low for low, _ in both), min(high for _, high in both)
        way = np.array([gain * np.array(control.limits)
                        for gain, control in zip(row, controls)]).reshape(-1, 2)
        travel = (max(stops[0], float(way.min(axis=1).sum())),
                  min(stops[1], float(way.max(axis=1).sum())))
        parts.append(Movable(names[key], *key, stops, travel))
    return tuple(parts), mixing


def _names(controls: tuple[Control, ...], found: dict[tuple, dict]) -> dict[tuple, tuple]:
    """Return the names of parts by each control: the control's own, or with the side added."""
    names: dict[tuple, tuple[str, ...]] = dict.fromkeys(found, ())
    taken = {control.name for control in controls}
    for c, control in enumerate(controls):
        keys = [key for key, movers in found.items() if c in movers]
        for key in keys:
            plain = name = f'{control.name}_{SIDES[key[2]]}' if key[2] else control.name
            if len(keys) == 1:
                name = control.name
            number = 2
            while len(keys) > 1 and name in taken:
                name, number = f'{plain}_{number}', number + 1
            taken.add(name)
            names[key] += (name,)
    return names

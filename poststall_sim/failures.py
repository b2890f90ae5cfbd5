# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Failures of movable parts, stuck, floating or lost whatever they are told, and engines off.

* STUCK: the part stays where it is, or at a given angle.
* FLOATING: nothing holds it, and it goes where its hinge carries no moment. By thin-airfoil
  theory that is an angle in proportion to the angle of attack of the section, see
  `flaps.floating_ratio`; it is that of the last step, with the wash on the surface in it. The part
  has no inertia, no balance and no friction, and stops at the end of its travel.
* LOST: it has no effect, as if it stood at neutral.
* OFF: an engine does not work, and has no throttle.
"""

import enum
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.frames import FloatArray


class Kind(enum.Enum):
    """In which way a part fails, or an engine."""

    STUCK = 'stuck'
    FLOATING = 'float'
    LOST = 'lost'
    OFF = 'off'


@dataclass(frozen=True, slots=True)
class Failure:
    """A failure; angle : at which a part is stuck [rad], None for where it is."""

    kind: Kind
    angle: float | None = None

    def __post_init__(self) -> None:
        """Refuse an angle that no part can have."""
        if self.angle is not None and self.kind is not Kind.STUCK:
            raise ConfigError(f'{self.kind.value} has no angle, only stuck has')
        if self.angle is not None and not abs(self.angle) <= math.pi / 2:
            raise ConfigError('stuck: the angle must be within -90 to 90 deg, got '
                              f'{math.degrees(self.angle):g}')


Failed = tuple[Failure | None, ...]
"""What has failed of each movable part of an aircraft."""


def of_parts(aircraft: Aircraft, failures: Mapping[str, Failure]) -> Failed:
    """
    Return the failures by part of failures by name: of a part, or of a control for all it moves.

    A control is stuck at a deflection of its own, a part at its angle, trailing edge down. Engines
    that are off are no parts, but must be there.
    """
    aircraft.require_engines(engines_off(failures))
    failed: list[Failure | None] = [None] * len(aircraft.movables)
    for name, failure in failures.items():
        if failure.kind is Kind.OFF:
            continue
        parts = [k for k, part in enumerate(aircraft.movables) if name in part.names]
        gains = [1.0] * len(parts)
        if name in aircraft.control_names:
            column = aircraft.mixing[:, aircraft.control_names.index(name)]
            parts = [k for k, gain in enumerate(column) if gain]
            gains = [float(column[k]) for k in parts]
        if not parts and name in aircraft.engine_names:
            raise ConfigError(f'{name} is an engine: it fails as {name}:off')
        if not parts:
            raise ConfigError(f'nothing is named {name!r} that could fail, there are '
                              f'{", ".join(names(aircraft)) or "no controls"}')
        for k, gain in zip(parts, gains):
            if failed[k] is not None:
                raise ConfigError(f'{name}: {aircraft.movables[k].name} has failed already')
            failed[k] = failure if failure.angle is None else Failure(
                failure.kind, gain * failure.angle)
            low, high = aircraft.movables[k].travel
            if failure.angle is not None and not (
                    low - 1e-12 <= failed[k].angle <= high + 1e-12):
                raise ConfigError(
                    f'{name}: {aircraft.movables[k].name} goes from {math.degrees(low):g} to '
                    f'{math.degrees(high):g} deg, it cannot be stuck at '
                    f'{math.degrees(failed[k].angle):g}')
    return tuple(failed)


def engines_off(failures: Mapping[str, Failure]) -> frozenset[str]:
    """Return the names of the engines that failures by name turn off."""
    return frozenset(name for name, failure in failures.items() if failure.kind is Kind.OFF)


def dead(aircraft: Aircraft, failed: Failed) -> list[str]:
    """Return the names of the controls that move nothing any more, since all they move failed."""
    return [name for name, column in zip(aircraft.control_names, aircraft.mixing.T)
            if column.any() and all(failed[k] for k in np.flatnonzero(column))]


def names(aircraft: Aircraft) -> list[str]:
    """Return all names under which something can fail."""
    return list(dict.fromkeys([
        *aircraft.control_names, *(name for part in aircraft.movables for name in part.names)]))


def by_name(aircraft: Aircraft, failed: Iterable[Failure | None]) -> dict[str, Failure]:
    """Return failures by the names of the parts."""
    return {part.name: failure for part, failure in zip(aircraft.movables, failed) if failure}


def angles(failed: Failed, asked: FloatArray, before: FloatArray,
           floating: FloatArray) -> FloatArray:
    """
    Return where the parts (k,) are [rad].

    asked : by the controls; before : a step ago; floating : where they would be if free.
    """
    if not any(failed):
        return asked
    found = asked.copy()
    for k, failure in enumerate(failed):
        if failure is None:
            continue
        if failure.kind is Kind.STUCK:
            found[k] = before[k] if failure.angle is None else failure.angle
        else:
            found[k] = floating[k] if failure.kind is Kind.FLOATING else 0.0
    return found


def as_array(failed: Failed) -> FloatArray:
    """Return failures as numbers (k, 2): 0 or the place of the kind from 1 on, and the angle."""
    return np.array([
        (0.0, math.nan) if failure is None else
        (1.0 + list(Kind).index(failure.kind),
         math.nan if failure.angle is None else failure.angle)
        for failure in failed]).reshape(-1, 2)


def from_array(array: FloatArray) -> Failed:
    """Return the failures that `as_array` made numbers of."""
    return tuple(
        Failure(list(Kind)[int(number) - 1], None if math.isnan(angle) else float(angle))
        if number else None for number, angle in array)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A stick as the pilot: axes of sensor_msgs/Joy to commands, buttons to what was pressed."""

import math
from collections.abc import Mapping
from typing import Any

from poststall_sim.ros.commands import Refusal, RefusedCommand
from poststall_sim.ros.parameters import JoySettings
from poststall_sim.topics import THROTTLE

BUTTONS = ('pause', 'reset', 'trim')
STICKS = ('aileron', 'elevator', 'rudder', THROTTLE)


class Lever:
    """
    The lever of the throttle, which says nothing until it has been moved.

    Unlike a stick it does not go back to where it means nothing, and many drivers show 0 for an
    axis that nobody has touched.
    """

    def __init__(self) -> None:
        self._first: float | None = None
        self._moved = False

    def moved(self, position: float, deadband: float) -> bool:
        """Tell whether it has gone further than a deadband from where it was seen first."""
        if self._first is None:
            self._first = position
        self._moved = self._moved or abs(position - self._first) > deadband
        return self._moved


def positions(message: Any, settings: JoySettings, trim: Mapping[str, float]) -> dict[str, float]:
    """
    Return where the axes are by which controls there are, of `STICKS`, are moved.

    Raises
    ------
    RefusedCommand
        When an axis that is used is missing or not a finite number.

    """
    found = {}
    for name in STICKS:
        axis = getattr(settings, f'joy_{name}')
        if axis < 0 or name not in trim:
            continue
        if axis >= len(message.axes):
            raise RefusedCommand(
                Refusal.LENGTH, f'joy has {len(message.axes)} axes, joy.axes.{name} is {axis}')
        if not math.isfinite(message.axes[axis]):
            raise RefusedCommand(
                Refusal.NOT_FINITE, f'axis {axis} is {message.axes[axis]}, not a finite number')
        found[name] = message.axes[axis]
    return found


def commands(where: Mapping[str, float], settings: JoySettings, trim: Mapping[str, float],
             lever: Lever) -> dict[str, float]:
    """
    Return the commands of a stick by name [rad; throttle 0..1].

    where : see `positions`; trim : of all controls that there are. A stick in the middle is trim;
    so is a lever of the throttle, whose ends are none and all, whatever trim is.
    """
    found = {}
    for name, position in where.items():
        way = getattr(settings, f'joy_{name}_scale') * _beyond(position, settings.joy_deadband)
        if name != THROTTLE:
            found[name] = trim[name] + way
        elif lever.moved(position, settings.joy_deadband):
            found[name] = trim[name] + way * (1.0 - trim[name] if way > 0.0 else trim[name])
    return found


def _beyond(value: float, deadband: float) -> float:
    """Return the way of an axis beyond its deadband, from -1 to 1 without a jump."""
    return math.copysign(max(0.0, abs(value) - deadband) / (1.0 - deadband), value)


class Buttons:
    """The buttons of a stick, and which of them have just been pressed."""

    def __init__(self) -> None:
        self._down: dict[str, bool] = {}

    def pressed(self, message: Any, settings: JoySettings) -> list[str]:
        """Return what to do, of `BUTTONS`; a button held down from the start does nothing."""
        now = {}
        for name in BUTTONS:
            index = getattr(settings, f'joy_{name}')
            now[name] = 0 <= index < len(message.buttons) and bool(message.buttons[index])
        before, self._down = self._down or now, now
        return [name for name in BUTTONS if now[name] and not before[name]]

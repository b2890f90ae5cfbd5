# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What was heard last of one simulator, as the parts of the page."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from poststall_sim import surface_order
from poststall_sim.frames import euler_from_quaternion, quaternion_from_enu_flu, rotation
from poststall_sim.report.page import numbers

Data = dict[str, Any]
Parts = dict[str, tuple[int, Data]]
"""By kind: a number that changes whenever the part does, and the part, ready for JSON."""

SILENT = 1.5
"""After so long without a state the page says that none comes [s]."""


class Scene:
    """
    The parts of the page: what changes with the flight, what seldom does, and how it goes.

    One thread puts in what it hears, another takes the parts out: each part is replaced and never
    changed. No number of a part is NaN; what is not known, or not finite, is null.
    """

    def __init__(self, namespace: str) -> None:
        self._state: Data = {}
        self._changes = 0
        self._kept: Parts = {}
        self._heard_at: float | None = None
        self._put('setup', {'namespace': namespace, 'aircraft': '', 'strips': None,
                            'limits': {}})
        self._put('link', {'level': 1, 'text': 'waiting for a simulator'})

    def parts(self) -> Parts:
        """Return the parts that there are."""
        changes, state = self._changes, dict(self._state)
        found = dict(self._kept)
        if self._heard_at is not None:
            found['state'] = changes, state
        return found

    @property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Limits of the controls by name [rad; throttle 0..1]; empty until they are known."""
        return self._kept['setup'][1]['limits']

    def pose(self, now: float, time: float, place: Sequence[float],
             xyzw: Sequence[float], velocity: Sequence[float]) -> None:
        """Take place [m] and attitude of FLU in ENU, velocity in FLU [m/s], at a time [s]."""
        if not np.isfinite([*place, *xyzw, *velocity]).all():
            return
        roll, pitch, yaw = euler_from_quaternion(quaternion_from_enu_flu(np.array(xyzw))).tolist()
        x, y, z, w = xyzw
        attitude = rotation(np.array([w, x, y, z]))
        self.values(time=time, place=list(place), altitude=place[2], bank=roll, pitch=pitch,
                    heading=yaw, attitude=attitude.ravel().tolist(),
                    velocity=(attitude @ velocity).tolist())
        self._heard_at = now   # only now: the state is told once it has a pose

    def values(self, **found: Any) -> None:
        """Take parts of the state: numbers, lists of numbers, numbers by name."""
        self._state = self._state | {key: _plain(value) for key, value in found.items()}
        self._changes += 1

    def shape(self, part: str, **points: np.ndarray) -> None:
        """Take points (n, 3) in base_link [m] of what is drawn, if they differ from before."""
        found = {name: numbers(each.ravel()) for name, each in points.items()}
        if self._kept.get(part, (0, None))[1] != found:
            self._put(part, found)

    def setup(self, **known: Any) -> None:
        """Take what stays: the name of the aircraft, strips, limits of the controls."""
        before = self._kept['setup'][1]
        after = before | {key: _plain(value) for key, value in known.items()}
        if after != before:
            self._put('setup', after)

    def report(self, conditions: Mapping[str, tuple[int, str, Mapping[str, str]]]) -> None:
        """Take diagnostics: level, message and values by their names."""
        self._put('report', {name: {'level': level, 'text': text, 'values': dict(values)}
                             for name, (level, text, values) in conditions.items()})

    def look(self, now: float, publishers: int, topic: str) -> None:
        """Judge whether the simulator is there: how many publish its state, under which name."""
        flight = self._kept.get('report', (0, {}))[1].get('flight')
        silent = None if self._heard_at is None else now - self._heard_at
        level, text = 1, ''
        if not publishers:
            text = (f'waiting for a simulator: nobody publishes {topic}' if silent is None else
                    f'the simulator has gone: nobody publishes {topic}; its last state is shown')
        elif silent is None:
            text = 'a simulator is there, its state has not come yet'
        elif flight is not None and flight['values'].get('paused') == 'true':
            reason = flight['values'].get('paused_reason')
            text = f'paused: {reason}' if reason else 'paused'
        elif silent > SILENT:
            text = f'no state for {silent:.0f} s: the simulator stands still, or has gone'
        else:
            level, text = (0, 'flying') if flight is None else (flight['level'], flight['text'])
        found = {'level': level, 'text': text, 'there': bool(publishers)}
        if self._kept['link'][1] != found:
            self._put('link', found)

    def _put(self, part: str, data: Data) -> None:
        self._kept = self._kept | {part: (self._kept.get(part, (0, {}))[0] + 1, data)}


def groups(names: Sequence[str], y: Sequence[float]) -> list[Data]:
    """Return the surfaces of strips called `surface_number`, the wing first."""
    found: list[Data] = []
    for i, name in enumerate(names):
        surface = name.rpartition('_')[0]
        if not found or found[-1]['name'] != surface:
            found.append({'name': surface, 'begin': i})
        found[-1]['end'] = i + 1
    for group in found:
        own = y[group['begin']:group['end']]
        span = max(own) - min(own)
        group |= {'span': span, 'upright': span < 1e-6}
    return [found[number] for number in surface_order.by_span(
        [slice(group['begin'], group['end']) for group in found], np.array(y))]


def _plain(value: Any) -> Any:
    """Return a value with null in the place of numbers that are not finite."""
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return value if isinstance(value, str) or math.isfinite(value) else None

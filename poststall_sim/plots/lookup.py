# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""One flight's topics in a bag, looked up by their names without the namespace."""

from collections.abc import Mapping

import numpy as np

from poststall_sim.frames import FloatArray
from poststall_sim.recording import BagError, Series

Pair = tuple[FloatArray, FloatArray]
"""Times (n,) [s] and values (n, ...)."""

_TELLING = ('odom', 'pose', 'joint_states', 'strip_cl')
"""Topics that a simulator's namespace is known by."""


class Lookup:
    """
    The topics of one namespace, and the notes taken while reading them.

    Each topic is read in order, one message for each time; where time jumps back (the simulator
    was reset with its time), only what comes after the last jump.
    """

    def __init__(self, topics: Mapping[str, Series]) -> None:
        self._topics = {name: series for name, series in topics.items() if len(series)}
        self.notes: list[str] = []
        skipped = sum(series.skipped for series in topics.values())
        if skipped:
            self.notes.append(f'{skipped} messages could not be decoded')
        homes = sorted({name[:-len(tail) - 1] for name in self._topics for tail in _TELLING
                        if name.endswith('/' + tail)}, key=lambda home: (len(home), home))
        if not homes:
            found = ', '.join(sorted(self._topics)[:8]) or 'no messages at all'
            raise BagError(f'no flight in the bag: expected one of {", ".join(_TELLING)}, '
                           f'found {found}')
        self._home, *self._others = homes
        if self._others:
            self.notes.append(f'several aircraft in the bag, drawn is {self._home or "/"}; there '
                              'is also ' + ', '.join(self._others))
        for series in self._topics.values():
            if (np.diff(series.time) < 0.0).any():
                self.notes.append('time jumps back: drawn is what comes after the last jump')
                break

    def find(self, name: str) -> Series | None:
        """Return a topic as it was read, None if the bag does not have it."""
        return self._topics.get(f'{self._home}/{name}')

    def column(self, topic: str, *keys: str) -> Pair | None:
        """Return times and one field (n, ...), or several (n, keys); None if not there."""
        series = self.find(topic)
        if series is None or any(key not in series.fields for key in keys):
            return None
        order = _once_in_order(series.time)
        columns = [np.asarray(series[key])[order] for key in keys]
        if any(column.dtype == object for column in columns):
            self.notes.append(f'{topic} changes its length: left out')
            return None
        return series.time[order], columns[0] if len(keys) == 1 else np.column_stack(columns)

    def joints(self, topic: str) -> dict[str, Pair]:
        """Return the positions of a JointState topic by name."""
        series = self.find(topic)
        if series is None or 'position' not in series.fields:
            return {}
        order = _once_in_order(series.time)
        result = {}
        for name, values in series.by_name().items():
            there = order[np.isfinite(values[order])]
            if there.size:
                result[name] = (series.time[there], values[there])
        return result

    def diagnostics(self) -> list[tuple[float, str, str, dict[str, str]]]:
        """Return time, name, hardware and values of every status that may be of this aircraft."""
        series = self._topics.get('/diagnostics') or self.find('diagnostics')
        if series is None or 'status' not in series.fields:
            return []
        rows = [(float(series.time[i]), status.name, status.hardware_id,
                 {item.key: item.value for item in status.values})
                for i in _once_in_order(series.time) for status in series['status'][i]]
        def of(home: str, name: str) -> bool:
            return name.lstrip('/').startswith(f'{home.lstrip("/")}/')

        rows = [row for row in rows if not any(of(home, row[1]) for home in self._others)]
        return [row for row in rows if self._home and of(self._home, row[1])] or rows


def onto(time: FloatArray, pair: Pair) -> FloatArray:
    """Return values (n, ...) interpolated to times, the ends held."""
    at, values = pair
    if values.ndim == 1:
        return np.interp(time, at, values)
    return np.column_stack([np.interp(time, at, column) for column in values.T])


def _once_in_order(time: FloatArray) -> np.ndarray:
    """Return the indices after the last jump back, the last message of each time."""
    back = np.flatnonzero(np.diff(time) < 0.0)
    begin = int(back[-1]) + 1 if back.size else 0
    return begin + np.flatnonzero(np.append(np.diff(time[begin:]) > 0.0, True))

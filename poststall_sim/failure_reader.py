# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Failures out of words, ``aileron_right:stuck=-5``, and of scenario files. Angles in degrees."""

import math
from collections.abc import Iterable, Mapping, Sequence

from poststall_sim.aircraft import ConfigError
from poststall_sim.failures import Failure, Kind
from poststall_sim.reader import Reader, listed, shown, suggestion
from poststall_sim.scenario import Fault

_KINDS = {kind.value: kind for kind in Kind}


def failure(word: str) -> tuple[str, Failure]:
    """Return the name and the failure of NAME:KIND or NAME:stuck=DEG."""
    name, colon, rest = word.strip().partition(':')
    kind, equals, angle = rest.partition('=')
    if not (name and colon and kind):
        raise ConfigError(f'a failure is NAME:KIND, such as rudder:float, got {shown(word)}')
    if kind not in _KINDS:
        raise ConfigError(f'{shown(word)}: it must be one of {listed(_KINDS)}'
                          f'{suggestion(kind, _KINDS)}')
    if not equals:
        return name, Failure(_KINDS[kind])
    try:
        degrees = float(angle)
    except ValueError:
        degrees = math.nan
    if not math.isfinite(degrees):
        raise ConfigError(f'{shown(word)}: the angle must be a number of degrees')
    return name, Failure(_KINDS[kind], math.radians(degrees))


def failures(words: Sequence[str]) -> dict[str, Failure]:
    """Return failures by name; a name stands once."""
    return by_name(map(failure, words))


def by_name(given: Iterable[tuple[str, Failure]]) -> dict[str, Failure]:
    """Return failures with their names by name; a name stands once."""
    found: dict[str, Failure] = {}
    for name, each in given:
        if name in found:
            raise ConfigError(f'{name} fails twice')
        found[name] = each
    return found


def words(failed: Mapping[str, Failure]) -> list[str]:
    """Return failures as words, the inverse of `failures`."""
    return [f'{name}:{each.kind.value}'
            + ('' if each.angle is None else f'={math.degrees(each.angle):g}')
            for name, each in failed.items()]


def fault(read: Reader) -> Fault:
    """Read what fails at a time of a scenario."""
    time, name = read.number('time_s', at_least=0), read.name('name')
    kind = read.choice('kind', _KINDS)
    angle = math.radians(read.number('angle_deg', within=(-90, 90))) \
        if read.has('angle_deg') else None
    return Fault(time, name, read.build(Failure, kind=kind, angle=angle))

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a page asks for: texts from the browser, judged before anything is done with them."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

LONGEST = 4096
"""A message of more bytes ends the connection."""

ACTIONS = ('pause', 'fly on', 'reset', 'trim')
"""What the buttons ask the simulator for."""


class Refused(ValueError):
    """What a page asked for and does not get; the text says why."""


@dataclass(frozen=True, slots=True)
class Fly:
    """Hold the controls so, by name [rad; throttle 0..1]; take : whoever has them now."""

    values: dict[str, float]
    take: bool


@dataclass(frozen=True, slots=True)
class Release:
    """Let go of the controls."""


@dataclass(frozen=True, slots=True)
class Act:
    """Ask the simulator for one of `ACTIONS`."""

    action: str


Order = Fly | Release | Act


def read(text: str, limits: Mapping[str, tuple[float, float]]) -> Order:
    """
    Return the order that a message holds; values beyond their limits are brought to them.

    Raises
    ------
    Refused
        When it is no order, or names a control that the aircraft does not have.

    """
    try:
        found = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError):
        raise Refused('not understood') from None
    if not isinstance(found, dict) or len(found) != 1:
        raise Refused('not understood')
    (kind, what), = found.items()
    if kind in ('take', 'fly') and isinstance(what, dict) and what:
        return Fly({name: _within(name, value, limits) for name, value in what.items()},
                   take=kind == 'take')
    if kind == 'release' and what is True:
        return Release()
    if kind == 'act' and isinstance(what, str) and what in ACTIONS:
        return Act(what)
    raise Refused('not understood')


def _no_number(name: str) -> NoReturn:
    raise ValueError(name)


def _within(name: str, value: Any, limits: Mapping[str, tuple[float, float]]) -> float:
    """Return a commanded value, cut to its limits."""
    if name not in limits:
        raise Refused('the aircraft has no such control')
    # bool is an int; 1e999 is an infinity, and so is a whole number of a thousand digits.
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        raise Refused(f'{name}: expected a number')
    low, high = limits[name]
    if isinstance(value, float) and not math.isfinite(value):
        raise Refused(f'{name}: expected a finite number')
    return float(min(max(value, low), high))

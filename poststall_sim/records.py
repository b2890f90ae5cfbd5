# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What all records of a definition share: how they refuse, how their arrays are kept."""

import math
from collections.abc import Sequence

import numpy as np

from poststall_sim.frames import FloatArray

SHORTEST, FARTHEST = 1e-6, 5e3
"""Of lengths and places of an aircraft [m]: others overflow in a lattice, or are no metres."""


class ConfigError(ValueError):
    """An aircraft or simulation definition that cannot be flown."""


def read_only(values) -> FloatArray:
    """Return a read-only float64 copy, so that a record cannot change behind its user."""
    array = np.array(values, dtype=np.float64, order='C')
    array.setflags(write=False)
    return array


def require_positive(name: str, value: float, unit: str) -> None:
    """Raise `ConfigError` unless the value is finite and above 0."""
    if not (math.isfinite(value) and value > 0.0):
        raise ConfigError(f'{name} must be above 0 {unit}, got {value!r}')


def require_length(name: str, value: float) -> None:
    """Raise `ConfigError` unless the value is a length [m] that an aircraft can have."""
    require_positive(name, value, 'm')
    if not SHORTEST <= value <= FARTHEST:
        raise ConfigError(f'{name} must be {SHORTEST:g} to {FARTHEST:g} m, got {value!r}')


def require_place(name: str, place: Sequence[float]) -> None:
    """Raise `ConfigError` unless a place (3,) [m] can be one on an aircraft."""
    if not all(abs(x) <= FARTHEST for x in place):
        raise ConfigError(f'{name} must be three finite lengths within +-{FARTHEST:g} m, got '
                          f'{tuple(place)}')

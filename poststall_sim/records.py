# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What all records of a definition share: how they refuse, how their arrays are kept."""

import math

import numpy as np

from poststall_sim.frames import FloatArray


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

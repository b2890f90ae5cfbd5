# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
An aerodynamic database as tables that are added up.

    C(alpha, beta, ...) = base(alpha, beta) + sum over rates and controls of increment(alpha, x)

What depends on alpha and beta is tabulated whole. Each rate and each control is an increment, at
zero sideslip and with all others at zero: how they change one another, and how sideslip changes
them, is left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from poststall_sim.aircraft import Reference, read_only
from poststall_sim.frames import FloatArray

COEFFICIENTS = ('CL', 'CD', 'CY', 'Cl', 'Cm', 'Cn')
"""In this order; CL and CD in stability axes, the others in body axes about the CG."""
RATES = ('p', 'q', 'r')


@dataclass(frozen=True, slots=True, eq=False)
class Increment:
    """What x adds: x (k,) rising, 0 among them [-, rad]; change (6, alphas, k) of coefficients."""

    x: FloatArray
    change: FloatArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for key in ('x', 'change'):
            object.__setattr__(self, key, read_only(getattr(self, key)))


@dataclass(frozen=True, slots=True, eq=False)
class BuildUp:
    """
    The tables of one aircraft in steady flow.

    cg_G [m] : what moments and rates are about; alpha (n,), beta (m,) rising [rad]; base (6, n,
    m); rates by `RATES`, of p b/2V, q c/2V, r b/2V, and controls by name, as far as there are any;
    density : of the air it was made in [kg/m^3].
    """

    aircraft: str
    reference: Reference
    cg_G: tuple[float, float, float]
    density: float
    alpha: FloatArray
    beta: FloatArray
    base: FloatArray
    rates: Mapping[str, Increment]
    controls: Mapping[str, Increment]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for key in ('alpha', 'beta', 'base'):
            object.__setattr__(self, key, read_only(getattr(self, key)))

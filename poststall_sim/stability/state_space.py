# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Linear systems in the form in which other tools take them.

Every quantity is a difference from the trim that the system is about.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, signal

from poststall_sim.aircraft import read_only
from poststall_sim.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class StateSpace:
    """
    x(k+1) = a x(k) + b u(k), y(k) = c x(k) + d u(k); of a continuous system dx/dt on the left.

    a (n, n); b (n, m); c (p, n); d (p, m); dt [s], None of a continuous system. states (n,),
    inputs (m,) and outputs (p,) are names; velocities, forces and moments are in body axes B, in
    SI units and radians.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray
    dt: float | None
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __post_init__(self) -> None:
        """Make the arrays read-only and compare their shapes with the names."""
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        for key, shape in (('a', (n, n)), ('b', (n, m)), ('c', (p, n)), ('d', (p, m))):
            array = read_only(getattr(self, key))
            if array.shape != shape:
                raise ValueError(f'{key} is {array.shape}, the names say {shape}')
            object.__setattr__(self, key, array)

    @property
    def eigenvalues(self) -> np.ndarray:
        """
        Return the continuous eigenvalues (n,) [1/s], ln(z)/dt of a discrete system.

        -inf stands for one that is gone after a step.
        """
        values = linalg.eigvals(self.a).astype(complex)
        if self.dt is None:
            return values
        with np.errstate(divide='ignore'):
            return np.log(np.abs(values)) / self.dt + 1j * (np.angle(values) / self.dt)

    def response(self, points: np.ndarray) -> np.ndarray:
        """Return y/u (k, p, m) at points (k,) in the plane of z, or of s [1/s] if continuous."""
        eye = np.eye(len(self.states))
        return np.array([self.c @ linalg.solve(point * eye - self.a, self.b) + self.d
                         for point in points])

    def continuous(self) -> 'StateSpace':
        """
        Return the continuous system whose trapezoidal (bilinear, Tustin) steps this one makes.

        That is the rule of the body's rows, which become M dy/dt = P L + R y again. With
        x = x(k) + (I + a)^-1 b u and h = dt/2,

            h dx/dt = (I + a)^-1 (a - I) x + 2 (I + a)^-2 b u,  y = c x + (d - c (I + a)^-1 b) u.

        Its response at s is this one's at z = (1 + s h)/(1 - s h). Seen over time, a frequency
        omega is too high by (omega dt)^2/12 of itself, and an eigenvalue off by as much, so that
        what is quicker than 1/dt is not that of the flow. The throttle, which acts all through
        the step that it ends, is seen half a step early. Raises `ValueError` where the system is
        continuous already.
        """
        if self.dt is None:
            raise ValueError('the system is continuous already')
        eye, half = np.eye(len(self.states)), 0.5 * self.dt
        factors = linalg.lu_factor(eye + self.a)
        once = linalg.lu_solve(factors, self.b)
        return StateSpace(
            linalg.lu_solve(factors, self.a - eye) / half,
            2.0 / half * linalg.lu_solve(factors, once), self.c, self.d - self.c @ once, None,
            self.states, self.inputs, self.outputs)

    def to_scipy(self) -> signal.StateSpace:
        """Return the system as `scipy.signal` has it; the names stay behind."""
        matrices = self.a, self.b, self.c, self.d
        return signal.StateSpace(*matrices) if self.dt is None \
            else signal.StateSpace(*matrices, dt=self.dt)

    def to_control(self) -> Any:
        """
        Return the system as ``control.ss`` of python-control, with its names.

        Raises `ImportError` with what to install where that is missing.
        """
        try:
            import control
        except ImportError:
            raise ImportError(
                "python-control is not installed: pip install '.[control]' in the "
                'checkout') from None
        return control.ss(
            self.a, self.b, self.c, self.d, 0 if self.dt is None else self.dt,
            states=list(self.states), inputs=list(self.inputs), outputs=list(self.outputs))

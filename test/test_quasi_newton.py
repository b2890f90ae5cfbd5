# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Factors that several steps share: held to LAPACK and to Broyden's matrix written out."""

import numpy as np
import pytest

from poststall_sim.aero.quasi_newton import MOST_STEPS, broyden_step, factor, newton_step


def diagonally_heavy(n, rng):
    return rng.normal(size=(n, n)) + n * np.eye(n)


@pytest.mark.parametrize('n', [1, 2, 3, 7, 26, 27, 104])
def test_step_solves_the_system(n):
    """As LAPACK does, whether the number of columns is even or odd."""
    rng = np.random.default_rng(n)
    matrix, residual, step = diagonally_heavy(n, rng), rng.normal(size=n), np.empty(n)
    factors = matrix.copy()
    factor(factors)
    newton_step(factors, residual, step)
    assert step == pytest.approx(np.linalg.solve(matrix, -residual), rel=1e-11, abs=1e-14)


def test_broyden_steps_are_those_of_the_updated_matrix():
    """B <- B + (y - B s) s' / s's, solved anew each time, on a nonlinear system."""
    rng = np.random.default_rng(3)
    matrix = diagonally_heavy(6, rng)

    def residual(x):
        return matrix @ x + np.sin(x) ** 2 - 1.0

    x, updated, factors = np.zeros(6), matrix.copy(), matrix.copy()
    steps = np.empty((MOST_STEPS, 6))
    factor(factors)
    newton_step(factors, residual(x), steps[0])
    step = np.linalg.solve(updated, -residual(x))
    for count in range(1, MOST_STEPS):
        change = residual(x + step) - residual(x)
        updated += np.outer(change - updated @ step, step) / (step @ step)
        x = x + step
        step = np.linalg.solve(updated, -residual(x))
        broyden_step(factors, residual(x), steps, count)
        assert steps[count] == pytest.approx(step, rel=1e-6, abs=1e-15)
    assert np.abs(residual(x)).max() < 1e-6     # and they lead somewhere


def test_singular_matrix_gives_a_step_that_is_not_finite():
    """So that whoever judges the step sees it; nothing is raised in compiled code."""
    factors, step = np.zeros((2, 2)), np.empty(2)
    factor(factors)
    newton_step(factors, np.ones(2), step)
    assert not np.isfinite(step).all()

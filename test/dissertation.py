# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The set-up of chapter 3 of Paul 2015, and how many iterations schemes A to D need in it."""

import math
from dataclasses import replace

import curves
import numpy as np

from poststall_sim import definition
from poststall_sim.aero import model as models
from poststall_sim.aero import operating
from poststall_sim.aero.decambering import AngleForm, Closure
from poststall_sim.aero.model import Settings
from poststall_sim.aero.schemes import Scheme

NACA4415 = definition.airfoil(curves.CONFIG / 'airfoils' / 'naca4415_re3e6.csv')
FOILS = {'naca4415': NACA4415, **{name: curves.airfoil(name) for name in curves.STALLS}}
RANKED = (16.0, 24.0, 30.0)
"""Incidences of Table 3.1 [deg]."""
RELAXED = (Scheme.A, Scheme.B, Scheme.C, Scheme.D)
DISSERTATION = Settings(chordwise=1, unsteady=False, closure=Closure.LOCAL, scheme=Scheme.D,
                        angle_form=AngleForm.LINEAR, symmetric=True, tolerance=1e-3, limit=400)
"""The lattice of chapter 3 and its small angles. Symmetric, or round-off would add to counts."""
LATTICE = replace(DISSERTATION, chordwise=4, angle_form=AngleForm.EXACT, tolerance=1e-4)


def build(machine, settings):
    """Return a model and what solves it at an incidence [deg] with other settings."""
    model = models.build(machine, settings)
    problems = {}

    def solve(degrees, delta0=None, rows=0, **changes):
        """Return the operating points and the path (rows, 2, n) of (alpha, cl)."""
        if degrees not in problems:
            flow = curves.level_flow(machine, math.radians(degrees))
            problems[degrees] = operating.steady_problem(model, flow.onset, flow.deflections)
        problem, n = problems[degrees], model.lattice.strips
        changed = replace(model, settings=replace(settings, **changes))
        path = np.full((rows, 2 * n), np.nan)
        found = operating.decamber(changed, problem.boundary, problem.operator,
                                   np.zeros(n) if delta0 is None else delta0, path)
        return found, path.reshape(rows, 2, n)

    return model, solve


def converged(found, settings=DISSERTATION):
    return bool(np.abs(found.residual).max() <= settings.tolerance)


def counts(solve, settings, degrees):
    """Return iterations by scheme, infinite where one fails."""
    found = {scheme: solve(degrees, scheme=scheme)[0] for scheme in RELAXED}
    return {scheme: f.iterations if converged(f, settings) else math.inf
            for scheme, f in found.items()}


def ranking():
    """Return iterations by section, incidence [deg] and scheme, undamped: Table 3.1 in kind."""
    table = {}
    for name, foil in FOILS.items():
        settings = DISSERTATION if foil is NACA4415 else LATTICE
        _, solve = build(curves.wing_tail(foil), settings)
        table[name] = {degrees: counts(solve, settings, degrees) for degrees in RANKED}
    return table

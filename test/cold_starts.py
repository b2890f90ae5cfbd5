# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Random flows solved from no decambering, what the solvers say of them, and whether it is so.

What is converged is checked by `Recheck`, which solves the lattice's equations with numpy and
writes both closures from their formulas. Used by test_robust.py with few flows and by
benchmark/test_decambering_convergence.py with thousands.
"""

import dataclasses
import math
from dataclasses import dataclass

import curves
import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from poststall_sim.aero import model as models
from poststall_sim.aero import operating, solver
from poststall_sim.aero.decambering import AngleForm, Closure, averaging
from poststall_sim.aero.model import Settings, far_normalwash, wake_direction
from poststall_sim.state import Status

TOLERANCE = 1e-4
BY_ROUNDING = 1.001
"""A part in a thousand of the tolerance for round-off, and two interpolants of a table."""
SHAPES = [('wing and tail', 26), ('swept, with a fin', 26), ('swept, with a fin', 80),
          ('wing and tail', 80), ('swept, with a fin', 104), ('wing and tail', 104)]
"""Aircraft of `shaped` and their strips; the first is the one that the figures are asked of."""
ATTITUDES = [('gentle', 1.0), ('normal', 1.0), ('sharp', 1.0), ('sharp', 1.5)]
"""Curves and averaging lengths that are turned all round."""


def settings(closure, form=AngleForm.EXACT, **changes):
    return Settings(closure=closure, angle_form=form, unsteady=False,
                    **{'tolerance': TOLERANCE, **changes})


def wrapped(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


class Recheck:
    """
    Both closures' residuals of a decambering, in numpy.

    From the model come geometry and influence coefficients only: its lattice's places and axes,
    the matrix of its bound rings, and the normalwash of its straight wakes.
    """

    def __init__(self, model, foil, ell):
        self.model, lattice = model, model.lattice
        around = np.concatenate([foil.alpha[:-1] - 2 * np.pi, foil.alpha,
                                 foil.alpha[1:] + 2 * np.pi])
        self.cl = PchipInterpolator(
            around, np.concatenate([foil.cl[:-1], foil.cl, foil.cl[1:]]))
        self.zero = brentq(self.cl, math.radians(-10), math.radians(5), xtol=1e-15)
        same = lattice.strip_surface[:, None] == lattice.strip_surface
        apart = (lattice.span_place - lattice.span_place[:, None]) / lattice.strip_chord[:, None]
        weight = lattice.strip_width * np.exp(-0.5 * (apart / ell) ** 2) * same
        beyond = np.zeros_like(weight)      # quarters of a strip at both ends of all surfaces
        for grid in model.lattice.grids:
            for strip, side in ((grid.strips.start, -1.0), (grid.strips.stop - 1, 1.0)):
                width = lattice.strip_width[strip]
                apart = (lattice.span_place[strip] + side * 0.625 * width - lattice.span_place) \
                    / lattice.strip_chord
                beyond[:, strip] += 0.25 * width * np.exp(-0.5 * (apart / ell) ** 2) \
                    * same[:, strip]
        total = (weight + beyond).sum(axis=1, keepdims=True)
        self.mean, self.beyond = weight / total, beyond / total
        self.cg = np.array(model.aircraft.mass.cg_G)

    def matrix(self, flow):
        """Return the steady matrix (panels, panels): bound rings, and wakes they feed."""
        far = far_normalwash(self.model.lattice, wake_direction(flow.onset.velocity_G))
        return self.model.bound + far @ self.model.te_rows

    def looked_up(self, alpha, shift):
        """Return where flaps make the curves be read: less and less off alpha past the stall."""
        lattice = self.model.lattice
        way = np.maximum(
            (alpha + shift - lattice.stall_high) / (lattice.separated_high - lattice.stall_high),
            (alpha + shift - lattice.stall_low) / (lattice.separated_low - lattice.stall_low))
        way = np.clip(way, 0.0, 1.0)
        return alpha + shift * (1.0 - 3.0 * way ** 2 + 2.0 * way ** 3)

    def __call__(self, flow, delta, matrix, form):
        """Return the residuals (n,) of the non-local and of the local closure."""
        lattice, onset = self.model.lattice, flow.onset
        speed, linear = np.linalg.norm(onset.velocity_G), form is AngleForm.LINEAR

        def air(points):
            return onset.velocity_G - np.cross(onset.rates_G, points - self.cg)

        across = np.sum(air(lattice.collocation) * lattice.normal, axis=1)
        along = np.sum(air(lattice.collocation) * lattice.tangent, axis=1)
        angles = self.model.aircraft.mixing @ flow.deflections
        turn, slant, shift = (angles @ each for each in (lattice.turn, lattice.slant,
                                                         lattice.shift))
        sideways = np.cross(lattice.normal, lattice.tangent)
        theta = (delta - self.zero)[lattice.panel_strip]
        if linear:
            wash = speed * (lattice.tangent[:, 0] * (np.arctan2(across, along) + theta + turn)
                            - sideways[:, 0] * slant)
        else:
            # Flaps slant the normals and turn them; decambering turns what they have made.
            aside = np.sum(air(lattice.collocation) * sideways, axis=1)
            wash = np.cos(slant) * (across * np.cos(theta + turn) + along * np.sin(theta + turn)) \
                - aside * np.sin(slant) * np.cos(theta)
        strength = np.linalg.solve(matrix, -wash)[lattice.te_panel]

        u = np.sum(air(lattice.quarter_chord) * lattice.chord_axis, axis=1)
        w = np.sum(air(lattice.quarter_chord) * lattice.strip_normal, axis=1)
        theta, plate = delta - self.zero + shift, np.pi * lattice.strip_chord
        flowing = np.hypot(u, w) > 0.05 * max(speed, 0.5)
        if linear:
            flowing &= u > 0.0     # small angles say nothing of a strip that flies backwards
            fade = np.ones_like(u)
            effective = speed * lattice.chord_axis[:, 0]
            alpha = strength / (plate * effective) - theta
        else:
            ramp = np.clip((u / np.hypot(u, w) - math.cos(math.radians(75.0)))
                           / (0.5 - math.cos(math.radians(75.0))), 0.0, 1.0)
            fade = ramp ** 2 * (3.0 - 2.0 * ramp)
            strength = fade * strength \
                + (1.0 - fade) * plate * (w * np.cos(theta) + u * np.sin(theta))
            along = u * np.cos(theta) - w * np.sin(theta)
            alpha = np.arctan2(strength / plate, along) - theta
            effective = np.hypot(strength / plate, along)
        apart = wrapped(alpha - alpha[:, None])
        idle = wrapped(self.zero - shift - delta - alpha[:, None])
        mean = alpha + fade * ((self.mean * apart + self.beyond * idle) * fade).sum(axis=1)
        curve = self.cl(wrapped(self.looked_up(mean, shift))) / (2.0 * np.pi)
        potential = curve if linear else np.arcsin(curve)
        nonlocal_ = wrapped(delta - potential + mean - (self.zero - shift))
        local = 2.0 * strength / (effective * lattice.strip_chord) \
            - self.cl(wrapped(alpha + shift))
        return np.where(flowing, nonlocal_, 0.0), np.where(flowing, local, 0.0)


def shaped(name, strips):
    """Return an aircraft of a shape and a number of strips, for a section."""
    wing = {26: 20, 80: 60, 104: 80}[strips]

    def make(foil):
        if name == 'wing and tail':
            return curves.with_strips(curves.wing_tail(foil), wing=wing, tail=strips - wing)
        return curves.swept(foil, wing, fin_strips=strips - wing)
    return make


@dataclass(frozen=True)
class Outcome:
    """How a solver did on some flows: iterations and rechecked residuals (count,), failures."""

    iterations: np.ndarray
    worst: np.ndarray
    lost: tuple[str, ...]

    def __str__(self):
        return '\n'.join([f'{len(self.lost)} of {len(self.worst)} failed', *self.lost[:5]])


class Starts:
    """Random flows about an aircraft with one section, their problems, and how solvers do."""

    def __init__(self, shape, name, form, count, seed):
        self.foil, self.form = curves.airfoil(name), form
        machine = shaped(*shape)(self.foil)
        self.model = models.build(machine, settings(Closure.NONLOCAL, form))
        self.flows = curves.random_flows(machine, count, seed)
        self.problems = [operating.steady_problem(self.model, flow.onset, flow.deflections)
                         for flow in self.flows]
        # The closures differ in what a flap does to a separated section, and in nothing else.
        local = dataclasses.replace(self.model, settings=settings(Closure.LOCAL, form))
        self.boundaries = {
            Closure.NONLOCAL: [problem.boundary for problem in self.problems],
            Closure.LOCAL: [operating.boundary_condition(local, flow.onset, flow.deflections)
                            for flow in self.flows]}

    def solve(self, closure, ell=1.0):
        """
        Solve all of them from no decambering.

        Lost is what does not converge, and what the recheck says has not.
        """
        chosen = settings(closure, self.form, ell=ell)
        model = dataclasses.replace(self.model, settings=chosen,
                                    mean=averaging(self.model.lattice, ell))
        recheck = Recheck(model, self.foil, ell)
        none, used, checked, lost = np.zeros(model.lattice.strips), [], [], []
        for flow, problem, boundary in zip(self.flows, self.problems, self.boundaries[closure]):
            found = operating.decamber(
                model, boundary, problem.operator, none, operating.NO_PATH)
            used.append(found.iterations)
            residual = recheck(flow, found.delta, recheck.matrix(flow), self.form)[
                closure is Closure.LOCAL]
            told = np.abs(found.residual).max()
            checked.append(np.abs(residual).max())
            if not (told <= TOLERANCE and checked[-1] <= BY_ROUNDING * TOLERANCE):
                lost.append(f'residual told {told:.3g}, rechecked {checked[-1]:.3g} in '
                            f'{found.iterations} iterations: {flow}')
        return Outcome(np.array(used), np.array(checked), tuple(lost))


def any_attitude(name, ell, count, seed):
    """
    Solve the non-local closure over a full turn, rates up to pb/2V = 0.3.

    Whatever comes out has to be numbers and a status, and the residual what it says it is.
    """
    foil = curves.airfoil(name)
    machine = curves.wing_tail(foil)
    model = models.build(machine, settings(Closure.NONLOCAL, ell=ell))
    recheck, used, checked, lost, faded = Recheck(model, foil, ell), [], [], [], 0
    for flow in curves.random_flows(
            machine, count, seed, alpha=(-180.0, 180.0), beta=180.0, rate=0.3):
        result = solver.steady(model, flow.onset, flow.deflections, density=curves.DENSITY)
        values = np.concatenate([result.force_G, result.moment_G, result.circulation, *(
            getattr(result.strips, key) for key in (
                'alpha', 'cl', 'cd', 'cm', 'delta', 'circulation', 'residual'))])
        assert np.isfinite(values).all(), str(flow)
        assert result.status in (Status.CONVERGED, Status.NOT_CONVERGED), str(flow)
        used.append(result.iterations)
        checked.append(np.abs(recheck(flow, result.strips.delta, recheck.matrix(flow),
                                      AngleForm.EXACT)[0]).max())
        told = result.max_residual
        assert abs(checked[-1] - told) <= max(1e-9, (BY_ROUNDING - 1.0) * told), str(flow)
        boundary = operating.boundary_condition(model, flow.onset, flow.deflections)
        faded += bool((boundary.fade < 1.0).any())
        if result.status is not Status.CONVERGED:
            lost.append(f'residual {checked[-1]:.3g}: {flow}')
    assert faded > 0.3 * count    # the fade zones and what is behind them were there
    return Outcome(np.array(used), np.array(checked), tuple(lost))


def broken(outcome, closure, name, ell):
    """
    Return what an outcome breaks of what is asked of the wing and tail on 26 strips, if anything.

    Robust: at most 10 iterations in the mean, 20 for 95 %. Non-local: 10 at most, or 6 in the
    mean on the sharp curve.
    """
    used = outcome.iterations
    if closure is Closure.LOCAL:
        asked = {'mean <= 10': used.mean() <= 10.0, 'p95 <= 20': np.percentile(used, 95) <= 20.0}
    elif name == 'sharp':
        asked = {'mean <= 6': used.mean() <= 6.0}
    else:
        asked = {'max <= 10': used.max() <= 10}
    return [what for what, held in asked.items() if not held]


def asked(name):
    """Return the closures and averaging lengths that are asked about on a curve."""
    return [(Closure.LOCAL, 1.0), (Closure.NONLOCAL, 1.0)] \
        + [(Closure.NONLOCAL, 1.5)] * (name == 'sharp')

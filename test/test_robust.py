# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Solvers that are asked not to fail: the robust one (local closure) and Newton (non-local closure).

Random flows are drawn afresh at every run; the seed is in the output of a test that fails, and
the variable POSTSTALL_SEED brings a run back. What is converged is checked by `Recheck`, which
solves the lattice's equations with numpy and writes both closures from their formulas.
"""

import dataclasses
import hashlib
import itertools
import math
import os
import subprocess
import sys
from pathlib import Path

import curves
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from poststall_sim import definition
from poststall_sim.aero import continuation, operating, rescue, robust, solver
from poststall_sim.aero import model as models
from poststall_sim.aero.decambering import AngleForm, Closure, averaging
from poststall_sim.aero.model import Settings, far_normalwash, wake_direction
from poststall_sim.aero.polars import section_polar
from poststall_sim.frames import body_to_stability, geometry_to_body
from poststall_sim.state import Status

TOLERANCE = 1e-4
ANGLES_DEG = tuple(range(41))


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

    def __call__(self, flow, delta, matrix, form):
        """Return the residuals (n,) of the non-local and of the local closure."""
        lattice, onset = self.model.lattice, flow.onset
        speed, linear = np.linalg.norm(onset.velocity_G), form is AngleForm.LINEAR

        def air(points):
            return onset.velocity_G - np.cross(onset.rates_G, points - self.cg)

        across = np.sum(air(lattice.collocation) * lattice.normal, axis=1)
        along = np.sum(air(lattice.collocation) * lattice.tangent, axis=1)
        turn = flow.deflections @ lattice.flap_angle
        shift = flow.deflections @ lattice.flap_shift
        theta = (delta - self.zero)[lattice.panel_strip] + turn
        if linear:
            wash = speed * lattice.tangent[:, 0] * (np.arctan2(across, along) + theta)
        else:
            wash = across * np.cos(theta) + along * np.sin(theta)
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
        curve = self.cl(wrapped(mean + shift)) / (2.0 * np.pi)
        potential = curve if linear else np.arcsin(curve)
        nonlocal_ = wrapped(delta - potential + mean - (self.zero - shift))
        local = 2.0 * strength / (effective * lattice.strip_chord) \
            - self.cl(wrapped(alpha + shift))
        return np.where(flowing, nonlocal_, 0.0), np.where(flowing, local, 0.0)


class Starts:
    """Random flows about an aircraft with one section, their problems, and how solvers do."""

    def __init__(self, machine, foil, form, count, seed, **flows):
        self.foil, self.form = foil, form
        self.model = models.build(machine, settings(Closure.NONLOCAL, form))
        self.flows = curves.random_flows(machine, count, seed, **flows)
        self.problems = [operating.steady_problem(self.model, flow.onset, flow.deflections)
                         for flow in self.flows]
        self.matrices = [Recheck(self.model, foil, 1.0).matrix(flow) for flow in self.flows]

    def solve(self, closure, ell=1.0, **changes):
        """
        Solve all of them from no decambering; return iterations (count,).

        Fails where one does not converge, or its residual is not what the recheck says.
        """
        chosen = settings(closure, self.form, ell=ell, **changes)
        model = dataclasses.replace(self.model, settings=chosen,
                                    mean=averaging(self.model.lattice, ell))
        recheck = Recheck(model, self.foil, ell)
        none, used, failed = np.zeros(model.lattice.strips), [], []
        for flow, problem, matrix in zip(self.flows, self.problems, self.matrices):
            found = operating.decamber(
                model, problem.boundary, problem.operator, none, operating.NO_PATH)
            used.append(found.iterations)
            residual = recheck(flow, found.delta, matrix, self.form)[closure is Closure.LOCAL]
            # A part in a thousand of the tolerance for round-off, and two interpolants of a table.
            worst = np.abs(residual).max()
            told = np.abs(found.residual).max()
            if not (told <= TOLERANCE and worst <= 1.001 * TOLERANCE):
                failed.append(f'residual told {told:.3g}, rechecked {worst:.3g} in '
                              f'{found.iterations} iterations: {flow}')
        assert not failed, f'{len(failed)} of {len(self.flows)} failed, {closure.value}, ' \
            f'{self.form.value}, ell {ell}, {self.foil.name}:\n' + '\n'.join(failed[:5])
        return np.array(used)


@pytest.fixture(scope='module')
def seed():
    """Return this run's seed."""
    return curves.fresh_seed()


def cold_starts(name, form, count, seed):
    """Hold both solvers to what is asked of the wing-tail aircraft."""
    foil = curves.airfoil(name)
    starts = Starts(curves.wing_tail(foil), foil, form, count, seed)
    print(f'seed {seed}, {name}, {form.value}')
    used = starts.solve(Closure.LOCAL)
    assert used.mean() <= 10.0 and np.percentile(used, 95) <= 20.0
    used = starts.solve(Closure.NONLOCAL, 1.0)
    if name == 'sharp':
        assert used.mean() <= 6.0
        assert starts.solve(Closure.NONLOCAL, 1.5).mean() <= 6.0
    else:
        assert used.max() <= 10


@pytest.mark.parametrize('form', AngleForm)
@pytest.mark.parametrize('name', curves.STALLS)
def test_cold_starts_converge(name, form, seed):
    """120 random flows a curve: alpha -30..60, beta +-15 deg, rates, aileron, flap, elevator."""
    cold_starts(name, form, 120, seed)


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('form', AngleForm)
@pytest.mark.parametrize('name', curves.STALLS)
def test_2000_cold_starts_converge(name, form, seed):
    """The same in the number that the issue asks for."""
    cold_starts(name, form, 2000, seed)


def shaped(name, strips):
    """Return an aircraft of a shape and a number of strips, for a section."""
    wing = {26: 20, 80: 60, 104: 80}[strips]

    def make(foil):
        if name == 'wing and tail':
            return curves.with_strips(curves.wing_tail(foil), wing=wing, tail=strips - wing)
        return curves.swept(foil, wing, fin_strips=strips - wing)
    return make


SHAPES = [('swept, with a fin', 26), ('swept, with a fin', 80), ('wing and tail', 80),
          ('swept, with a fin', 104), ('wing and tail', 104)]


def asked(forms):
    """
    Return what is asked on other shapes: shape, curve, angle form, closure, ell.

    What is open is asked as well and may fail; not strictly, for the draws are random.
    """
    cases = []
    for shape, name, form in itertools.product(SHAPES, curves.STALLS, forms):
        for closure, ell in [(Closure.LOCAL, 1.0), (Closure.NONLOCAL, 1.0)] \
                + [(Closure.NONLOCAL, 1.5)] * (name == 'sharp'):
            open_ = closure is Closure.LOCAL and form is AngleForm.EXACT and shape[1] > 26 \
                and shape[0] == 'wing and tail' and name != 'sharp'
            marks = [pytest.mark.xfail(strict=False, reason=(
                'open: a fold just missed, about one flow in a thousand'))] * open_
            cases.append(pytest.param(
                shape, name, form, closure, ell, marks=marks,
                id=f'{shape[0]} {shape[1]}-{name}-{form.value}-{closure.value}-{ell}'))
    return cases


def other_shapes(shape, name, form, closure, ell, count, seed):
    """Hold a closure's solver to convergence."""
    foil = curves.airfoil(name)
    print(f'seed {seed}, {name}, {form.value}, {shape}')
    Starts(shaped(*shape)(foil), foil, form, count, seed).solve(closure, ell)


@pytest.mark.parametrize('shape, name, form, closure, ell', [
    case for case in asked([AngleForm.EXACT]) if case.values[0] in SHAPES[:3]])
def test_cold_starts_converge_on_other_shapes(shape, name, form, closure, ell, seed):
    """Swept, tapered, leaning, with a fin swept 45 deg; narrow strips; sines as sines."""
    other_shapes(shape, name, form, closure, ell, {26: 80, 80: 8}[shape[1]], seed)


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize('shape, name, form, closure, ell', asked(AngleForm))
def test_many_cold_starts_converge_on_other_shapes(shape, name, form, closure, ell, seed):
    """The same with more flows, more strips and both angle forms."""
    other_shapes(shape, name, form, closure, ell, {26: 2000, 80: 300, 104: 200}[shape[1]], seed)


# Flows that the first solver loses, found by random search: the fallback has to bring them home.

def lost_by_newton(model, machine, seed, places, monkeypatch):
    """Return the problems at places of 3000 random flows that Newton alone does not solve."""
    lost = []
    with monkeypatch.context() as patched:
        patched.setattr(continuation, 'MOST', 0)
        flows = curves.random_flows(machine, 3000, seed)
        for flow in [flows[i] for i in places]:
            problem = operating.steady_problem(model, flow.onset, flow.deflections)
            arguments = (model, problem.boundary, problem.operator,
                         np.zeros(model.lattice.strips), operating.NO_PATH)
            alone = np.abs(operating.decamber(*arguments).residual).max()
            if alone > TOLERANCE:
                lost.append((arguments, alone))
    return lost


def test_the_path_from_attached_flow_goes_round_the_folds_that_newton_loses(monkeypatch):
    """All that Newton loses of 3000, and within 150 Jacobians more than it wasted."""
    foil = curves.airfoil('sharp')
    machine = curves.swept(foil)
    model = models.build(machine, settings(Closure.NONLOCAL))
    lost = lost_by_newton(model, machine, 77, (
        367, 685, 728, 1268, 1466, 1469, 1794, 2275, 2569, 2756), monkeypatch)
    assert len(lost) > 2
    for arguments, _ in lost:
        found = operating.decamber(*arguments)
        assert np.abs(found.residual).max() <= TOLERANCE
        assert found.iterations <= model.settings.limit + 150


def test_nothing_better_is_thrown_away_where_the_path_misleads(monkeypatch):
    """A path that ends nowhere good, and few steps from there: what Newton had is kept."""
    machine = curves.swept(curves.airfoil('sharp'))
    model = models.build(machine, settings(Closure.NONLOCAL))
    model = dataclasses.replace(model, settings=settings(Closure.NONLOCAL, limit=3))
    lost = lost_by_newton(model, machine, 77, (367, 685, 728, 1268), monkeypatch)
    assert lost
    monkeypatch.setattr(continuation, 'follow', lambda begin, *rest: (begin + 1.5, 1))
    for arguments, alone in lost:
        assert np.abs(operating.decamber(*arguments).residual).max() <= alone


def test_with_small_angles_a_strip_that_flies_backwards_is_left_out():
    """Fin strips in flow from behind had no solution at all; the others have one without them."""
    machine = curves.swept(curves.airfoil('sharp'))
    model = models.build(machine, settings(Closure.NONLOCAL, AngleForm.LINEAR))
    flows = curves.random_flows(machine, 3000, 1)
    out = 0
    for flow in [flows[i] for i in (38, 847, 1090, 1191, 1431, 1583, 1629, 2211)]:
        problem = operating.steady_problem(model, flow.onset, flow.deflections)
        found = operating.decamber(model, problem.boundary, problem.operator,
                                   np.zeros(model.lattice.strips), operating.NO_PATH)
        idle = problem.boundary.strips[7] == 0.0
        out += idle.sum()
        assert np.abs(found.residual).max() <= TOLERANCE
        assert np.all(found.delta[idle] == 0.0)
    assert out > 0


def narrow(count, seed, name, form):
    """Return wing and tail on 80 strips, its local model, and `decamber`'s arguments of flows."""
    foil = curves.airfoil(name)
    machine = shaped('wing and tail', 80)(foil)
    model = models.build(machine, settings(Closure.LOCAL, form))
    flows = curves.random_flows(machine, count, seed)
    problems = [operating.steady_problem(model, flow.onset, flow.deflections) for flow in flows]
    return [(model, problem.boundary, problem.operator, np.zeros(80), operating.NO_PATH)
            for problem in problems]


def give_up(*arguments):
    """Stand in for `rescue.rescue` and find nothing."""
    arguments[-2][:] = np.inf
    return 0


def test_a_symmetric_flow_that_robust_loses_is_rescued(monkeypatch):
    """A wing of 40 strips at 23 deg, exact angles, the section of the demonstration."""
    foil = definition.airfoil(definition.find('airfoils', 'naca4415_re3e6'))
    machine = curves.wing_alone(foil, 40)
    model = models.build(machine, settings(Closure.LOCAL))
    flow = curves.level_flow(machine, math.radians(23.0))
    problem = operating.steady_problem(model, flow.onset, flow.deflections)
    arguments = (model, problem.boundary, problem.operator, np.zeros(40), operating.NO_PATH)
    assert np.abs(operating.decamber(*arguments).residual).max() <= TOLERANCE
    monkeypatch.setattr(operating.rescue, 'rescue', give_up)
    assert np.abs(operating.decamber(*arguments).residual).max() > TOLERANCE


@pytest.mark.parametrize('form', AngleForm)
def test_what_the_robust_solver_loses_on_narrow_strips_is_rescued(form, monkeypatch):
    """Nearly half the flows with exact angles, where lift falls slowly, a tenth with linear."""
    flows, used = narrow(20, 5, 'gentle', form), []
    for arguments in flows:
        found = operating.decamber(*arguments)
        assert np.abs(found.residual).max() <= TOLERANCE
        assert len(found.history) == found.iterations + 1
        used.append(found.iterations)
    lost = [k for k in range(20) if used[k] > operating.ROBUST_LIMIT]
    assert lost
    # What bounds the time: some seconds on 104 strips.
    assert max(used) <= operating.ROBUST_LIMIT + rescue.DESCENT_LIMIT + rescue.RESCUE_LIMIT

    monkeypatch.setattr(operating.rescue, 'rescue', give_up)
    for k in lost:
        assert np.abs(operating.decamber(*flows[k]).residual).max() > TOLERANCE


@pytest.mark.parametrize('form', AngleForm)
@pytest.mark.parametrize('name', curves.STALLS)
def test_symmetric_flow_does_not_roll_on_narrow_strips(name, form):
    """Nor differ from the same asked again: what is scattered is scattered alike on both sides."""
    machine = shaped('wing and tail', 80)(curves.airfoil(name))
    model = models.build(machine, settings(Closure.LOCAL, form))
    for degrees in range(0, 56, 5):
        flow = curves.level_flow(machine, math.radians(degrees))
        first, again = steady(model, flow), steady(model, flow)
        assert np.array_equal(first.strips.delta, again.strips.delta)
        assert abs(coefficients(machine, first, 0.0)[2]) < 1e-9, f'{degrees} deg'


@pytest.mark.parametrize('form', AngleForm)
def test_rescue_of_what_is_not_finite_ends_and_says_so(form):
    """Infinite air gives a residual that is not below any tolerance, and no exception."""
    model, boundary, operator, none, _ = narrow(1, 5, 'gentle', form)[0]
    lattice, n = model.lattice, model.lattice.strips
    inverse, level = np.empty((n, n)), np.empty((n, n + 1))
    robust.prepare(boundary.strips, operator, form is AngleForm.LINEAR, inverse, level)
    history = np.zeros(rescue.DESCENT_LIMIT + rescue.RESCUE_LIMIT + 1)
    alpha, circulation, speed, residual = (np.zeros(n) for _ in range(4))
    used = rescue.rescue(
        none, boundary.strips, operator * np.nan, inverse, level * np.nan,
        form is AngleForm.LINEAR, lattice.curves, lattice.polar_index, lattice.mirror, model.mean,
        lattice.strip_chord * lattice.strip_width, TOLERANCE, alpha, circulation, speed, residual,
        history)
    assert used == 0
    assert not np.abs(residual).max() <= TOLERANCE


def any_attitude(name, ell, count, seed):
    """Hold the non-local closure to its word over a full turn; return those that failed."""
    foil = curves.airfoil(name)
    machine = curves.wing_tail(foil)
    model = models.build(machine, settings(Closure.NONLOCAL, ell=ell))
    recheck, failed, faded = Recheck(model, foil, ell), [], 0
    print(f'seed {seed}, {name}')
    for flow in curves.random_flows(
            machine, count, seed, alpha=(-180.0, 180.0), beta=180.0, rate=0.3):
        result = solver.steady(model, flow.onset, flow.deflections, density=curves.DENSITY)
        values = np.concatenate([result.force_G, result.moment_G, result.circulation, *(
            getattr(result.strips, key) for key in (
                'alpha', 'cl', 'cd', 'cm', 'delta', 'circulation', 'residual'))])
        assert np.isfinite(values).all(), str(flow)
        assert result.status in (Status.CONVERGED, Status.NOT_CONVERGED), str(flow)
        worst = np.abs(recheck(flow, result.strips.delta, recheck.matrix(flow),
                               AngleForm.EXACT)[0]).max()
        # What it says of itself is so, to round-off and two interpolants of one table.
        assert worst == pytest.approx(result.max_residual, rel=1e-3, abs=1e-9), str(flow)
        boundary = operating.boundary_condition(model, flow.onset, flow.deflections)
        faded += bool((boundary.fade < 1.0).any())
        if result.status is not Status.CONVERGED:
            failed.append(f'residual {worst:.3g}: {flow}')
    assert faded > 0.3 * count    # the fade zones and what is behind them were there
    return failed


ATTITUDES = [('gentle', 1.0), ('normal', 1.0), ('sharp', 1.0), ('sharp', 1.5)]


def test_any_attitude_gives_numbers_and_a_status(seed):
    """Alpha and beta in +-180 deg, rates up to pb/2V = 0.3: 60 flows each of three curves."""
    failed = [f for name, ell in ATTITUDES[:3] for f in any_attitude(name, ell, 60, seed)]
    # None of 6000 failed when this was written, so that two of 180 are no accident.
    assert len(failed) <= 1, '\n'.join(failed)


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('name, ell', ATTITUDES)
def test_any_attitude_converges(name, ell, seed):
    """The same with 2000 flows each: 99.9 % converge."""
    failed = any_attitude(name, ell, 2000, seed)
    assert len(failed) <= 2, '\n'.join(failed)


def coefficients(machine, result, alpha):
    """Return CL, CD about the flow and Cl (roll), Cn (yaw) about body axes at the CG."""
    pressure = 0.5 * curves.DENSITY * curves.SPEED ** 2 * machine.reference.area
    x, _, z = body_to_stability(geometry_to_body(result.force_G), alpha) / pressure
    roll, _, yaw = geometry_to_body(result.moment_G) / (pressure * machine.reference.span)
    return -z, -x, roll, yaw


def steady(model, flow, delta0=None):
    """Return the steady result of a flow, which must have converged."""
    result = solver.steady(model, flow.onset, flow.deflections, density=curves.DENSITY,
                           delta0=delta0)
    assert result.status is Status.CONVERGED, f'{result.max_residual:.3g}: {flow}'
    return result


@pytest.mark.parametrize('closure', Closure)
@pytest.mark.parametrize('name', curves.STALLS)
@pytest.mark.parametrize('degrees', [90.0, -90.0, 180.0])
def test_flow_across_and_from_behind_loads_strips_as_their_sections(degrees, name, closure):
    """CL and CD within 5 % of area-weighted strip theory (method 4.8)."""
    foil, alpha = curves.airfoil(name), math.radians(degrees)
    machine = curves.wing_tail(foil)
    result = steady(models.build(machine, settings(closure)), curves.level_flow(machine, alpha))
    lift, drag = coefficients(machine, result, alpha)[:2]
    share = (12.0 + 0.67 * 3.35) / machine.reference.area
    cl, cd = section_polar(foil).at(alpha)[:2] * share
    assert drag == pytest.approx(cd, rel=0.05)
    # Where there is no lift to speak of, 5 % of 5 % of the drag.
    assert lift == pytest.approx(cl, abs=0.05 * max(abs(cl), 0.05 * cd))


@pytest.mark.parametrize('form', AngleForm)
@pytest.mark.parametrize('closure', Closure)
@pytest.mark.parametrize('name', curves.STALLS)
@pytest.mark.parametrize('shape', ['wing and tail', 'swept'])
def test_symmetric_flow_does_not_roll(shape, name, closure, form):
    """No rolling moment coefficient above 1e-9 from 0 to 40 deg, robust and non-local."""
    foil = curves.airfoil(name)
    machine = curves.wing_tail(foil) if shape == 'wing and tail' \
        else curves.swept(foil, fin_strips=0)
    model = models.build(machine, settings(closure, form))
    rolls = {degrees: abs(coefficients(machine, steady(
        model, curves.level_flow(machine, math.radians(degrees))), 0.0)[2])
        for degrees in ANGLES_DEG}
    worst = max(rolls, key=rolls.get)
    assert rolls[worst] < 1e-9, f'{rolls[worst]:.3g} at {worst} deg'


ANSWER = 'import test_robust; print(test_robust.digest())'


def digest():
    """Return a hash of the decambering of 40 random flows by both solvers, all three curves."""
    answer = hashlib.sha256()
    for name in curves.STALLS:
        foil = curves.airfoil(name)
        machine = curves.wing_tail(foil)
        for closure in Closure:
            model = models.build(machine, settings(closure))
            for flow in curves.random_flows(machine, 20, 7):
                result = solver.steady(
                    model, flow.onset, flow.deflections, density=curves.DENSITY)
                for values in (result.strips.delta, result.force_G, result.moment_G):
                    answer.update(values.tobytes())
    return answer.hexdigest()


def test_same_input_gives_same_answer_in_every_process():
    """Bit for bit: twice in this process, once in another."""
    here = Path(__file__).parent
    paths = os.pathsep.join([str(here.parent), str(here)])
    other = subprocess.run([sys.executable, '-c', ANSWER], cwd=here.parent, text=True, check=True,
                           capture_output=True, env={**os.environ, 'PYTHONPATH': paths})
    assert digest() == digest() == other.stdout.strip()


@pytest.mark.parametrize('name', curves.STALLS)
def test_lift_does_not_depend_on_the_number_of_strips(name):
    """Non-local CL on 20, 40, 80 strips: apart by no more than 1.5 times what it is attached."""
    foil, lift = curves.airfoil(name), []
    for strips in (20, 40, 80):
        machine = curves.wing_alone(foil, strips)
        model = models.build(machine, settings(Closure.NONLOCAL, tolerance=1e-7))
        lift.append([coefficients(machine, steady(
            model, curves.level_flow(machine, math.radians(degrees))), math.radians(degrees))[0]
            for degrees in ANGLES_DEG])
    apart = np.ptp(lift, axis=0)
    # Attached: up to where the first strip's curve bends, where CL differs by its tips alone.
    attached, stalled = apart[:11].max(), apart[11:].max()
    assert stalled <= 1.5 * attached, (
        f'{stalled:.4f} at {11 + apart[11:].argmax()} deg against {attached:.4f} attached, '
        f'ratio {stalled / attached:.2f}')


@pytest.mark.parametrize('form', AngleForm)
@pytest.mark.parametrize('name', curves.STALLS)
def test_non_local_closure_has_one_answer(name, form, seed):
    """From 30 random starts at each angle from 0 to 40 deg, and it says so itself."""
    foil, rng = curves.airfoil(name), np.random.default_rng(seed)
    machine = curves.wing_tail(foil)
    model = models.build(machine, settings(Closure.NONLOCAL, form, tolerance=1e-9))
    n = model.lattice.strips
    for degrees in ANGLES_DEG:
        flow = curves.level_flow(machine, math.radians(degrees))
        problem = operating.steady_problem(model, flow.onset, flow.deflections)
        answers = [operating.decamber(model, problem.boundary, problem.operator, start,
                                      operating.NO_PATH)
                   for start in [np.zeros(n), *rng.uniform(-0.5, 0.2, (30, n))]]
        worst = max(np.abs(found.residual).max() for found in answers)
        assert worst <= 1e-9, f'{degrees} deg, seed {seed}: {worst:.3g}'
        deltas = np.array([found.delta for found in answers])
        # The residual's tolerance times the inverse of the Jacobian's least eigenvalue, 0.023 on
        # the sharp curve at 25 deg (0.026 on twice and four times the tail's strips).
        assert np.ptp(deltas, axis=0).max() < 1e-7, f'{degrees} deg, seed {seed}'
        assert operating.uniqueness(model, problem, deltas[0]) > 0.02, degrees


def local_solutions(model, flow, starts):
    """Return distinct local solutions (k, n) found from starts, and the uniqueness of each."""
    problem = operating.steady_problem(model, flow.onset, flow.deflections)
    found = []
    for start in starts:
        answer = operating.decamber(
            model, problem.boundary, problem.operator, start, operating.NO_PATH)
        if np.abs(answer.residual).max() <= TOLERANCE and not any(
                np.abs(answer.delta - known).max() < 1e-4 for known in found):
            found.append(answer.delta)
    return np.array(found), [operating.uniqueness(model, problem, delta) for delta in found]


def test_uniqueness_tells_smooth_solutions_from_one_of_many():
    """
    Min Re eig is above 0 where there is one solution; local ones past stall are many.

    Method 4.7: for AR 12 on 20 strips the saw-tooth makes max eig W 0.68 rad, so that a smooth
    stalled state is stable only while lift falls by less than 1.47 per radian: on the gentle
    curve it is, and stays one; on the normal one it is not. The robust solver ends on saw-tooths
    that are stable themselves, so that the sign alone does not count solutions.
    """
    rng = np.random.default_rng(11)
    starts = [np.zeros(20), *rng.uniform(-0.5, 0.1, (60, 20))]
    number = {}
    for name in curves.STALLS:
        machine = curves.wing_alone(curves.airfoil(name))
        model = models.build(machine, settings(Closure.LOCAL, limit=400))
        for degrees in (5.0, 20.0):
            flow = curves.level_flow(machine, math.radians(degrees))
            solutions, signs = local_solutions(model, flow, starts)
            number[name, degrees] = len(solutions)
            print(f'{name}, {degrees:g} deg: {len(solutions)} local solutions from 61 starts, '
                  f'uniqueness {min(signs):.3f} to {max(signs):.3f}')
            if degrees == 5.0 or name == 'gentle':
                assert len(solutions) == 1 and min(signs) > 0.0
    assert number['normal', 20.0] > 10 and number['sharp', 20.0] > 10
    # The smooth state of the normal curve at 20 deg, which the non-local closure finds: as a
    # solution of the local one it would not be stable, and the local measure says so.
    machine = curves.wing_alone(curves.airfoil('normal'))
    flow = curves.level_flow(machine, math.radians(20.0))
    smooth = models.build(machine, settings(Closure.NONLOCAL))
    problem = operating.steady_problem(smooth, flow.onset, flow.deflections)
    delta = steady(smooth, flow).strips.delta
    assert operating.uniqueness(smooth, problem, delta) > 0.0
    local = dataclasses.replace(smooth, settings=settings(Closure.LOCAL))
    assert operating.uniqueness(local, problem, delta) < 0.0


RATE = 0.05
"""pb/2V at which autorotation is asked about."""


def roll_damping(model, degrees, about_velocity):
    """Return Cl/(pb/2V) of the non-local closure about body x or the velocity."""
    alpha = math.radians(degrees)
    axis = np.array([math.cos(alpha), 0.0, math.sin(alpha)]) if about_velocity \
        else np.array([1.0, 0.0, 0.0])
    rate = RATE * 2.0 * curves.SPEED / model.aircraft.reference.span
    result = steady(model, curves.Flow(alpha, 0.0, rate * axis, np.zeros(0)))
    _, _, roll, yaw = coefficients(model.aircraft, result, alpha)
    return (roll * axis[0] + yaw * axis[2]) / RATE


def strip_theory_damping(polar, alpha):
    """
    Return Cl/(pb/2V) about body x of strips that do not know of each other, at a section angle.

    A rectangular wing in the flow of a roll at RATE, integrated over its span as it is: the
    slope's formula of method 9, -(CN' cos a + 2 CN sin a)/6, is its limit for small rates.
    """
    eta = np.linspace(-1.0, 1.0, 2001)
    along, across = math.cos(alpha) * np.ones_like(eta), math.sin(alpha) + RATE * eta
    angle = np.arctan2(across, along)
    values = polar.at(angle)
    normal = values[:, 0] * np.cos(angle) + values[:, 1] * np.sin(angle)
    # The moment to port of a lift to starboard, over q S b: half the span's share of half.
    load = -normal * (along ** 2 + across ** 2) * eta
    return float(np.sum(0.5 * (load[1:] + load[:-1]) * np.diff(eta))) / 4.0 / RATE


def test_strip_theory_of_small_rates_is_its_formula():
    """-(CN' cos a + 2 CN sin a)/6 about body x, on the attached side and on a level shelf."""
    polar = section_polar(curves.airfoil('gentle'))
    for degrees in (0.0, 4.0, 40.0):
        alpha, h = math.radians(degrees), 1e-4
        cn = [v[0] * math.cos(a) + v[1] * math.sin(a)
              for a in (alpha - h, alpha, alpha + h) for v in [polar.at(a)]]
        slope = (cn[2] - cn[0]) / (2.0 * h)
        formula = -(slope * math.cos(alpha) + 2.0 * cn[1] * math.sin(alpha)) / 6.0
        # The rate turns the tips by 3 deg, over which neither curve bends much.
        assert strip_theory_damping(polar, alpha) == pytest.approx(formula, rel=0.02, abs=0.005)


@pytest.mark.parametrize('name', curves.STALLS)
def test_autorotation_past_a_steep_stall_and_not_past_a_gentle_one(name):
    """
    The moment about body x of a roll about body x changes sign past stall, or never.

    Its sign is that of strip theory at the angle at which the sections work on the mean, where
    that is more than 0.5 per radian either way. About the velocity the values are printed: the
    gentle curve, too, has a little autorotation there, for its lift falls while its drag, which
    damps, is small.
    """
    foil = curves.airfoil(name)
    machine = curves.wing_alone(foil)
    model = models.build(machine, settings(Closure.NONLOCAL, tolerance=1e-7))
    polar, body, velocity, strips = section_polar(foil), [], [], []
    for degrees in ANGLES_DEG:
        body.append(roll_damping(model, degrees, False))
        velocity.append(roll_damping(model, degrees, True))
        straight = steady(model, curves.level_flow(machine, math.radians(degrees)))
        mean = np.average(straight.strips.alpha, weights=model.lattice.strip_width)
        strips.append(strip_theory_damping(polar, mean))
    body, velocity, strips = np.array(body), np.array(velocity), np.array(strips)
    for label, values in (('body x', body), ('the velocity', velocity),
                          ('body x, strip theory', strips)):
        print(f'{name}, Cl/(pb/2V) about {label}: '
              + ' '.join(f'{d}:{values[d]:+.2f}' for d in range(10, 41, 2)))
    assert (body[:13] < -0.5).all()                 # attached: aspect ratio 12 damps at 0.67
    assert body[0] == pytest.approx(velocity[0], abs=1e-12)
    rotating = np.flatnonzero(body > 0.0)
    if name == 'gentle':
        assert rotating.size == 0
    else:
        assert body[rotating].max() > 0.2
        assert 15 < rotating[0] and rotating[-1] < 30
        assert np.array_equal(rotating, np.arange(rotating[0], rotating[-1] + 1))
        assert (body[30:] < -0.2).all()             # damped again in deep stall
    sure = np.abs(strips) > 0.5
    assert sure.any()
    wrong = [d for d in np.flatnonzero(sure) if np.sign(body[d]) != np.sign(strips[d])]
    assert not wrong, [(d, body[d], strips[d]) for d in wrong]

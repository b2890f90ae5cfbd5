# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The linearised lattice: every block against differences of the march it is the derivative of."""

import dataclasses
import math

import curves
import numpy as np
import pytest
import wings

from poststall_sim.aero import solver, wash
from poststall_sim.aero import wake as wakes
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.history import History
from poststall_sim.aero.model import Onset, Settings, build
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Placement, Shape
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import body_to_geometry, geometry_to_body
from poststall_sim.stability import linear

SPEED, ROWS = 40.0, 12
DT = 0.25 / SPEED
HERE = Placement(np.zeros(3), wings.LEVEL)


class Step:
    """One step of the march about its equilibrium, as a function of all that it depends on."""

    def __init__(self, machine, alpha, deflections, nu0, **settings):
        row = SPEED * DT
        self.model = build(machine, Settings(
            tolerance=1e-12, wake=Shape.FROZEN, wake_length=(ROWS - 0.5) * row, chordwise=2,
            **wings.EXACTLY, **settings))
        self.deflections = np.array(deflections)
        self.nu = np.concatenate([geometry_to_body(-wings.onset(SPEED, alpha).velocity_G),
                                  np.zeros(3)]) + nu0
        onset = self.onset(np.zeros(6))
        self.aero = solver.steady(self.model, onset, self.deflections, density=wings.DENSITY)
        self.flow, _ = solver.start(
            self.model, onset, HERE, self.deflections, density=wings.DENSITY, dt=DT,
            delta0=self.aero.strips.delta)
        self.linear = linear.linearise(
            self.model, onset, self.deflections, self.aero, density=wings.DENSITY, dt=DT,
            rows=ROWS)

    def onset(self, change):
        velocity, rates = np.split(self.nu + change, 2)
        return Onset(body_to_geometry(-velocity), body_to_geometry(rates))

    def __call__(self, *, nu=0.0, flap=0.0, before=0.0, older=0.0, rings=0.0):
        """
        Return circulation, decambering and load after a step with differences at its begin.

        nu (6,), flap (controls,) of the end; before, older (p,) circulation of the last steps;
        rings (ROWS, n) of the wake, the newest as it will be shed.
        """
        flow, wake = self.flow, self.flow.wake
        rings = np.zeros((ROWS, self.model.lattice.strips)) + rings
        store = wake.circulation
        assert len(store) == ROWS
        nodes = np.concatenate([wake.moving_A, wake.settled_A])
        history = History(nodes[1:], np.concatenate([
            store[1:] + np.concatenate([rings[2:], rings[-1:]]), store[-1:]]))
        moved = dataclasses.replace(
            wake, moving_rings=store[:1] + rings[1:2], settled=history, first=history.first)
        flow = dataclasses.replace(
            flow, wake=moved, circulation=flow.circulation + before,
            previous=flow.previous + older, shed=flow.shed + rings[0])
        new, result = solver.advance(
            self.model, flow, self.onset(np.zeros(6) + nu), HERE, self.deflections + flap,
            density=wings.DENSITY, dt=DT, drift_N=np.zeros(3))
        return np.concatenate([new.circulation, new.delta, geometry_to_body(result.force_G),
                               geometry_to_body(result.moment_G)])

    def difference(self, name, direction, size):
        """Return the central difference of the three in a direction."""
        change = {name: size * direction}
        back = {name: -size * direction}
        return np.split((self(**change) - self(**back)) / (2.0 * size), self.splits)

    @property
    def splits(self):
        lattice = self.model.lattice
        return [lattice.panels, lattice.panels + lattice.strips]

    def derivative(self, *, nu=None, flap=None, before=None, older=None, rings=None):
        """Return the same from the matrices."""
        m, lattice = self.linear, self.model.lattice
        nu = np.zeros(6) if nu is None else nu
        flap = np.zeros(len(self.deflections)) if flap is None else flap
        before, older = (np.zeros(lattice.panels) if x is None else x for x in (before, older))
        rings = np.zeros((ROWS, lattice.strips)) if rings is None else rings
        wash = np.einsum('rpn,rn->p', m.foreign, rings) + m.other @ before
        delta = m.follow_nu @ nu + m.follow_flap @ flap + m.follow_wash @ wash
        normal = m.onset @ nu + m.flap @ flap + m.turn @ delta \
            + np.einsum('rpn,rn->p', m.wake, rings)
        circulation = -np.linalg.solve(m.bound, normal)
        rate = (3.0 * circulation - 4.0 * before + older) / (2.0 * DT)
        load = m.load_bound @ circulation + m.load_rate @ rate \
            + np.einsum('rkn,rn->k', m.load_wake, rings) + m.load_nu @ nu + m.load_flap @ flap \
            + m.load_turn @ delta + m.load_wash @ wash
        return circulation, delta, load


CASES = {
    'attached': (3.0, {}), 'stalled': (20.0, {}), 'deep': (40.0, {}),
    'stalled, local': (17.0, {'closure': Closure.LOCAL}),
    'potential flow': (20.0, {'decambering': False})}


@pytest.fixture(scope='module', params=CASES)
def step(request):
    degrees, settings = CASES[request.param]
    machine = curves.with_strips(curves.wing_tail(curves.airfoil('gentle')), wing=8, tail=4)
    return Step(machine, math.radians(degrees),
                0.05 * np.ones(len(machine.controls)), np.array([0, 2.0, 0, 0.3, 0.1, -0.2]),
                **settings)


def test_the_step_stays_at_its_equilibrium(step):
    """The march's wake of equal rows is the straight one of the steady flow."""
    circulation, delta, load = np.split(step(), step.splits)
    assert circulation == pytest.approx(step.aero.circulation, abs=1e-8)
    assert delta == pytest.approx(step.aero.strips.delta, abs=1e-10)
    assert load[:3] == pytest.approx(geometry_to_body(step.aero.force_G), rel=1e-8, abs=1e-5)


@pytest.mark.parametrize(('name', 'size'), [
    ('nu', 1e-4), ('flap', 1e-6), ('before', 1e-4), ('older', 1e-4), ('rings', 1e-4)])
def test_every_block_is_the_difference_of_the_march(step, name, size):
    """In random directions: circulation, decambering, load, to the curvature of the curves."""
    shape = {'nu': (6,), 'flap': step.deflections.shape, 'rings': (ROWS, step.model.lattice.strips)
             }.get(name, (step.model.lattice.panels,))
    generator = np.random.default_rng(7)
    for _ in range(4):
        direction = generator.normal(size=shape)
        found = step.difference(name, direction, size)
        expected = step.derivative(**{name: direction})
        for one, other in zip(found, expected):
            # Twelve digits of the closure over a step of 1e-5.
            assert one == pytest.approx(other, rel=1e-5, abs=2e-6 * np.abs(other).max() + 1e-7)


def test_displaced_rows_are_the_difference_of_the_wake_they_are_of():
    """
    Wing and tail, rows that are shifted and turned about the centre of gravity, one at a time.

    Against the velocity that the march has of such a wake; the last takes the closing row along.
    """
    machine = curves.with_strips(curves.wing_tail(curves.airfoil('gentle')), wing=8, tail=4)
    model = build(machine, Settings(
        chordwise=2, wake_length=(ROWS - 0.5) * SPEED * DT, **wings.EXACTLY))
    lattice, air = model.lattice, wings.onset(SPEED, 0.1)
    flaps = np.zeros(len(machine.controls))
    aero = solver.steady(model, air, flaps, density=wings.DENSITY)
    found = linear.linearise(
        model, air, flaps, aero, density=wings.DENSITY, dt=DT).sway
    cg, row_G = np.array(machine.mass.cg_G), DT * air.velocity_G
    at_edge = aero.circulation[lattice.te_panel]
    straight = wakes.straight(lattice, HERE, row_G, ROWS, at_edge)
    assert len(found.foreign) == ROWS

    def seen(row, m, size):
        nodes = HERE.to_geometry(np.concatenate([straight.moving_A, straight.settled_A]))
        step_G = body_to_geometry(size * np.eye(3)[m % 3])
        nodes[row] += step_G if m < 3 else np.cross(step_G, nodes[row] - cg)
        moved = HERE.to_inertial(nodes)
        history = History(moved[1:], np.tile(at_edge, (ROWS, 1)))
        one = dataclasses.replace(straight, settled=history, first=history.first)
        everywhere, _ = wash.velocity(one, lattice, model.felt, HERE, False)
        everything, foreign, at_edges = wash.on_lattice(everywhere, model.felt, lattice.normal)
        return everything, foreign, at_edges.ravel()

    for row in (1, 2, 5, ROWS):
        for m in range(6):
            columns = [(ahead - back) / 2e-4 for ahead, back in zip(
                seen(row, m, 1e-4), seen(row, m, -1e-4))]
            for one, blocks in zip(columns, (found.normalwash, found.foreign, found.at_edges)):
                expected = blocks[row - 1, :, m]
                assert one == pytest.approx(expected, abs=1e-3 * np.abs(expected).max() + 1e-5)


@pytest.mark.parametrize('wrong', [
    {'ground': True}, {'unsteady': False}, {'separation': Separation.GOMAN_KHRABROV}])
def test_what_is_not_in_the_equations_is_refused(wrong):
    model = build(curves.wing_alone(curves.airfoil('gentle'), 6), Settings(chordwise=1, **wrong))
    air = wings.onset(SPEED, 0.1)
    aero = solver.steady(model, air, np.zeros(0), density=wings.DENSITY)
    with pytest.raises(ConfigError, match='linear system'):
        linear.linearise(model, air, np.zeros(0), aero, density=wings.DENSITY, dt=DT)


def test_a_flow_without_a_derivative_says_so(step):
    assert not step.linear.at_fold
    for condition in (1e7, math.inf, math.nan):
        assert dataclasses.replace(step.linear, condition=condition).at_fold


def test_an_all_moving_tail_and_an_aileron_at_its_stop_have_their_derivatives():
    """
    The tail turns its strips' chords; the right aileron is held by a stop, the left moves.

    Both about axes that are not their hinge lines, which slants normals towards the side.
    """
    machine = curves.with_strips(curves.wing_tail(curves.airfoil('gentle')), wing=8, tail=4)
    controls = []
    for each in machine.controls:
        changed = {'stops': (-0.02, 0.3)} if each.name == 'aileron' else {}
        changed['hinge_axis'] = (0.4, 1.0, 0.1)
        controls.append(dataclasses.replace(each, effectors=tuple(
            dataclasses.replace(one, **changed, hinge=0.0 if one.surface == 'tail' else one.hinge)
            for one in each.effectors)))
    machine = dataclasses.replace(machine, controls=tuple(controls))
    step = Step(machine, math.radians(20.0), 0.05 * np.ones(len(controls)), np.zeros(6))
    assert step.model.lattice.pivot.any() and step.model.lattice.slant.any()
    assert not step.model.lattice.angle_rate(step.deflections).any(axis=1).all()
    for name, size in (('nu', 1e-4), ('flap', 1e-6)):
        direction = np.random.default_rng(7).normal(
            size=(6,) if name == 'nu' else step.deflections.shape)
        for one, other in zip(step.difference(name, direction, size),
                              step.derivative(**{name: direction})):
            assert one == pytest.approx(other, rel=1e-5, abs=2e-6 * np.abs(other).max() + 1e-7)

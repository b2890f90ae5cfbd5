# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Flaps past the stall, all-moving surfaces, and where a free flap floats."""

import dataclasses
import math

import curves
import numpy as np
import pytest
import wings
from scipy.integrate import quad

from poststall_sim.aero import plate, solver
from poststall_sim.aero.decambering import TWO_PI, AngleForm, Closure
from poststall_sim.aero.flaps import LEFT, floating_ratio, look_up
from poststall_sim.aero.model import Onset, Settings, build
from poststall_sim.controls import Control, Effector

DEG = math.radians(1.0)
WHOLE = 0.0
FOIL = wings.stalling()


def long_wing(airfoil=FOIL, *, hinge=0.75, rows=4, **settings):
    """Return the model of a wing so long that its middle is in two-dimensional flow."""
    flap = Control('flap', (-0.6, 0.6), (Effector('wing', hinge=hinge),))
    machine = wings.rectangular(1e4, 5, airfoil, controls=(flap,))
    return build(machine, Settings(chordwise=rows, unsteady=False, tolerance=1e-11, **settings))


def middle(model, alpha, deflection, delta0=None):
    """Return alpha, cl, cd, cm of the middle strip in steady flow."""
    strips = wings.steady(model, 20.0, alpha, deflections=[deflection], delta0=delta0).strips
    return np.array([each[2] for each in (strips.alpha, strips.cl, strips.cd, strips.cm)])


@pytest.mark.parametrize('axis', [None, (0.0, 1.0, 0.0), (-0.3, 0.8, 0.5), (0.6, -2.0, 0.0)])
def test_a_flap_turns_its_normals_about_its_hinge(axis):
    """
    By h x n per radian at first, and n keeps its length however far, on both sides of a wing.

    In a flow along each axis by turns; the small-angle form is asked for the stream along x only.
    """
    ends = np.array([[0.0, 0.0, 0.0], [1.5, 4.0, 0.4]])
    chords, hinge = np.array([1.4, 0.6]), 0.6
    machine = wings.aircraft(
        [wings.panel_wing(FOIL, ends, chords, 6, symmetric=True)], FOIL, area=8.0, chord=1.0,
        span=8.0, controls=(Control('flap', (-0.6, 0.6), (
            Effector('wing', hinge=hinge, hinge_axis=axis),)),))
    line = np.diff(ends, axis=0)[0] + [hinge * (chords[1] - chords[0]), 0.0, 0.0]
    right = line if axis is None else np.array(axis) * math.copysign(1.0, axis[1])
    right = right / np.linalg.norm(right)
    left = right * [-1.0, 1.0, -1.0]   # drawn from tip to root
    for form, flows in ((AngleForm.EXACT, np.eye(3)), (AngleForm.LINEAR, np.eye(3)[:1])):
        model = build(machine, Settings(chordwise=5, unsteady=False, angle_form=form))
        lattice = model.lattice

        def normals(deflection, model=model, flows=flows):
            return np.stack([solver.boundary_condition(
                model, Onset(flow, np.zeros(3)), np.array([deflection])).level
                for flow in flows], axis=1)

        behind = np.repeat([0.0, 0.0, 0.0, 1.0, 1.0], 6)[:, None]
        about = np.tile(np.array([left] * 3 + [right] * 3), (5, 1))
        expected = behind * np.cross(about, lattice.normal)[:, :len(flows)]
        step = 1e-5
        assert (normals(step) - normals(-step)) / (2.0 * step) == pytest.approx(expected, abs=1e-9)
        if form is AngleForm.EXACT:
            assert np.linalg.norm(normals(0.5), axis=1) == pytest.approx(1.0, abs=1e-12)


def test_a_flap_ends_where_kirchhoff_leaves_a_quarter_of_the_lift():
    lattice = long_wing().lattice
    for side, begin, end in ((1, lattice.stall_high[0], lattice.separated_high[0]),
                             (-1, lattice.stall_low[0], lattice.separated_low[0])):
        assert 10.0 < side * end / DEG < 60.0 and side * end > side * begin
        attached = TWO_PI * math.sin(end - lattice.zero_lift[0])
        cl = np.interp(end, FOIL.alpha, FOIL.cl)
        # The angle is one of those at every quarter of a degree.
        assert LEFT - 0.02 < cl / attached <= LEFT + 1e-3
    never = long_wing(wings.potential()).lattice
    assert np.all(never.separated_high > 1e8) and np.all(never.separated_low < -1e8)


def test_what_is_left_of_a_flap_falls_smoothly_from_one_to_nothing():
    """It and its slope by differences; without a flap the curve is read at alpha itself."""
    lattice = long_wing().lattice
    alpha = np.linspace(-math.pi, math.pi, 4001)
    strips = np.zeros((16, alpha.size))
    strips[12], strips[13] = lattice.stall_high[0], lattice.separated_high[0]
    strips[14], strips[15] = lattice.stall_low[0], lattice.separated_low[0]
    angles, left, slope = np.empty((3, alpha.size))
    look_up(alpha, strips, angles, left, slope)
    assert np.array_equal(angles, alpha)
    attached = (alpha >= lattice.stall_low[0]) & (alpha <= lattice.stall_high[0])
    gone = (alpha >= lattice.separated_high[0]) | (alpha <= lattice.separated_low[0])
    assert np.all(left[attached] == 1.0) and np.all(left[gone] == 0.0)
    between = left[~attached & ~gone]
    assert between.size > 200 and np.all((between > 0.0) & (between < 1.0))
    step = alpha[1] - alpha[0]
    # Trapezoidal: second order, but for the corners of the slope.
    assert np.diff(left) == pytest.approx(0.5 * step * (slope[1:] + slope[:-1]), abs=2e-5)


@pytest.mark.parametrize('closure', list(Closure))
def test_section_with_a_flap_is_read_off_its_moved_curve(closure):
    """
    Attached: alpha + tau deflection, whole. Far past the stall: the plain section at alpha.

    Under the local closure whole at any angle.
    """
    model = long_wing(closure=closure)
    tau = plate.flap_effectiveness(4, 0.75)
    plain = model.lattice
    for deflection in (-8.0 * DEG, 8.0 * DEG):
        low = middle(model, 4.0 * DEG, deflection)
        x = low[0] + tau * deflection
        assert low[0] == pytest.approx(4.0 * DEG, abs=2e-3)   # the tips are 5000 chords away
        assert low[1] == pytest.approx(np.interp(x, FOIL.alpha, FOIL.cl), abs=2e-3)
        deep = plain.separated_high[0] + 8.0 * DEG
        if closure is Closure.LOCAL:
            high = middle(model, deep, deflection)
            assert high[1] == pytest.approx(
                np.interp(high[0] + tau * deflection, FOIL.alpha, FOIL.cl), abs=2e-3)
            continue
        high, clean = middle(model, deep, deflection), middle(model, deep, 0.0)
        # A lattice turned by the deflection at its rear carries that of one turned by tau times
        # it as a whole to first order: alpha differs by 5e-4.
        assert high[1:3] == pytest.approx(clean[1:3], abs=2e-3)
        # Its moment as well: what the lattice still has of the flap is in the section's.
        assert high[3] - clean[3] == pytest.approx(
            -plate.flap_moment(4, 0.75) * deflection, abs=2e-3)


def test_flap_at_a_stalled_section_has_less_effect_than_at_an_attached_one():
    """From 1 over a half to nothing, in lift per deflection over the slope of the curve."""
    model = long_wing()
    lattice, tau = model.lattice, plate.flap_effectiveness(4, 0.75)
    way = lattice.separated_high[0] - lattice.stall_high[0]
    angles, left, slope = np.empty((3, 5))
    for share, expected in ((-0.3, 1.0), (0.5, 0.5), (1.2, 0.0)):
        alpha = float(lattice.stall_high[0] + share * way)
        strips = np.zeros((16, 5))
        strips[6] = 1e-6 * tau
        strips[12:] = np.array([lattice.stall_high, lattice.separated_high,
                                lattice.stall_low, lattice.separated_low])
        look_up(np.full(5, alpha), strips, angles, left, slope)
        assert (angles[2] - alpha) / (1e-6 * tau) == pytest.approx(expected, abs=1e-5)


def test_moment_of_a_flap_tends_to_thin_airfoil_theory():
    """d(cm)/d(deflection) about the quarter chord is -sin t (1 - cos t)/2, cos t = 1 - 2 hinge."""
    for hinge in (0.5, 0.75):
        t = math.acos(1.0 - 2.0 * hinge)
        errors = [plate.flap_moment(rows, hinge) + 0.5 * math.sin(t) * (1.0 - math.cos(t))
                  for rows in (40, 80, 160)]
        assert abs(2.0 * errors[2] - errors[1]) < 1e-3 and abs(errors[2]) < 0.02
    assert plate.flap_moment(4, 0.0) == pytest.approx(0.0, abs=1e-14)


def test_free_flap_floats_where_thin_airfoil_theory_has_no_hinge_moment():
    """The vorticity of incidence and of deflection, each integrated about the hinge."""
    for hinge in (0.2, 0.5, 0.75, 0.9):
        h = math.acos(1.0 - 2.0 * hinge)

        def moment(vorticity, h=h):
            def slice_of(t):
                return vorticity(t) * (math.cos(h) - math.cos(t)) * math.sin(t)
            return quad(slice_of, h, math.pi, limit=200)[0]

        by_alpha = moment(lambda t: (1.0 + math.cos(t)) / math.sin(t))
        by_flap = moment(lambda t, h=h: (
            (math.pi - h) * (1.0 + math.cos(t)) / math.sin(t)
            + math.log(math.sin(0.5 * (t + h)) / max(math.sin(0.5 * (t - h)), 1e-300)))
            / math.pi)
        assert floating_ratio(hinge) == pytest.approx(by_alpha / by_flap, rel=1e-6)
    assert floating_ratio(0.0) == pytest.approx(1.0)


def test_all_moving_section_is_the_section_turned():
    """In two dimensions a deflection of an all-moving wing is an incidence, past the stall too."""
    model = long_wing(hinge=WHOLE)
    for alpha, deflection in ((2.0, 5.0), (-4.0, 30.0), (25.0, -15.0), (50.0, 20.0)):
        turned = middle(model, alpha * DEG, deflection * DEG)
        plain = middle(model, (alpha + deflection) * DEG, 0.0)
        assert turned == pytest.approx(plain, abs=5e-4)   # tips 5000 chords away


def test_drag_of_an_all_moving_surface_is_along_the_flow():
    """Sections of drag alone: the force is along the air, whatever the deflection."""
    foil = dataclasses.replace(
        wings.potential(), cl=1e-9 * wings.potential().cl, cd=np.full(1441, 0.4))
    model = long_wing(foil, hinge=WHOLE)
    for deflection in (0.0, 20.0, -35.0):
        force = wings.steady(model, 20.0, 10.0 * DEG, deflections=[deflection * DEG]).force_G
        assert math.atan2(force[2], force[0]) == pytest.approx(10.0 * DEG, abs=1e-3)


def tailed(tail_incidence, hinge):
    """Return a stalling wing with a tail at an incidence [rad] that moves behind a hinge."""
    wing = wings.panel_wing(FOIL, [(0, 0, 0), (0, 4, 0)], [1, 1], 12, symmetric=True)
    tail = wings.panel_wing(FOIL, [(5, 0, 0.3), (5, 1.5, 0.3)], [0.6, 0.6], 6, symmetric=True,
                            name='tail', twist=tail_incidence)
    return build(wings.aircraft(
        [wing, tail], FOIL, area=8.0, chord=1.0, span=8.0,
        controls=(Control('elevator', (-0.5, 0.5), (Effector('tail', hinge=hinge),)),)),
        Settings(tolerance=1e-11))


@pytest.mark.parametrize(('alpha', 'part'), [(3.0, 0.02), (22.0, 0.05)])
def test_all_moving_tail_is_the_tail_built_at_that_incidence(alpha, part):
    """
    To first order in the angle: forces, moments and the tail's operating points.

    But for what the tail's own rings and wake induce along its chord, which normals that are
    turned in the onset alone do not see: a few per cent where the wake leaves at 22 deg.
    """
    turned = tailed(0.0, WHOLE)
    for size in (1.0, 0.5):
        built = wings.steady(tailed(size * DEG, WHOLE), 20.0, alpha * DEG)
        moved = wings.steady(turned, 20.0, alpha * DEG, deflections=[size * DEG])
        plain = wings.steady(turned, 20.0, alpha * DEG)
        tail = turned.lattice.grids[1].strips
        change = built.force_G - plain.force_G
        assert moved.force_G - plain.force_G == pytest.approx(
            change, abs=part * np.abs(change).max())
        assert moved.moment_G[1] - plain.moment_G[1] == pytest.approx(
            built.moment_G[1] - plain.moment_G[1], rel=part)
        for key in ('alpha', 'cl', 'cd'):
            ours, theirs, before = (getattr(each.strips, key)[tail]
                                    for each in (moved, built, plain))
            assert ours - before == pytest.approx(
                theirs - before, abs=part * np.abs(theirs - before).max())


def test_fading_into_strip_theory_is_by_the_turned_chord():
    """At alpha 68 deg a surface turned by -30 deg meets its flow at 38: all lattice."""
    lattice_flow = solver.boundary_condition(
        long_wing(hinge=WHOLE), wings.onset(20.0, 68.0 * DEG), np.array([-30.0 * DEG]))
    assert np.all(lattice_flow.fade == 1.0)
    faded = solver.boundary_condition(
        long_wing(hinge=WHOLE), wings.onset(20.0, 68.0 * DEG), np.zeros(1))
    assert np.all(faded.fade < 1.0)


def test_flows_with_flaps_past_the_stall_are_all_solved():
    """Flaps at random in their limits at alpha 10 to 45 deg: where eta changes."""
    machine = curves.with_strips(curves.wing_tail(curves.airfoil('sharp')), wing=12, tail=6)
    for closure in Closure:
        model = build(machine, Settings(closure=closure, unsteady=False))
        for flow in curves.random_flows(machine, 25, 11, alpha=(10.0, 45.0)):
            aero = solver.steady(model, flow.onset, flow.deflections, density=wings.DENSITY)
            assert aero.status is solver.Status.CONVERGED, str(flow)

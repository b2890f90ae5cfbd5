# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The steady lattice against published wings and closed forms; its signs and symmetries."""

import math
from dataclasses import replace

import exact
import numpy as np
import pytest
import wings

from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.model import Settings, build

SMALL = 1e-4
"""An incidence [rad] so small that its square is below every tolerance here."""


def slope(machine, model, name='lift'):
    """Return the change of a coefficient per incidence of a wing that lifts nothing at 0."""
    return getattr(wings.coefficients(machine, wings.steady(model, 1.0, SMALL), 1.0, SMALL),
                   name) / SMALL


def span_efficiency(machine, model, alpha=0.05):
    """Return e = CL^2/(pi AR CD) from the near-field forces and from the Trefftz plane."""
    result = wings.steady(model, 1.0, alpha)
    near = wings.coefficients(machine, result, 1.0, alpha)
    y = model.lattice.wake_nodes[:, 1]
    circulation = result.circulation[model.lattice.te_panel]
    middle, width = 0.5 * (y[1:] + y[:-1]), np.diff(y)
    trailing = np.diff(circulation, prepend=0.0, append=0.0)
    wash = -(trailing / (2.0 * math.pi * (middle[:, None] - y))).sum(axis=1)
    lift, drag = 2.0 * circulation @ width, np.abs(wash) * circulation @ width
    factor = machine.reference.area / (math.pi * machine.reference.span ** 2)
    return (factor * near.lift ** 2 / near.drag,
            factor * lift ** 2 / drag / machine.reference.area)


def test_swept_wing_of_bertin_and_smith():
    """Aerodynamics for Engineers, the hand-worked swept wing: 4 x 1 panels a side, 0.2 %."""
    wing = wings.panel_wing(
        wings.potential(), [(0, 0, 0), (2.5, 2.5, 0)], [1, 1], 8, symmetric=True)
    machine = wings.aircraft([wing], wings.potential(), area=5.0, chord=1.0, span=5.0)
    model = build(machine, Settings(chordwise=1))
    assert slope(machine, model) == pytest.approx(1.096 * math.pi, rel=0.002)
    circulation = wings.steady(model, 1.0, SMALL).circulation[4:] / (4.0 * math.pi * 5.0 * SMALL)
    # Printed with four decimals, three digits: half a unit of the last.
    assert circulation == pytest.approx([0.0273, 0.0287, 0.0286, 0.0250], abs=0.6e-4)


def test_warren_12_planform():
    """OpenVSP's validation document quotes CL_alpha 2.743, Cm_alpha -3.10 about the apex."""
    half = math.sqrt(2.0)
    wing = wings.panel_wing(wings.potential(), [(0, 0, 0), (0.5 + half, half, 0)], [1.5, 0.5], 40,
                            symmetric=True)
    machine = wings.aircraft([wing], wings.potential(), area=2.0 * half, chord=1.0,
                             span=2.0 * half, cg_G=(0, 0, 0))
    model = build(machine, Settings(chordwise=8))
    # Lattices of this fineness scatter by 2 and 3 % around their common limit.
    assert slope(machine, model) == pytest.approx(2.743, rel=0.02)
    assert slope(machine, model, 'pitch') == pytest.approx(-3.10, rel=0.03)


@pytest.mark.parametrize(('ratio', 'lift', 'roll'), [
    (4, 3.676, -0.345), (6, 4.276, -0.450), (8, 4.644, -0.528)])
def test_rectangular_wings(ratio, lift, roll):
    """Another lattice's slopes (8 x 40, cosine) to its digits; Helmbold's from below."""
    machine = wings.rectangular(ratio, 40, cosine=True)
    model = build(machine, Settings(chordwise=8))
    assert slope(machine, model) == pytest.approx(lift, abs=0.6e-3)
    rolling = wings.steady(model, 1.0, rates_B=(2.0 * SMALL / ratio, 0.0, 0.0))
    damping = wings.coefficients(machine, rolling, 1.0).roll / SMALL
    assert damping == pytest.approx(roll, abs=0.6e-3)
    # Lifting surfaces of constant chord lie 4 to 6 % below the formula, never above.
    assert 0.92 < slope(machine, model) / exact.helmbold_slope(ratio) < 1.0
    assert exact.roll_damping_strip(1.0) < damping < 0.0


def elliptic(strips):
    """Return an elliptic wing of aspect ratio 8 about its straight quarter-chord line."""
    eta = np.linspace(0.0, 1.0, strips // 2 + 1)
    chord = 32.0 / (8.0 * math.pi) * np.sqrt(np.maximum(1.0 - eta ** 2, 4e-4))
    stations = [(0.25 * (chord[0] - c), 4.0 * e, 0.0) for c, e in zip(chord, eta)]
    wing = wings.panel_wing(wings.potential(), stations, chord, strips, symmetric=True)
    area = 8.0 * np.trapezoid(chord, eta) if hasattr(np, 'trapezoid') \
        else 8.0 * np.trapz(chord, eta)   # NumPy 1.26  # noqa: NPY201
    return wings.aircraft([wing], wings.potential(), area=area, chord=1.0, span=8.0)


def test_elliptic_wing_has_the_slope_and_the_efficiency_of_its_kind():
    """Between Helmbold's 4.91 less 3 % and Prandtl's 5.03; least induced drag, e = 1."""
    efficiency = []
    for strips in (40, 80):
        machine = elliptic(strips)
        model = build(machine)
        assert 4.75 < slope(machine, model) < exact.prandtl_slope(8.0)
        efficiency.append(span_efficiency(machine, model)[0])
    assert 0.97 < efficiency[1] < 1.03
    # e is first order in the strips' number, whose tip vortex is too far out.
    assert 2.0 * efficiency[1] - efficiency[0] == pytest.approx(1.0, abs=0.01)


def test_induced_drag_of_the_near_field_is_that_of_the_far_field():
    """Joukowski on the rings against the Trefftz plane, which shares nothing with it."""
    for cosine in (False, True):
        machine = wings.rectangular(8.0, 80, cosine=cosine)
        near, far = span_efficiency(machine, build(machine))
        assert near == pytest.approx(far, rel=0.005)
        assert 0.97 < near < 1.03


def test_wing_of_avl_runs_1_and_8():
    """
    Coefficients at alpha 1 deg and 2 deg of incidence, as AVL printed them.

    Its drag on one row is that in its Trefftz plane. On the edges it has 0.00243: their middles
    miss the corners of a swept wing, see `corners`; so would ours (0.002429).
    """
    alpha = math.radians(1.0)
    for rows, lift, drag, pitch in ((1, 0.24324, 0.00245, -0.02252),
                                    (6, 0.24454, 0.00247, -0.02091)):
        machine, model = wings.wing_a(rows)
        ours = wings.coefficients(machine, wings.steady(model, 1.0, alpha), 1.0, alpha)
        # AVL turns the normals for incidence, here the plate itself is turned: 2 deg squared.
        assert ours.lift == pytest.approx(lift, rel=0.002)
        assert ours.drag == pytest.approx(drag, rel=0.005)
        assert ours.pitch == pytest.approx(pitch, rel=0.005)


def test_wing_of_avl_run_11_derivatives():
    """Slopes and damping in stability axes. AVL's wake trails along x, ours along the flow."""
    machine, model = wings.wing_a(1)
    alpha = math.radians(1.0)

    def slopes(change, rates=(0.0, 0.0, 0.0)):
        high, low = (wings.coefficients(machine, wings.steady(
            model, 1.0, alpha + sign * change, rates_B=sign * np.array(rates)), 1.0,
            alpha + sign * change) for sign in (1.0, -1.0))
        return {key: (getattr(high, key) - getattr(low, key)) / (2.0 * SMALL)
                for key in ('lift', 'roll', 'pitch')}

    incidence = slopes(SMALL)
    assert incidence['lift'] == pytest.approx(4.638088, rel=0.002)
    assert incidence['pitch'] == pytest.approx(-0.429247, rel=0.01)
    assert slopes(0.0, (0.0, SMALL, 0.0))['pitch'] == pytest.approx(-0.517094, rel=0.005)
    rolling = slopes(0.0, (2.0 * SMALL / 15.0, 0.0, 0.0))
    assert rolling['roll'] == pytest.approx(-0.518725, rel=0.01)


@pytest.fixture(scope='module')
def trainer():
    """Return the shipped conventional aircraft, built once."""
    machine = wings.shipped_aircraft('trainer')
    return machine, build(machine)


def of_trainer(trainer, name, alpha=0.07, **flow):
    """Return a coefficient of the trainer in flight at 15 m/s."""
    machine, model = trainer
    result = wings.steady(model, 15.0, alpha, **flow)
    return getattr(wings.coefficients(machine, result, 15.0, alpha), name)


def changed(trainer, name, **change):
    """Return by how much a coefficient of the trainer rises with a small change of the flow."""
    return of_trainer(trainer, name, **change) - of_trainer(trainer, name)


def test_signs_of_motion(trainer):
    """Each motion is opposed, and sideslip does what fin and dihedral are there for."""
    lift = [of_trainer(trainer, 'lift', alpha=a) for a in (0.0, 0.05, 0.1)]
    assert lift[0] < lift[1] < lift[2]                          # incidence lifts
    right_wing_down, nose_up, nose_right = np.eye(3) * 0.1
    assert changed(trainer, 'roll', rates_B=right_wing_down) < 0.0
    assert changed(trainer, 'pitch', rates_B=nose_up) < 0.0
    assert changed(trainer, 'yaw', rates_B=nose_right) < 0.0
    assert changed(trainer, 'roll', rates_B=nose_right) > 0.0   # the left wing is faster
    from_the_right = 0.05
    assert changed(trainer, 'side', beta=from_the_right) < 0.0
    assert changed(trainer, 'yaw', beta=from_the_right) > 0.0    # into the wind
    assert changed(trainer, 'roll', beta=from_the_right) < 0.0   # away from it


def test_signs_of_controls(trainer):
    """Positive is trailing edge down, rudder left; the aileron rolls to the right."""
    assert trainer[0].control_names == ('aileron', 'elevator', 'rudder')
    aileron, elevator, rudder = np.eye(3) * math.radians(5.0)
    assert changed(trainer, 'roll', deflections=aileron) > 0.0
    assert changed(trainer, 'pitch', deflections=elevator) < 0.0   # nose down
    assert changed(trainer, 'lift', deflections=elevator) > 0.0
    assert changed(trainer, 'yaw', deflections=rudder) < 0.0       # nose left
    assert changed(trainer, 'side', deflections=rudder) > 0.0      # the fin is pushed right
    # Past the wing's stall the tail flies on where it trims, with the elevator up.
    up = [of_trainer(trainer, 'pitch', alpha=math.radians(20.0), deflections=-steps * elevator)
          for steps in (6, 5, 4, 3)]
    assert np.all(np.diff(up) < 0.0) and up[0] > 0.0 > up[-1]


def test_decambering_is_negative_in_stall_and_unloads(trainer):
    """At 20 deg the attached lattice would lift far more; upside down the signs change."""
    machine, model = trainer
    attached = build(machine, Settings(decambering=False))
    wing = slice(0, 20)
    for degrees, sign in ((20.0, 1.0), (-25.0, -1.0)):
        alpha = math.radians(degrees)
        stalled, other = (wings.steady(m, 15.0, alpha) for m in (model, attached))
        assert np.all(sign * stalled.strips.delta[wing] < 0.0)
        assert stalled.strips.stalled[wing].sum() >= 10
        assert sign * stalled.force_G[2] < 0.7 * sign * other.force_G[2]
        assert not other.strips.stalled.any() and np.all(other.strips.delta == 0.0)


def test_moment_moves_with_its_reference_like_a_force(trainer):
    """The same flow about another centre of gravity: M - M' = (r' - r) x F, to round-off."""
    machine, model = trainer
    shift = np.array([0.3, -0.1, 0.2])
    other = build(replace(machine, mass=replace(
        machine.mass, cg_G=tuple(np.array(machine.mass.cg_G) + shift))))
    # Without rates the flow does not depend on where they would turn.
    here, there = (wings.steady(m, 15.0, 0.2, 0.1, deflections=[0.1, -0.1, 0.2])
                   for m in (model, other))
    assert there.force_G == pytest.approx(here.force_G, abs=1e-10)
    assert there.moment_G == pytest.approx(
        here.moment_G - np.cross(shift, here.force_G), abs=1e-9)


FLOWS = [(0.1, 0.1, (0.3, 0.2, -0.1)), (0.35, -0.2, (-0.2, 0.3, 0.1)), (1.4, 0.3, (0, 0, 0)),
         (2.6, -0.6, (0.1, 0.0, 0.2))]


@pytest.mark.parametrize(('alpha', 'beta', 'rates'), FLOWS)
def test_mirrored_flow_gives_mirrored_loads(trainer, alpha, beta, rates):
    """Fin and all: sideslip, roll, yaw, aileron and rudder change sign."""
    machine, model = trainer
    here = wings.steady(model, 15.0, alpha, beta, rates, [0.1, -0.2, 0.15])
    there = wings.steady(model, 15.0, alpha, -beta, np.array(rates) * [-1, 1, -1],
                         [-0.1, -0.2, -0.15])
    pressure = 0.5 * wings.DENSITY * 15.0 ** 2 * machine.reference.area
    assert there.force_G == pytest.approx(here.force_G * [1, -1, 1], abs=1e-9 * pressure)
    assert there.moment_G == pytest.approx(here.moment_G * [-1, 1, -1], abs=1e-9 * pressure)
    assert there.status is here.status and there.iterations == here.iterations
    wing = slice(0, 20)
    assert there.strips.delta[wing][::-1] == pytest.approx(here.strips.delta[wing], abs=1e-9)


def test_symmetric_flow_makes_no_roll_yaw_or_side_force():
    """Stalled or not: below 1e-9 of the dynamic pressure's force and moment."""
    machine = wings.wing_tail()
    model = build(machine)
    for degrees in range(-20, 181, 10):
        result = wings.steady(model, 40.0, math.radians(degrees), rates_B=(0.0, 0.4, 0.0))
        ours = wings.coefficients(machine, result, 40.0, math.radians(degrees))
        assert max(abs(ours.side), abs(ours.roll), abs(ours.yaw)) < 1e-9, degrees


def moved(surface, *, scale=1.0, shift=(0.0, 0.0, 0.0)):
    """Return a surface larger by scale and displaced by shift [m]."""
    return replace(surface, sections=tuple(
        replace(s, chord=scale * s.chord, leading_edge_G=tuple(
            scale * x + d for x, d in zip(s.leading_edge_G, shift))) for s in surface.sections))


def test_coefficients_do_not_know_units_origin_or_order():
    """Speed, density, size, where the drawing starts, which surface comes first."""
    machine = wings.wing_tail()
    flow = {'alpha': 0.3, 'beta': 0.1}
    turn = np.array([0.01, 0.004, -0.006])   # per metre, times speed

    def of(machine, speed, scale=1.0):
        result = wings.steady(build(machine), speed, rates_B=turn * speed / scale,
                              deflections=[0.1, 0.05], **flow)
        ours = wings.coefficients(machine, result, speed, 0.3)
        return np.array([ours.lift, ours.drag, ours.side, ours.roll, ours.pitch, ours.yaw])

    base = of(machine, 40.0)
    assert of(machine, 4.0) == pytest.approx(base, abs=1e-6)   # tolerance 1e-5 rad on delta
    big = replace(
        machine, surfaces=tuple(moved(s, scale=3.0) for s in machine.surfaces),
        mass=replace(machine.mass, cg_G=(0.75, 0.0, 0.0)),
        reference=replace(machine.reference, area=108.0, chord=3.0, span=36.0))
    assert of(big, 40.0, scale=3.0) == pytest.approx(base, abs=1e-6)
    away = replace(
        machine, surfaces=tuple(moved(s, shift=(5.0, 0.0, -2.0)) for s in machine.surfaces),
        mass=replace(machine.mass, cg_G=(5.25, 0.0, -2.0)))
    assert of(away, 40.0) == pytest.approx(base, abs=1e-6)
    assert of(replace(machine, surfaces=machine.surfaces[::-1]), 40.0) == pytest.approx(
        base, abs=1e-6)


def test_wing_turned_about_its_chord_has_its_loads_turned_with_it():
    """A wing on edge in sideslip is a wing at incidence; at 30 deg of bank likewise."""
    results = []
    for bank in (0.0, math.radians(30.0), math.radians(90.0)):
        c, s = math.cos(bank), math.sin(bank)
        wing = wings.panel_wing(
            wings.stalling(), [(0, -3 * c, -3 * s), (0.4, 3 * c, 3 * s)], [1, 0.8], 8)
        machine = wings.aircraft([wing], wings.stalling(), area=5.4, chord=0.9, span=6.0)
        model = build(machine)
        turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])   # geometry axes, about x
        level = wings.onset(1.0, 0.28, 0.1, (0.05, 0.02, 0.01))
        result = solver.steady(model, models.Onset(turn @ level.velocity_G, turn @ level.rates_G),
                               np.zeros(0), density=wings.DENSITY)
        results.append(np.concatenate([turn.T @ result.force_G, turn.T @ result.moment_G,
                                       result.strips.delta]))
    assert results[1] == pytest.approx(results[0], abs=1e-7)
    assert results[2] == pytest.approx(results[0], abs=1e-7)

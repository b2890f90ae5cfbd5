# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Marches into stall, out of it, backwards, and with the wing's wake over the tail.

The wing has AR 12 and 20 strips; the three stalls are those of `curves`. The sharp one falls at
11 per radian and is averaged over 1.5 chords, without which its solution is not unique.
"""

import dataclasses
import math

import curves
import exact
import numpy as np
import pytest
import wings

from poststall_sim.aero import solver
from poststall_sim.aero.decambering import AngleForm
from poststall_sim.aero.model import Settings, build
from poststall_sim.aero.polars import section_polar
from poststall_sim.aircraft import Aircraft, MassProperties, Reference
from poststall_sim.state import Status

SPEED = curves.SPEED
ELL = {'gentle': 1.0, 'normal': 1.0, 'sharp': 1.5}


def marched(machine, stall, angle, rows, *, at_rest=False):
    """Return lift and results of a march through angles [rad], a panel's chord of 1 m a step."""
    model, dt = build(machine, Settings(chordwise=rows, ell=ELL[stall])), 1.0 / (rows * SPEED)
    turning = np.gradient(angle, dt)

    def air(t):
        k = round(t / dt)
        return wings.onset(SPEED, angle[k], rates_B=(0.0, turning[k], 0.0))

    results = [r for _, _, r in wings.march(model, air, dt, len(angle) - 1, at_rest=at_rest)]
    lift = np.array([wings.coefficients(machine, r, SPEED, a).lift
                     for r, a in zip(results, angle)])
    return lift, results


def saw_tooth(cl):
    """Return the amplitude of an alternation from strip to strip, smooth loadings left out."""
    return np.abs(np.diff(cl, 4)).max() / 16.0


@pytest.mark.parametrize('rows', [1, 2, 4, pytest.param(8, marks=pytest.mark.soak)])
@pytest.mark.parametrize('stall', curves.STALLS)
def test_sudden_start_past_stall_settles_on_the_steady_solution(stall, rows):
    """No step fails; over the last 10 of 40 chords lift is steady to 0.001, 0.01 being asked."""
    machine = curves.wing_alone(curves.airfoil(stall))
    for degrees in (5.0, 16.0, 20.0, 24.0, 30.0, 45.0):
        angle = np.full(40 * rows + 1, math.radians(degrees))
        lift, results = marched(machine, stall, angle, rows, at_rest=True)
        assert all(r.status is Status.CONVERGED for r in results)
        last = lift[-10 * rows:]
        # At 30 chords the starting vortex, at 2.5 spans, takes 2e-4 of the lift.
        assert last == pytest.approx(np.full(10 * rows, lift[0]), abs=1e-3)
        # Asked 0.02; smooth loadings have 0.006 at the tips, where lift falls to zero.
        assert max(saw_tooth(r.strips.cl) for r in results[1:]) < 0.01


@pytest.mark.parametrize('form', AngleForm)
@pytest.mark.parametrize('degrees', [5.0, 24.0])
def test_both_angle_forms_march_to_their_own_steady_solution(form, degrees):
    """Sines and small angles differ by 1 and 2 % in lift there; each march ends on its own."""
    machine, dt = curves.wing_alone(curves.airfoil('normal')), 0.5 / SPEED
    model = build(machine, Settings(chordwise=2, angle_form=form))
    angle = math.radians(degrees)
    air = wings.onset(SPEED, angle)
    *_, (_, _, last) = wings.march(model, lambda t: air, dt, 80, at_rest=True)
    steady = solver.steady(model, air, np.zeros(0), density=wings.DENSITY)
    assert last.status is Status.CONVERGED
    assert wings.coefficients(machine, last, SPEED, angle).lift == pytest.approx(
        wings.coefficients(machine, steady, SPEED, angle).lift, rel=1e-3)
    # Which form it is shows in the operating points, as both solve the same section curves.
    other = build(machine, Settings(
        chordwise=2, angle_form=next(each for each in AngleForm if each is not form)))
    apart = solver.steady(other, air, np.zeros(0), density=wings.DENSITY)
    assert np.abs(last.strips.cl - apart.strips.cl).max() > 5.0 * np.abs(
        last.strips.cl - steady.strips.cl).max()


def swing(rows, k, periods=1):
    """Return 15 + 10 sin(2 k V t/c) degrees at every step [rad]."""
    t = np.arange(round(periods * math.pi / k * rows) + 1) / rows
    return np.radians(15.0 + 10.0 * np.sin(2.0 * k * t))


def up_and_down(rows):
    """Return 0 to 35 deg in 50 chords and back [rad]."""
    up = np.radians(np.linspace(0.0, 35.0, 50 * rows + 1))
    return np.concatenate([up, up[-2::-1]])


@pytest.mark.parametrize('k', [None, 0.05, 0.1])
@pytest.mark.parametrize('rows', [1, 2, 4, 8])
@pytest.mark.parametrize('stall', curves.STALLS)
def test_lift_does_not_jump_on_the_way_through_stall(stall, rows, k):
    """
    Ramp 0-35-0 deg, or 15 +- 10 deg at k: below 0.06 in a step, and every step converges.

    Where the section by itself changes by more in one of these steps, below that: long steps turn
    by up to 2 deg, in which attached lift rises by 0.15 and that of the sharp stall falls by 0.35.
    """
    foil = curves.airfoil(stall)
    angle = up_and_down(rows) if k is None else swing(rows, k)
    lift, results = marched(curves.wing_alone(foil), stall, angle, rows)
    assert all(r.status is Status.CONVERGED for r in results)
    assert max(saw_tooth(r.strips.cl) for r in results) < 0.01
    assert lift.max() > 1.5 and np.ptp(lift) > 0.6   # up to the stall, and through it
    section = section_polar(foil).at(angle)[:, 0]
    assert np.abs(np.diff(lift)).max() < max(0.06, np.abs(np.diff(section)).max())


def strip_theory(model, foil, onset):
    """Return the force (3,) in G of all strips as sections by themselves."""
    lattice = model.lattice
    air = onset.at(model.quarter_arm)
    u = np.einsum('ij,ij->i', air, lattice.chord_axis)
    w = np.einsum('ij,ij->i', air, lattice.strip_normal)
    alpha = np.arctan2(w, u)
    load = 0.5 * wings.DENSITY * (u * u + w * w) * lattice.strip_chord * lattice.strip_width
    cl, cd = (np.interp(alpha, foil.alpha, table) for table in (foil.cl, foil.cd))
    along = cd * np.cos(alpha) - cl * np.sin(alpha)
    across = cl * np.cos(alpha) + cd * np.sin(alpha)
    return (load * along) @ lattice.chord_axis + (load * across) @ lattice.strip_normal


@pytest.mark.parametrize('degrees', [80.0, 90.0, 110.0, 130.0, 150.0, 165.0, 175.0])
def test_reversed_flow_is_that_of_strip_theory(degrees):
    """From 80 to 175 deg the march from rest has the sections' own lift and drag from step one."""
    foil = curves.airfoil('normal')
    model = build(curves.wing_tail(foil))
    air = wings.onset(SPEED, math.radians(degrees))
    expected = strip_theory(model, foil, air)
    scale = np.linalg.norm(expected)
    for _, _, result in wings.march(model, wings.steadily(air), 0.25 / SPEED, 60, at_rest=True):
        assert result.status is Status.CONVERGED
        # The table is read linearly here, the product's curve is smooth.
        assert result.force_G == pytest.approx(expected, abs=2e-3 * scale)


@pytest.mark.parametrize('degrees', [63.0, 67.0, 70.0])
def test_fading_strips_settle_on_the_steady_solution(degrees):
    """Between 60 and 75 deg as below: to 0.01."""
    machine = curves.wing_alone(curves.airfoil('normal'))
    lift, _ = marched(machine, 'normal', np.full(161, math.radians(degrees)), 4, at_rest=True)
    assert lift[-1] == pytest.approx(lift[0], abs=0.01)


def test_flight_over_its_back_at_two_metres_a_second():
    """From 40 m/s level to 2 m/s at 113 deg and back in 6 s: strip theory and added mass."""
    foil, period, dt = curves.airfoil('normal'), 6.0, 0.0125
    model = build(curves.wing_tail(foil))
    turn = 2.0 * math.pi / period

    def angle(t):
        return math.radians(56.5) * (1.0 - math.cos(turn * t))

    def air(t):
        return wings.onset(21.0 + 19.0 * math.cos(turn * t), angle(t), rates_B=(
            0.0, math.radians(56.5) * turn * math.sin(turn * t), 0.0))

    def attitude(t):
        c, s = math.cos(angle(t)), math.sin(angle(t))
        return wings.LEVEL @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])

    results = [r for _, _, r in wings.march(
        model, air, dt, round(period / dt), attitude_at=attitude)]
    force = np.array([r.force_G for r in results])
    assert np.isfinite(force).all() and all(r.status is Status.CONVERGED for r in results)
    # At most what an area of wing and tail with a resultant of 2.1 has at 40 m/s.
    most = 0.5 * wings.DENSITY * SPEED ** 2 * 2.1 * (12.0 + 2.24)
    assert np.linalg.norm(force, axis=1).max() < most
    assert np.linalg.norm(np.diff(force, axis=0), axis=1).max() < 0.02 * most

    def motion(t):   # u, v, w, p, q, r in B
        a = air(t)
        return np.concatenate([-a.velocity_G, a.rates_G]) * [-1, 1, -1, -1, 1, -1]

    beyond = 0
    for k, load in enumerate(force):
        t = k * dt
        leaving = air(t).at(model.quarter_arm)
        if np.arctan2(leaving[:, 2], leaving[:, 0]).min() < math.radians(75.0):
            continue
        speeding = (motion(t + 1e-5) - motion(t - 1e-5)) / 2e-5
        carried = -wings.DENSITY * (model.added_mass @ speeding)[:3] * [-1, 1, -1]
        # Backward differences of the second order: 1e-3 of the 260 N that the plates carry along.
        assert load == pytest.approx(strip_theory(model, foil, air(t)) + carried, abs=1.0)
        beyond += 1
    assert beyond > 150 and angle(0.5 * period) > math.radians(100.0)


def high_tail(height, foil):
    """Return wing and tail, the tail alone, and the wing: the tail never stalls."""
    plate = wings.potential()
    wing = wings.panel_wing(foil, [(0, 0, 0), (0, 6, 0)], [1, 1], 20, symmetric=True)
    tail = wings.panel_wing(plate, [(7.5, 0, height), (7.5, 1.675, height)], [0.67, 0.67], 6,
                            symmetric=True, name='tail')
    mass = MassProperties(100.0, (0.25, 0.0, 0.0), np.diag([100.0, 200.0, 250.0]))
    reference = Reference(12.0, 1.0, 12.0)
    return (Aircraft('both', (wing, tail), (foil, plate), reference, mass, ()),
            Aircraft('alone', (tail,), (plate,), reference, mass, ()))


def tail_angles(height, degrees, across_only):
    """
    Return the tail's mean operating angle, what the wing's horseshoes leave of it, and alone.

    The first after a march of 40 chords from rest; the second is the tail's by itself in the
    wash that is made here from the wing's circulation, or in its part across the chord only.
    """
    both, alone = high_tail(height, curves.airfoil('normal'))
    model, bare = build(both), build(alone)
    angles = []
    for degree in degrees:
        air = wings.onset(SPEED, math.radians(degree))
        *_, (_, _, result) = wings.march(model, wings.steadily(air), 0.25 / SPEED, 160,
                                         at_rest=True)
        wash = horseshoe_wash(model.lattice, result, air.velocity_G)
        if across_only:
            wash = wash * [0.0, 0.0, 1.0]
        washed = dataclasses.replace(air, velocity_G=air.velocity_G + wash)
        angles.append([result.strips.alpha[20:].mean()] + [
            solver.steady(bare, onset, np.zeros(0), density=wings.DENSITY).strips.alpha.mean()
            for onset in (washed, air)])
    return np.degrees(angles).T


def horseshoe_wash(lattice, result, velocity):
    """Return the mean velocity (3,) at the tail's three-quarter chord, vortices along the air."""
    place = lattice.quarter_chord[20:] + 0.5 * lattice.strip_chord[20:, None] * [1.0, 0.0, 0.0]
    half = 0.5 * lattice.strip_width[:20, None] * lattice.span_axis[:20]
    left, right = lattice.quarter_chord[:20] - half, lattice.quarter_chord[:20] + half
    away = 1e4 * velocity / np.linalg.norm(velocity)
    induced = np.zeros_like(place)
    for a, b, strength in zip(left, right, result.strips.circulation[:20]):
        for begin, end in ((a + away, a), (a, b), (b, b + away)):
            induced += exact.segment_velocity(place, begin, end, strength)
    return induced.mean(axis=0)


def test_tail_flies_in_the_wash_of_the_wing_and_the_wake_passes_a_high_one():
    """Alpha 0 to 40 deg: what the wing's horseshoes leave, and the wake that rises past stall."""
    degrees = np.arange(0.0, 41.0, 4.0)
    turn = {}
    for height in (0.0, 2.4, 4.2):
        tail, washed, alone = tail_angles(height, degrees, across_only=True)
        turn[height] = alone - tail
        # One wash for the whole tail, and vortices where the lattice has several along the chord.
        assert tail == pytest.approx(washed, abs=0.05 * turn[height].max())
    low, middle, high = turn.values()
    # In the wake's plane: more with lift, up to the stall at 15 deg; then the wing loses it.
    assert np.all(np.diff(low[:4]) > 0.0)
    assert low[5] < 0.7 * low[3]
    # The wake leaves the low tail below itself and comes up to the high ones.
    assert np.all(middle[:3] < low[:3]) and np.all(middle[6:] > low[6:])
    assert np.all(middle[7:] > 1.1 * low[7:])
    assert np.all(high[:5] < middle[:5]) and np.all(high[9:] > middle[9:])


@pytest.mark.xfail(strict=True, reason='open: the operating point takes of the wash the part '
                   'across the chord only, about cos^2 of the incidence')
def test_stalled_tail_feels_the_whole_turn_of_the_flow():
    """At 32 and 40 deg: to a tenth of the turn, as at 4 deg."""
    tail, washed, alone = tail_angles(2.4, [4.0, 32.0, 40.0], across_only=False)
    error = np.abs(tail - washed) / (alone - washed)
    assert error[0] < 0.1
    assert error[1:].max() < 0.1

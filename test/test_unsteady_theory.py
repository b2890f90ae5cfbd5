# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The march against theory: indicial, oscillating and gust lift, circulation, the steady limit.

At V dt = one panel the march is of second order in 1/M where the motion is smooth.
"""

import math
from dataclasses import replace

import exact
import numpy as np
import pytest
import wings
from wings import loads, steadily

from poststall_sim.aero import model as models
from poststall_sim.aero import wash
from poststall_sim.aero.kernels import ring_influence
from poststall_sim.aero.model import Settings, build

LONG = 2000.0
"""Aspect ratio of one strip that stands for two dimensions: tips matter as 1/LONG, 5e-4."""
PLATE = 2.0 * math.pi
SMALL = 1e-3
"""Amplitudes [rad] and gusts over airspeed: what is not linear is of the order of 1e-6."""


def chord(rows, wake_length, coarsen=False):
    """Return the model of a plate of chord 1 in two dimensions."""
    return build(wings.rectangular(LONG, 1), Settings(
        chordwise=rows, wake_length=wake_length, **{**wings.EXACTLY, 'coarsen': coarsen}))


def wagner_march(rows, s):
    """Return the share of the final lift at s after a sudden start."""
    lift = loads(chord(rows, 12.0), steadily(wings.onset(1.0, SMALL)), 1.0 / rows,
                 round(0.5 * rows * max(s)), 1.0, at_rest=True)[:, 2]
    return lift[np.round(0.5 * s * rows).astype(int)] / (PLATE * SMALL)


def test_lift_after_a_sudden_start_is_that_of_wagner():
    """From s = 0.5, the eighth step, to 0.5 % of the exact function, at the second order."""
    s = np.array([0.5, 1.0, 2.0, 4.0, 6.0, 10.0])
    reference = exact.wagner(s)
    coarse, fine = wagner_march(16, s), wagner_march(32, s)
    assert fine == pytest.approx(reference, rel=0.005)
    order = np.log2((coarse - reference) / (fine - reference))[:4]
    # Later the tips' share of 1/LONG is as large as the errors.
    assert order == pytest.approx(np.full(4, 2.0), abs=0.35)


def oscillating(rows, k, kind, per_panel=1):
    """
    Return the complex lift over 2 pi alpha of a plate in plunge (alpha hdot/V) or in pitch.

    Pitch is about the quarter chord. From the last of three periods; what the start leaves and
    what is lost behind 120 chords of wake is below 0.05 % of the lift together.
    """
    omega = 2.0 * k
    steps = round(2.0 * math.pi / omega * rows * per_panel)
    dt = 2.0 * math.pi / omega / steps

    def plunge(t):   # the body sinks: air from below
        return models.Onset(np.array([1.0, 0.0, SMALL * math.sin(omega * t)]), np.zeros(3))

    def pitch(t):
        return wings.onset(1.0, SMALL * math.sin(omega * t),
                           rates_B=(0.0, SMALL * omega * math.cos(omega * t), 0.0))

    def nose_up(t):
        angle = SMALL * math.sin(omega * t)
        c, s = math.cos(angle), math.sin(angle)
        return wings.LEVEL @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])

    model, options = chord(rows, 120.0, coarsen=True), {}
    if kind == 'pitch':
        options['attitude_at'] = nose_up
    lift = loads(model, pitch if kind == 'pitch' else plunge, dt, 3 * steps, 1.0,
                 **options)[-steps:, 2]
    t = dt * np.arange(2 * steps + 1, 3 * steps + 1)
    return 2j * np.mean(lift * np.exp(-1j * omega * t)) / (PLATE * SMALL)


def theodorsen(k, kind):
    """Return what `oscillating` should."""
    return exact.plunging_plate_lift(k) if kind == 'plunge' else exact.pitching_plate_lift(k, -0.5)


def within(lift, reference, share, degrees):
    """Tell whether amplitude and phase of a complex lift are those of a reference."""
    ratio = lift / reference
    return abs(abs(ratio) - 1.0) < share and abs(np.degrees(np.angle(ratio))) < degrees


@pytest.mark.parametrize('kind', ['plunge', 'pitch'])
@pytest.mark.parametrize('k', [0.1, 0.3, 0.5])
def test_oscillating_plate_has_the_lift_of_theodorsen(k, kind):
    """To 1 % and 0.5 deg with eight panels, to 1 % and 1 deg with the four that fly."""
    assert within(oscillating(8, k, kind), theodorsen(k, kind), 0.01, 0.5)
    assert within(oscillating(4, k, kind), theodorsen(k, kind), 0.01, 1.0)


@pytest.mark.parametrize('kind', ['plunge', 'pitch'])
def test_oscillating_plate_converges_with_panels_and_steps(kind):
    """Lift at k = 0.3, step and panel halved at once: errors fall as their square, nearly."""
    errors = np.array([abs(oscillating(rows, 0.3, kind) / theodorsen(0.3, kind) - 1.0)
                       for rows in (2, 4, 8)])
    orders = np.log2(errors[:-1] / errors[1:])
    print(kind, errors, orders)
    assert np.all(orders > 1.5)


def test_step_shorter_than_a_panel_costs_accuracy_but_not_much():
    """Half the step: the wake then starts half a row late, an error of the order of its root."""
    half = oscillating(8, 0.3, 'plunge', per_panel=2)
    assert abs(half) == pytest.approx(abs(theodorsen(0.3, 'plunge')), rel=0.06)


def entering(rows, s):
    """Return the share of the final lift at s after the leading edge met a sharp-edged gust."""
    ahead = wings.rectangular(LONG, 1).mass.cg_G[0]

    def air(t):
        def gust(arm):   # from below; as sharp as the lattice can tell: over one panel
            share = np.clip((t - ahead - arm[:, 0]) * rows + 0.5, 0.0, 1.0)
            return share[:, None] * np.array([0.0, 0.0, SMALL])
        return models.Onset(np.array([1.0, 0.0, 0.0]), np.zeros(3), gust)

    lift = loads(chord(rows, 12.0), air, 1.0 / rows, round(0.5 * rows * max(s)), 1.0)[:, 2]
    return lift[np.round(0.5 * s * rows).astype(int)] / (PLATE * SMALL)


def test_lift_on_entering_a_gust_is_that_of_kuessner():
    """To 2 % with 32 panels; second order but at s = 2, where the slope jumps."""
    s = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0])
    reference = exact.kuessner(s)
    coarse, fine = entering(16, s), entering(32, s)
    assert fine == pytest.approx(reference, rel=0.02)
    order = np.log2(((coarse - reference) / (fine - reference))[s >= 3.0])
    assert order == pytest.approx(np.full(4, 2.0), abs=0.2)


def impulsive(ratio, chords, per_chord, wake_length):
    """Return the lift coefficient of a start from rest at 5 deg, 4 x 13 panels, steady first."""
    model = build(wings.rectangular(ratio, 13), Settings(wake_length=wake_length, **wings.EXACTLY))
    alpha = math.radians(5.0)
    force = loads(model, steadily(wings.onset(1.0, alpha)), 1.0 / per_chord, chords * per_chord,
                  1.0, at_rest=True)
    return force[:, 2] * math.cos(alpha) - force[:, 0] * math.sin(alpha)


REFERENCE_LATTICE = {
    4: [0.309, 0.317, 0.325, 0.328, 0.330], 8: [0.364, 0.382, 0.400, 0.408, 0.413]}
"""Another lattice's lift at 1, 2, 4, 6, 9 chords in Katz & Plotkin's case, V dt = c/16."""


@pytest.mark.parametrize('ratio', [4, 8])
def test_impulsive_start_is_that_of_the_reference_lattice(ratio):
    """2 %. Both lattices shed four rows a panel and are above the converged lift at first."""
    lift = impulsive(ratio, 9, 16, 12.0)[[16, 32, 64, 96, 144]]
    assert lift == pytest.approx(REFERENCE_LATTICE[ratio], rel=0.02)


@pytest.mark.parametrize('ratio', [4, 8])
def test_gap_to_the_steady_lift_closes_with_the_square_of_the_distance(ratio):
    """A starting vortex far behind is a dipole: its wash, and so the gap, falls as 1/x^2."""
    lift = impulsive(ratio, 80, 4, 100.0)
    gap = lift[0] - lift[[80, 160, 320]]   # 20, 40 and 80 chords behind
    assert np.all(gap > 0.0)
    slope = np.log2(gap[:-1] / gap[1:])
    # Spans over the distance, or chords, are the next term: the slope's own error halves.
    assert slope[1] == pytest.approx(2.0, abs=0.15)
    assert abs(slope[1] - 2.0) < 0.75 * abs(slope[0] - 2.0)
    end = lift[320] + (lift[320] - lift[160]) / 3.0
    assert end == pytest.approx(lift[0], rel=3e-5)


ALONE, TAILED = 'wing alone', 'wing and tail'


@pytest.mark.parametrize('alpha', [0.07, 0.35])
@pytest.mark.parametrize('which', [ALONE, TAILED])
def test_march_from_the_steady_wake_stays_where_it_starts(which, alpha):
    """Attached and stalled: round-off alone, which the guards against 0/0 make 1e-9."""
    machine, speed, arm = (wings.rectangular(8, 12), 1.0, 1.0) if which == ALONE else (
        wings.wing_tail(), 40.0, 7.25)
    model = build(machine, Settings(tolerance=1e-9, **wings.EXACTLY))
    march = loads(model, steadily(wings.onset(speed, alpha)), 0.25 / speed, 40, speed)
    change = np.abs(march - march[0]).max(axis=0)
    # The tail's force acts at 7.25 chords from the centre of gravity.
    assert change[:3].max() < 1e-9 and change[3:].max() < 1e-9 * arm


def drag_near_and_far(model, result, alpha):
    """Return induced drag from the force, and from circulation in the Trefftz plane [N]."""
    circulation, edge = result.strips.circulation, model.lattice.wake_nodes[:, 1]
    trailing = np.diff(circulation, prepend=0.0, append=0.0)
    middle = 0.5 * (edge[1:] + edge[:-1])
    wash = (trailing / (middle[:, None] - edge[None, :])).sum(axis=1) / (2.0 * math.pi)
    far = 0.5 * wings.DENSITY * circulation @ (wash * np.diff(edge))
    x, _, z = result.force_G
    return x * math.cos(alpha) + z * math.sin(alpha), abs(far)


@pytest.mark.parametrize(('ratio', 'rows', 'cosine'), [(8, 1, False), (8, 4, True), (4, 4, False)])
def test_induced_drag_of_near_and_far_field_are_the_same_after_a_march(ratio, rows, cosine):
    """Joukowski on the rings against the Trefftz plane, from rest to 40 chords: to 1 %."""
    model = build(wings.rectangular(ratio, 20, cosine=cosine),
                  Settings(chordwise=rows, decambering=False))
    for alpha in (0.05, 0.2):
        *_, (_, _, result) = wings.march(
            model, steadily(wings.onset(1.0, alpha)), 1.0 / rows, 40 * rows, at_rest=True)
        near, far = drag_near_and_far(model, result, alpha)
        assert near == pytest.approx(far, rel=0.01)


def swept_gap(sweep, strips, rows, cosine=False):
    """Return induced drag of near over far field, less 1, of a wing swept by an angle [rad]."""
    model = build(wings.rectangular(8, strips, sweep=sweep, cosine=cosine),
                  Settings(chordwise=rows, decambering=False))
    near, far = drag_near_and_far(model, wings.steady(model, 1.0, 0.1), 0.1)
    return near / far - 1.0


@pytest.mark.parametrize('cosine', [False, True])
@pytest.mark.parametrize(('strips', 'rows'), [(20, 2), (40, 1), (40, 4), (80, 4), (80, 8)])
@pytest.mark.parametrize('sweep', [0.25, -0.25])
def test_induced_drag_of_a_swept_wing_in_near_and_far_field(sweep, strips, rows, cosine):
    """
    14 deg back and forward: to 1 %, as of a straight wing.

    Of the middles alone it is 1 to 5 % off on even strips, 2 to 11 % in cosine spacing. Strips
    much wider than rows are left: forward, 40 x 8 in cosine spacing has 1.2 %.
    """
    assert abs(swept_gap(sweep, strips, rows, cosine)) < 0.01


def test_induced_drag_of_a_highly_swept_wing_converges_with_the_strips():
    """
    29 deg, 4 panels: 1.4 % on 40 strips, of the first order in their width.

    But for 0.1 % of the last rings' sides, whose load ends at the trailing edge.
    """
    gaps = np.array([swept_gap(0.5, strips, 4) for strips in (40, 80, 160)])
    assert abs(gaps[0]) < 0.015 and abs(gaps[1]) < 0.01
    assert np.log2((gaps[0] - gaps[1]) / (gaps[1] - gaps[2])) == pytest.approx(1.0, abs=0.2)


def changing(rows, coarsen):
    """Return model, steps of a march whose incidence comes and goes, and what its edge had."""
    model = build(wings.rectangular(4, 5), Settings(
        chordwise=rows, wake_length=12.0, **{**wings.EXACTLY, 'coarsen': coarsen}))
    steps = list(wings.march(model, lambda t: wings.onset(1.0, 0.1 * math.sin(2.0 * t)),
                             1.0 / rows, 9 * rows, at_rest=True))
    return model, steps, [r.circulation[model.lattice.te_panel] for _, _, r in steps[1:]]


@pytest.mark.parametrize('coarsen', [False, True])
def test_each_row_carries_what_the_trailing_edge_had_when_it_was_shed(coarsen):
    """Every row, the oldest too; the row of the start is older than any circulation."""
    _, steps, at_edge = changing(4, coarsen)
    rows = steps[-1][1].wake.circulation
    # The newest row is of the step before the last.
    assert np.array_equal(rows[:35], at_edge[-2::-1])
    assert np.all(rows[36:] == 0.0)
    assert np.ptp(rows[:35]) > 0.1 * np.abs(rows).max()   # and they differ


@pytest.mark.parametrize('coarsen', [False, True])
def test_circulation_around_a_path_through_wing_and_wake(coarsen):
    """Stokes: around all that is ahead of a cut, the circulation of the ring that is cut."""
    model, steps, _ = changing(4, coarsen)
    placement, flow, result = steps[-1]
    lattice, wake = model.lattice, flow.wake
    nodes = placement.to_geometry(wake.nodes_N)
    length, distance = np.empty(wake.rows), np.empty(wake.rows + 1)
    wash.lengths(nodes, length)
    wash.distances(nodes, model.felt.box[0], distance)
    marks = np.empty(wake.rows + 2, dtype=np.int64)
    marks = marks[:wash.ladder(length, distance, coarsen, marks) + 1]
    assert (len(marks) == wake.rows + 1) is not coarsen
    grouped = [np.average(wake.circulation[a:b, 2], weights=length[a:b])
               for a, b in zip(marks, marks[1:])]
    nodes = nodes[marks, 2, 0]
    bound = result.circulation.reshape(4, 5)[:, 2]

    def velocity(points):
        out = np.empty((len(points), lattice.panels, 3))
        ring_influence(points, np.ascontiguousarray(lattice.ring_corners),
                       np.zeros(out.shape[:2]), out)
        # Felt at the path, in the groups of rows in which the wing feels its wake.
        n, bounds = len(points), model.felt.bounds.copy()
        bounds[0, 4] = bounds[1, 2] = n
        own, _ = wash.velocity(
            wake, lattice, replace(model.felt, points=points, rounded=points, bounds=bounds,
                                   weights=(np.empty((n, 0)),)), placement, coarsen)
        return np.einsum('ijk,j->ik', out, result.circulation) + own[:, :3]

    place, weight = np.polynomial.legendre.leggauss(40)
    front = lattice.ring_corners.reshape(4, 5, 4, 3)[:, 2, 0, 0]
    # A filament's core of 1e-5 chords shows at 1/8 chord, where the path passes the newest rows.
    cuts = [(front[row] + 0.125, bound[row], 1e-10 if row < 3 else 1e-9) for row in range(4)]
    cuts += [(nodes[i:i + 2].mean(), grouped[i], 1e-10 if i > 0 else 1e-9)
             for i in (0, 5, 15, 18, 20)]
    for cut, enclosed, most in cuts:
        path = np.array([[-2, 0, -4], [-2, 0, 4], [cut, 0, 4], [cut, 0, -4.0]])
        around = 0.0
        for a, b in zip(path, np.roll(path, -1, axis=0)):
            for begin in a + (b - a) * np.arange(48)[:, None] / 48.0:
                points = begin + (b - a) / 96.0 * (1.0 + place[:, None])
                around += weight @ (velocity(points) @ (b - a)) / 96.0
        # Gauss of order 40 on pieces of a sixth of a chord has no error left.
        assert around == pytest.approx(enclosed, abs=most)

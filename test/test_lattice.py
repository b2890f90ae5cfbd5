# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Aircraft to lattice: areas, orders, signs, what controls turn, and the added mass."""

import math

import exact
import numpy as np
import pytest
import wings

from poststall_sim.aero import lattice as lattices
from poststall_sim.aero.model import Settings, build
from poststall_sim.aero.plate import flap_effectiveness, flat_plate_share, plate_vortices
from poststall_sim.aircraft import ConfigError
from poststall_sim.controls import Control, Effector

FOIL = wings.potential()


def lattice_of(*surfaces, rows=4, controls=()):
    """Return the lattice of surfaces, reference lengths of no consequence."""
    machine = wings.aircraft(surfaces, FOIL, area=1.0, chord=1.0, span=1.0, controls=controls)
    return lattices.build(machine, rows)


def tapered(strips=10, **options):
    """Return a swept, tapered wing with a kink at 40 % of its half span of 5."""
    return wings.panel_wing(
        FOIL, [(0, 0, 0), (0.5, 2, 0.1), (2, 5, 0.6)], [2, 1.5, 0.5], strips, symmetric=True,
        **options)


def fin(strips=4):
    """Return a fin of 1.2 in height, drawn from its root up."""
    return wings.panel_wing(FOIL, [(6, 0, 0.2), (6.3, 0, 1.4)], [1, 0.7], strips, name='fin')


def test_panels_add_up_to_the_area_of_the_surface():
    """Planar trapezoids: area = mean chord x length in the y-z plane, at any cut and twist."""
    inner, outer = math.hypot(2.0, 0.1), math.hypot(3.0, 0.5)
    area = 2.0 * (1.75 * inner + 1.0 * outer)
    for rows, options in ((1, {}), (4, {}), (7, {'cosine': True})):
        flat = lattice_of(tapered(**options), rows=rows)
        assert flat.area.sum() == pytest.approx(area, rel=1e-12)
        # A strip's area is its chord normal to the span axis times its width along it.
        by_strip = np.bincount(flat.panel_strip, flat.area)
        assert flat.strip_chord * flat.strip_width == pytest.approx(by_strip, rel=1e-12)
    # Constant twist turns a straight surface as a whole.
    twisted = lattice_of(wings.panel_wing(
        FOIL, [(0, 0, 0), (0, 5, 0)], [1, 1], 10, symmetric=True, twist=0.1))
    assert twisted.area.sum() == pytest.approx(10.0, rel=1e-12)


def test_strips_run_from_left_to_right_and_a_fin_upwards():
    """The order of every result: port tip first, starboard tip last, then the next surface."""
    both = lattice_of(tapered(10), fin(4))
    wing, tall = (grid.strips for grid in both.grids)
    assert (wing, tall) == (slice(0, 10), slice(10, 14))
    y = both.quarter_chord[wing, 1]
    assert np.all(np.diff(y) > 0.0) and y == pytest.approx(-y[::-1], abs=1e-12)
    assert np.all(np.diff(both.quarter_chord[tall, 2]) > 0.0)
    assert both.strip_names[0] == 'wing_1' and both.strip_names[9] == 'wing_10'
    assert both.strip_names[10:] == ('fin_1', 'fin_2', 'fin_3', 'fin_4')
    # Panels: rows from the leading edge, each along the strips; the last row sheds the wake.
    assert np.array_equal(both.panel_strip[both.te_panel], np.arange(14))
    x = both.collocation[both.grids[0].panels, 0].reshape(4, 10)
    assert np.all(np.diff(x, axis=0) > 0.0)


def test_axes_of_strips_are_right_handed_and_suction_is_up_or_to_port():
    """Chord aft, span left to right, normal = chord x span; a fin's normal points to port."""
    both = lattice_of(tapered(10), fin(4))
    axes = np.stack([both.chord_axis, both.span_axis, both.strip_normal], axis=1)
    assert axes @ axes.transpose(0, 2, 1) == pytest.approx(
        np.broadcast_to(np.eye(3), (14, 3, 3)), abs=1e-14)
    assert np.linalg.det(axes) == pytest.approx(np.ones(14), abs=1e-14)
    assert np.all(both.normal[:40, 2] > 0.9) and np.all(both.normal[40:, 1] < -0.999)
    # Dihedral leans both halves' normals inwards; twist nose-up leans them aft.
    starboard = both.collocation[:40, 1] > 0.0
    assert np.all(both.normal[:40, 1][starboard] < -0.04)
    assert np.all(both.normal[:40, 1][~starboard] > 0.04)
    twisted = lattice_of(wings.panel_wing(
        FOIL, [(0, -2, 0), (0, 2, 0)], [1, 1], 4, twist=math.radians(5.0)))
    expected = [math.sin(math.radians(5.0)), 0.0, math.cos(math.radians(5.0))]
    assert twisted.normal == pytest.approx(np.tile(expected, (16, 1)), abs=1e-13)
    assert twisted.tangent == pytest.approx(
        np.tile([expected[2], 0.0, -expected[0]], (16, 1)), abs=1e-13)


def test_rings_and_collocation_points_stand_at_quarters_of_the_panels():
    """Front of a ring at 1/4, collocation at 3/4, the wake 1/4 panel behind the edge."""
    plate = lattice_of(wings.panel_wing(FOIL, [(0, -1, 0), (0, 1, 0)], [1, 1], 2), rows=4)
    front = plate.ring_corners[:, 0, 0].reshape(4, 2)
    assert front == pytest.approx(np.repeat((np.arange(4) + 0.25) / 4, 2).reshape(4, 2))
    assert plate.collocation[:, 0].reshape(4, 2) == pytest.approx(front + 0.125)
    assert plate.wake_nodes[:, 0] == pytest.approx(1.0 + 0.25 / 4)
    assert plate.wake_nodes[:, 1] == pytest.approx([-1.0, 0.0, 1.0])
    # Every edge appears once, with the rings on both sides: (M + 1) N across, M (N + 1) along.
    assert len(plate.edge_vector) == 5 * 2 + 4 * 3
    assert (plate.edge_wake >= 0).sum() == 2
    used = np.concatenate([plate.edge_plus, plate.edge_minus])
    assert np.array_equal(np.bincount(used[used >= 0]), np.full(8, 4))   # four sides a ring


def test_a_strip_edge_stands_on_every_kink_and_both_sides_are_cut_alike():
    """No strip straddles a section, with uniform and with cosine spacing."""
    for cosine in (False, True):
        for strips in (4, 10, 22):
            flat = lattice_of(tapered(strips, cosine=cosine))
            y = flat.wake_nodes[:, 1]
            assert len(y) == strips + 1
            for kink in (-5.0, -2.0, 0.0, 2.0, 5.0):
                assert np.abs(y - kink).min() < 1e-12, (cosine, strips, kink)
            assert np.all(np.diff(y) > 0.0)
            assert flat.wake_nodes[::-1] * [1, -1, 1] == pytest.approx(flat.wake_nodes, abs=1e-12)


def test_cosine_spacing_crowds_strips_towards_the_tips():
    """Edges at (b/2) cos of equal angles."""
    plate = lattice_of(
        wings.panel_wing(FOIL, [(0, -3, 0), (0, 3, 0)], [1, 1], 12, cosine=True))
    expected = -3.0 * np.cos(np.pi * np.arange(13) / 12)
    assert plate.wake_nodes[:, 1] == pytest.approx(expected, abs=1e-12)


def test_place_along_the_span_counts_the_true_length():
    """Averaging needs distances along the surface: of a fin and of a wing with dihedral, too."""
    both = lattice_of(tapered(10), fin(4))
    for grid in both.grids:
        steps = np.linalg.norm(np.diff(both.quarter_chord[grid.strips], axis=0), axis=1)
        place = np.diff(both.span_place[grid.strips])
        straight = np.ones(len(steps), dtype=bool)
        if grid.name == 'wing':
            straight[[4]] = False   # across the root, around the corner of the dihedral
        # Neighbours on either side of the kink are apart along two sides of a triangle.
        assert place[straight] == pytest.approx(steps[straight], rel=0.05)
        assert np.all(place >= steps - 1e-12)


def test_flat_plate_lattice_carries_the_circulation_of_a_plate_with_any_number_of_rows():
    """James' theorem: vortices at 1/4, points at 3/4 of equal panels give pi c V exactly."""
    for rows in (1, 2, 5, 16):
        vortices = plate_vortices(np.ones(rows))
        assert vortices.sum() == pytest.approx(math.pi, rel=1e-12)
        share = flat_plate_share(rows)
        assert share[-1] == pytest.approx(1.0, abs=1e-14) and np.all(np.diff(share) > 0.0)
    # The plate's own, G(x)/G = (2/pi) (asin sqrt x + sqrt(x (1 - x))), half-way between two
    # vortices. It ends at the trailing edge with 1 - x to the power 3/2, and so does the error.
    errors = []
    for rows in (32, 64, 128):
        x = (np.arange(rows) + 0.75) / rows
        plate = (2.0 / math.pi) * (np.arcsin(np.sqrt(x)) + np.sqrt(x * (1.0 - x)))
        errors.append(np.abs(flat_plate_share(rows) - plate)[rows // 4:].max())
    assert errors[0] < 5e-4
    order = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert order == pytest.approx([1.5, 1.5], abs=0.03)


def test_flap_effectiveness_tends_to_thin_airfoil_theory():
    """The lattice's own value is first order in 1/M; the hinge may cut a panel."""
    for hinge in (0.25, 0.5, 0.75, 0.9):
        errors = [flap_effectiveness(rows, hinge) - exact.flap_effectiveness(hinge)
                  for rows in (80, 160, 320)]
        order = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
        assert order == pytest.approx([1.0, 1.0], abs=0.02)
        assert abs(2.0 * errors[2] - errors[1]) < 3e-5   # extrapolated
    # Whole panels behind 3/4 (or 4/5) of the chord, as published with the method: two digits.
    for rows, hinge, value in ((4, 0.75, 0.55), (8, 0.75, 0.58), (10, 0.8, 0.52),
                               (20, 0.75, 0.60)):
        assert flap_effectiveness(rows, hinge) == pytest.approx(value, abs=0.005)
    assert flap_effectiveness(4, 0.0) == pytest.approx(1.0, abs=1e-15)   # all-moving
    steps = [flap_effectiveness(4, hinge) for hinge in np.linspace(0.0, 0.99, 100)]
    assert np.all(np.diff(steps) < 0.0)   # a cut panel counts by its part


def control(*effectors):
    """Return a control of the effectors."""
    return Control('flap', (-0.5, 0.5), effectors)


def covered(flat, hinge=0.75):
    """Return the share of each strip that the only control covers, from what it shifts."""
    return (flat.mixing.T @ flat.shift)[0] / flap_effectiveness(flat.grids[0].rows, hinge)


def hinge_turn(hinge, leading, chords, length):
    """
    Return what a turn about the hinge of a trapezoid is about its quarter chord's direction.

    Of strips, by what washes alike along the chord: the cosine of the hinge's sweep over that of
    the quarter chord's; and of panels: the cosine of the angle between the two lines.
    """
    hinge, quarter = (math.atan2(leading[1] - leading[0] + share * (chords[1] - chords[0]), length)
                      for share in (hinge, 0.25))
    return math.cos(hinge) / math.cos(quarter), math.cos(hinge - quarter)


def test_control_turns_strips_by_the_share_that_it_covers():
    """The turn of all strips times their width is the effector's length, however they are cut."""
    for strips, low, high in ((10, 0.6, 1.0), (10, 0.33, 0.71), (6, 0.0, 0.2), (22, 0.1, 0.9)):
        # A hinge along the quarter chord, about which strips turn: see the next tests for others.
        flat = lattice_of(tapered(strips), controls=[control(
            Effector('wing', (low, high), hinge=0.25))])
        share = covered(flat, 0.25)
        assert np.all((share >= 0.0) & (share <= 1.0 + 1e-12))
        # Lengths in the y-z plane, where spans are counted.
        nodes = flat.wake_nodes[:, 1:]
        half = math.hypot(2.0, 0.1) + math.hypot(3.0, 0.5)
        plane = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
        assert share @ plane == pytest.approx(2.0 * (high - low) * half, rel=1e-9)
        assert share == pytest.approx(share[::-1], abs=1e-12)   # both sides


def test_side_and_gain_of_an_effector_pick_strips_and_sign():
    """Ailerons: the right one trailing edge up, the left one down, nothing between."""
    flat = lattice_of(tapered(10), controls=[control(
        Effector('wing', (0.6, 1.0), side=1, gain=-1.0),
        Effector('wing', (0.6, 1.0), side=-1, gain=0.5))])
    share = covered(flat)
    ratio, own = hinge_turn(0.75, (0.5, 2.0), (1.5, 0.5), math.hypot(3.0, 0.5))
    assert share[:2] == pytest.approx(0.5 * ratio) and share[-2:] == pytest.approx(-ratio)
    assert np.all(share[3:7] == 0.0)
    # Hinge at 3/4 of four rows: the last row turns whole, the others not at all.
    turn = (flat.mixing.T @ flat.turn)[0].reshape(4, 10)
    assert np.all(turn[:3] == 0.0)
    assert turn[3] == pytest.approx(share * own / ratio)


def test_panel_cut_by_the_hinge_turns_by_its_part_behind_it():
    """Hinge at 0.6 of four rows: 2/5 of the third panel lie ahead, so it turns by 3/5."""
    flat = lattice_of(fin(), controls=[Control('rudder', (-0.4, 0.4), (
        Effector('fin', hinge=0.6),))])
    turn = (flat.mixing.T @ flat.turn)[0].reshape(4, 4)
    # Trailing edge left is towards the fin's normal, so its turn is nose-down: negative.
    expected = -np.array([0.0, 0.0, 0.6, 1.0]) * hinge_turn(0.6, (6.0, 6.3), (1.0, 0.7), 1.2)[1]
    assert turn == pytest.approx(np.tile(expected[:, None], (1, 4)), abs=1e-12)


def test_control_without_effect_is_refused():
    """Two effectors that cancel everywhere would make a control that does nothing."""
    for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)):
        with pytest.raises(ConfigError, match='flap_right: its span of surface wing, 0.5 to 1, is '
                           'too short to turn, or its hinge_axis crosses the span'):
            lattice_of(wings.panel_wing(FOIL, [(0, 0, 0), (0, 5, 0)], [1, 1], 10, symmetric=True),
                       controls=[control(Effector('wing', (0.5, 1.0), hinge_axis=axis))])
    with pytest.raises(ConfigError, match='control flap: its effectors cancel'):
        lattice_of(tapered(), controls=[control(
            Effector('wing', gain=1.0), Effector('wing', gain=-1.0))])


def test_part_without_width_is_refused():
    """It would float at 0/0, whatever else the control moves."""
    with pytest.raises(ConfigError, match='span of surface wing, 0 to 1e-300, is too short'):
        lattice_of(tapered(), controls=[control(
            Effector('wing', span=(0.5, 1.0)), Effector('wing', span=(0.0, 1e-300)))])


def added_mass(aspect_ratio, rows, strips, cg=0.5):
    """Return the added mass (6, 6) per density of a rectangular plate of chord 1."""
    machine = wings.rectangular(aspect_ratio, strips, cg_G=(cg, 0.0, 0.0))
    return build(machine, Settings(chordwise=rows)).added_mass


def test_added_mass_of_a_long_plate_is_that_of_strip_theory():
    """
    In heave pi rho c^2/4, in pitch about midchord pi rho c^4/128 per span.

    The lattice has (1 + 1/M) times the first: rings reach a quarter panel behind the plate.
    """
    ratio, n = 1000.0, 15
    coarse, fine = added_mass(ratio, 8, n), added_mass(ratio, 16, n)
    heave = math.pi / 4.0 * ratio
    # Two-dimensional to 1e-5; the tips of a plate of aspect ratio 1000 miss a chord's part.
    assert coarse[2, 2] / heave == pytest.approx(1.0 + 1.0 / 8.0, abs=2e-5)
    assert fine[2, 2] / heave == pytest.approx(1.0 + 1.0 / 16.0, abs=2e-5)
    # In roll each strip moves as a whole: sum y_j^2 = b^2/12 (1 - 1/N^2). Tips as above.
    roll = heave * ratio ** 2 / 12.0 * (1.0 - 1.0 / n ** 2)
    assert fine[3, 3] / roll == pytest.approx(1.0 + 1.0 / 16.0, rel=1e-3)
    # Pitch is first order in 1/M as well, and about midchord not coupled with heave.
    pitch = math.pi / 128.0 * ratio
    extrapolated = 2.0 * fine - coarse
    assert extrapolated[4, 4] == pytest.approx(pitch, rel=0.01)
    assert abs(extrapolated[2, 4]) < 0.002 * heave


def test_added_mass_is_symmetric_positive_and_blind_to_motion_in_the_plane():
    """A kinetic energy: of the impulse normal to a flat plate, and of nothing else."""
    mass = added_mass(4.0, 4, 8)
    assert np.abs(mass[[0, 1, 5]]).max() < 1e-12
    assert np.abs(mass - mass.T).max() < 1e-12 * mass[3, 3]
    assert np.linalg.eigvalsh(0.5 * (mass + mass.T)).min() > -1e-12 * mass[3, 3]
    # A fin resists in y and, far behind the centre of gravity, in yaw: nose right, air left.
    machine = wings.aircraft([fin()], FOIL, area=1.0, chord=1.0, span=1.0)
    tall = build(machine).added_mass
    assert tall[1, 1] > 0.0 and tall[5, 5] > 30.0 * tall[1, 1] > 0.0
    assert tall[1, 5] < 0.0 and abs(tall[2, 2]) < 1e-3 * tall[1, 1]


@pytest.mark.parametrize(('ratio', 'published'), [(1, 0.5790), (2, 0.7568)])
def test_added_mass_of_a_rectangular_plate_is_the_published_one(ratio, published):
    """Meyerhoff, J. Ship Research 14 (1970): share of strip theory, in motion normal to it."""
    shares = [added_mass(ratio, n, n)[2, 2] / (math.pi / 4.0 * ratio) for n in (12, 24)]
    # First order in both directions; what is left after extrapolation is of second, 0.1 %.
    assert 2.0 * shares[1] - shares[0] == pytest.approx(published, rel=0.002)


def test_kinks_crowded_at_the_tip_get_an_edge_each():
    """Six stations, four of them in the outer tenth, on five strips a side: just enough."""
    places = [(0, 0, 0), (0, 1.0, 0), (0, 1.5, 0), (0, 1.52, 0), (0, 1.54, 0), (0, 1.6, 0)]
    surface = wings.panel_wing(FOIL, places, [0.4] * 6, 10, symmetric=True)
    lattice = lattice_of(surface)
    edges = np.unique(np.round(np.abs(lattice.wake_nodes[:, 1]), 9))
    assert edges == pytest.approx([y for _, y, _ in places], abs=1e-9)


@pytest.mark.parametrize('surfaces, message', [
    ([wings.panel_wing(FOIL, [(0, 0, 0), (0, 5, 0)], [1, 1], 10, symmetric=True),
      wings.panel_wing(FOIL, [(0.4, 0, 0.005), (0.4, 2, 0.005)], [0.5, 0.5], 4, symmetric=True,
                       name='tail')],
     'surfaces .* and .* lie in each other'),
    ([wings.panel_wing(FOIL, [(0, 0, 0), (0, 1e-5, 1)], [1, 1], 4, symmetric=True)],
     'the two sides of surface wing lie in each other'),
    ([wings.panel_wing(FOIL, [(0, 0, 0), (0, 1e-3, 0)], [1, 1], 4, symmetric=True)],
     'strip wing_1 is 5.0e-04 of its chord wide, it needs at least 0.001'),
])
def test_surfaces_that_lie_in_each_other_or_have_no_width_are_refused(surfaces, message):
    machine = wings.aircraft(surfaces, FOIL, area=1.0, chord=1.0, span=1.0)
    with pytest.raises(ConfigError, match=message):
        build(machine)

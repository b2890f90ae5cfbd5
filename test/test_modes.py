# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Modes have the names and numbers of the textbooks, whatever a solver does to their order."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from poststall_sim.stability import modes
from poststall_sim.stability.modes import LATERAL, LONGITUDINAL

# The Navion of Nelson, Flight Stability and Automatic Control, in ft and s, at 176 ft/s.
SPEED = 176.0
SIZE = {'airspeed': SPEED, 'span': 33.4, 'chord': 5.7}
NAVION_LONGITUDINAL = np.array([
    [-0.045, 0.036, 0.0, -32.2], [-0.369, -2.02, 176.0, 0.0],
    [0.0019, -0.0396, -2.948, 0.0], [0.0, 0.0, 1.0, 0.0]])
# Of (beta, p, r, phi).
NAVION_LATERAL = np.array([
    [-0.254, 0.0, -1.0, 0.182], [-16.02, -8.40, 2.19, 0.0],
    [4.488, -0.350, -0.760, 0.0], [0.0, 1.0, 0.0, 0.0]])
CLASSICAL = ['short period', 'phugoid', 'Dutch roll', 'roll', 'spiral']


def navion(coupling=0.0):
    """Return the whole matrix (9, 9), heading last; coupling of v with w and of p with u."""
    matrix = np.zeros((9, 9))
    matrix[np.ix_(LONGITUDINAL, LONGITUDINAL)] = NAVION_LONGITUDINAL
    sideways = np.array([SPEED, 1.0, 1.0, 1.0])   # v = beta V
    matrix[np.ix_(LATERAL, LATERAL)] = NAVION_LATERAL * sideways[:, None] / sideways
    matrix[8, 5] = 1.0
    matrix[1, 2], matrix[2, 1] = coupling, -coupling
    return matrix


def named(matrix, **options):
    return modes.classify(*np.linalg.eig(matrix), **SIZE, **options)


def made(*described):
    """Return classified modes of a body from (eigenvalue, state to share of the shape)."""
    units = np.array([SPEED] * 3 + [2.0 * SPEED / SIZE['span'], 2.0 * SPEED / SIZE['chord'],
                                    2.0 * SPEED / SIZE['span'], 1.0, 1.0, 1.0])
    values, vectors = [], []
    for value, shape in described:
        vector = np.zeros(9, dtype=complex)
        for state, share in shape.items():
            vector['u v w p q r phi theta psi'.split().index(state)] = share
        values += [value] if np.imag(value) == 0.0 else [value, np.conj(value)]
        vectors += [vector * units] if np.imag(value) == 0.0 else [
            vector * units, vector.conj() * units]
    return modes.classify(np.array(values), np.array(vectors).T, **SIZE)


def names(found):
    return [mode.name for mode in found]


def test_navion_has_the_roots_of_the_book():
    found = named(navion())
    assert names(found) == CLASSICAL
    short_period, phugoid, dutch_roll, roll, spiral = (mode.eigenvalue for mode in found)
    # Half a unit of the last digit printed.
    assert short_period == pytest.approx(-2.4895 + 2.5978j, abs=0.8e-4)
    assert phugoid == pytest.approx(-0.0170 + 0.2135j, abs=0.8e-4)
    assert dutch_roll == pytest.approx(-0.4862 + 2.3336j, abs=0.8e-4)
    assert roll == pytest.approx(-8.433, abs=0.5e-3)
    assert spiral == pytest.approx(-0.0089, abs=0.5e-4)


def test_longitudinal_and_lateral_motion_may_come_alone():
    matrix = navion()
    for states, expected in ((LONGITUDINAL, CLASSICAL[:2]), (LATERAL, CLASSICAL[2:])):
        values, some = np.linalg.eig(matrix[np.ix_(states, states)])
        vectors = np.zeros((9, 4), dtype=complex)
        vectors[list(states)] = some
        assert names(modes.classify(values, vectors, **SIZE)) == expected


def test_numbers_of_a_mode_are_those_of_its_exponential():
    short_period, *_, roll, spiral = named(navion())
    assert short_period.natural_frequency == pytest.approx(3.598, abs=1e-3)
    assert short_period.damping_ratio == pytest.approx(2.4895 / 3.598, abs=1e-4)
    time = short_period.time_to_half_or_double
    assert abs(np.exp(short_period.eigenvalue * time)) == pytest.approx(0.5, rel=1e-12)
    turned = np.exp(1j * short_period.eigenvalue.imag * short_period.period)
    assert turned == pytest.approx(1.0, abs=1e-12)
    assert short_period.stable and short_period.oscillates
    assert roll.period == math.inf and roll.damping_ratio == 1.0 and not roll.oscillates
    growing, = made((0.35, {'p': 1.0}))
    assert not growing.stable and growing.damping_ratio == -1.0
    assert np.exp(0.35 * growing.time_to_half_or_double) == pytest.approx(2.0, rel=1e-12)
    still, = made((0.0, {'p': 1.0}))
    assert still.time_to_half_or_double == math.inf and math.isnan(still.damping_ratio)


def test_vectors_are_eigenvectors_and_shares_add_up():
    matrix = navion()
    for mode in named(matrix):
        assert matrix @ mode.vector == pytest.approx(
            mode.eigenvalue * mode.vector, abs=1e-11 * np.abs(mode.vector).max())
        assert mode.participation.sum() == pytest.approx(1.0, abs=1e-12)
        assert mode.participation[8] == 0.0
        assert mode.vector[:3] == pytest.approx(mode.shape[:3] * SPEED)
        assert mode.vector[4] == pytest.approx(mode.shape[4] * 2.0 * SPEED / SIZE['chord'])
        with pytest.raises(ValueError, match='read-only'):
            mode.vector[0] = 0.0
    phugoid, roll = named(matrix)[1], named(matrix)[3]
    assert np.argsort(phugoid.participation)[-2:].tolist() in ([0, 7], [7, 0])
    assert set(np.argsort(roll.participation)[-2:]) == {3, 6}


@settings(max_examples=60, deadline=None)
@given(order=st.permutations(range(9)),
       size=st.lists(st.floats(1e-6, 1e6), min_size=9, max_size=9),
       phase=st.lists(st.floats(-math.pi, math.pi), min_size=9, max_size=9))
def test_order_length_and_phase_of_the_vectors_do_not_matter(order, size, phase):
    values, vectors = np.linalg.eig(navion(coupling=0.3))
    factors = np.array(size) * np.exp(1j * np.array(phase))
    expected = modes.classify(values, vectors, **SIZE)
    found = modes.classify(values[order], (vectors * factors)[:, order], **SIZE)
    assert names(found) == names(expected)
    for mode, same in zip(found, expected):
        assert mode.eigenvalue == same.eigenvalue
        assert mode.shape == pytest.approx(same.shape, abs=1e-12 * np.abs(same.shape).max())


def test_one_of_each_pair_is_kept():
    found = named(navion())
    assert all(mode.eigenvalue.imag >= 0.0 for mode in found)
    values, vectors = np.linalg.eig(navion())
    upper = values.imag >= 0.0
    assert names(modes.classify(values[upper], vectors[:, upper], **SIZE)) == CLASSICAL
    # What round-off leaves of a real root's imaginary part is no oscillation.
    nudged = np.where(values.imag == 0.0, values * (1.0 + 1e-14j), values)
    assert names(modes.classify(nudged, vectors, **SIZE)) == CLASSICAL


@pytest.mark.parametrize('target', [1e-2, 1e-3, 1e-4, -1e-4, -1e-3])
def test_the_heading_is_dropped_and_a_slow_spiral_is_not(target):
    """Yaw damping brings the spiral near 0, where it is nearly all heading."""
    def with_damping(damping):
        matrix = navion()
        matrix[5, 5] = damping
        return named(matrix)

    damping = brentq(lambda x: with_damping(x)[-1].eigenvalue.real - target, -0.8, -0.3,
                     xtol=1e-15)
    found = with_damping(damping)
    assert names(found) == CLASSICAL
    assert found[-1].eigenvalue == pytest.approx(target, abs=1e-11)
    # A steady turn: psi = r / lambda, r = (g/V) phi nearly.
    assert abs(found[-1].vector[8] / found[-1].vector[6]) == pytest.approx(
        32.2 / SPEED / abs(target), rel=0.1)


def test_a_body_without_air_has_no_modes_that_move():
    """All roots of gravity and rotation alone are 0; round-off makes of them what it may."""
    matrix = np.zeros((9, 9))
    matrix[0, 7], matrix[1, 6], matrix[2, 4], matrix[1, 5] = -9.81, 9.81, SPEED, -SPEED
    matrix[6, 3] = matrix[7, 4] = matrix[8, 5] = 1.0
    found = named(matrix)
    assert len(set(names(found))) == len(found) <= 9
    for mode in found:
        # (machine epsilon)^(1/4) of the rates, for chains of four.
        assert mode.natural_frequency < 1e-2
        assert np.isfinite(mode.vector).all()


def test_an_eigenvalue_without_a_motion_of_the_body_is_left_over():
    values, vectors = np.linalg.eig(navion())
    found = modes.classify(np.append(values, -7.0), np.column_stack([vectors, np.zeros(9)]),
                           participation=np.append(np.ones(9), 0.0), **SIZE)
    assert names(found) == [*CLASSICAL, 'other 1']
    assert found[-1].participation.sum() == 0.0


def test_modes_of_the_wake_are_left_over_whatever_they_look_like():
    """Eigenvalues that a wake adds, with all kinds of small motion of the body."""
    values, vectors = np.linalg.eig(navion())
    generator = np.random.default_rng(1)
    wake = -6.0 - 3.0 * generator.random(6) + 1j * np.array([0, 0, 4.0, -4.0, 9.0, -9.0])
    motion = generator.normal(size=(9, 6)).astype(complex)
    shuffled = generator.permutation(15)
    found = modes.classify(
        np.append(values, wake)[shuffled], np.column_stack([vectors, motion])[:, shuffled],
        participation=np.append(np.linspace(0.5, 1.0, 9), np.full(6, 0.1))[shuffled], **SIZE)
    assert names(found) == [*CLASSICAL, 'other 1', 'other 2', 'other 3', 'other 4']


def test_a_statically_unstable_aircraft_diverges_in_pitch():
    """With Cm_alpha turned round the short period splits; the phugoid remains an oscillation."""
    matrix = navion()
    matrix[4, 2] = 0.0396
    found = named(matrix)
    assert names(found) == ['short period, fast', 'short period, slow', *CLASSICAL[1:]]
    assert found[0].stable and not found[1].stable


def test_a_heavily_damped_short_period_splits():
    matrix = navion()
    matrix[4, 4] = -12.0
    assert names(named(matrix))[:3] == ['short period, fast', 'short period, slow', 'phugoid']


def test_a_phugoid_splits_on_the_back_of_the_power_curve():
    matrix = navion()
    matrix[0, 0] = 0.6   # thrust and drag drive it away from its speed
    found = named(matrix)
    assert names(found)[:3] == ['short period', 'phugoid, fast', 'phugoid, slow']
    assert not found[1].stable


def test_without_a_fin_the_dutch_roll_splits():
    matrix = navion()
    matrix[5, 1] = -6.0 / SPEED   # N_beta turned round
    found = named(matrix)
    assert names(found)[2:] == ['Dutch roll, fast', 'Dutch roll, slow', 'roll', 'spiral']
    assert [mode.stable for mode in found[2:4]].count(False) == 1   # directional divergence


def test_roll_and_spiral_merge_where_roll_damping_is_lost():
    matrix = navion()
    matrix[3, 3] = 2.0
    assert names(named(matrix))[2:] == ['Dutch roll', 'lateral phugoid']


def test_dutch_roll_may_split_while_roll_and_spiral_are_one():
    found = made((0.1 + 0.5j, {'phi': 1.0, 'p': 0.2, 'v': 0.05}), (-3.0, {'v': 1.0, 'phi': 0.5}),
                 (1.5, {'v': -1.0, 'phi': 0.4}))
    assert names(found) == ['Dutch roll, fast', 'Dutch roll, slow', 'lateral phugoid']


def test_a_wing_that_is_free_to_roll_has_a_roll_mode():
    assert names(made((-3.0, {'p': 1.0}))) == ['roll']
    assert names(made((-3.0, {'p': 1.0}), (-0.1, {'phi': 1.0}))) == ['roll', 'spiral']
    assert names(made((-0.1 + 1j, {'u': 1.0, 'theta': 0.5j}))) == ['phugoid']
    assert names(made((-0.1 + 1j, {'w': 1.0, 'q': 0.5j}))) == ['short period']


def test_coupled_modes_say_so():
    """The short period takes sideslip, the Dutch roll angle of attack, the others little."""
    assert names(named(navion(coupling=0.05))) == CLASSICAL
    found = names(named(navion(coupling=2.0)))
    assert found[0] == 'coupled short period' and 'coupled Dutch roll' in found


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 1.0))
def test_any_body_has_modes_with_names_of_their_own(seed, share):
    """Random matrices, coupled or not: each eigenvalue is in one mode, each name used once."""
    generator = np.random.default_rng(seed)
    matrix, other = (generator.normal(size=(9, 9)) for _ in range(2))
    for each in (matrix, other):
        for rows, columns in ((LONGITUDINAL, LATERAL), (LATERAL, LONGITUDINAL)):
            each[np.ix_(rows, columns)] *= share
    first, second = named(matrix), named(other)
    assert len(set(names(first))) == len(first)
    assert sum(1 + mode.oscillates for mode in first) == 9
    followed = modes.track(first, second)
    assert len(set(names(followed))) == len(followed) == len(second)
    assert {mode.eigenvalue for mode in followed} == {mode.eigenvalue for mode in second}
    same = modes.track(first, first[::-1])
    assert [(mode.name, mode.eigenvalue) for mode in same] \
        == [(mode.name, mode.eigenvalue) for mode in first]


def test_arrays_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r'vectors \(9, k\), got \(3,\), \(3,\) and \(8, 3\)'):
        modes.classify(np.zeros(3), np.zeros((8, 3)), **SIZE)


def test_a_branch_is_followed_through_a_crossing():
    """A roll and a short period swap speeds, and two lateral pairs swap theirs: names stay."""
    def at(x):
        return made((complex(-1.0, 3.0 - x), {'v': 1.0, 'r': 1.0j, 'phi': 0.3}),
                    (complex(-0.5, 1.0 + x), {'phi': 1.0, 'p': 0.4j, 'v': 0.1}))

    followed = list(at(0.0))
    assert names(followed) == ['Dutch roll', 'lateral phugoid']
    for x in np.linspace(0.1, 2.0, 20):
        followed = modes.track(followed, at(x))
    assert names(followed) == ['Dutch roll', 'lateral phugoid']
    assert followed[0].eigenvalue == pytest.approx(-1.0 + 1.0j)
    assert names(at(2.0)) == ['Dutch roll', 'lateral phugoid']
    assert at(2.0)[0].eigenvalue == pytest.approx(-0.5 + 3.0j)   # which classify cannot know


def test_eigenvalues_that_coincide_are_told_apart_by_their_shapes():
    first = made((-1.0, {'p': 1.0, 'phi': 0.5}), (-1.0 + 1e-3, {'r': 1.0, 'v': 0.5}))
    then = made((-1.0 + 1e-3, {'p': 1.0, 'phi': 0.5}), (-1.0, {'r': 1.0, 'v': 0.5}))
    after = modes.track(first, then)
    assert names(after) == names(first)
    for before, now in zip(first, after):
        assert np.argmax(before.participation) == np.argmax(now.participation)


def test_tracking_through_splits_and_merges_of_the_navion():
    """Roll damping is taken away and given back: roll and spiral merge, and part again."""
    followed = list(named(navion()))
    met = []
    for damping in (*np.linspace(-8.4, 2.0, 40), *np.linspace(2.0, -8.4, 40)):
        matrix = navion()
        matrix[3, 3] = damping
        followed = modes.track(followed, named(matrix))
        met.append(tuple(names(followed)))
    assert met[39] == ('short period', 'phugoid', 'Dutch roll', 'lateral phugoid')
    assert sorted(met[-1]) == sorted(CLASSICAL)
    assert followed[[mode.name for mode in followed].index('roll')].eigenvalue \
        == pytest.approx(-8.433, abs=0.5e-3)


def test_tracking_a_short_period_that_splits_to_the_third_oscillation():
    """
    Static stability is taken away and given back.

    The short period splits, then the phugoid; one of it diverges, the other makes the third
    oscillation with the slower half of the short period; all the way back again.
    """
    followed = list(named(navion()))
    slopes = np.linspace(-0.0396, 0.02, 60)
    met = []
    for slope in (*slopes, *slopes[::-1]):
        matrix = navion()
        matrix[4, 2] = slope
        followed = modes.track(followed, named(matrix))
        longitudinal = tuple(names(followed)[:-3])
        assert names(followed)[-3:] == CLASSICAL[2:]
        if longitudinal not in met:
            met.append(longitudinal)
    assert met == [
        ('short period', 'phugoid'),
        ('short period, fast', 'short period, slow', 'phugoid'),
        ('short period, fast', 'short period, slow', 'phugoid, fast', 'phugoid, slow'),
        ('short period, fast', 'short period, slow + phugoid, fast', 'phugoid, slow')]
    assert names(followed) == CLASSICAL


def test_a_merger_of_strangers_has_both_names():
    apart = made((-5.0, {'w': 1.0, 'theta': 0.5}), (-1.0, {'w': 1.0, 'theta': -0.4, 'u': 0.3}),
                 (-0.4, {'u': 1.0, 'theta': 0.5, 'w': 0.5}), (0.1, {'u': 1.0, 'theta': -0.5}))
    assert names(apart) == ['short period, fast', 'short period, slow', 'phugoid, fast',
                            'phugoid, slow']
    merged = made((-5.0, {'w': 1.0, 'theta': 0.5}),
                  (-0.7 + 0.1j, {'w': 1.0, 'theta': 0.1j, 'u': 0.8}),
                  (0.1, {'u': 1.0, 'theta': -0.5}))
    followed = modes.track(apart, merged)
    assert names(followed) == ['short period, fast', 'short period, slow + phugoid, fast',
                               'phugoid, slow']
    assert names(modes.track(followed, apart)) == names(apart)


def test_what_appears_and_what_disappears():
    few, many = named(navion()), list(named(navion()))
    extra, = made((-20.0, {'r': 1.0}))
    assert extra.name == 'roll'
    followed = modes.track(few, [extra, *many])
    assert names(followed) == [*CLASSICAL, 'other 1']
    assert names(modes.track(followed, many)) == CLASSICAL
    assert names(modes.track([], few)) == CLASSICAL
    assert modes.track(few, []) == []

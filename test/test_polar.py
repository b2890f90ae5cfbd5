# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Steady loads over conditions: rates, continuation, hysteresis, and the count of solutions."""

import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from poststall_sim import cli, definition, jobs, polar
from poststall_sim.aero import model as models
from poststall_sim.aero.decambering import AngleForm, Closure
from poststall_sim.aero.polars import section_polar
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.commands.polar import _row
from poststall_sim.polar import Condition
from poststall_sim.state import Status

AIR = {'airspeed': 20.0, 'density': 1.225}
DOCS = Path(__file__).resolve().parents[1] / 'docs'
LOCAL = {'closure': Closure.LOCAL, 'unsteady': False}


def build(tail=True, airfoil='naca4415_re4e5', sweep=0.0, **settings):
    """Return the dissertation's wing and tail with an ordinary stall."""
    aircraft = definition.aircraft(definition.find('aircraft', 'wing_tail'))
    curves = definition.airfoil(definition.find('airfoils', airfoil), aircraft.airfoils[0].name)
    wing, horizontal = aircraft.surfaces
    wing = replace(wing, sections=tuple(
        replace(s, leading_edge_G=(math.tan(sweep) * s.leading_edge_G[1], *s.leading_edge_G[1:]))
        for s in wing.sections))
    return models.build(replace(
        aircraft, airfoils=(curves,), surfaces=(wing, horizontal) if tail else (wing,),
        controls=aircraft.controls if tail else ()), models.Settings(**settings))


@pytest.fixture(scope='module')
def nonlocal_wing():
    return build(tail=False)


@pytest.fixture(scope='module')
def local_wing():
    return build(tail=False, **LOCAL)


def conditions(*degrees):
    return [Condition(math.radians(alpha)) for alpha in degrees]


def lift(points):
    return np.array([each.coefficients.CL for each in points])


def test_coefficients_know_neither_airspeed_nor_density():
    model = build()
    condition = Condition(math.radians(18.0), math.radians(4.0), np.array([0.03, 0.004, -0.02]),
                          np.radians([3.0, -5.0, 4.0]))
    first, second = (polar.point(model, condition, airspeed=v, density=rho)
                     for v, rho in ((20.0, 1.225), (55.0, 0.4)))
    assert first.aero.status is second.aero.status is Status.CONVERGED
    for key in ('CL', 'CD', 'CY', 'Cl', 'Cm', 'Cn'):
        assert getattr(second.coefficients, key) == pytest.approx(
            getattr(first.coefficients, key), abs=1e-9)


@pytest.mark.parametrize('axis, key', [(0, 'Cl'), (1, 'Cm'), (2, 'Cl')])
def test_rates_are_about_body_axes_with_span_chord_span(axis, key):
    """The rate [rad/s] of p b/2V, q c/2V, r b/2V, by hand, and what it does to the loads."""
    model = build()
    rates = np.zeros(3)
    rates[axis] = 0.02
    reference = model.aircraft.reference
    onset = polar.onset(model, Condition(0.1, 0.0, rates), 30.0)
    length = (reference.span, reference.chord, reference.span)[axis]
    expected = np.zeros(3)
    expected[axis] = 0.02 * 2.0 * 30.0 / length
    np.testing.assert_allclose(onset.rates_G * [-1.0, 1.0, -1.0], expected, atol=1e-12)
    still, turning = (polar.point(model, Condition(0.1, 0.0, r), **AIR)
                      for r in (np.zeros(3), rates))
    change = getattr(turning.coefficients, key) - getattr(still.coefficients, key)
    # p and q are damped; the left wing runs ahead in a yaw to the right and lifts more.
    assert change > 0.0 if axis == 2 else change < 0.0


def test_roll_damping_is_that_of_a_finite_wing(nonlocal_wing):
    """Strip theory says -(Cl' + Cd)/6 about the velocity; aspect ratio 12 has two thirds of it."""
    rates = np.array([0.01, 0.0, 0.0])
    rolling = polar.point(nonlocal_wing, Condition(0.0, 0.0, rates), **AIR)
    damping = rolling.coefficients.Cl / 0.01
    assert -2.0 * math.pi / 6.0 < damping < -0.6 * 2.0 * math.pi / 6.0


def test_surface_lift_adds_up_to_the_loads(nonlocal_wing):
    """Attached, strip cl over the area is the Joukowski lift to within 1 %, swept or not."""
    for sweep in (0.0, math.radians(30.0)):
        model = build(tail=False, sweep=sweep) if sweep else nonlocal_wing
        point = polar.point(model, Condition(math.radians(3.0)), **AIR)
        assert polar.surface_lift(model, point.aero.strips.cl, 'wing') == pytest.approx(
            point.coefficients.CL, rel=0.012)


def test_a_sweep_hands_the_decambering_on(local_wing):
    flown = conditions(18.0, 19.0, 20.0)
    points = list(polar.sweep(local_wing, flown, **AIR))
    for before, here in zip(points, points[1:]):
        again = polar.point(local_wing, here.condition, delta0=before.aero.strips.delta, **AIR)
        np.testing.assert_array_equal(again.aero.strips.delta, here.aero.strips.delta)
    starts = [each.aero.strips.delta for each in points]
    told = list(polar.sweep(local_wing, flown, starts=starts, **AIR))
    assert [each.aero.iterations for each in told] == [0, 0, 0]


def test_a_start_from_zero_takes_no_decambering_along():
    model = build(tail=False, **LOCAL, start=Start.ZERO)
    swept = list(polar.sweep(model, conditions(20.0, 22.0), **AIR))
    alone = polar.point(model, swept[1].condition, **AIR)
    np.testing.assert_array_equal(swept[1].aero.strips.delta, alone.aero.strips.delta)


def test_up_and_down_shows_hysteresis_of_the_local_closure_only(local_wing, nonlocal_wing):
    flown = conditions(*np.arange(10.0, 31.0))
    loops = {}
    for model in (local_wing, nonlocal_wing):
        points = list(polar.up_and_down(model, flown, **AIR))
        assert len(points) == 2 * len(flown) - 1
        assert all(each.aero.status is Status.CONVERGED for each in points)
        alphas = [each.condition.alpha for each in points]
        assert alphas == alphas[::-1]
        loops[model.settings.closure] = np.abs(lift(points) - lift(points)[::-1])
    assert loops[Closure.LOCAL].max() > 0.05
    assert loops[Closure.LOCAL][:3].max() < 1e-6   # attached flow remembers nothing
    assert loops[Closure.NONLOCAL].max() < 1e-4


def test_attached_flow_has_one_solution(local_wing, nonlocal_wing):
    for model in (local_wing, nonlocal_wing):
        found = polar.distinct_solutions(model, Condition(math.radians(6.0)), starts=20,
                                         generator=np.random.default_rng(1), **AIR)
        assert (len(found.points), found.counts, found.failed) == (1, (20,), 0)


def test_solutions_past_stall(local_wing, nonlocal_wing):
    condition = Condition(math.radians(20.0))
    generators = [np.random.default_rng(7) for _ in range(3)]
    local, again = (polar.distinct_solutions(
        local_wing, condition, starts=60, generator=g, **AIR) for g in generators[:2])
    assert len(local.points) > 20 and sum(local.counts) + local.failed == local.starts == 60
    assert list(local.counts) == sorted(local.counts, reverse=True)
    assert again.counts == local.counts
    np.testing.assert_array_equal(lift(again.points), lift(local.points))
    # Every one of them has all strips on the section's curve, and they are not the same.
    curve = section_polar(local_wing.aircraft.airfoils[0])
    deltas = [each.aero.strips.delta for each in local.points]
    for point in local.points:
        strips = point.aero.strips
        np.testing.assert_allclose(strips.cl, curve.at(strips.alpha)[:, 0], atol=1e-4)
    for i, first in enumerate(deltas):
        assert all(np.abs(first - other).max() > polar.APART for other in deltas[:i])
    assert np.ptp(lift(local.points)) > 0.03
    smooth = polar.distinct_solutions(
        nonlocal_wing, condition, starts=60, generator=generators[2], **AIR)
    assert (len(smooth.points), smooth.failed) == (1, 0)


def test_random_starts_are_starts_whatever_the_settings_say():
    model = build(tail=False, **LOCAL, scheme=Scheme.D, start=Start.ZERO, tolerance=1e-4,
                  limit=1000)
    found = polar.distinct_solutions(model, Condition(math.radians(20.0)), starts=10,
                                     generator=np.random.default_rng(0), **AIR)
    assert len(found.points) > 1


def test_uniqueness_is_told_where_a_closure_is_at_work(nonlocal_wing, local_wing):
    attached = build(tail=False, decambering=False)
    point = polar.point(attached, Condition(0.3), **AIR)
    assert math.isnan(point.uniqueness) and not point.may_not_be_unique
    smooth = polar.point(nonlocal_wing, Condition(math.radians(20.0)), **AIR)
    assert 0.0 < smooth.uniqueness < 1.0 and not smooth.may_not_be_unique
    states = list(polar.sweep(local_wing, conditions(*np.arange(10.0, 25.0)), **AIR))
    assert any(each.may_not_be_unique for each in states)
    assert states[0].uniqueness > 0.9


def test_small_angles_are_for_steady_flow():
    model = build(tail=False, chordwise=1, angle_form=AngleForm.LINEAR, unsteady=False)
    exact = build(tail=False, chordwise=1)
    small, true = (polar.point(each, Condition(math.radians(4.0)), **AIR)
                   for each in (model, exact))
    assert small.coefficients.CL == pytest.approx(true.coefficients.CL, rel=0.01)


def test_a_flow_that_is_no_number_is_a_status_not_an_exception(nonlocal_wing):
    point = polar.point(nonlocal_wing, Condition(math.nan), **AIR)
    assert point.aero.status is Status.DIVERGED and math.isnan(point.uniqueness)
    good = list(polar.sweep(nonlocal_wing, [Condition(math.nan), *conditions(4.0)], **AIR))[1]
    assert good.aero.status is Status.CONVERGED


def result(tmp_path, *words):
    """Run the command and return what it writes as JSON."""
    path = tmp_path / 'result.json'
    assert cli.main([*words, '--json', str(path)]) == 0
    return json.loads(path.read_text())


def test_up_and_down_is_written_with_its_way(tmp_path):
    found = result(tmp_path, 'polar', '--alpha', '14:26:4', '--sweep', 'updown',
                   '--aircraft', 'wing_tail', '--closure', 'local')
    assert [p['alpha_deg'] for p in found['points']] == [14, 18, 22, 26, 22, 18, 14]
    assert [p['way'] for p in found['points']] == ['up'] * 4 + ['down'] * 3
    assert found['sweep'] == 'updown'


def test_solutions_are_counted_and_flagged(tmp_path, capsys):
    words = ['polar', '--alpha', '10:24:14', '--aircraft', 'wing_tail', '--starts', '20']
    local, again = (result(tmp_path, *words, '--closure', 'local') for _ in range(2))
    printed = capsys.readouterr().out
    assert local == again   # the same input, the same answer
    assert [p['solutions']['starts'] for p in local['points']] == [20, 20]
    attached, stalled = (p['solutions'] for p in local['points'])
    assert attached['distinct'] == 1 and stalled['distinct'] > 3
    assert sum(stalled['times_found']) + stalled['not_converged'] == 20
    assert len(stalled['CL']) == stalled['distinct']
    assert 'solutions' in printed and f'{stalled["distinct"]}/20' in printed
    flagged = [p for p in local['points'] if p['uniqueness'] < 0.0]
    assert all(p['flags'] == ['MAY_NOT_BE_UNIQUE'] for p in flagged)
    assert printed.count('converged MAY_NOT_BE_UNIQUE') == 2 * len(flagged)
    smooth = result(tmp_path, *words)
    assert [p['solutions']['distinct'] for p in smooth['points']] == [1, 1]


def test_a_point_that_may_not_be_unique_is_marked_in_the_table():
    point = {'alpha_deg': 20.0, **dict.fromkeys(jobs.COEFFICIENTS, 0.0), 'CDi_far': 0.0,
             'status': 'converged',
             'stalled_strips': 3, 'strips': {'cl': [0.0] * 5}, 'iterations': 4,
             'max_residual': 1e-6, 'uniqueness': -0.25, 'flags': ['MAY_NOT_BE_UNIQUE']}
    assert _row(point)[-3:] == ['1e-06', '-0.250', 'converged MAY_NOT_BE_UNIQUE']
    assert _row({**point, 'uniqueness': None, 'flags': []})[-2:] == ['-', 'converged']


def test_a_run_starts_from_an_earlier_one(tmp_path, capsys):
    earlier = tmp_path / 'earlier.json'
    words = ['polar', '--alpha', '18:22:2', '--closure', 'local']
    assert cli.main([*words, '--json', str(earlier)]) == 0
    again = result(tmp_path, *words, '--start', f'given={earlier}')
    assert [p['iterations'] for p in again['points']] == [0, 0, 0]
    assert again['start'] == 'given'
    before = json.loads(earlier.read_text())['points']
    assert [p['CL'] for p in again['points']] == pytest.approx([p['CL'] for p in before])
    capsys.readouterr()
    assert cli.main([*words, '--strips', 'wing=12', '--start', f'given={earlier}']) == 2
    assert 'is of another lattice' in capsys.readouterr().err
    earlier.write_text('{"points": 3}')
    assert cli.main([*words, '--start', f'given={earlier}']) == 2
    assert 'is not the JSON of a polar' in capsys.readouterr().err


def test_the_figures_of_the_docs_are_there_and_small():
    """Of the dissertation 38 figures, five of ours, eight of the validation."""
    pages = {name: (DOCS / f'{name}.md').read_text() for name in ('figures', 'validation')}
    named = {name: re.findall(r'\]\(figures/(\w+)\.png\)', text) for name, text in pages.items()}
    files = {path.stem: path.stat().st_size for path in (DOCS / 'figures').iterdir()}
    numbers = [*(f'2_{k}' for k in range(1, 5)), *(f'3_{k}' for k in (*range(1, 10), 11, 12, 14)),
               *(f'4_{k}' for k in range(1, 10)), *(f'5_{k}' for k in (1, 2, 3, 4, *range(6, 15)))]
    assert named['figures'] == [f'figure_{name}' for name in (
        *numbers, 'solutions', 'strips', 'wakes', 'let_go', 'response')]
    assert named['validation'] == [f'figure_{name}' for name in (
        'wings', 'avl', 'indicial', 'oscillating', 'sections', 'bodies', 'navion', 'turbulence')]
    assert set(files) == {each for page in named.values() for each in page}
    assert max(files.values()) < 150_000 and sum(files.values()) < 3_000_000
    assert len(re.findall(r'^\| [ABCD] \| ', pages['figures'], re.MULTILINE)) == 8


def test_every_picture_of_the_docs_is_one_that_the_tool_draws():
    drawn = re.findall(r'^def picture_(\w+)', (
        DOCS.parent / 'tools' / 'pictures.py').read_text(), re.MULTILINE)
    examples = {path.stem for path in (DOCS.parent / 'examples').glob('*.py')} - {'figures'}
    assert {path.name for path in (DOCS / 'images').iterdir()} == {
        'flight.gif', *(f'{name}.png' for name in drawn),
        *(f'example_{name}.png' for name in examples)}


def test_the_tool_of_the_docs_draws(tmp_path):
    """
    One figure, with the modules of all of them imported: a page must not outlive its tool.

    What wants a browser where there is none, says so and leaves the others alone.
    """
    for name in ('matplotlib', 'rosbags', 'tqdm'):
        pytest.importorskip(name, reason=f'figures need {name}')
    tool = DOCS.parent / 'tools' / 'figures.py'
    (tmp_path / 'docs').mkdir()
    done = subprocess.run(
        [sys.executable, str(tool), 'watch', '2_2', '--docs', str(tmp_path / 'docs')],
        env={**os.environ, 'PATH': ''}, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and 'watch: not drawn, it needs ' in done.stdout, done.stderr
    assert 5_000 < (tmp_path / 'docs' / 'figures' / 'figure_2_2.png').stat().st_size < 150_000


def test_panels_are_drawn_with_what_is_in_them(tmp_path):
    pytest.importorskip('matplotlib', reason='figures need matplotlib')
    from matplotlib.colors import to_rgb
    from matplotlib.image import imread

    from poststall_sim.plots import decambering
    from poststall_sim.plots.decambering import Curve, Kind, Panel
    curve = section_polar(definition.airfoil(definition.find('airfoils', 'naca4415_re3e6')))
    lines = decambering.section_curves(curve, deltas=(0.0, -9.65))
    # The anchor: decambered by -9.65 deg, potential flow meets the section's curve at 20 deg.
    assert np.interp(20.0, lines[2].x, lines[2].y) == pytest.approx(
        np.interp(20.0, lines[0].x, lines[0].y), abs=2e-3)
    mark = Curve('here', np.array([10.0]), np.array([1.0]), '#D55E00', '', 'o', size=9.0)
    file = decambering.draw(tmp_path / 'a' / 'b.png', [
        Panel(Kind.SECTION, 'one', (*lines, mark)), Panel(Kind.SECTION, 'two', lines)],
        shared=True)
    image = imread(file)[..., :3]
    orange = np.abs(image - to_rgb('#D55E00')).max(axis=-1) < 0.03
    assert 50 < np.count_nonzero(orange) < 2000

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Derivatives at given angles, past the stall and in sideslip: against polars, and as told."""

import dataclasses
import json
import math

import numpy as np
import pytest
import wings

from poststall_sim import cli, derivative_analysis, jobs, polar
from poststall_sim.aero import model as models
from poststall_sim.atmosphere import standard_air

STEP = 1e-4
DENSITY = standard_air(0.0).density


@pytest.fixture(scope='module')
def model():
    return models.build(wings.shipped_aircraft('trainer'))


def slopes(model, point, name):
    """Return the central differences of two polar points on the branch of a third."""
    exact = dataclasses.replace(model, settings=dataclasses.replace(
        model.settings, tolerance=1e-10))
    ends = []
    for change in (-STEP, STEP):
        values = {'alpha': point.condition.alpha, 'beta': point.condition.beta,
                  'rates': np.zeros(3), 'deflections': np.array(point.condition.deflections)}
        if name in ('alpha', 'beta'):
            values[name] += change
        elif name in ('p', 'q', 'r'):
            values['rates']['pqr'.index(name)] += change
        else:
            values['deflections'][model.aircraft.control_names.index(name)] += change
        found = polar.point(exact, polar.Condition(**values), airspeed=15.0, density=DENSITY,
                            delta0=point.aero.strips.delta).coefficients
        ends.append(np.array(dataclasses.astuple(found)))
    return (ends[1] - ends[0]) / (2.0 * STEP)


def test_derivatives_are_slopes_of_the_polar_past_the_stall_and_in_sideslip(model):
    """Beta is turned about at constant alpha and airspeed, as in a polar, not v alone."""
    beta, deflected = math.radians(9.0), np.radians([2.0, -6.0, 1.0])
    alphas = np.radians([12.0, 16.0, 20.0])
    *_, last = derivative_analysis.along(
        model, alphas, beta=beta, deflected=deflected, airspeed=15.0, altitude=0.0)
    *_, point = polar.sweep(model, jobs.conditions(
        alphas, beta=beta, rates=np.zeros(3), deflected=deflected), airspeed=15.0,
        density=DENSITY)
    assert last['status'] == 'converged' and last['stalled_strips'] > 5
    assert last['coefficients'] == dataclasses.asdict(point.coefficients)
    names = ['alpha', 'beta', 'p', 'q', 'r', *model.aircraft.control_names]
    assert derivative_analysis.variables(last) == names
    for name in names:
        told = [last['derivatives'][f'{key}_{name}'] for key in jobs.COEFFICIENTS]
        # Of curves that bend past the stall, by steps of 1e-4 along different lines.
        assert told == pytest.approx(slopes(model, point, name), abs=1e-4), name


def test_about_stability_axes_they_are_those_of_a_body_that_turns_about_them(model):
    """A steady roll about the wind is p cos alpha and p sin alpha about the body's axes."""
    alpha = math.radians(6.0)
    exact = dataclasses.replace(model, settings=dataclasses.replace(
        model.settings, tolerance=1e-10))
    told, = derivative_analysis.along(
        exact, [alpha], beta=math.radians(2.0), deflected=np.zeros(3), airspeed=15.0,
        altitude=0.0, axes=derivative_analysis.Axes.STABILITY)

    def moments(rates=(0.0, 0.0, 0.0), change=0.0):
        found = polar.point(exact, polar.Condition(
            alpha + change, math.radians(2.0), np.array(rates), np.zeros(3)), airspeed=15.0,
            density=DENSITY).coefficients
        c, s = math.cos(alpha + change), math.sin(alpha + change)
        return np.array([c * found.Cl + s * found.Cn, c * found.Cn - s * found.Cl, found.CY])

    c, s = math.cos(alpha), math.sin(alpha)
    slopes = {'p': (moments((STEP * c, 0.0, STEP * s)) - moments((-STEP * c, 0.0, -STEP * s))),
              'r': (moments((-STEP * s, 0.0, STEP * c)) - moments((STEP * s, 0.0, -STEP * c))),
              'alpha': moments(change=STEP) - moments(change=-STEP)}
    for name, change in slopes.items():
        assert [told['derivatives'][f'{key}_{name}'] for key in ('Cl', 'Cn', 'CY')] \
            == pytest.approx(change / (2.0 * STEP), abs=1e-4), name
    assert [told['coefficients'][key] for key in ('Cl', 'Cn', 'CY')] == pytest.approx(moments())


def test_moments_about_the_neutral_point_do_not_change_with_alpha(tmp_path):
    words = ['derivatives', '--alpha', '2', '--json', str(tmp_path / 'd.json')]
    assert cli.main(words) == 0
    about_cg = json.loads((tmp_path / 'd.json').read_text())
    point, = about_cg['points']
    assert about_cg['moment_reference_m'] == about_cg['reference']['cg_m']
    # The trainer was designed for a tenth of the chord, see its file.
    assert point['static_margin'] == pytest.approx(0.09, abs=0.02)
    x, _, z = about_cg['reference']['cg_m']
    assert point['neutral_point_x_m'] == pytest.approx(x + 0.4 * point['static_margin'])
    assert cli.main([*words, '--reference', f'{point["neutral_point_x_m"]},0,{z}']) == 0
    there, = json.loads((tmp_path / 'd.json').read_text())['points']
    # Lift in place of the force across the chord: 1 - cos alpha, and drag by alpha.
    assert abs(there['derivatives']['Cm_alpha']) < 0.02 * abs(point['derivatives']['Cm_alpha'])
    for key, value in point['derivatives'].items():
        if key.startswith(('CL_', 'CD_', 'CY_')) and key[-2:] not in ('_p', '_q', '_r'):
            assert there['derivatives'][key] == pytest.approx(value, abs=1e-6)


def test_a_block_for_each_angle_with_axes_and_units(tmp_path, capsys):
    pytest.importorskip('matplotlib', reason='figures need matplotlib')
    figure = tmp_path / 'd.png'
    assert cli.main(['derivatives', '--alpha', '2:20:6', '--strips', 'wing=12', '--plot',
                     str(figure), '--json', str(tmp_path / 'd.json')]) == 0
    printed = capsys.readouterr().out
    assert printed.count('by alpha ') == printed.count('by rudder') == 4
    assert 'static margin' in printed and 'stability axes' in printed and '[1/rad]' in printed
    assert figure.stat().st_size > 10_000
    told = json.loads((tmp_path / 'd.json').read_text())
    assert 'rad' in told['units'] and 'rate of alpha' in told['left_out']
    # Past the stall lift falls with alpha, and no neutral point is told.
    assert told['points'][-1]['derivatives']['CL_alpha'] < 0.0
    assert told['points'][-1]['static_margin'] is None


def test_a_control_beyond_its_limits_is_refused(capsys):
    assert cli.main(['derivatives', '--alpha', '4', '--deflect', 'elevator=90']) == 2
    assert 'elevator goes from' in capsys.readouterr().err

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Databases: the grid, what a broken run leaves, and the tables in the words of other programs."""

import csv
import dataclasses
import json
import math
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import wings

from poststall_sim import (
    aero_database,
    cli,
    gazebo_writer,
    jsbsim_writer,
    lift_drag_fit,
    polar,
)
from poststall_sim.aero import model as models
from poststall_sim.aircraft import ConfigError, Reference
from poststall_sim.atmosphere import standard_air
from poststall_sim.buildup import COEFFICIENTS, BuildUp, Increment

AIR = {'airspeed': 15.0, 'altitude': 0.0}
ALPHA = [-4.0, 0.0, 4.0, 8.0, 12.0, 16.0, 20.0, 24.0]
GRID = aero_database.Grid(
    ALPHA, [-8.0, 0.0, 8.0], {'p': [-0.05, 0.0, 0.05], 'q': [0.01], 'r': [0.05]},
    {'elevator': [-10.0, 0.0, 10.0], 'aileron': [10.0]})


@pytest.fixture(scope='module')
def model():
    return models.build(wings.shipped_aircraft('trainer'))


def finished(folder, model, grid=GRID, **options):
    database = aero_database.Database(folder, model, grid, **AIR, **options)
    list(database.run())
    return database


@pytest.fixture(scope='module')
def whole(model, tmp_path_factory):
    return finished(tmp_path_factory.mktemp('whole') / 'db', model)


@pytest.fixture(scope='module')
def tables(whole):
    return whole.build_up()


def rows_of(folder):
    with (folder / aero_database.TABLE).open(newline='') as table:
        return list(csv.DictReader(table))


def test_rows_are_the_points_of_polars(model, whole):
    rows = rows_of(whole._folder)
    assert len(rows) == whole.rows == len(ALPHA) * (3 + 4 + 3)
    assert [row['status'] for row in rows] == ['converged'] * whole.rows
    density = standard_air(0.0).density
    for row in rows[4 * len(ALPHA):5 * len(ALPHA)]:   # the second roll rate, or the first but one
        assert (float(row['beta [deg]']), float(row['p b/2V [-]'])) == (0.0, 0.05)
    swept = polar.sweep(model, [
        polar.Condition(math.radians(alpha), 0.0, np.array([0.05, 0.0, 0.0]))
        for alpha in ALPHA], airspeed=15.0, density=density)
    for row, point in zip(rows[4 * len(ALPHA):], swept):
        for key in COEFFICIENTS:
            assert float(row[f'{key} [-]']) == pytest.approx(
                getattr(point.coefficients, key), abs=1e-12)


def test_a_full_grid_has_every_combination():
    grid = aero_database.Grid([0.0, 4.0], [0.0, 5.0], {'q': [0.0, 0.01]},
                              {'rudder': [0.0, 5.0, 10.0]}, full=True)
    cases = grid.cases(('elevator', 'rudder'))
    assert len(cases) == len(set(cases)) == 2 * 2 * 3
    assert aero_database.Case(5.0, (0.0, 0.01, 0.0), (0.0, 10.0)) in cases


def test_a_full_grid_holds_the_same_build_up(model, tmp_path):
    axes = {'beta': [0.0, 8.0], 'rates': {'q': [0.0, 0.01]},
            'deflections': {'elevator': [0.0, 10.0]}}
    one, other = (finished(tmp_path / str(full), model, aero_database.Grid(
        [0.0, 4.0, 20.0], full=full, **axes)).build_up() for full in (False, True))
    assert np.array_equal(one.base, other.base)
    assert np.array_equal(one.rates['q'].change, other.rates['q'].change)
    assert np.array_equal(one.controls['elevator'].change, other.controls['elevator'].change)


@pytest.mark.parametrize('rows', [0, 1, 11, 79])
def test_a_broken_run_goes_on_to_the_same_bytes(model, whole, tmp_path, rows):
    """Broken off in a sweep, past the stall, and in the middle of a line."""
    folder = tmp_path / 'db'
    broken = aero_database.Database(folder, model, GRID, **AIR).run()
    for _ in range(rows):
        next(broken)
    table = folder / aero_database.TABLE
    # As a run that is killed leaves it: what was computed is in the file already.
    assert table.read_bytes().count(b'\n') == 1 + rows
    broken.close()
    table.write_bytes(table.read_bytes() + b'4.0,0.0,0.0,0')
    again = aero_database.Database(folder, model, GRID, **AIR, resume=True)
    assert again.done == rows
    assert len(list(again.run())) == again.rows - rows
    assert table.read_bytes() == (whole._folder / aero_database.TABLE).read_bytes()


def test_a_database_is_not_mixed_with_another(model, whole):
    folder = whole._folder
    with pytest.raises(ConfigError, match='has a database already: --resume'):
        aero_database.Database(folder, model, GRID, **AIR)
    for changed, message in (
            ({'grid': aero_database.Grid(ALPHA)}, 'beta_deg was .* now it is'),
            ({'airspeed': 12.0}, 'airspeed_m_s was 15.0'),
            ({'model': models.build(model.aircraft, models.Settings(chordwise=3))},
             'settings was'),
            ({'model': models.build(wings.shipped_aircraft('wing_tail'))}, 'aircraft|control')):
        given = {'model': model, 'grid': GRID, **AIR, 'resume': True, **changed}
        with pytest.raises(ConfigError, match=message):
            aero_database.Database(folder, given.pop('model'), given.pop('grid'), **given)
    assert len(list(finished(folder, model, resume=True).run())) == 0


def test_a_table_that_was_tampered_with_is_refused(model, tmp_path):
    folder = tmp_path / 'db'
    grid = aero_database.Grid([0.0, 2.0])
    finished(folder, model, grid)
    table = folder / aero_database.TABLE
    table.write_text(table.read_text().replace('\n2.0,', '\n3.0,'))
    with pytest.raises(ConfigError, match='row 2 is not of this grid'):
        aero_database.Database(folder, model, grid, **AIR, resume=True)


def test_a_table_of_nobody_is_not_written_over(model, tmp_path):
    (tmp_path / aero_database.TABLE).write_text('alpha,CL\n1,2\n')
    with pytest.raises(ConfigError, match='is not written over'):
        aero_database.Database(tmp_path, model, aero_database.Grid([0.0]), **AIR, resume=True)
    assert (tmp_path / aero_database.TABLE).read_text() == 'alpha,CL\n1,2\n'


def test_a_grid_without_end_is_refused_at_once():
    many = [float(x) for x in range(1000)]
    grid = aero_database.Grid(many, many, {'p': many, 'q': many, 'r': many}, full=True)
    with pytest.raises(ConfigError, match='the grid has 1000000000000000 conditions'):
        grid.cases(('elevator',))


def test_no_tables_are_made_with_a_point_that_diverged(model, tmp_path):
    folder, grid = tmp_path / 'db', aero_database.Grid([0.0, 2.0])
    database = finished(folder, model, grid)
    table = folder / aero_database.TABLE
    head, first, second = table.read_text().splitlines()
    cells = second.split(',')
    cells[head.split(',').index('CD [-]')] = ''
    table.write_text('\n'.join([head, first, ','.join(cells)]) + '\n')
    with pytest.raises(ConfigError, match='row 2 of database.csv diverged'):
        database.build_up()


@pytest.mark.parametrize('grid', [
    aero_database.Grid([0.0]), aero_database.Grid([0.0, 2.0], [5.0]),
    aero_database.Grid([0.0, 2.0], rates={'q': [0.01]}, full=True)])
def test_tables_need_zero(grid):
    with pytest.raises(ConfigError, match='0 among'):
        grid.require_tables()


# --- JSBSim

def lookup(function, properties):
    """Return the value of a function of our kind, as JSBSim computes it."""
    product, = function
    value = 1.0
    for factor in product:
        if factor.tag == 'property':
            value *= properties[factor.text]
            continue
        row, *column = (each.text for each in factor.findall('independentVar'))
        lines = [list(map(float, line.split())) for line in
                 factor.find('tableData').text.strip().splitlines()]
        if column:
            head, *lines = lines
            at = [np.interp(properties[column[0]], head, line[1:]) for line in lines]
        else:
            at = [line[1] for line in lines]
        value *= np.interp(properties[row], [line[0] for line in lines], at)
    return value


FEET = 1.0 / 0.3048


def jsbsim_inputs(model, **changes):
    """Return JSBSim's properties for a condition, in its units."""
    reference = model.aircraft.reference
    given = {'alpha': 0.0, 'beta': 0.0, 'p': 0.0, 'q': 0.0, 'r': 0.0, 'elevator': 0.0,
             'aileron': 0.0, **changes}
    return {'aero/qbar-psf': 2.0, 'metrics/Sw-sqft': reference.area * FEET ** 2,
            'metrics/bw-ft': reference.span * FEET, 'metrics/cbarw-ft': reference.chord * FEET,
            'aero/alpha-rad': given['alpha'], 'aero/beta-rad': given['beta'],
            **{f'aero/poststall/{each}-hat': given[each] for each in 'pqr'},
            **{f'fcs/{each}-pos-rad': given[each] for each in ('elevator', 'aileron')}}


def test_jsbsim_tables_add_up_to_the_polars(model, tables):
    """At nodes of the tables: forces turned into wind axes, moments in body axes."""
    root = jsbsim_writer.element(tables)
    for condition, changes in (
            (polar.Condition(math.radians(20.0), math.radians(8.0)),
             {'alpha': math.radians(20.0), 'beta': math.radians(8.0)}),
            (polar.Condition(math.radians(8.0), 0.0, np.array([0.05, 0.0, 0.0])),
             {'alpha': math.radians(8.0), 'p': 0.05}),
            (polar.Condition(math.radians(4.0), deflections=np.radians([0.0, -10.0, 0.0])),
             {'alpha': math.radians(4.0), 'elevator': math.radians(-10.0)})):
        properties = jsbsim_inputs(model, **changes)
        found = {axis.get('name'): sum(lookup(function, properties)
                                       for function in axis.findall('function'))
                 for axis in root.findall('axis')}
        assert list(found) == ['LIFT', 'DRAG', 'SIDE', 'ROLL', 'PITCH', 'YAW']
        # Continued in alpha as the tables are, for the branch.
        *_, point = polar.sweep(model, [
            polar.Condition(math.radians(alpha), condition.beta, condition.rates,
                            condition.deflections)
            for alpha in ALPHA if math.radians(alpha) <= condition.alpha + 1e-9],
            airspeed=15.0, density=standard_air(0.0).density)
        c, area = point.coefficients, 2.0 * properties['metrics/Sw-sqft']
        span, chord = properties['metrics/bw-ft'], properties['metrics/cbarw-ft']
        cb, sb = math.cos(condition.beta), math.sin(condition.beta)
        expected = [c.CL, c.CD * cb - c.CY * sb, c.CY * cb + c.CD * sb, c.Cl * span, c.Cm * chord,
                    c.Cn * span]
        assert list(found.values()) == pytest.approx([area * x for x in expected], abs=1e-7 * area)


def test_jsbsim_loads_the_tables_and_makes_the_same_loads(model, tables, tmp_path):
    """The program itself, where it is installed: its own axes, units and interpolation."""
    jsbsim = pytest.importorskip('jsbsim', reason='wants jsbsim')
    reference, mass = model.aircraft.reference, model.aircraft.mass
    folder = tmp_path / 'aircraft' / 'plane'
    folder.mkdir(parents=True)
    x, y, z = mass.cg_G
    place = f'<x>{x}</x><y>{y}</y><z>{z}</z>'
    (folder / 'plane.xml').write_text(f"""<?xml version="1.0"?>
<fdm_config name="plane" version="2.0" release="BETA"><fileheader/>
<metrics><wingarea unit="M2">{reference.area}</wingarea>
<wingspan unit="M">{reference.span}</wingspan><chord unit="M">{reference.chord}</chord>
<location name="AERORP" unit="M">{place}</location></metrics>
<mass_balance><ixx unit="KG*M2">1</ixx><iyy unit="KG*M2">1</iyy><izz unit="KG*M2">1</izz>
<emptywt unit="KG">{mass.mass}</emptywt><location name="CG" unit="M">{place}</location>
</mass_balance><ground_reactions/><propulsion/><flight_control name="none"/>
{ET.tostring(jsbsim_writer.element(tables), encoding='unicode')}</fdm_config>""")
    program = jsbsim.FGFDMExec(str(tmp_path), None)
    program.set_debug_level(0)
    program.set_dt(1e-4)
    assert program.load_model('plane', True)
    alpha, beta, p, aileron = math.radians(19.0), math.radians(6.0), 0.6, math.radians(5.0)
    for name, value in (('ic/h-sl-ft', 0.0), ('ic/vt-fps', 15.0 * FEET), ('ic/alpha-rad', alpha),
                        ('ic/beta-rad', beta), ('ic/p-rad_sec', p)):
        program[name] = value
    assert program.run_ic()
    program['fcs/aileron-pos-rad'] = aileron
    program.run()
    properties = jsbsim_inputs(
        model, alpha=program['aero/alpha-rad'], beta=program['aero/beta-rad'], aileron=aileron,
        **{each: program[f'velocities/{each}-aero-rad_sec'] * program[f'aero/{unit}2vel']
           for each, unit in (('p', 'bi'), ('q', 'ci'), ('r', 'bi'))})
    properties['aero/qbar-psf'] = program['aero/qbar-psf']
    assert properties['aero/alpha-rad'] == pytest.approx(alpha, abs=0.01)
    assert properties['aero/poststall/p-hat'] == pytest.approx(0.6 * 3.2 / 30.0, rel=0.05)
    expected = {axis.get('name'): sum(lookup(function, properties)
                                      for function in axis.findall('function'))
                for axis in jsbsim_writer.element(tables).findall('axis')}
    names = {'LIFT': 'forces/fwz-aero-lbs', 'DRAG': 'forces/fwx-aero-lbs',
             'SIDE': 'forces/fwy-aero-lbs', 'ROLL': 'moments/l-aero-lbsft',
             'PITCH': 'moments/m-aero-lbsft', 'YAW': 'moments/n-aero-lbsft'}
    for axis, name in names.items():
        assert program[name] == pytest.approx(expected[axis], rel=1e-6, abs=1e-6), axis


def test_names_that_would_be_no_properties_are_refused(tables):
    change = tables.controls['elevator']
    with pytest.raises(ConfigError, match="'left flap' .* no property of JSBSim"):
        jsbsim_writer.element(dataclasses.replace(tables, controls={'left flap': change}))
    odd = dataclasses.replace(tables, aircraft='a -- b')
    for root in (jsbsim_writer.element(odd),
                 gazebo_writer.element(odd, lift_drag_fit.fit(odd))):
        ET.fromstring(ET.tostring(root))


# --- Gazebo

def plugin_tables(alpha_deg, beta_deg, stall_deg):
    """Return tables of an aircraft that is as the plugin has it, and its parameters."""
    reference = Reference(1.2, 0.35, 3.4)
    truth = {'CL0': 0.3, 'CLa': 4.8, 'alpha_stall': math.radians(stall_deg), 'CLb': 0.05,
             'CD0': 0.03, 'eff': 0.8, 'Cem0': 0.02, 'Cema': -0.9, 'Cema_stall': -1.4,
             'Cemb': 0.01, 'CYa': 0.02, 'CYb': -0.4, 'Cella': 0.01, 'Cellb': -0.1, 'Cena': -0.01,
             'Cenb': 0.08, 'AR': 3.4 ** 2 / 1.2}
    a, b = np.meshgrid(np.radians(alpha_deg), np.radians(beta_deg), indexing='ij')
    across = np.arctan2(np.sin(b), np.cos(a) * np.cos(b))
    lift, drag = lift_drag_fit.lift_and_drag(truth, a, across)
    base = [lift, drag, truth['CYa'] * a + truth['CYb'] * across,
            truth['Cella'] * a + truth['Cellb'] * across,
            lift_drag_fit.moment(truth, a, across),
            truth['Cena'] * a + truth['Cenb'] * across]
    x = np.radians([-10.0, 0.0, 10.0])
    change = np.multiply.outer(np.array([0.3, 0.02, 0.0, 0.0, -1.2, 0.0]),
                               np.broadcast_to(x, (len(alpha_deg), 3)))
    rate = np.multiply.outer(np.array([0.0, 0.0, 0.05, -0.5, 0.0, -0.04]), np.broadcast_to(
        np.array([0.0, 0.05]), (len(alpha_deg), 2)))
    return truth, BuildUp(
        'plane', reference, (0.1, 0.0, 0.0), 1.2, np.radians(alpha_deg), np.radians(beta_deg),
        np.array(base) * np.cos(b) ** 2, {'p': Increment(np.array([0.0, 0.05]), rate)},
        {'elevator': Increment(x, change)})


def test_the_fit_finds_an_aircraft_that_is_as_the_plugin_has_it():
    truth, tables = plugin_tables(np.arange(-12.0, 41.0, 2.0), np.array([-8.0, 0.0, 8.0]), 15.0)
    fit = lift_drag_fit.fit(tables)
    for key, value in truth.items():
        assert fit.values[key] == pytest.approx(value, abs=1e-9), key
    assert max(each[1] for each in fit.worst.values()) < 1e-9
    elevator, = fit.controls.values()
    # By degrees of the joint, as the plugin multiplies.
    assert elevator['Cem_ctrl'] == pytest.approx(-1.2 * math.pi / 180.0)
    assert elevator['CL_ctrl'] == pytest.approx(0.3 * math.pi / 180.0)
    assert fit.values['Cellp'] == pytest.approx(-0.5)
    assert fit.values['Cenp'] == pytest.approx(-0.04)


def test_blending_is_that_of_the_plugin():
    """In the form in which gz-sim writes it."""
    alpha, stall, m = np.linspace(-1.5, 1.5, 31), 0.3, lift_drag_fit.SHARPNESS
    below, above = np.exp(-m * (alpha - stall)), np.exp(m * (alpha + stall))
    assert lift_drag_fit.blend(alpha, stall) == pytest.approx(
        (1.0 + below + above) / ((1.0 + below) * (1.0 + above)), abs=1e-12)


def test_the_fragment_of_sdf_has_what_the_plugin_reads(tables):
    fit = lift_drag_fit.fit(tables)
    root = gazebo_writer.element(tables, fit)
    assert root.get('name') == 'gz::sim::systems::AdvancedLiftDrag'
    assert float(root.find('CLa').text) == pytest.approx(fit.values['CLa'], rel=1e-8)
    assert 4.0 < fit.values['CLa'] < 6.0 and math.radians(12) < fit.values['alpha_stall'] < 0.5
    assert [each.find('name').text for each in root.findall('control_surface')] == \
        ['elevator', 'aileron'] and root.find('num_ctrl_surfaces').text == '2'
    # Trailing edge down lifts the tail, a positive aileron rolls to the right.
    assert float(root.find('control_surface/Cem_ctrl').text) < 0.0
    assert fit.controls['aileron']['Cell_ctrl'] > 0.0 > fit.values['Cellp']
    # The worst of what is left is a point's; no more than the whole lift curve is off by.
    for key in COEFFICIENTS:
        assert fit.rms[key][1] <= fit.worst[key][1] < 0.5


def test_angles_without_a_lift_curve_are_refused():
    _, tables = plugin_tables(np.array([10.0, 12.0]), np.array([0.0]), 15.0)
    with pytest.raises(ConfigError, match='at least 4 angles'):
        lift_drag_fit.fit(tables)
    _, tables = plugin_tables(np.arange(61.0, 70.0), np.array([0.0]), 15.0)
    with pytest.raises(ConfigError, match='angles of attack about 0'):
        lift_drag_fit.fit(tables)


# --- the command

def test_the_command_writes_resumes_and_refuses(tmp_path, capsys):
    words = ['database', '--alpha', '-4:20:6', '--beta', '-5:5:5', '--q', '0:0.01:0.01',
             '--deflect', 'elevator=-10:10:10', '--output', str(tmp_path / 'db'), '--format',
             'csv,jsbsim,gz', '--json', str(tmp_path / 'db.json')]
    assert cli.main(words) == 0
    told = json.loads((tmp_path / 'db.json').read_text())
    assert told['rows'] == 5 * 6 and told['statuses'] == {'converged': 30}
    for name in ('database.csv', 'manifest.json', 'aerodynamics.xml', 'advanced_lift_drag.sdf'):
        assert (tmp_path / 'db' / name).stat().st_size > 200
    capsys.readouterr()
    assert cli.main(words) == 2
    assert '--resume' in capsys.readouterr().err
    assert cli.main([*words, '--resume']) == 0
    assert '30 of them from before' in capsys.readouterr().out
    assert cli.main([*words, '--resume', '--beta', '5']) == 2
    assert 'tables need' in capsys.readouterr().err
    assert cli.main([*words, '--resume', '--airspeed', '14']) == 2
    assert 'airspeed_m_s was 15.0' in capsys.readouterr().err

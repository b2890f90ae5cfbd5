# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The figures of an aircraft, what is odd about it, and new aircraft that fly at once."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import wings

from poststall_sim import cli, definition, derivative_analysis, polar, survey, trim
from poststall_sim.aero import model as models
from poststall_sim.aircraft import MassProperties, Section, Surface
from poststall_sim.controls import Effector
from poststall_sim.frames import GRAVITY, body_to_stability, geometry_to_body
from poststall_sim.plots import strips, sweeps
from poststall_sim.state import Status
from poststall_sim.watch import scene

PLANE = """plane
0.0
0 0 0
0.4 0.2 2.0
0.05 0.0 0.0
SURFACE
wing
4 1 12 1
YDUPLICATE
0.0
SECTION
0.0 0.0 0.0 0.2 1.0
SECTION
0.0 1.0 0.05 0.2 0.0
"""


@pytest.fixture(scope='module')
def trainer():
    """Return the shipped trainer's model, once."""
    return models.build(wings.shipped_aircraft('trainer'))


def findings(model):
    """Return what is odd about an aircraft."""
    return survey.findings(model, survey.survey(model), survey.stall(model))


def found(model):
    """Return the subjects of what is odd about an aircraft."""
    return [each.subject for each in findings(model)]


def changed(trainer, **change):
    """Return the trainer's model with something else in its definition."""
    return models.build(replace(trainer.aircraft, **change))


def test_planform_of_a_swept_trapezoid_is_that_of_the_textbook():
    """Mean chord 2/3 c (1 + t + t^2)/(1 + t), its place b/6 (1 + 2 t)/(1 + t) out."""
    wing = Surface('wing', (Section((0.0, 0.0, 0.0), 2.0, 'a'),
                            Section((1.5, 4.0, 0.0), 1.0, 'a')), strips=8, symmetric=True)
    plan = survey.planform(wing)
    assert plan.area == pytest.approx(12.0) and plan.aspect_ratio == pytest.approx(64.0 / 12.0)
    assert plan.mean_chord == pytest.approx(2.0 / 3.0 * 2.0 * 1.75 / 1.5)
    out = 8.0 / 6.0 * 2.0 / 1.5
    assert plan.quarter_x == pytest.approx(0.25 * 2.0 + out * math.tan(plan.sweep))
    assert math.tan(plan.sweep) == pytest.approx((1.5 + 0.25 - 0.5) / 4.0)
    assert not plan.upright and survey.planform(replace(wing, symmetric=False, sections=(
        Section((0.0, 0.0, 0.0), 1.0, 'a'), Section((0.0, 0.0, 1.0), 1.0, 'a')))).upright


def test_the_wing_is_the_widest_surface_for_all_that_names_one(trainer):
    """Beside a fuselage that is a plate, as AVL's users draw it, of more area than the wing."""
    plate = Surface('fuselage', (Section((-0.5, 0.0, -0.6), 2.2, 'tail'),
                                 Section((-0.5, 0.4, -0.6), 2.2, 'tail')), strips=4,
                    symmetric=True)
    model = changed(trainer, surfaces=(plate, *trainer.aircraft.surfaces))
    lattice = model.lattice
    place = -lattice.quarter_chord[:, 1]
    figures = survey.survey(model).planforms
    assert figures[1].name == 'fuselage' and figures[1].area > figures[0].area
    columns = {'y_m': place.tolist(),
               'surface': [name.rpartition('_')[0] for name in lattice.strip_names]}
    assert {figures[0].name, model.aircraft.surfaces[survey.wing_of(model)].name,
            sweeps._wing(columns), strips._groups(place, lattice)[0].name,
            scene.groups(lattice.strip_names, place.tolist())[0]['name']} == {'wing'}


def test_the_trainer_has_the_figures_of_its_design_and_nothing_odd(trainer):
    """Volumes as its file says; the neutral point is where Cm does not change."""
    figures = survey.survey(trainer)
    wing, tail, fin = figures.planforms
    assert tail.volume == pytest.approx(0.612, abs=0.001)
    assert fin.volume == pytest.approx(0.043, abs=0.001)
    assert found(trainer) == []
    assert figures.authority['aileron'][0] > 0.0 > figures.authority['elevator'][1]
    mass = trainer.aircraft.mass
    there = changed(trainer, mass=replace(
        mass, cg_G=(figures.neutral_point, *mass.cg_G[1:])))
    assert survey.survey(there).static_margin == pytest.approx(0.0, abs=1e-3)


def test_each_oddity_is_found_where_it_is(trainer):
    """One thing wrong at a time, and that one named."""
    aircraft = trainer.aircraft
    mass = aircraft.mass
    wing, tail, fin = aircraft.surfaces
    level = replace(tail, sections=tuple(replace(
        s, leading_edge_G=(*s.leading_edge_G[:2], 0.02)) for s in tail.sections))
    aileron, elevator, rudder = aircraft.controls
    backwards = replace(aileron, effectors=tuple(
        replace(e, gain=-e.gain) for e in aileron.effectors))
    cliff = np.array(aircraft.airfoils[0].cl)
    alpha = aircraft.airfoils[0].alpha
    cliff[(alpha > 0.30) & (alpha < 0.6)] -= 0.5
    for change, subject in (
            ({'mass': replace(mass, cg_G=(0.30, *mass.cg_G[1:]))}, 'static margin'),
            ({'mass': MassProperties(mass.mass, mass.cg_G, 9.0 * mass.inertia_B)},
             'inertia in roll'),
            ({'surfaces': (wing, level, fin)}, 'tail'),
            ({'surfaces': (wing.cut(6), tail, fin)}, 'wing'),
            ({'controls': (backwards, elevator, rudder)}, 'aileron'),
            ({'controls': (aileron, rudder)}, 'elevator'),
            ({'airfoils': (replace(aircraft.airfoils[0], cl=cliff), aircraft.airfoils[1])},
             'airfoil wing')):
        assert subject in found(changed(trainer, **change)), subject


def v_tailed(trainer, dihedral, gains):
    """Return the trainer on a V-tail at a dihedral [deg], with gains of elevator and rudder."""
    aircraft = trainer.aircraft
    wing, tail, _ = aircraft.surfaces
    aft, up = 1.26, math.radians(dihedral)
    halves = replace(tail, name='vee', sections=tuple(
        Section((aft, 0.6 * share * math.cos(up), 0.6 * share * math.sin(up)), 0.3,
                tail.sections[0].airfoil) for share in (0.0, 1.0)))
    aileron, elevator, rudder = aircraft.controls
    mixed = [replace(control, effectors=tuple(
        Effector('vee', hinge=0.65, side=side, gain=gain) for side, gain in zip((1, -1), each)))
        for control, each in zip((elevator, rudder), gains)]
    return changed(trainer, surfaces=(wing, halves), controls=(aileron, *mixed))


def test_a_v_tail_is_level_to_45_deg_and_two_fins_beyond_and_what_mixes_it_wrong_is_said(trainer):
    """Both turn the nose down by elevator and to the left by rudder with the gains of the page."""
    level, steep = ((1.0, 1.0), (-1.0, 1.0)), ((-1.0, 1.0), (1.0, 1.0))
    for dihedral, gains in ((40.0, level), (50.0, steep)):
        figures = survey.survey(v_tailed(trainer, dihedral, gains))
        assert figures.authority['elevator'][1] < -0.3 and figures.authority['rudder'][2] < -0.02
        assert abs(figures.authority['elevator'][2]) < 1e-9
    wrong = v_tailed(trainer, 50.0, level)
    elevator, = (each for each in findings(wrong) if each.subject == 'elevator')
    assert 'vee is steeper than 45 deg' in elevator.what and 'gain -1 on the' in elevator.advice
    assert not {'vertical tail', 'horizontal tail volume'} & set(found(wrong))


def test_a_centre_of_gravity_far_aft_is_no_small_tail(trainer):
    """Its place for the least margin is said, and is right; nothing is said of the tail."""
    mass = trainer.aircraft.mass
    far = changed(trainer, mass=replace(mass, cg_G=(0.9, *mass.cg_G[1:])))
    subjects = {each.subject: each for each in findings(far)}
    assert 'static margin' in subjects and not {each for each in subjects if 'tail' in each}
    to = float(subjects['static margin'].advice.split('to x = ')[1].split(' m')[0])
    there = changed(trainer, mass=replace(mass, cg_G=(to, *mass.cg_G[1:])))
    # The neutral point does not move but for the drag's arm, of which there is little.
    assert survey.survey(there).static_margin == pytest.approx(0.05, abs=3e-3)


def test_check_says_what_to_do_and_strict_has_an_exit_code(tmp_path, capsys, monkeypatch):
    """In words, and in JSON."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(['check', 'trainer', '--strict']) == 0
    assert 'nothing odd' in capsys.readouterr().out
    text = definition.find(definition.Kind.AIRCRAFT, 'trainer').read_text()
    (tmp_path / 'aft.yaml').write_text(text.replace('cg_m: [0.19', 'cg_m: [0.26'))
    assert cli.main(['check', 'aft.yaml', '--json', 'aft.json']) == 0
    assert 'Move the centre of gravity forward' in capsys.readouterr().out
    assert cli.main(['check', 'aft.yaml', '--strict']) == 1
    assert json.loads((tmp_path / 'aft.json').read_text())['static_margin'] < 0.0


def test_show_draws_and_writes(tmp_path, capsys, monkeypatch):
    """A figure with ink on it, AVL's files, and the table."""
    pytest.importorskip('matplotlib')
    monkeypatch.chdir(tmp_path)
    assert cli.main(['show', 'trainer', '--plot', 'trainer.png', '--avl', 'back.avl']) == 0
    said = capsys.readouterr().out
    assert 'static margin' in said and '0.612' in said and 'stall speed 8.62 m/s' in said
    assert (tmp_path / 'trainer.png').stat().st_size > 20_000
    assert definition.aircraft(tmp_path / 'back.avl').mass.mass == 9.0


@pytest.mark.parametrize(('span', 'chord', 'mass', 'odd'), [
    (4.0, 0.3, 5.0, []), (1.2, 0.2, 0.8, ['sections'])])
def test_a_new_aircraft_passes_its_check_trims_and_flies(tmp_path, monkeypatch, span, chord, mass,
                                                         odd):
    """
    Nothing odd, 5 to 20 % stable, level at CL 0.5, and two seconds of the stall scenario.

    A small one flies its tail at Reynolds numbers far below the shipped table's: that is said.
    """
    monkeypatch.chdir(tmp_path)
    assert cli.main(['new', 'mine', '--span', str(span), '--chord', str(chord), '--mass',
                     str(mass)]) == 0
    model = models.build(definition.aircraft('mine.yaml'))
    assert found(model) == odd
    assert 0.05 < survey.survey(model).static_margin < 0.20
    cruise = math.sqrt(2.0 * mass * 9.81 / (1.225 * span * chord * 0.5))
    level = trim.straight(model, airspeed=cruise, altitude=100.0)
    assert level.status is Status.CONVERGED and 0.0 < level.controls.throttle < 1.0
    assert cli.main(['fly', '--aircraft', 'mine.yaml', '--duration', '2', '--airspeed',
                     f'{cruise:.2f}', '--json', 'flight.json']) == 0
    flown = json.loads((tmp_path / 'flight.json').read_text())['summary']
    assert flown['flown_s'] == pytest.approx(2.0, abs=0.02)
    assert abs(flown['altitude_lost_m']) < 1.0 and flown['not_converged_steps'] == 0


def test_new_and_show_mean_the_same_tail_volume_and_lengths_are_in_millimetres(tmp_path,
                                                                               monkeypatch):
    """Rounding moves the volume by half a millimetre in a chord of 0.14 m and in its span."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(['new', 'mine', '--span', '2', '--chord', '0.2', '--mass', '2',
                     '--tail-volume', '0.62']) == 0
    aircraft = definition.aircraft('mine.yaml')
    tail = survey.survey(models.build(aircraft)).planforms[1]
    assert tail.volume == pytest.approx(0.62, rel=0.01)
    lengths = [*aircraft.mass.cg_G, *aircraft.engines[0].position_G, *(
        length for surface in aircraft.surfaces for section in surface.sections
        for length in (*section.leading_edge_G, section.chord))]
    assert 1e3 * np.array(lengths) == pytest.approx(np.round(1e3 * np.array(lengths)), abs=1e-9)


def test_ailerons_that_move_together_are_called_that_and_no_sign_is_claimed(trainer):
    aileron, *others = trainer.aircraft.controls
    flaps = replace(aileron, effectors=tuple(replace(e, gain=1.0) for e in aileron.effectors))
    model = changed(trainer, controls=(flaps, *others))
    figures = survey.survey(model)
    finding, = survey.findings(model, figures, None)
    assert finding.subject == 'aileron' and survey.backwards(figures) == ()
    assert finding.what == 'right and left move together: it does not roll'


def test_sections_far_from_their_reynolds_numbers_are_found(trainer):
    """Level at the stall 9 kg on 1.28 m^2 with a greatest lift of 1.5 fly 8.6 m/s: 2.4e5."""
    wing, tail = trainer.aircraft.airfoils
    for factor, odd in ((1.0, []), (3.0, ['sections'])):
        model = changed(trainer, airfoils=(replace(wing, reynolds=factor * wing.reynolds), tail))
        assert found(model) == odd
    finding, = findings(model)
    assert finding.what.endswith('its tables are of 1.2e+06')


def test_at_the_stall_speed_the_greatest_lift_is_the_weight(trainer):
    """The lift of the lattice in newtons; a degree to both sides it is less."""
    stall, air = survey.stall(trainer), trainer.atmosphere.at(0.0)
    weight = trainer.aircraft.mass.mass * GRAVITY
    lifts = [-body_to_stability(geometry_to_body(each.aero.force_G), each.condition.alpha)[2]
             for each in polar.sweep(trainer, [polar.Condition(
                 stall.alpha + math.radians(turn)) for turn in (-1.0, 0.0, 1.0)],
                 airspeed=stall.airspeed, density=air.density)]
    # To what the closure's tolerance of 1e-5 rad leaves.
    assert lifts[1] == pytest.approx(weight, rel=1e-4) and lifts[1] == max(lifts)
    high = trainer.atmosphere.at(3000.0)
    assert polar.stall(trainer.aircraft, [0.2, 0.3, 0.4], [1.0, stall.lift, 1.2], high.density) \
        .airspeed == pytest.approx(stall.airspeed * math.sqrt(air.density / high.density))


@pytest.mark.parametrize('lifts', [
    [], [1.0], [0.5, 1.0, 1.5], [1.5, 1.0, 0.5], [-3.0, -1.0, -2.0]])
def test_a_polar_whose_lift_is_greatest_at_an_end_has_no_stall(trainer, lifts):
    assert polar.stall(trainer.aircraft, 0.1 * np.arange(len(lifts)), lifts, 1.2) is None


def test_a_polar_ends_with_its_stall_and_only_where_it_is_one(tmp_path, capsys, monkeypatch):
    """The same as the survey's; in attached flow, sideslip or rotation nothing stalls."""
    monkeypatch.chdir(tmp_path)
    words = ['polar', '--alpha', '16:20:1', '--json', 'polar.json']
    for more, said in (([], True), (['--altitude', '3000'], True), (['--beta', '5'], False),
                       (['--p', '0.05'], False), (['--no-decambering'], False)):
        assert cli.main([*words, *more]) == 0
        result = json.loads((tmp_path / 'polar.json').read_text())
        assert ('stall speed' in capsys.readouterr().out) == said == (result['stall'] is not None)
        if not more:
            stall = survey.stall(models.build(wings.shipped_aircraft('trainer')))
            # Found along other angles: the same to what the closure's tolerance leaves.
            assert result['stall']['airspeed_m_s'] == pytest.approx(stall.airspeed, rel=1e-4)
            assert result['stall']['alpha_deg'] == pytest.approx(math.degrees(stall.alpha))


def test_the_static_margin_of_the_survey_is_that_of_attached_derivatives(trainer):
    """Both take differences of the same flow; with the sections' curves it is another."""
    attached = replace(trainer, settings=replace(trainer.settings, decambering=False))
    margins = [next(derivative_analysis.along(
        model, [survey.ALPHA], beta=0.0, deflected=np.zeros(3), airspeed=15.0,
        altitude=0.0))['static_margin'] for model in (attached, trainer)]
    assert margins[0] == pytest.approx(survey.survey(trainer).static_margin, abs=1e-5)
    assert 0.001 < margins[0] - margins[1] < 0.01


def test_a_new_aircraft_has_its_guesses_to_three_digits(tmp_path, monkeypatch):
    """Inertias, thrust and where it ends; and masses that an AVL file leaves open."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(['new', 'mine', '--span', '1.9', '--chord', '0.23', '--mass', '2.37']) == 0
    (tmp_path / 'plane.avl').write_text(PLANE)
    assert cli.main(['new', 'other', '--from', 'plane.avl']) == 0
    for name in ('mine', 'other'):
        aircraft = definition.aircraft(f'{name}.yaml')
        engine, = aircraft.engines
        for value in (*np.diag(aircraft.mass.inertia_B), engine.static_thrust,
                      engine.zero_thrust_airspeed, aircraft.mass.mass):
            assert value == float(f'{value:.3g}')


def test_sections_that_stand_in_for_unknown_ones_are_found_until_there_are_tables(
        tmp_path, monkeypatch):
    """Of an AVL file, and then of what was made of it; no shipped section is one."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'plane.avl').write_text(PLANE)
    assert cli.main(['new', 'other', '--from', 'plane.avl']) == 0
    other = definition.aircraft('other.yaml')
    said, = (each.what for each in findings(models.build(other)) if each.subject == 'sections')
    assert said == 'flat of wing: past the stall one generic plate, before it without drag'
    table = replace(wings.shipped_aircraft('trainer').airfoils[0], name='flat')
    known = models.build(replace(other, airfoils=(table,)))
    assert not [each for each in findings(known) if 'generic plate' in each.what]
    there = definition.aircraft('plane.avl')
    assert [each.subject for each in findings(models.build(there))
            if 'generic plate' in each.what] == ['assumed']


def test_new_from_avl_writes_the_same_lattice(tmp_path, monkeypatch):
    """Our YAML and CSV have all that the AVL file has, and an engine."""
    monkeypatch.chdir(tmp_path)
    first = wings.shipped_aircraft('trainer')
    assert cli.main(['show', 'trainer', '--avl', 'plane.avl']) == 0
    assert cli.main(['new', 'mine', '--from', 'plane.avl']) == 0
    ours, theirs = definition.aircraft('mine.yaml'), definition.aircraft('plane.avl')
    assert ours.engines and not theirs.engines and ours.mass.mass == first.mass.mass
    one, other = (models.lattices.build(each, 4) for each in (ours, theirs))
    for key in ('ring_corners', 'normal', 'turn'):
        assert getattr(one, key) == pytest.approx(getattr(other, key), abs=1e-9)
    assert one.curves == pytest.approx(other.curves, abs=1e-5)


@pytest.mark.parametrize(('options', 'complaint'), [
    (['new', '2fast', '--span', '4'], 'must be a name'),
    (['new', 'mine', '--span', '4'], 'new needs --chord'),
    (['new', 'mine', '--span', '4', '--chord', '3', '--mass', '1'], 'span over chord'),
    (['new', 'mine', '--from', 'nowhere.avl', '--span', '4'], '--span has no effect'),
    (['new', 'mine', '--from', 'nowhere.avl'], 'nowhere.avl: does not exist')])
def test_bad_numbers_are_refused_in_one_line(capsys, tmp_path, monkeypatch, options, complaint):
    monkeypatch.chdir(tmp_path)
    assert cli.main(options) == 2
    error = capsys.readouterr().err
    assert complaint in error and error.count('\n') == 1

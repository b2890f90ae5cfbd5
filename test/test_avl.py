# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""AVL's files read and written, and what AVL says of them at the same lattice."""

import math
from dataclasses import replace

import numpy as np
import pytest

from poststall_sim import (
    airfoil_report,
    avl_mass,
    avl_reader,
    avl_sections,
    avl_writer,
    cli,
    definition,
)
from poststall_sim.aero import lattice, polars
from poststall_sim.aero import model as models
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import geometry_to_body
from poststall_sim.polar import Condition, point
from poststall_sim.reader import Place

HEAD = 'Test plane\n0.0\n0 0 0.0  ! symmetry\n1.28 0.4 3.2\n0.19 0 0\n'
CONVENTIONAL = HEAD + """
SURFACE
Wing
6 0.0 12 0.0
YDUPLICATE
0.0
SECTION
0 0 0 0.5 0
CONTROL
flap 1.0 0.75 0 0 0 1.0
SECTION
0.1 0.8 0.03 0.42 0
CONTROL
flap 1.0 0.75 0 0 0 1.0
CONTROL
aileron -1.0 0.75 0 0 0 -1.0
SECTION
0.2 1.6 0.08 0.3 -2
CONTROL
aileron -1.0 0.75 0 0 0 -1.0
SURFACE
Tail
6 0.0 6 0.0
YDUPLICATE
0.0
TRANSLATE
1.2 0 0.15
SECTION
0 0 0 0.28 -1
CONTROL
elevator 1.0 0.6 0 0 0 1.0
SECTION
0.08 0.52 0 0.2 -1
CONTROL
elevator 1.0 0.6 0 0 0 1.0
SURFACE
Fin
6 0.0 6 0.0
TRANSLATE
1.15 0 0.15
SECTION
0 0 0.0 0.36 0
CONTROL
rudder 1.0 0.55 0 0 0 1.0
SECTION
0.12 0 0.45 0.24 0
CONTROL
rudder 1.0 0.55 0 0 0 1.0
"""
SWEPT = HEAD.replace('1.28 0.4 3.2', '9.0 1.25 7.5').replace('0.19', '0.9') + """
# crowded towards the tip by a sine, washed out, hinges at another share of each chord
SURFACE
Wing
5 0.0 12 -2.0
YDUPLICATE
0.0
ANGLE
1.5
SECTION
0 0 0 1.6 0
SECTION
1.0 2.2 0.1 1.2 -0.5
CONTROL
aileron 1.0 0.75 0 1 0 -1
SECTION
1.75 3.75 0.2 0.7 -2
CONTROL
aileron 1.0 0.65 0 1 0 -1
SURFACE
V tail
5 0.0 8 1.0
YDUPLICATE
0.0
TRANSLATE
4.2 0 0.4
SECTION
0 0 0 0.9 -1
CONTROL
elevator 1.0 0.7 0 0 0 1
CONTROL
rudder 1.0 0.7 0 0 0 -1
SECTION
0.5 1.1 0.8 0.5 -1
CONTROL
elevator 1.0 0.7 0 0 0 1
CONTROL
rudder 1.0 0.7 0 0 0 -1
"""
SURFACE = """SURFACE
Wing
2 0.0 4 0.0
YDUPLICATE
{half}
SECTION
0 {root} 0 1 0
CONTROL
flap 1.0 0.75 0.3 1 0 1
SECTION
0 {y} 0 1 0
CONTROL
flap 1.0 0.75 0.3 1 0 1
"""
# Hinges off their lines: along a taper's, about y, and about a vector that SCALE turns as well.
OFF = SWEPT.replace('0.75 0 1 0 -1', '0.75 0 0 0 -1').replace('0.65 0 1 0 -1', '0.65 0 0 0 -1') \
    .replace('elevator 1.0 0.7 0 0 0', 'elevator 1.0 0.7 0 1 0') \
    .replace('rudder 1.0 0.7 0 0 0', 'rudder 1.0 0.7 0.2 1 1') \
    .replace('TRANSLATE', 'SCALE\n1.0 1.2 0.9\nTRANSLATE')


@pytest.fixture
def read(tmp_path):
    """Return an aircraft from the text of an AVL file, and of a mass file beside it."""
    def read(text, mass=None):
        (tmp_path / 'plane.avl').write_text(text)
        if mass is not None:
            (tmp_path / 'plane.mass').write_text(mass)
        return definition.aircraft(tmp_path / 'plane.avl')
    return read


def figures(aircraft, rows, alpha_deg, **settings):
    """Return coefficients and their derivatives as AVL prints them, in body axes but CL and CD."""
    model = models.build(aircraft, models.Settings(
        chordwise=rows, decambering=False, unsteady=False, **settings))
    alpha, count = math.radians(alpha_deg), len(aircraft.controls)
    reference = aircraft.reference
    lengths = [reference.span, reference.chord, reference.span]

    def at(alpha=alpha, rates=(0.0, 0.0, 0.0), deflections=None):
        found = point(model, Condition(
            alpha, 0.0, np.array(rates), np.zeros(count) if deflections is None else deflections),
            airspeed=1.0, density=2.0 / reference.area)
        c = found.coefficients
        loads = np.concatenate([geometry_to_body(found.aero.force_G),
                                geometry_to_body(found.aero.moment_G) / lengths])
        return {'CL': c.CL, 'CD': c.CD, 'CDff': found.induced_far,
                **dict(zip(('CX', 'CY', 'CZ', 'Cl', 'Cm', 'Cn'), loads))}

    step = 1e-3
    result = at()
    changes = {'alpha': {'alpha': alpha}, **{
        letter: {'rates': row} for letter, row in zip('pqr', np.eye(3))}, **{
        name: {'deflections': row} for name, row in zip(aircraft.control_names, np.eye(count))}}
    for name, change in changes.items():
        (key, value), = change.items()
        high, low = (at(**{key: alpha + sign * step if key == 'alpha' else sign * step * value})
                     for sign in (1.0, -1.0))
        result |= {f'{key}_{name}': (high[key] - low[key]) / (2.0 * step) for key in high}
    return result


# AVL 3.4x as built into OptVL 2.5.0 (`pip install optvl`), on the file above, with what near-field
# potential flow is in it: forces of the trailing legs (LTRFORCE) and no cores between surfaces
# (VRCOREW 0). Its controls per degree are here per radian. Its wakes go along x, as here. Of the
# swept wing its drag is 6 % less on the edges than in its Trefftz plane, for what edges miss at
# corners (see `corners`); ours lies between, as do side force and yaw of roll, and is not asked.
AVL = {
    'conventional': (CONVENTIONAL, 6, 3.0, {
        'CL': 0.240896, 'Cm': -0.0290913, 'CD': 0.0022802, 'CL_alpha': 5.411,
        'Cm_alpha': -1.38042, 'Cl_p': -0.540715, 'CZ_q': -10.2323, 'Cm_q': -13.4041,
        'Cl_r': 0.0487775, 'CL_flap': 1.37766, 'Cm_flap': 0.253092, 'Cl_aileron': 0.346389,
        'CL_elevator': 0.620821, 'Cm_elevator': -1.63714, 'CY_rudder': -0.252618,
        'Cl_rudder': -0.0203524, 'Cn_rudder': 0.0912254, 'CD_flap': 0.027782}),
    'swept': (SWEPT, 5, 2.0, {
        'CL': 0.226226, 'Cm': -0.0138747, 'CL_alpha': 4.67338, 'Cm_alpha': -1.6443,
        'Cl_p': -0.429635, 'CZ_q': -9.04048, 'Cm_q': -11.9281, 'Cl_r': 0.0852667,
        'Cl_aileron': -0.237273, 'CL_elevator': 0.431172, 'Cm_elevator': -1.26839,
        'CY_rudder': -0.172103, 'Cl_rudder': -0.0362112, 'Cn_rudder': 0.0903687}),
}
TOLERANCES = {'CL': 0.005, 'Cm': 0.01, 'CD': 0.02, 'CL_alpha': 0.005}


@pytest.mark.parametrize('name', AVL)
def test_the_lattice_says_what_avl_says(read, name):
    """CL 0.5 %, Cm 1 %, CD 2 %, rate derivatives 1 %, control derivatives 2 %."""
    text, rows, alpha, expected = AVL[name]
    aircraft = read(text)
    ours = figures(aircraft, rows, alpha, axial_wake=True)
    for key, value in expected.items():
        by_control = key.partition('_')[2] in aircraft.control_names
        tolerance = TOLERANCES.get(key, 0.02 if by_control else 0.01)
        assert ours[key] == pytest.approx(value, rel=tolerance), key


# The same as it prints them of its own accord, without forces of the trailing legs, but with all
# surfaces in one component, which is without cores.
AS_AVL = {
    'conventional': (CONVENTIONAL, 6, 3.0, {
        'CL': 0.240896, 'Cm': -0.0290913, 'CD': 0.0022802, 'CDff': 0.00229424, 'CL_alpha': 5.411,
        'Cm_alpha': -1.38042, 'CX_q': 0.376715, 'CY_p': -0.0770581, 'CY_r': 0.258953,
        'CZ_q': -10.2323, 'Cl_p': -0.540999, 'Cl_r': 0.04706, 'Cm_q': -13.4041,
        'Cn_p': -0.0438239, 'Cn_r': -0.0872512, 'CL_flap': 1.37766, 'CL_elevator': 0.620821,
        'CD_flap': 0.027782, 'CD_elevator': 0.0155019, 'CY_aileron': 0.0325963,
        'CY_rudder': -0.251297, 'Cl_aileron': 0.346439, 'Cl_rudder': -0.0208542,
        'Cm_flap': 0.253092, 'Cm_elevator': -1.63714, 'Cn_aileron': 0.0168948,
        'Cn_rudder': 0.0907557}),
    'swept': (SWEPT, 5, 2.0, {
        'CL': 0.226226, 'Cm': -0.0138747, 'CD': 0.00248777, 'CDff': 0.00264804,
        'CL_alpha': 4.67338, 'Cm_alpha': -1.6443, 'CX_q': 0.174755, 'CY_p': -0.0538185,
        'CY_r': 0.16579, 'CZ_q': -9.04048, 'Cl_p': -0.429795, 'Cl_r': 0.0799924,
        'Cm_q': -11.9281, 'Cn_p': -0.0177625, 'Cn_r': -0.0780918, 'CL_elevator': 0.431172,
        'CD_elevator': 0.00610587, 'CY_aileron': -0.0288552, 'CY_rudder': -0.170811,
        'Cl_aileron': -0.237296, 'Cl_rudder': -0.0363053, 'Cm_elevator': -1.26839,
        'Cn_aileron': -0.001277, 'Cn_rudder': 0.0897357}),
    'hinges off their lines': (OFF, 5, 6.0, {
        'CL': 0.558951, 'CD': 0.0150039, 'CDff': 0.0158561, 'Cm': -0.152308,
        'CL_elevator': 0.469406, 'CD_elevator': 0.029551, 'CX_elevator': 0.0196772,
        'CY_aileron': -0.0204023, 'CY_rudder': -0.160076, 'CZ_elevator': -0.469924,
        'Cl_aileron': -0.230306, 'Cl_rudder': -0.0433247, 'Cm_elevator': -1.38626,
        'Cn_aileron': -0.00723489, 'Cn_rudder': 0.0834906}),
}


@pytest.mark.parametrize('name', AS_AVL)
def test_by_avls_rules_of_forces_all_is_what_avl_says(read, name):
    """To the digits given, controls too: about their hinge lines or the vectors of the file."""
    text, rows, alpha, expected = AS_AVL[name]
    ours = figures(read(text), rows, alpha, as_avl=True)
    for key, value in expected.items():
        assert ours[key] == pytest.approx(value, rel=2e-5), key


@pytest.mark.parametrize('text', [CONVENTIONAL, SWEPT, OFF])
def test_what_is_written_is_read_as_the_same_lattice(read, tmp_path, text):
    """Strips, points, turned normals and what controls turn; masses too."""
    first = read(text)
    second = read(avl_writer.text(first, 5), avl_mass.text(first.mass, first.name))
    one, other = lattice.build(first, 5), lattice.build(second, 5)
    for key in ('ring_corners', 'collocation', 'normal', 'zero_lift', 'strip_normal'):
        assert getattr(other, key) == pytest.approx(getattr(one, key), abs=1e-9), key
    order = [second.control_names.index(control) for control in first.control_names]
    turned, again = (each.mixing.T @ each.turn for each in (one, other))
    assert again[order] == pytest.approx(turned, abs=1e-9)
    turned, again = (each.mixing.T @ each.slant for each in (one, other))
    assert again[order] == pytest.approx(turned, abs=1e-9) and np.any(turned)
    assert second.mass.inertia_B == pytest.approx(first.mass.inertia_B, rel=1e-12)
    assert second.mass.cg_G == pytest.approx(first.mass.cg_G, rel=1e-12)
    assert second.reference == first.reference


def test_surfaces_that_stand_on_each_other_are_written_as_one_component(read):
    """AVL has cores of two strip widths between components."""
    lines = avl_writer.text(read(CONVENTIONAL), 4).splitlines()
    components = {lines[i - 2]: lines[i + 1] for i, line in enumerate(lines)
                  if line == 'COMPONENT'}
    assert components['Tail'] == components['Fin'] != components['Wing']


def test_one_of_several_tables_is_written_and_said(read):
    """That in the middle, whichever the order: more Reynolds numbers AVL has no place for."""
    aircraft = read(CONVENTIONAL)
    plain, = aircraft.airfoils
    tables = tuple(replace(plain, reynolds=reynolds, cd=plain.cd + 1e3 / reynolds)
                   for reynolds in (1e6, 1e5, 4e5))
    text = avl_writer.text(replace(aircraft, airfoils=tables), 4)
    assert text == avl_writer.text(replace(aircraft, airfoils=tables[::-1]), 4)
    assert text.startswith('# airfoil flat: of its 3 tables the one at Reynolds number 400000 is')
    lines = text.splitlines()
    drag = [float(lines[i + 1].split()[3]) for i, line in enumerate(lines) if line == 'CDCL']
    assert drag == pytest.approx([1e3 / 4e5] * len(drag), abs=1e-6) and drag


def test_a_new_aircraft_has_controls_that_sticks_mind(tmp_path, monkeypatch, capsys):
    """AVL's rudder is positive to the right about the z axis; ours to the left, which is said."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'plane.avl').write_text(CONVENTIONAL)
    assert cli.main(['new', 'mine', '--from', 'plane.avl']) == 0
    said = 'rudder: its sign is not that of the file, in which a positive one yaws to the right'
    assert said in capsys.readouterr().out
    assert f'# {said}' in (tmp_path / 'mine.yaml').read_text()
    ours, theirs = (definition.aircraft(tmp_path / name) for name in ('mine.yaml', 'plane.avl'))
    gains = [{control.name: [e.gain for e in control.effectors] for control in each.controls}
             for each in (ours, theirs)]
    assert gains[0].pop('rudder') == [1.0] and gains[1].pop('rudder') == [-1.0]
    assert gains[0] == gains[1]
    # Back again the file has the same rudder, of the other sign.
    (tmp_path / 'back.avl').write_text(avl_writer.text(ours, 6))
    assert definition.aircraft(tmp_path / 'back.avl').controls[-1].effectors[0].gain == 1.0


def test_shipped_aircraft_go_through_avl_and_back(read):
    """Their strips to round-off; their zero-lift angles as well as a camber line of points can."""
    for name in ('trainer', 'wing_tail'):
        path = definition.find(definition.Kind.AIRCRAFT, name)
        first = definition.aircraft(path)
        one = lattice.build(first, 4)
        other = lattice.build(read(avl_writer.text(first, 4)), 4)
        assert other.ring_corners == pytest.approx(one.ring_corners, abs=1e-9)
        assert other.zero_lift == pytest.approx(one.zero_lift, abs=1e-4)


def test_scale_translate_angle_and_both_kinds_of_images(read):
    """A half drawn from its tip, off the plane of symmetry, in another unit."""
    text = HEAD + """SURFACE
Boom fin
2 0 4 0
SCALE
2.0 2.0 3.0
TRANSLATE
1.0 0.5 0.25
YDUPLICATE
0.0
SECTION
0.1 0 0.5 0.2 0
SECTION
0 0 0 0.25 0
"""
    right, left = read(text, 'Lunit = 10.0 cm\n1 0 0 0 1 1 1\n').surfaces
    assert (right.name, left.name) == ('Boom_fin', 'Boom_fin_image')
    # From below upwards; chords by the scale of x; everything times 0.1 m.
    assert right.sections[0].leading_edge_G == pytest.approx((0.1, 0.05, 0.025))
    assert right.sections[1].leading_edge_G == pytest.approx((0.12, 0.05, 0.175))
    assert right.sections[0].chord == pytest.approx(0.05)
    assert left.sections[1].leading_edge_G == pytest.approx((0.12, -0.05, 0.175))


def test_signs_of_controls_follow_the_hinge_vector(read):
    """AVL turns by the right-hand rule; the image by SgnDup. Ours: trailing edge down, or left."""
    aircraft = read(CONVENTIONAL)
    controls = {control.name: control for control in aircraft.controls}
    assert {(e.side, e.gain) for e in controls['aileron'].effectors} == {(1, -1.0), (-1, 1.0)}
    assert [(e.side, e.gain) for e in controls['elevator'].effectors] == [(0, 1.0)]
    # About the z axis a trailing edge goes to the right.
    assert [e.gain for e in controls['rudder'].effectors] == [-1.0]
    turned = read(CONVENTIONAL.replace('rudder 1.0 0.55 0 0 0', 'rudder 1.0 0.55 0 0 -1'))
    rudder, = turned.controls[-1].effectors
    assert (rudder.gain, rudder.hinge_axis) == (1.0, (0.0, 0.0, -1.0))
    # Along the hinge line there is nothing to say, but where that is no line of the chords is.
    assert all(e.hinge_axis is None for e in controls['aileron'].effectors)
    tapered = read(CONVENTIONAL.replace('rudder 1.0 0.55 0 0 0', 'rudder 1.0 0.45 0 0 0', 1))
    line = np.array([0.12 + 0.55 * 0.24 - 0.45 * 0.36, 0.0, 0.45])
    for rudder in tapered.controls[-1].effectors:
        assert rudder.hinge_axis == pytest.approx(line / np.linalg.norm(line))


def test_an_image_that_stands_still_has_nothing_that_moves(read):
    """SgnDup 0, of both sides of one surface, there and back, and of a surface of its own."""
    first = read(CONVENTIONAL.replace('aileron -1.0 0.75 0 0 0 -1.0', 'aileron -1.0 0.75 0 0 0 0'))
    for aircraft in (first, read(avl_writer.text(first, 4))):
        aileron, = (each for each in aircraft.controls if each.name == 'aileron')
        assert [(each.side, each.gain) for each in aileron.effectors] == [(1, -1.0)]
    apart = SURFACE.format(half='0.0', y=2.0, root=0.5).replace('0.3 1 0 1', '0.3 1 0 0')
    assert [each.surface for each in read(HEAD + apart).controls[0].effectors] == ['Wing']


def test_axis_of_an_image_is_that_of_the_right_side(read):
    """Drawn on the left, or as two surfaces of their own."""
    wing = SURFACE.format(half='0.0', y=-2.0, root=0.0)
    flap, = read(HEAD + wing).controls[0].effectors
    assert (flap.side, flap.gain, flap.hinge_axis) == (0, 1.0, (0.3, -1.0, 0.0))
    apart = read(HEAD + SURFACE.format(half='0.0', y=2.0, root=0.5)).controls[0].effectors
    assert {(e.surface, e.gain, e.hinge_axis) for e in apart} == {
        ('Wing', 1.0, (0.3, 1.0, 0.0)), ('Wing_image', 1.0, (0.3, -1.0, 0.0))}


def test_a_hinge_across_the_span_moves_nothing(read):
    assert read(CONVENTIONAL.replace('elevator 1.0 0.6 0 0 0', 'elevator 1.0 0.6 1 0 0')) \
        .control_names == ('flap', 'aileron', 'rudder')


def test_camber_lines_have_the_angles_of_thin_airfoil_theory():
    """Zero lift of the 2412 at -2.08 deg and cm -0.053 (thin camber line; Abbott & Doenhoff)."""
    where = Place('test')
    line = avl_sections.camber(avl_sections.naca('2401', where), where)
    for rows, spacing in ((200, 0.0), (40, 1.0)):
        found = avl_sections.thin_airfoil(line, rows, spacing)
        assert math.degrees(found.zero_lift) == pytest.approx(-2.077, abs=0.01)
        assert found.moment == pytest.approx(-0.0531, abs=5e-4)
    # A parabola of height h: -2 h and -pi h, on any even panels.
    h = 0.02
    parabola = avl_sections.thin_airfoil(lambda x: 4.0 * h * (1.0 - 2.0 * x), 3)
    assert parabola.zero_lift == pytest.approx(-2.0 * h, rel=1e-12)


def test_generic_sections_stall_and_are_softer_than_strips_can_bear():
    """
    Attached as given within 8 deg; then the sum of attached and plate that it says, and gently.

    The greatest of k 2 pi sin a + (1 - k) 1.1 sin 2a by itself, on a fine row of angles. Of 40
    strips on aspect ratio 8 half the fall would still leave one solution.
    """
    flat = avl_sections.section('flat', avl_sections.ThinAirfoil(0.0, 0.0), 1.0, (0.01,))
    polar = polars.section_polar(flat)
    near = np.radians([-8.0, 3.0, 8.0])
    assert polar.at(near)[:, 0] == pytest.approx(2.0 * math.pi * np.sin(near), abs=1e-4)
    assert polar.at(near)[:, 1] == pytest.approx(0.01)
    alpha = np.linspace(0.0, 0.5, 5001)
    gone = np.clip((alpha - avl_sections.STALL) / avl_sections.WIDTH, 0.0, 1.0)
    k = 1.0 - gone ** 2 * (3.0 - 2.0 * gone)
    lift = 2.0 * math.pi * k * np.sin(alpha) + 1.1 * (1.0 - k) * np.sin(2.0 * alpha)
    found = airfoil_report.figures(polar).positive
    # The table has a row a degree; the spline between them keeps the top to a few 1e-4.
    assert found.cl == pytest.approx(lift.max(), abs=2e-3)
    assert found.alpha == pytest.approx(alpha[np.argmax(lift)], abs=math.radians(0.5))
    limit = airfoil_report.steepest_unique_fall(flat, aspect_ratio=8.0, strips=40)
    assert 0.5 * limit < found.steepest_fall < 0.0


def test_masses_are_put_together_about_their_common_centre(read):
    """Two points and a rod: parallel axes by hand, units of inch and pound."""
    text = """Lunit = 0.0254 m
Munit = 0.45359237 kg
Tunit = 1 s
g = 9.81
# mass x y z Ixx Iyy Izz
* 2 1 1 1 1 1 1
+ 0 1 0 0
1.0   10 0 0   0 4 4 ! front
1.0   30 0 10  0 4 4 ! rear
"""
    mass = read(CONVENTIONAL, text).mass
    inch, pound = 0.0254, 0.45359237
    assert mass.mass == pytest.approx(4.0 * pound)
    assert mass.cg_G == pytest.approx((21.0 * inch, 0.0, 5.0 * inch))
    unit = pound * inch ** 2
    assert mass.inertia_B[0, 0] == pytest.approx(4.0 * 25.0 * unit)
    assert mass.inertia_B[1, 1] == pytest.approx((4.0 * 125.0 + 8.0) * unit)
    # The rear mass is high and aft: in body axes x < 0 and z < 0, the product is positive.
    assert mass.inertia_B[0, 2] == pytest.approx(-4.0 * 10.0 * 5.0 * unit)


def test_what_is_assumed_is_said(read):
    """Masses, travel of controls, flow past the stall, drag; a body and a slat left out."""
    text = CONVENTIONAL.replace('flap 1.0 0.75', 'flap 1.0 -0.2') \
        + 'BODY\nFuselage\n20 1.0\nBFIL\nfuse.dat\n'
    said = ' '.join(read(text).assumptions)
    for word in ('no mass file', '30 deg', 'generic plate', 'no profile drag', 'Fuselage',
                 'leading edge'):
        assert word in said
    assert 'flap' not in read(text).control_names


def test_a_control_at_one_section_alone_moves_nothing_and_that_is_said(read):
    """Half of the flap's two: as AVL has it, a flap is between two sections."""
    once = CONVENTIONAL.replace('CONTROL\nflap 1.0 0.75 0 0 0 1.0\n', '', 1)
    aircraft = read(once)
    assert 'flap' not in aircraft.control_names and 'aileron' in aircraft.control_names
    said, = (each for each in aircraft.assumptions if 'one section alone' in each)
    assert said.startswith('surface Wing: flap moves nothing')
    assert not any('one section alone' in each for each in read(CONVENTIONAL).assumptions)


@pytest.mark.parametrize(('old', 'new', 'complaint'), [
    ('0 0 0.0  !', '0 1 0.0  !', 'iZsym'),
    ('6 0.0 12 0.0', 'six 0.0', 'line 9: Nchord Cspace must be'),
    ('YDUPLICATE\n0.0\nSECTION\n0 0 0 0.5 0', 'NOWAKE\nSECTION\n0 0 0 0.5 0',
     'NOWAKE is not supported'),
    ('0 0 0 0.5 0', '0 0 0 -0.5 0', 'must be above 0'),
    ('0 0 0 0.5 0', '0 0 0 0.5 0\nNACA\n23012', 'NACA must be four digits'),
    ('0 0 0 0.5 0', '0 0 0 0.5 0\nAFILE\nnowhere.dat',
     'line 14: AFILE must be the name of a file'),
    ('6 0.0 12 0.0', '6 0.0 1 0.0', 'Nspan 1 is too few for 3 sections'),
    ('SURFACE\nFin', 'SRUFACE\nFin', 'expected SURFACE or BODY'),
])
def test_bad_files_are_refused_in_one_line(read, old, new, complaint):
    """With file and line, and what was expected."""
    with pytest.raises(ConfigError, match='plane.avl|nowhere') as error:
        read(CONVENTIONAL.replace(old, new, 1))
    assert complaint in str(error.value) and '\n' not in str(error.value)


def test_another_number_of_strips_is_by_the_spacing(read):
    """The command line's --strips: edges that were given are forgotten."""
    wing = read(CONVENTIONAL).surfaces[0]
    assert wing.cut(8).edges == () and wing.cut(8).strips == 8
    assert wing.cut(wing.strips) is wing
    with pytest.raises(ConfigError, match='strip edges must rise'):
        replace(wing, strips=8)


def test_an_equal_spacing_of_three_is_the_equal_one_of_none():
    """AVL's parameter comes round; its blends lie between."""
    assert avl_reader.spaced(5, 3.0) == pytest.approx(avl_reader.spaced(5, 0.0))
    between = avl_reader.spaced(5, 1.5)
    assert between == pytest.approx(
        0.5 * (avl_reader.spaced(5, 1.0) + avl_reader.spaced(5, 2.0)))
    assert 1.0 - avl_reader.spaced(5, -2.0)[::-1] == pytest.approx(avl_reader.spaced(5, 2.0))

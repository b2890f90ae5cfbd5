# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Each key of an aircraft and of a scenario acts, in the direction that its description says."""

import dataclasses
import functools
import math
import re
from pathlib import Path

import everything
import numpy as np
import pytest
from everything import AIRCRAFT_TREE, GONE, OTHER_SCENARIO_TREE, SCENARIO_TREE, load

from poststall_sim import definition, jobs, polar, propulsion, simulation
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.frames import geometry_to_body
from poststall_sim.polar import Condition
from poststall_sim.propulsion import Meeting
from poststall_sim.reader import Place, Reader
from poststall_sim.simulation import Flight
from poststall_sim.state import BodyState, Controls, EngineState

COARSE = models.Settings(chordwise=2)
SPEED, ALTITUDE, DT_NS = 20.0, 100.0, 10_000_000
DEG = math.radians(1.0)
X, Y, Z, ROLL, PITCH, YAW = range(6)
LINE, TABLE, ELECTRIC, PITCHED, STATIONS = range(5)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp('everything')
    everything.write_curves(folder)
    return folder


# ------------------------------------------------------------------------ what can be measured


class Plane:
    """An aircraft, its model once that is asked for, and what it does in a given state."""

    def __init__(self, folder, tree):
        self.aircraft = load(folder, tree, definition.aircraft)

    @functools.cached_property
    def model(self):
        return models.build(self.aircraft, COARSE)

    def told(self, throttle=0.0, **deflections):
        return Controls(np.array([DEG * deflections.get(name, 0.0)
                                  for name in self.aircraft.control_names]), throttle)

    def loads(self, alpha=4.0, beta=0.0, pitching=0.0, **deflections):
        """Return force and moment (6,) in B, in steady flow and without engines."""
        return self.point(alpha, beta, pitching, **deflections)[0]

    def point(self, alpha=4.0, beta=0.0, pitching=0.0, **deflections):
        air = self.model.atmosphere.at(ALTITUDE)
        asked = self.told(**deflections).deflections
        condition = Condition(DEG * alpha, DEG * beta, np.array([0.0, pitching, 0.0]), asked)
        aero = solver.steady(
            self.model.at(SPEED, air.kinematic_viscosity, asked),
            polar.onset(self.model, condition, SPEED), asked, density=air.density)
        return (np.concatenate([geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)]),
                polar.coefficients(self.model, aero, condition.alpha, 100.0))

    def flight(self, throttle=0.0, **deflections):
        """Return a flight level at 20 m/s that begins with these controls."""
        body = BodyState(np.array([0.0, 0.0, -ALTITUDE]),
                         SPEED * np.array([math.cos(4 * DEG), 0.0, math.sin(4 * DEG)]),
                         np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        return Flight(self.model, body, self.told(throttle, **deflections), dt_ns=DT_NS)

    def meeting(self, throttle, airspeed):
        return Meeting(np.array([airspeed, 0.0, 0.0]), np.zeros(3), 1.2,
                       np.full(len(self.aircraft.engines), throttle))


def air(axis, **state):
    """Return a measure: a component of the aerodynamic load in steady flow."""
    return lambda plane: plane.loads(**state)[axis]


def coefficient(name, **state):
    return lambda plane: getattr(plane.point(**state)[1], name)


def begun(axis, **controls):
    """Return a measure: a component of the aerodynamic load where a flight begins."""
    def measure(plane):
        snapshot = plane.flight(**controls).snapshot
        return np.concatenate([snapshot.force_B, snapshot.moment_B])[axis]
    return measure


def turns(axis, **controls):
    """Return a measure: an angular acceleration where a flight begins."""
    return lambda plane: plane.flight(**controls).snapshot.rate_change_B[axis - ROLL]


def deflects(control, steps=3):
    """Return a measure: where a control is some steps after it was told to go to 10 deg."""
    def measure(plane):
        flight = plane.flight()
        for _ in range(steps):
            flight.step(plane.told(**{control: 10.0}))
        return flight.snapshot.controls.deflections[plane.aircraft.control_names.index(control)]
    return measure


def engine(number, reading, *, throttle=0.3, airspeed=15.0, charge=1.0):
    """Return a measure: what one engine does with its shaft in balance."""
    def measure(plane):
        meeting = plane.meeting(throttle, airspeed)
        state = propulsion.settled(
            plane.aircraft, meeting, np.full(len(plane.aircraft.engines), charge))
        push = propulsion.loads(plane.aircraft, state, meeting)
        return getattr(push.readings, reading)[number]
    return measure


def pushes(axis, throttle=0.3):
    """Return a measure: a component of what all engines do together."""
    return lambda plane: propulsion.balanced(
        plane.aircraft, plane.meeting(throttle, 15.0)).load[axis]


def later(number, quantity):
    """Return a measure: an engine's shaft or battery some time after a start at half speed."""
    def measure(plane):
        meeting = plane.meeting(0.6, 15.0)
        begin = EngineState(np.full(5, 200.0), np.ones(5))
        return getattr(propulsion.advance(plane.aircraft, begin, meeting, 0.02), quantity)[number]
    return measure


lift, drag = (lambda plane: -plane.loads()[Z]), (lambda plane: -plane.loads(alpha=0.0)[X])
rolls = air(ROLL, aileron=10.0)
yaws = air(YAW, rudder=-10.0)


# ------------------------------------------------------------- key, other value, measure, way
# The way is that of the measure as the key goes to the other value. ANY stands where the
# description of the key has no direction: where strips end, which of several laws.


UP, DOWN, ANY = 1.0, -1.0, 0.0
AIRCRAFT = [
    ('airfoils.wing[0].file', 'best.csv', lift, UP),
    ('airfoils.fin', 'tail_down.csv', drag, UP),
    ('airfoils.wing[0].reynolds', 4e5, lift, DOWN),           # nearer to the table of less lift
    ('airfoils.tail[1].flap_deg', 25.0, air(Z, elevator=10.0), UP),   # as much for more degrees
    ('reference.area_m2', 1.5, coefficient('CL'), DOWN),
    ('reference.chord_m', 0.5, coefficient('Cm', elevator=-10.0), DOWN),
    ('reference.span_m', 3.5, coefficient('Cl', aileron=10.0), DOWN),

    ('surfaces[0].incidence_deg', 2.0, lift, UP),
    ('surfaces[0].strips', 10, lift, ANY),
    ('surfaces[0].spacing', 'cosine', lift, ANY),
    ('surfaces[1].strip_edges[1]', 0.6, lift, ANY),
    ('surfaces[1].strip_points[0]', 0.3, lift, ANY),
    ('surfaces[1].flat', False, lift, ANY),
    ('surfaces[1].symmetric', (False, {'surfaces[1].strips': 2}), air(ROLL), DOWN),
    ('surfaces[0].name', ('tail', {'surfaces[1].name': 'wing'}), rolls, DOWN),
    ('surfaces[0].sections[1].leading_edge_m[0]', 0.1, air(PITCH), DOWN),   # lift farther aft
    ('surfaces[0].sections[1].leading_edge_m[1]', 1.7, lift, UP),
    ('surfaces[0].sections[1].leading_edge_m[2]', 0.15, air(ROLL, beta=5.0), DOWN),   # dihedral
    ('surfaces[0].sections[1].chord_m', 0.45, lift, UP),
    ('surfaces[0].sections[1].twist_deg', 0.0, lift, UP),
    ('surfaces[0].sections[1].airfoil', 'tail', lift, DOWN),   # without camber

    ('controls.elevator.limits_deg[0]', -10.0, begun(PITCH, elevator=-40.0), DOWN),
    ('controls.elevator.limits_deg[1]', 10.0, begun(PITCH, elevator=40.0), UP),
    ('controls.aileron.actuator.time_constant_s', 0.06, deflects('aileron'), DOWN),
    ('controls.aileron.actuator.dead_time_s', 0.01, deflects('aileron'), DOWN),
    ('controls.elevator.actuator.natural_frequency_rad_s', 50.0, deflects('elevator'), UP),
    ('controls.elevator.actuator.damping', 1.0, deflects('elevator'), DOWN),
    ('controls.rudder.actuator.rate_limit_deg_s', 250.0, deflects('rudder'), UP),
    ('controls.elevator.effectors[0].surface', 'fin', air(PITCH, elevator=10.0), UP),
    ('controls.aileron.effectors[1].side', 'both', rolls, DOWN),   # the right half undone
    ('controls.aileron.effectors[1].span[0]', 0.5, rolls, UP),
    ('controls.aileron.effectors[1].span[1]', 1.0, rolls, UP),
    ('controls.aileron.effectors[1].hinge', 0.7, rolls, UP),
    ('controls.aileron.effectors[1].gain', 1.2, rolls, UP),
    ('controls.rudder.effectors[0].hinge_axis[0]', 0.5, yaws, DOWN),   # less of it along the span
    ('controls.rudder.effectors[0].hinge_axis[1]', 0.5, yaws, DOWN),
    ('controls.rudder.effectors[0].hinge_axis[2]', 3.0, yaws, UP),
    ('controls.aileron.effectors[0].limits_deg[0]', -12.0, begun(ROLL, aileron=20.0), DOWN),
    ('controls.aileron.effectors[0].limits_deg[1]', 12.0, begun(ROLL, aileron=-20.0), UP),

    ('mass.mass_kg', 10.0, lambda plane: plane.flight().snapshot.load_factor, DOWN),
    ('mass.cg_m[0]', 0.2, air(PITCH), UP),                 # lift ahead of it
    ('mass.cg_m[1]', 0.01, air(ROLL), UP),                 # lift on its left
    ('mass.cg_m[2]', -0.04, air(PITCH, alpha=-4.0), DOWN),   # drag below it
    ('mass.inertia_kgm2.xx', 1.3, turns(ROLL, aileron=10.0), DOWN),
    ('mass.inertia_kgm2.yy', 1.5, turns(PITCH, elevator=-10.0), DOWN),
    ('mass.inertia_kgm2.zz', 2.55, turns(YAW, rudder=-10.0), DOWN),
    ('mass.inertia_kgm2.xy', 0.02, turns(ROLL, elevator=-10.0), UP),   # integral of x y dm
    ('mass.inertia_kgm2.yz', 0.02, turns(PITCH, rudder=-10.0), UP),
    ('mass.inertia_kgm2.xz', 0.04, turns(YAW, aileron=10.0), UP),

    ('bodies[0].position_m[0]', 0.2, air(PITCH), DOWN),    # pushed up by the flow from below
    ('bodies[0].position_m[1]', 0.1, air(YAW), UP),
    ('bodies[0].position_m[2]', -0.2, air(PITCH, alpha=0.0), UP),
    ('bodies[0].drag_area_m2[0]', 0.02, drag, UP),
    ('bodies[0].drag_area_m2[1]', 0.03, air(Y, beta=5.0), DOWN),   # wind from the right
    ('bodies[0].drag_area_m2[2]', 0.02, lift, UP),
    ('bodies[1].length_m', 1.9, air(PITCH, alpha=0.0, pitching=0.01), DOWN),   # damps
    ('bodies[1].volume_m3', 0.006, air(PITCH), UP),
]
ENGINES = [
    ('engines[0].kind', ('table', {
        'engines[0].static_thrust_N': GONE, 'engines[0].zero_thrust_airspeed_m_s': GONE,
        'engines[0].throttle': [0.0, 1.0], 'engines[0].airspeed_m_s': [0.0, 30.0],
        'engines[0].thrust_N': [[0.0, 0.0], [99.0, 99.0]]}), engine(LINE, 'thrust'), UP),
    ('engines[0].static_thrust_N', 44.0, engine(LINE, 'thrust'), UP),
    ('engines[0].zero_thrust_airspeed_m_s', 33.0, engine(LINE, 'thrust'), UP),
    ('engines[0].position_m[0]', -0.4, pushes(PITCH), DOWN),   # its thrust goes up, too
    ('engines[0].position_m[1]', 0.1, pushes(YAW), DOWN),
    ('engines[0].position_m[2]', 0.1, pushes(PITCH), DOWN),
    ('engines[0].direction[0]', -1.2, pushes(X), UP),
    ('engines[0].direction[1]', 0.2, pushes(Y), UP),
    ('engines[0].direction[2]', 0.3, pushes(Z), DOWN),
    ('engines[1].throttle[1]', 0.6, engine(TABLE, 'thrust'), DOWN),
    ('engines[1].airspeed_m_s[1]', 35.0, engine(TABLE, 'thrust'), UP),
    ('engines[1].thrust_N[1][0]', 7.0, engine(TABLE, 'thrust'), UP),
    ('engines[1].thrust_N[1][1]', 3.0, engine(TABLE, 'thrust'), UP),
    ('engines[2].diameter_m', 0.44, engine(ELECTRIC, 'thrust', airspeed=0.0), UP),
    ('engines[2].rotation', 'counterclockwise', pushes(ROLL, 1.0), UP),   # clockwise: left
    ('engines[2].inertia_kgm2', 7e-4, later(ELECTRIC, 'speed'), DOWN),
    ('engines[2].slipstream', (False, {'engines[2].swirl': False}),
     begun(Z, throttle=1.0), UP),                          # the wing lifts less
    ('engines[2].swirl', False, begun(YAW, throttle=1.0), UP),   # pushes the fin to the right
    ('engines[2].coefficients[1][0]', 0.5, engine(ELECTRIC, 'thrust', throttle=1.0), UP),
    ('engines[2].coefficients[1][1]', 0.07, engine(ELECTRIC, 'thrust', throttle=1.0), UP),
    ('engines[2].coefficients[1][2]', 0.042, engine(ELECTRIC, 'speed', throttle=1.0), DOWN),
    ('engines[2].motor.kv_rpm_V', 420.0, engine(ELECTRIC, 'speed', throttle=1.0), UP),
    ('engines[2].motor.resistance_Ohm', 0.05, engine(ELECTRIC, 'speed', throttle=1.0), DOWN),
    ('engines[2].motor.no_load_current_A', 1.5, engine(ELECTRIC, 'speed', throttle=1.0), DOWN),
    ('engines[2].motor.gear', 1.8, engine(ELECTRIC, 'speed', throttle=1.0), DOWN),
    ('engines[2].battery.voltage_V', 26.0, engine(ELECTRIC, 'speed', throttle=1.0), UP),
    ('engines[2].battery.empty_voltage_V', 21.0,
     engine(ELECTRIC, 'speed', throttle=1.0, charge=0.5), UP),
    ('engines[2].battery.resistance_Ohm', 0.06, engine(ELECTRIC, 'speed', throttle=1.0), DOWN),
    ('engines[2].battery.capacity_Ah', 6.0, later(ELECTRIC, 'charge'), UP),
    ('engines[3].rpm', 6600.0, engine(PITCHED, 'thrust', airspeed=5.0), UP),
    ('engines[3].spool_time_s', 0.4, later(PITCHED, 'speed'), DOWN),
    ('engines[3].blades.count', 3, engine(PITCHED, 'thrust', airspeed=5.0), UP),
    ('engines[3].blades.airfoil', 'tail', engine(PITCHED, 'thrust', airspeed=5.0), DOWN),
    ('engines[3].blades.pitch_m', 0.28, engine(PITCHED, 'thrust', airspeed=5.0), UP),
    ('engines[3].blades.chord_m', 0.035, engine(PITCHED, 'thrust', airspeed=5.0), UP),
    ('engines[3].blades.hub_radius_m', 0.06, engine(PITCHED, 'thrust', airspeed=5.0), DOWN),
    # The angle and the chord of the middle one farther out.
    ('engines[4].blades.stations[1][0]', 0.12, engine(STATIONS, 'thrust', airspeed=5.0), UP),
    ('engines[4].blades.stations[1][1]', 0.04, engine(STATIONS, 'thrust', airspeed=5.0), UP),
    ('engines[4].blades.stations[1][2]', 24.0, engine(STATIONS, 'thrust', airspeed=5.0), UP),
]


def snapshot(of):
    """Return a measure: a number from the last snapshot of a scenario's flight."""
    return lambda flown: of(flown.snapshot)


EAST, NORTH, AIR_UP = (snapshot(lambda s, i=i, sign=sign: sign * s.wind_N[i])
                       for i, sign in ((1, 1.0), (0, 1.0), (2, -1.0)))
density = snapshot(lambda s: s.density)
gusty = snapshot(lambda s: s.wind_N[0])
fails = snapshot(lambda s: s.angles[-1])
LAW = {'air.shear.roughness_m': GONE, 'air.shear.exponent': 0.143}
SIGMA = {'air.turbulence.level': GONE}


def tossed(flown):
    """Return the speed of the turbulence where the flight began [m/s]."""
    return float(np.linalg.norm(dataclasses.replace(flown.scenario.weather, gusts=(), shear=None)
                                .beyond_N(0.0, np.zeros((1, 3)), np.zeros(3), np.zeros(3))))


def after(other, base):
    """Return a row's values where the base of the comparison is not the file as it stands."""
    return other, {}, base


SCENARIO = [
    ('duration_s', 0.06, snapshot(lambda s: s.time), UP),
    ('initial.airspeed_m_s', 19.0, lambda flown: flown.started.snapshot.airspeed, UP),
    ('initial.altitude_m', 80.0, lambda flown: flown.started.snapshot.density, DOWN),
    ('air.temperature_offset_K', 20.0, density, DOWN),
    ('air.sea_level_pressure_Pa', 101000.0, density, UP),
    ('air.density_kg_m3', 1.0, density, DOWN),
    ('air.wind_enu_m_s[0]', 5.0, EAST, UP),
    ('air.wind_enu_m_s[1]', 2.0, NORTH, UP),
    ('air.wind_enu_m_s[2]', 1.0, snapshot(lambda s: s.body.position_N[2]), DOWN),
    ('air.shear.law', ('power', LAW), EAST, ANY),
    ('air.shear.roughness_m', 0.8, EAST, UP),              # above the reference height
    ('air.shear.exponent', after(
        0.2, {'air.shear.law': 'power', **LAW}), EAST, UP),
    ('air.shear.reference_height_m', 8.0, EAST, DOWN),
    ('air.gusts[0].velocity_enu_m_s[0]', 1.0, EAST, UP),
    ('air.gusts[0].velocity_enu_m_s[1]', 1.0, NORTH, UP),
    ('air.gusts[0].velocity_enu_m_s[2]', 4.0, snapshot(lambda s: s.load_factor), UP),
    ('air.gusts[0].length_m', 12.0, AIR_UP, DOWN),
    ('air.gusts[0].begin_m', -4.0, AIR_UP, DOWN),
    ('air.gusts[0].speed_m_s', 2.0, AIR_UP, UP),
    ('air.gusts[0].heading_deg', 30.0, AIR_UP, DOWN),      # not so far into it
    ('air.gusts[1].shape', 'rise', AIR_UP, UP),            # past its greatest
    ('air.turbulence.spectrum', 'von_karman', gusty, ANY),
    ('air.turbulence.level', 'moderate', tossed, UP),
    ('air.turbulence.sigma_m_s', after(3.0, {**SIGMA, 'air.turbulence.sigma_m_s': 2.0}),
     tossed, UP),
    ('air.turbulence.scale_m', 30.0, gusty, ANY),
    ('air.turbulence.seed', 2, gusty, ANY),
    ('channels.throttle.relative', False, snapshot(lambda s: s.controls.throttle), DOWN),
    ('channels.throttle.points[1][0]', 2.0, snapshot(lambda s: s.controls.throttle), DOWN),
    ('channels.throttle.points[1][1]', 0.6, snapshot(lambda s: s.controls.throttle), UP),
    ('channels.elevator.points_deg[1][0]', 2.0,
     snapshot(lambda s: s.controls.deflections[1]), DOWN),
    ('channels.elevator.points_deg[1][1]', 25.0,
     snapshot(lambda s: s.controls.deflections[1]), UP),
    ('failures[0].time_s', 1.0, fails, DOWN),
    ('failures[0].name', 'elevator', fails, DOWN),
    ('failures[0].kind', ('lost', {'failures[0].angle_deg': GONE}), fails, DOWN),
    ('failures[0].angle_deg', 7.0, fails, UP),
]
LABELS = {
    'name': 'what files, logs and topics call it',
    'description': 'for those who read the file',
    'engines[].name': 'what engine_failures and diagnostics call it',
    'bodies[].name': 'what errors call it',
}
"""Keys that change nothing, and what they are there for."""


class Flown:
    """A scenario, flown from a trim that is found once."""

    def __init__(self, folder, tree, plane, start):
        self.scenario = load(folder, tree, definition.scenario)
        self.plane, self.start = plane, start

    @functools.cached_property
    def snapshot(self):
        flight = Flight.resumed(self.plane.model, dataclasses.replace(
            self.start, atmosphere=self.scenario.atmosphere, weather=self.scenario.weather))
        flight.reset(time_ns=0)
        *_, last = jobs.fly(flight, self.scenario, self.scenario.duration)
        return last

    @functools.cached_property
    def started(self):
        """Return a flight in a trim of its own."""
        return simulation.start(
            self.plane.aircraft, COARSE, airspeed=self.scenario.airspeed,
            altitude=self.scenario.altitude, dt=1e-9 * DT_NS)


# ---------------------------------------------------------------------------------- the tests


FEW = {**AIRCRAFT_TREE, 'engines': AIRCRAFT_TREE['engines'][:1]}
"""With one engine: blades take time to read."""


def row_name(value):
    return value if isinstance(value, str) else ''


def compared(make, tree, path, value, measure, way):
    """
    Check that a key changes a measure, and which way.

    value : the other one, or with it what has to change besides, and the tree to compare with.
    """
    other, besides, base = (*value, {}, {})[:3] if isinstance(value, tuple) else (value, {}, {})
    tree = everything.changed(tree, base)
    before = measure(make(tree))
    now = measure(make(everything.changed(tree, {**besides, path: other})))
    assert math.isfinite(before) and math.isfinite(now)
    change = now - before
    assert (way * change if way else abs(change)) > 1e-9 * max(abs(before), abs(now), 1.0)


@pytest.fixture(scope='module')
def planes(folder):
    """Return a function that makes an aircraft of a tree, those as they stand once only."""
    known = [(tree, Plane(folder, tree)) for tree in (AIRCRAFT_TREE, FEW)]

    def make(tree):
        return next((plane for each, plane in known if each == tree), None) or Plane(folder, tree)
    return make


@pytest.mark.parametrize('path, value, measure, way', AIRCRAFT, ids=row_name)
def test_a_key_of_an_airframe_changes_what_it_describes(planes, path, value, measure, way):
    compared(planes, FEW, path, value, measure, way)


@pytest.mark.parametrize('path, value, measure, way', ENGINES, ids=row_name)
def test_a_key_of_an_engine_changes_what_it_describes(planes, path, value, measure, way):
    compared(planes, AIRCRAFT_TREE, path, value, measure, way)


@pytest.fixture(scope='module')
def start(planes):
    return simulation.start(planes(FEW).aircraft, COARSE, airspeed=18.0, altitude=60.0,
                            dt=1e-9 * DT_NS).saved()


@pytest.mark.parametrize('path, value, measure, way', SCENARIO, ids=row_name)
def test_a_key_of_a_scenario_changes_what_it_describes(folder, planes, start, path, value,
                                                       measure, way):
    compared(lambda tree: Flown(folder, tree, planes(FEW), start),
             SCENARIO_TREE, path, value, measure, way)


def general(path):
    """Return a path for all items of lists and for all names of the user's choice."""
    path = re.sub(r'\[\d+\]', '[]', path)
    path = re.sub(r'^airfoils\.\w+(\[\])?', 'airfoils.*', path)   # one file, or a list of them
    return re.sub(r'^(controls|channels)\.\w+', r'\1.*', path)


def test_every_key_that_a_reader_asks_for_stands_in_these_tables(folder, monkeypatch):
    """One that is added to a reader needs a row here, and its vectors one for each component."""
    asked, vectors = set(), {}
    get, vector = Reader._get, Place.vector

    def asking(self, key, *default):
        asked.add(general(self.where.key(key).path))
        return get(self, key, *default)

    def components(self, value, length, **limits):
        vectors.setdefault(general(self.path), set()).update(range(length))
        return vector(self, value, length, **limits)

    monkeypatch.setattr(Reader, '_get', asking)
    monkeypatch.setattr(Place, 'vector', components)
    for tree in (SCENARIO_TREE, OTHER_SCENARIO_TREE):
        load(folder, tree, definition.scenario)
    load(folder, AIRCRAFT_TREE, definition.aircraft)

    rows = {row[0] for row in (*AIRCRAFT, *ENGINES, *SCENARIO)}
    shown = {re.sub(r'(\[\])+$', '', general(path)) for path in rows}
    assert shown <= asked, 'rows of keys that nobody asks for'
    above = {path[:dot.start()].removesuffix('[]') for path in shown
             for dot in re.finditer(r'\.', path)}
    assert asked - shown - above == set(LABELS)
    for at, each in vectors.items():
        found = {int(path[path.rindex('[') + 1:-1]) for path in rows
                 if path.endswith(']') and general(path[:path.rindex('[')]) == at}
        assert found == each, at



def test_every_key_in_the_text_of_a_reader_stands_in_these_tables():
    """Those too that are asked for only where something else is there that no text here has."""
    package = Path(definition.__file__).parent
    text = ''.join(path.read_text(encoding='utf-8') for path in (
        package / 'definition.py', *package.glob('*_reader.py')) if 'avl' not in path.name)
    found = set(re.findall(
        r"\.(?:number|number_if_any|count|boolean|text|name|choice|vector|numbers|rows|points"
        r"|mapping|mappings|files|has)\(\s*'(\w+)'", text))
    known = {word for path in (*LABELS, *(row[0] for row in (*AIRCRAFT, *ENGINES, *SCENARIO)))
             for word in re.findall(r'\w+', path)}
    assert len(found) > 80
    assert found <= known

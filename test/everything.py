# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""An aircraft and a scenario with every key that a reader knows, and ways to change a tree."""

import copy
import math
import re
from pathlib import Path

import yaml

CONFIG = Path(__file__).resolve().parents[1] / 'config'

AIRCRAFT = """\
name: everything
description: An aircraft with every key that a reader knows.
airfoils:
  wing: [{file: low.csv, reynolds: 2.0e+5}, {file: high.csv, reynolds: 1.2e+6}]
  tail: [tail.csv, {file: tail_down.csv, flap_deg: 20.0}]
  fin: tail.csv
reference: {area_m2: 1.28, chord_m: 0.4, span_m: 3.2}
surfaces:
  - name: wing
    symmetric: true
    strips: 8
    spacing: uniform
    incidence_deg: 1.0
    sections:
      - {leading_edge_m: [0.0, 0.0, 0.0], chord_m: 0.4, twist_deg: 0.0, airfoil: wing}
      - {leading_edge_m: [0.05, 1.6, 0.07], chord_m: 0.4, twist_deg: -1.0, airfoil: wing}
  - name: tail
    symmetric: true
    strips: 4
    strip_edges: [0.0, 0.5, 1.0]
    strip_points: [0.25, 0.75]
    flat: true
    incidence_deg: -1.0
    sections:
      - {leading_edge_m: [1.195, 0.0, -0.12], chord_m: 0.26, airfoil: tail}
      - {leading_edge_m: [1.195, 0.52, -0.12], chord_m: 0.26, airfoil: tail}
  - name: fin
    symmetric: false
    strips: 2
    sections:
      - {leading_edge_m: [1.11, 0.0, -0.10], chord_m: 0.36, airfoil: fin}
      - {leading_edge_m: [1.23, 0.0, 0.40], chord_m: 0.26, airfoil: fin}
controls:
  aileron:
    limits_deg: [-20.0, 20.0]
    actuator: {time_constant_s: 0.05, dead_time_s: 0.005}
    effectors:
      - {surface: wing, side: right, span: [0.6, 0.9], hinge: 0.75, gain: -1.0,
         limits_deg: [-15.0, 15.0]}
      - {surface: wing, side: left, span: [0.6, 0.9], hinge: 0.75, gain: 1.0}
  elevator:
    limits_deg: [-12.0, 12.0]
    actuator: {natural_frequency_rad_s: 40.0, damping: 0.8}
    effectors:
      - {surface: tail, side: both, span: [0.0, 1.0], hinge: 0.6, gain: 1.0}
  rudder:
    limits_deg: [-25.0, 25.0]
    actuator: {rate_limit_deg_s: 200.0}
    effectors:
      - {surface: fin, hinge: 0.55, hinge_axis: [0.2, 0.1, 1.0]}
mass:
  mass_kg: 9.0
  cg_m: [0.19, 0.0, -0.05]
  inertia_kgm2: {xx: 1.2, yy: 1.4, zz: 2.5, xy: 0.01, yz: 0.01, xz: 0.03}
engines:
  - kind: linear
    name: line
    static_thrust_N: 40.0
    zero_thrust_airspeed_m_s: 30.0
    position_m: [-0.45, 0.0, 0.0]
    direction: [-1.0, 0.1, 0.2]
  - kind: table
    position_m: [-0.45, 0.0, -0.05]
    throttle: [0.0, 0.5, 1.0]
    airspeed_m_s: [0.0, 30.0]
    thrust_N: [[0.0, -1.0], [6.0, 2.0], [10.0, 3.0]]
  - kind: propeller
    position_m: [-0.45, 0.0, -0.05]
    diameter_m: 0.4
    rotation: clockwise
    inertia_kgm2: 6.0e-4
    slipstream: true
    swirl: true
    coefficients: [[0.0, 0.10, 0.045], [0.4, 0.06, 0.040], [0.8, 0.00, 0.012]]
    motor: {kv_rpm_V: 400.0, resistance_Ohm: 0.04, no_load_current_A: 1.0, gear: 1.5}
    battery: {voltage_V: 25.2, empty_voltage_V: 19.8, resistance_Ohm: 0.05, capacity_Ah: 5.0}
  - kind: propeller
    position_m: [-0.45, 0.0, -0.05]
    diameter_m: 0.4
    rpm: 6000.0
    spool_time_s: 0.3
    blades: {count: 2, airfoil: wing, pitch_m: 0.25, chord_m: 0.03, hub_radius_m: 0.03}
  - kind: propeller
    position_m: [-0.45, 0.0, -0.05]
    diameter_m: 0.4
    rpm: 6000.0
    spool_time_s: 0.3
    blades: {count: 2, airfoil: tail,
             stations: [[0.03, 0.025, 50.0], [0.1, 0.035, 22.0], [0.2, 0.015, 11.0]]}
bodies:
  - {name: gear, position_m: [0.1, 0.0, -0.3], drag_area_m2: [0.01, 0.02, 0.01]}
  - {name: fuselage, position_m: [0.4, 0.0, 0.0], drag_area_m2: [0.006, 0.12, 0.12],
     length_m: 1.7, volume_m3: 0.005}
"""

SCENARIO = """\
name: rough
description: A scenario with every key that a reader knows, but those that exclude each other.
duration_s: 0.05
initial: {airspeed_m_s: 18.0, altitude_m: 60.0}
air:
  temperature_offset_K: 15.0
  sea_level_pressure_Pa: 100500.0
  wind_enu_m_s: [4.0, 1.0, 0.5]
  shear: {law: logarithmic, roughness_m: 0.61, reference_height_m: 6.1}
  gusts:
    - {velocity_enu_m_s: [0.5, 0.5, 3.0], length_m: 10.0, begin_m: -5.0, speed_m_s: 1.0,
       heading_deg: 10.0}
    - {velocity_enu_m_s: [0.0, 0.0, 1.0], length_m: 4.0, begin_m: -6.0, shape: one_minus_cosine}
  turbulence: {spectrum: dryden, level: light, seed: 1}
channels:
  throttle: {relative: true, points: [[0.0, 0.0], [1.0, 0.5]]}
  elevator: {relative: true, points_deg: [[0.0, 1.0], [1.0, 21.0]]}
failures:
  - {time_s: 0.0, name: rudder, kind: stuck, angle_deg: 5.0}
"""

AIRCRAFT_TREE, SCENARIO_TREE = yaml.safe_load(AIRCRAFT), yaml.safe_load(SCENARIO)
GONE = object()
"""As a value in `changed`: the key is not there."""


def write_curves(folder):
    """Write the section curves of the aircraft: shipped ones, every fourth degree of them."""
    for name, shipped, share, more, drag in (
            ('low', 'naca4415_re4e5', 0.9, 0.0, 1.5), ('high', 'naca4415_re4e5', 1.0, 0.0, 1.0),
            ('best', 'naca4415_re4e5', 1.1, 0.0, 1.0), ('tail', 'naca0012_re3e5', 1.0, 0.0, 1.0),
            ('tail_down', 'naca0012_re3e5', 1.0, 0.8, 3.0)):
        text = (CONFIG / 'airfoils' / f'{shipped}.csv').read_text(encoding='utf-8')
        lines = ['alpha_deg,cl,cd,cm']
        for line in text.splitlines():
            if re.match('-?[0-9]', line):
                alpha, cl, cd, cm = map(float, line.split(','))
                if alpha % 4.0 == 0.0:
                    lift = share * cl + more * max(math.cos(math.radians(alpha)), 0.0)
                    lines.append(f'{alpha},{lift:.5f},{drag * cd:.5f},{cm:.5f}')
        (folder / f'{name}.csv').write_text('\n'.join([*lines, '']), encoding='utf-8')


def load(folder, tree, reader):
    """Return what a reader makes of a tree in a file."""
    path = folder / 'file.yaml'
    path.write_text(yaml.safe_dump(tree, sort_keys=False), encoding='utf-8')
    return reader(path)


def keys(path):
    """Return 'surfaces[0].name' as ('surfaces', 0, 'name')."""
    return tuple(int(word) if word.isdigit() else word
                 for word in re.findall(r'[^.\[\]]+', path))


def changed(tree, changes):
    """Return a tree with other values at some paths, or without these."""
    result = copy.deepcopy(tree)
    for path, value in changes.items():
        *way, last = keys(path) if isinstance(path, str) else path
        branch = result
        for key in way:
            branch = branch[key]
        if value is GONE:
            del branch[last]
        else:
            branch[last] = value
    return result


OTHER_SCENARIO_TREE = changed(SCENARIO_TREE, {
    'air.density_kg_m3': 1.1, 'air.shear': {'law': 'power', 'exponent': 0.143},
    'air.turbulence': {'spectrum': 'von_karman', 'sigma_m_s': 2.0, 'scale_m': 30.0}})
"""With the keys of the air that stand in the place of others."""

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
An aircraft as the text of our own files: YAML, and CSV for each table of a section's curves.

Read again it is the same aircraft, to the twelfth digit. Blades are not a part of it: what was
made of them is, and is written as coefficients.
"""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from poststall_sim.actuators import IDEAL, Actuator
from poststall_sim.aircraft import Aircraft, Airfoil, Surface
from poststall_sim.control_reader import SIDES
from poststall_sim.controls import Control
from poststall_sim.engine_reader import HOUR, ROTATIONS, RPM
from poststall_sim.engines import ElectricMotor, Engine, LinearThrust, Propeller
from poststall_sim.nonlifting import NonliftingBody

_SIDES = {side: word for word, side in SIDES.items()}


def text(aircraft: Aircraft, files: Sequence[str], *, remarks: tuple[str, ...] = ()) -> str:
    """Return the YAML of an aircraft, its curves in a file for each of its airfoils."""
    reference, mass = aircraft.reference, aircraft.mass
    inertia = mass.inertia_B
    lines = [f'# {remark}'.rstrip() for remark in (*remarks, *aircraft.assumptions)]
    lines += [
        '#', '# Axes: x aft, y right, z up. Lengths in metres, angles in degrees, deflections '
        'positive', '# trailing edge down (rudder: trailing edge left).', '',
        f'name: {aircraft.name}', '',
        'airfoils:              # curves over a full turn: put measured or computed ones there',
        *_airfoils(aircraft, files), '',
        f'reference: {{area_m2: {_n(reference.area)}, chord_m: {_n(reference.chord)}, '
        f'span_m: {_n(reference.span)}}}', '', 'surfaces:']
    for surface in aircraft.surfaces:
        lines += _surface(surface)
    lines += ['', 'controls:' if aircraft.controls else 'controls: {}']
    for control in aircraft.controls:
        lines += _control(control)
    lines += [
        '', 'mass:', f'  mass_kg: {_n(mass.mass)}', f'  cg_m: {_list(mass.cg_G)}',
        '  # About the centre of gravity in body axes: x forward, y right, z down; products are',
        '  # the integrals themselves, xz = integral of x z dm.',
        '  inertia_kgm2: {' + ', '.join(
            f'{name}: {_n(value)}' for name, value in (
                ('xx', inertia[0, 0]), ('yy', inertia[1, 1]), ('zz', inertia[2, 2]),
                ('xy', -inertia[0, 1]), ('yz', -inertia[1, 2]), ('xz', -inertia[0, 2]))) + '}']
    if aircraft.bodies:
        lines += ['', 'bodies:', *map(_body, aircraft.bodies)]
    if aircraft.engines:
        lines += ['', 'engines:']
    for engine in aircraft.engines:
        lines += _engine(engine)
    return '\n'.join([*lines, ''])


def csv_names(aircraft: Aircraft) -> list[str]:
    """Return names of files for the curves of each airfoil, of this aircraft alone."""
    named = [each.name for each in aircraft.airfoils]
    names = []
    for airfoil in aircraft.airfoils:
        name = f'{aircraft.name}_{airfoil.name}'
        if named.count(airfoil.name) > 1:
            name += f'_{named[:len(names)].count(airfoil.name) + 1}'
        names.append(f'{name}.csv')
    return names


def _airfoils(aircraft: Aircraft, files: Sequence[str]) -> list[str]:
    tables: dict[str, list[str]] = {}
    for airfoil, file in zip(aircraft.airfoils, files):
        flap = f'{{file: {file}, flap_deg: {_n(math.degrees(airfoil.deflection))}}}'
        tables.setdefault(airfoil.name, []).append(flap if airfoil.deflection else file)
    return [f'  {name}: {each[0]}' if len(each) == 1 else f'  {name}: [{", ".join(each)}]'
            for name, each in tables.items()]


def curves(airfoil: Airfoil) -> str:
    """Return the CSV of a section's curves."""
    rows = np.column_stack([np.degrees(airfoil.alpha), airfoil.cl, airfoil.cd, airfoil.cm])
    rows[[0, -1], 0] = -180.0, 180.0
    reynolds = [f'# reynolds: {_n(airfoil.reynolds)}'] if airfoil.reynolds else []
    return '\n'.join([f'# {airfoil.name}; cm about the quarter chord, nose-up positive',
                      *reynolds, 'alpha_deg,cl,cd,cm',
                      *(','.join(map(_n, row)) for row in rows), ''])


def _n(value: float) -> str:
    return f'{value + 0.0:.12g}'


def _list(values: Iterable[float]) -> str:
    return '[' + ', '.join(_n(value) for value in values) + ']'


def _surface(surface: Surface) -> list[str]:
    lines = [f'  - name: {surface.name}', f'    symmetric: {str(surface.symmetric).lower()}',
             f'    strips: {surface.strips}'
             + ('             # both sides together' if surface.symmetric else ''),
             f'    spacing: {"cosine" if surface.spacing_cosine else "uniform"}']
    if surface.flat:
        lines.append('    flat: true             # twist turns normals, the panels stay')
    for key, values in (('strip_edges', surface.edges), ('strip_points', surface.points)):
        if values:
            lines.append(f'    {key}: {_list(values)}')
    lines.append('    sections:' + ('             # root to starboard tip'
                                    if surface.symmetric else ''))
    lines += [f'      - {{leading_edge_m: {_list(s.leading_edge_G)}, chord_m: {_n(s.chord)}, '
              f'twist_deg: {_n(math.degrees(s.twist))}, airfoil: {s.airfoil}}}'
              for s in surface.sections]
    return lines


def _control(control: Control) -> list[str]:
    lines = [f'  {control.name}:',
             f'    limits_deg: {_list(math.degrees(x) for x in control.limits)}']
    if control.actuator != IDEAL:
        lines.append(f'    actuator: {_flow(_actuator(control.actuator))}')
    lines.append('    effectors:')
    for each in control.effectors:
        part = {'surface': each.surface, 'side': _SIDES[each.side], 'span': _list(each.span),
                'hinge': _n(each.hinge), 'gain': _n(each.gain)}
        if each.hinge_axis is not None:
            part['hinge_axis'] = _list(each.hinge_axis)
        if all(map(math.isfinite, each.stops)):
            part['limits_deg'] = _list(math.degrees(x) for x in each.stops)
        lines.append(f'      - {_flow(part)}')
    return lines


def _actuator(actuator: Actuator) -> dict[str, str]:
    keys = {'time_constant_s': _n(actuator.time_constant), 'dead_time_s': _n(actuator.dead_time)}
    if math.isfinite(actuator.rate_limit):
        keys['rate_limit_deg_s'] = _n(math.degrees(actuator.rate_limit))
    if actuator.natural_frequency:
        keys |= {'natural_frequency_rad_s': _n(actuator.natural_frequency),
                 'damping': _n(actuator.damping)}
    return keys


def _body(body: NonliftingBody) -> str:
    keys = {'name': body.name, 'position_m': _list(body.position_G),
            'drag_area_m2': _list(body.drag_area)}
    for key, value in (('length_m', body.length), ('volume_m3', body.volume)):
        if value is not None:
            keys[key] = _n(value)
    return f'  - {_flow(keys)}'


def _engine(engine: Engine) -> list[str]:
    """Return the lines of an engine of any kind; docs/propulsion.md lists the keys."""
    keys = {'name': engine.name} if engine.name else {}
    keys |= {'position_m': _list(engine.position_G),
             'direction': f'{_list(engine.direction_G)}     # the way the thrust pushes'}
    if isinstance(engine, LinearThrust):
        kind = 'linear'
        keys |= {'static_thrust_N': _n(engine.static_thrust),
                 'zero_thrust_airspeed_m_s': _n(engine.zero_thrust_airspeed)}
    elif isinstance(engine, Propeller):
        kind = 'propeller'
        keys |= _propeller(engine)
    else:
        kind = 'table'
        keys |= {'throttle': _list(engine.throttle), 'airspeed_m_s': _list(engine.airspeed),
                 'thrust_N': _rows(engine.thrust)}
    return [f'  - kind: {kind}', *(f'    {key}: {value}' for key, value in keys.items())]


def _propeller(engine: Propeller) -> dict[str, str]:
    table, drive = engine.coefficients, engine.drive
    rotations = {value: word for word, value in ROTATIONS.items()}
    keys = {'diameter_m': _n(engine.diameter), 'rotation': rotations[engine.rotation],
            'inertia_kgm2': _n(engine.inertia), 'slipstream': str(engine.slipstream).lower(),
            'swirl': str(engine.swirl).lower(),
            'coefficients': '# J, CT, CP' + _rows(
                np.column_stack([table.advance_ratio, table.thrust, table.power]))}
    if not isinstance(drive, ElectricMotor):
        return keys | {'rpm': _n(drive.greatest_speed / RPM),
                       'spool_time_s': _n(drive.spool_time)}
    battery = drive.battery
    return keys | {
        'motor': _flow({'kv_rpm_V': _n(drive.speed_constant / RPM),
                        'resistance_Ohm': _n(drive.resistance),
                        'no_load_current_A': _n(drive.no_load_current), 'gear': _n(drive.gear)}),
        'battery': _flow({'voltage_V': _n(battery.voltage),
                          'empty_voltage_V': _n(battery.empty_voltage),
                          'resistance_Ohm': _n(battery.resistance),
                          'capacity_Ah': _n(battery.capacity / HOUR)})}


def _flow(keys: Mapping[str, str]) -> str:
    return '{' + ', '.join(f'{key}: {value}' for key, value in keys.items()) + '}'


def _rows(rows: Iterable[Iterable[float]]) -> str:
    return ''.join(f'\n      - {_list(row)}' for row in rows)

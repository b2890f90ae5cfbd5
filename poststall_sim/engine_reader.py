# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Engines out of the mappings of an aircraft file; docs/propulsion.md lists the keys."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from poststall_sim import blade_elements
from poststall_sim.aircraft import Airfoil
from poststall_sim.blade_elements import Blades
from poststall_sim.engines import (
    AHEAD,
    Battery,
    Coefficients,
    ElectricMotor,
    Engine,
    Governor,
    LinearThrust,
    Propeller,
    Rotation,
    ThrustTable,
)
from poststall_sim.reader import Reader, shown

RPM = 2.0 * math.pi / 60.0
"""[rad/s]"""
HOUR = 3600.0
"""[s]"""
_MOST = 1e6
"""Of turns a minute, turns a minute and volt, and volts: no propeller overflows."""
ROTATIONS = {'clockwise': Rotation.CLOCKWISE, 'counterclockwise': Rotation.COUNTERCLOCKWISE}


def engine(read: Reader, airfoils: Sequence[Airfoil]) -> Engine:
    """Read an engine of any kind; the sections of its blades are airfoils of the aircraft."""
    kind = read.choice('kind', {
        'linear': _linear, 'table': _table,
        'propeller': lambda read, given: _propeller(read, given, airfoils)}, default='linear')
    given = {'position_G': read.vector('position_m', 3), 'direction_G': _direction(read)}
    if read.has('name'):
        given['name'] = read.name('name')
    return kind(read, given)


def _direction(read: Reader) -> tuple[float, ...]:
    direction = read.vector('direction', 3, default=list(AHEAD))
    length = math.hypot(*direction)
    if not 0.0 < length < math.inf:
        raise read.where.key('direction').error(f'must point somewhere, got {direction}')
    return tuple(component / length for component in direction)


def _linear(read: Reader, given: dict[str, Any]) -> LinearThrust:
    return read.build(
        LinearThrust, static_thrust=read.number('static_thrust_N', above=0),
        zero_thrust_airspeed=read.number('zero_thrust_airspeed_m_s', above=0), **given)


def _table(read: Reader, given: dict[str, Any]) -> ThrustTable:
    throttle, airspeed = read.numbers('throttle'), read.numbers('airspeed_m_s')
    return read.build(
        ThrustTable, throttle=throttle, airspeed=airspeed,
        thrust=read.rows('thrust_N', len(airspeed)), **given)


def _propeller(read: Reader, given: dict[str, Any], airfoils: Sequence[Airfoil]) -> Propeller:
    diameter = read.number('diameter_m', above=0, at_most=100)
    if read.has('blades'):
        if read.has('coefficients'):
            raise read.where.key('blades').error('expected either blades or coefficients')
        table = _from_blades(read.mapping('blades'), diameter, airfoils)
    else:
        table = _coefficients(read, 'coefficients')
    return read.build(
        Propeller, diameter=diameter, coefficients=table, **_drive(read),
        rotation=read.choice('rotation', ROTATIONS, default='clockwise'),
        slipstream=read.boolean('slipstream', default=False),
        swirl=read.boolean('swirl', default=False), **given)


def _drive(read: Reader) -> dict[str, Any]:
    """Return what turns a propeller, and the inertia of all that turns."""
    if not read.has('motor'):
        if read.has('battery'):
            raise read.where.key('battery').error(
                'is of a motor: expected the key motor beside it')
        if not read.has('rpm'):
            raise read.where.error('expected what turns the propeller: motor and battery, or rpm '
                                   'and spool_time_s, got none of them')
        return {'drive': _governor(read),
                'inertia': read.number('inertia_kgm2', at_least=0, default=0.0)}
    for key in ('rpm', 'spool_time_s'):
        if read.has(key):
            raise read.where.key(key).error(
                'expected either a motor, whose speed follows from its battery and the air, or '
                f'rpm with spool_time_s, got both: motor and {shown(read.value(key))} here')
    if not read.has('battery'):
        raise read.where.key('motor').error('expected the key battery beside a motor')
    if not read.has('inertia_kgm2'):
        raise read.where.key('inertia_kgm2').error(
            'must be there where a motor turns the propeller: motor and propeller, as felt at the '
            'propeller, above 0')
    return {'drive': _motor(read.mapping('motor'), read.mapping('battery')),
            'inertia': read.number('inertia_kgm2', above=0)}


def _coefficients(read: Reader, key: str) -> Coefficients:
    rows = np.array(read.rows(key, 3)).reshape(-1, 3)
    return read.where.key(key).build(
        Coefficients, advance_ratio=rows[:, 0], thrust=rows[:, 1], power=rows[:, 2])


def _from_blades(read: Reader, diameter: float, airfoils: Sequence[Airfoil]) -> Coefficients:
    count = read.count('count', at_most=20)
    # Of several tables of a section the one of the least Reynolds number, without a flap.
    section = read.choice('airfoil', {
        each.name: each for each in sorted(airfoils, key=lambda each: -(each.reynolds or 0.0))
        if each.deflection == 0.0})
    tip = 0.5 * diameter
    if read.has('pitch_m') == read.has('stations'):
        raise read.where.error('expected either pitch_m with chord_m or stations, got '
                               + ('both' if read.has('stations') else 'neither'))
    if read.has('pitch_m'):
        hub = read.number('hub_radius_m', above=0, default=0.15 * tip)
        if hub >= tip:
            raise read.where.key('hub_radius_m').error(
                f'must be below the radius of {tip:g} m, got {shown(hub)}')
        radius = np.linspace(hub, tip, blade_elements.ELEMENTS + 1)
        chord = np.full(radius.size, read.number('chord_m', above=0))
        angle = blade_elements.constant_pitch(read.number('pitch_m', above=0), radius)
    else:
        rows = np.array(read.rows('stations', 3)).reshape(-1, 3)
        radius, chord, angle = rows[:, 0], rows[:, 1], np.radians(rows[:, 2])
        if rows.size and abs(radius[-1] - tip) > 1e-6 * tip:
            raise read.where.key('stations').error(
                f'must end at the radius of {tip:g} m, half the diameter, got {radius[-1]:g}')
    blades = read.build(Blades, count=count, radius=radius, chord=chord, angle=angle,
                        alpha=section.alpha, cl=section.cl, cd=section.cd)
    return read.where.build(blade_elements.coefficients, blades=blades)


def _governor(read: Reader) -> Governor:
    return read.where.build(
        Governor, greatest_speed=RPM * read.number('rpm', above=0, at_most=_MOST),
        spool_time=read.number('spool_time_s', above=0))


def _motor(read: Reader, battery: Reader) -> ElectricMotor:
    return read.build(
        ElectricMotor, speed_constant=RPM * read.number('kv_rpm_V', above=0, at_most=_MOST),
        resistance=read.number('resistance_Ohm', above=0),
        no_load_current=read.number('no_load_current_A', at_least=0, default=0.0),
        gear=read.number('gear', within=(1e-3, 1e3), default=1.0), battery=_battery(battery))


def _battery(read: Reader) -> Battery:
    voltage = read.number('voltage_V', above=0, at_most=_MOST)
    return read.build(
        Battery, voltage=voltage,
        empty_voltage=read.number('empty_voltage_V', above=0, default=voltage),
        resistance=read.number('resistance_Ohm', at_least=0, default=0.0),
        capacity=HOUR * read.number('capacity_Ah', above=0))

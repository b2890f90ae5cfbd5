# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Aerodynamic tables as the ``aerodynamics`` element of a JSBSim aircraft.

JSBSim's DRAG, SIDE and LIFT are in wind axes, ROLL, PITCH and YAW in body axes about the
aerodynamic reference point. Tables are looked up linearly and held at their ends. Angles are in
radians, deflections those of this package, in the properties ``fcs/NAME-pos-rad``.

References
----------
J. S. Berndt et al., JSBSim Reference Manual, 2011; FGAerodynamics.cpp on the axes.

"""

import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from poststall_sim import atomic_file
from poststall_sim.aircraft import ConfigError
from poststall_sim.buildup import COEFFICIENTS, BuildUp
from poststall_sim.frames import FloatArray

_OWN = ('elevator', 'rudder', 'flap', 'speedbrake', 'spoiler')
"""Controls of which JSBSim itself has the deflection as a property."""
_HAT = 'aero/poststall/{}-hat'
_RATE_OF = {'p': ('aero/bi2vel', 'velocities/p-aero-rad_sec'),
            'q': ('aero/ci2vel', 'velocities/q-aero-rad_sec'),
            'r': ('aero/bi2vel', 'velocities/r-aero-rad_sec')}
_AXES = {'CL': 'LIFT', 'CD': 'DRAG', 'CY': 'SIDE', 'Cl': 'ROLL', 'Cm': 'PITCH', 'Cn': 'YAW'}
_LENGTH = {'Cl': 'metrics/bw-ft', 'Cm': 'metrics/cbarw-ft', 'Cn': 'metrics/bw-ft'}


def deflection_property(control: str) -> str:
    """Return the JSBSim property of a control's deflection [rad]."""
    return f'fcs/{control}-pos-rad'


def to_wind(coefficients: FloatArray, beta: FloatArray) -> FloatArray:
    """
    Return (6, n, m) with drag and side force in wind axes, at sideslips (m,) [rad].

    Stability axes turned about z by beta: CD_w = CD cos beta - CY sin beta,
    CY_w = CY cos beta + CD sin beta; lift is the same in both.
    """
    out = np.array(coefficients)
    drag, side = COEFFICIENTS.index('CD'), COEFFICIENTS.index('CY')
    cb, sb = np.cos(beta), np.sin(beta)
    out[drag] = coefficients[drag] * cb - coefficients[side] * sb
    out[side] = coefficients[side] * cb + coefficients[drag] * sb
    return out


def element(tables: BuildUp) -> ET.Element:
    """Return the tables as an element ``aerodynamics``."""
    reference, cg = tables.reference, tables.cg_G
    for name in tables.controls:
        if not re.fullmatch(r'[A-Za-z_][\w-]*', name):
            raise ConfigError(f'the control {name!r} can be no property of JSBSim: its name must '
                              'be of letters, digits, - and _')
    root = ET.Element('aerodynamics')
    root.append(ET.Comment(
        f' {re.sub("-+", "-", tables.aircraft)}: steady coefficients, base(alpha, beta) plus an '
        'increment of each rate and control alone, at no sideslip. It goes with wingarea '
        f'{reference.area:.9g} M2, wingspan {reference.span:.9g} M, chord {reference.chord:.9g} '
        f'M, and AERORP where the centre of gravity was, {cg[0]:.9g} {cg[1]:.9g} {cg[2]:.9g} M '
        '(x aft, y right, z up). Deflections: trailing edge down, of a fin to the left; an '
        'aileron is positive right side up. '))
    for name in tables.controls:
        if name not in _OWN:
            ET.SubElement(root, 'property', value='0').text = deflection_property(name)
    for name in tables.rates:
        function = ET.SubElement(root, 'function', name=_HAT.format(name))
        factors = ET.SubElement(function, 'product')
        for each in _RATE_OF[name]:
            ET.SubElement(factors, 'property').text = each
    base = to_wind(tables.base, tables.beta)
    for key in ('LIFT', 'DRAG', 'SIDE', 'ROLL', 'PITCH', 'YAW'):
        coefficient = next(name for name in COEFFICIENTS if _AXES[name] == key)
        i = COEFFICIENTS.index(coefficient)
        axis = ET.SubElement(root, 'axis', name=key)
        _function(axis, coefficient, 'base', tables.alpha, 'aero/beta-rad', tables.beta, base[i])
        for name, change in tables.rates.items():
            _function(axis, coefficient, name, tables.alpha, _HAT.format(name), change.x,
                      change.change[i])
        for name, change in tables.controls.items():
            _function(axis, coefficient, name, tables.alpha, deflection_property(name), change.x,
                      change.change[i])
    return root


def _function(axis: ET.Element, coefficient: str, by: str, alpha: FloatArray, column: str,
              x: FloatArray, values: FloatArray) -> None:
    """Add force or moment by one table: rows of alpha, columns of x, none where x is one."""
    function = ET.SubElement(axis, 'function', name=f'aero/force/{coefficient}_{by}'
                             if coefficient not in _LENGTH else f'aero/moment/{coefficient}_{by}')
    factors = ET.SubElement(function, 'product')
    for name in ('aero/qbar-psf', 'metrics/Sw-sqft', *([_LENGTH[coefficient]]
                                                       if coefficient in _LENGTH else [])):
        ET.SubElement(factors, 'property').text = name
    table = ET.SubElement(factors, 'table')
    ET.SubElement(table, 'independentVar', lookup='row').text = 'aero/alpha-rad'
    lines = [_line((a, *row)) for a, row in zip(alpha, values)]
    if len(x) > 1:
        ET.SubElement(table, 'independentVar', lookup='column').text = column
        lines.insert(0, ' ' * 17 + _line(x))
    ET.SubElement(table, 'tableData').text = '\n' + '\n'.join(lines) + '\n'


def _line(values: Iterable[float]) -> str:
    return ' '.join(f'{value:16.9e}' for value in values)


def write(path: Path, tables: BuildUp) -> None:
    """Write the tables, whole or not at all."""
    root = element(tables)
    ET.indent(root, ' ')
    with atomic_file.writing(path) as file:
        ET.ElementTree(root).write(file, encoding='utf-8', xml_declaration=True)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""An aircraft as the text of our own files: YAML, and CSV for each section's curves."""

import math
from collections.abc import Mapping

import numpy as np

from poststall_sim.aircraft import Aircraft, Airfoil, Surface
from poststall_sim.controls import Control

_SIDES = {0: 'both', 1: 'right', -1: 'left'}


def text(aircraft: Aircraft, files: Mapping[str, str], *, remarks: tuple[str, ...] = ()) -> str:
    """Return the YAML of an aircraft, its curves in files by the names of the airfoils."""
    reference, mass = aircraft.reference, aircraft.mass
    inertia = mass.inertia_B
    lines = [f'# {remark}'.rstrip() for remark in (*remarks, *aircraft.assumptions)]
    lines += [
        '#', '# Axes: x aft, y right, z up. Lengths in metres, angles in degrees, deflections '
        'positive', '# trailing edge down (rudder: trailing edge left).', '',
        f'name: {aircraft.name}', '',
        'airfoils:              # curves over a full turn: put measured or computed ones there',
        *(f'  {airfoil.name}: {files[airfoil.name]}' for airfoil in aircraft.airfoils), '',
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
    if aircraft.engines:
        lines += ['', 'engines:               # thrust falls in a straight line over airspeed']
    for engine in aircraft.engines:
        lines += [f'  - static_thrust_N: {_n(engine.static_thrust)}',
                  f'    zero_thrust_airspeed_m_s: {_n(engine.zero_thrust_airspeed)}',
                  f'    position_m: {_list(engine.position_G)}',
                  f'    direction: {_list(engine.direction_G)}     # the way the thrust pushes']
    return '\n'.join([*lines, ''])


def csv_name(aircraft: Aircraft, airfoil: Airfoil) -> str:
    """Return the name of the file for a section's curves, of this aircraft alone."""
    return f'{aircraft.name}_{airfoil.name}.csv'


def curves(airfoil: Airfoil) -> str:
    """Return the CSV of a section's curves."""
    rows = np.column_stack([np.degrees(airfoil.alpha), airfoil.cl, airfoil.cd, airfoil.cm])
    rows[[0, -1], 0] = -180.0, 180.0
    return '\n'.join([f'# {airfoil.name}; cm about the quarter chord, nose-up positive',
                      'alpha_deg,cl,cd,cm',
                      *(','.join(f'{value + 0.0:.9g}' for value in row) for row in rows), ''])


def _n(value: float) -> str:
    return f'{value + 0.0:.12g}'


def _list(values) -> str:
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
    return [f'  {control.name}:',
            f'    limits_deg: {_list(math.degrees(x) for x in control.limits)}', '    effectors:',
            *(f'      - {{surface: {e.surface}, side: {_SIDES[e.side]}, span: {_list(e.span)}, '
              f'hinge: {_n(e.hinge)}, gain: {_n(e.gain)}}}' for e in control.effectors)]

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A polar as the page shows it, from what ``poststall polar`` writes as JSON."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from poststall_sim import surface_order
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aircraft import Aircraft
from poststall_sim.plots import style
from poststall_sim.plots.strips import StripData, StripGroup, matching
from poststall_sim.report import loading
from poststall_sim.report.page import Data, frames, line, numbers, panel, readout, tables

_COEFFICIENTS = (('CL', 'lift coefficient'), ('CD', 'drag coefficient'),
                 ('Cm', 'pitching moment about the cg'), ('CY', 'side force coefficient'),
                 ('Cl', 'rolling moment'), ('Cn', 'yawing moment'))


def of_json(result: Mapping[str, Any], aircraft: Aircraft | None) -> Data:
    """Return the page of a polar: the slider goes through its points."""
    points = result['points']
    alpha = np.array([point['alpha_deg'] for point in points])
    strips, notes = _strips(result), []
    lattice = None if aircraft is None else _lattice(result, aircraft, strips)
    if lattice is None:
        notes.append(f'{result["aircraft"]} is not known here with these strips: its section '
                     'curves are not drawn')
    else:
        strips = replace(strips, cl_max=lattice.greatest_lift)
    flown = {name: (np.zeros(1), np.radians([value]))
             for name, value in result['deflections_deg'].items()}
    angle = loading.angles(strips, lattice, aircraft, flown)
    chosen = frames(strips.time, len(strips.y))
    if len(chosen) < len(points):
        notes.append(f'thinned: {len(chosen)} of {len(points)} points are in this page')
    share = 100.0 * strips.stalled_share
    columns = {key: np.array([point[key] for point in points]) for key, _ in _COEFFICIENTS}
    panels = [panel(f'{title}', '-', [line(key, columns[key][chosen], style.ATTACHED)])
              for key, title in _COEFFICIENTS
              if key in ('CL', 'CD', 'Cm') or np.abs(columns[key]).max() > 1e-6]
    panels.append(panel('wing strips stalled', '%', [
        line('stalled', share[chosen], style.STALLED)]))
    events = _events(points, strips, chosen)
    head = {key: value for key, value in result.items()
            if key not in ('points', 'axes', 'strip_axes')}
    return {
        'title': f'Polar of {result["aircraft"]}',
        'subtitle': f'{len(points)} points, alpha {alpha.min():g} to {alpha.max():g} deg, '
        f'CL to {columns["CL"].max():.2f}',
        'axis': {'label': 'angle of attack', 'symbol': '\u03b1', 'unit': 'deg', 'digits': 1},
        'frames': numbers(alpha[chosen]), 'x': numbers(alpha[chosen]), 'rate': 4.0,
        'points': True, 'panels': panels, 'shaded': [], 'view': None,
        'readouts': [readout(key, '', 3, columns[key][chosen]) for key in ('CL', 'CD', 'Cm')]
        + [readout('stalled', ' %', 0, share[chosen])],
        'strips': loading.loading(strips, chosen, angle),
        'curves': [] if lattice is None else loading.curves(
            lattice, strips, angle, airspeed=result['airspeed_m_s'],
            altitude=result['altitude_m']),
        'events': events,
        'first': next((event['frame'] for event in events if event['kind'] == 'extreme'), 0),
        'tables': tables('Run', head), 'notes': notes,
        'averaged': result.get('closure') == Closure.NONLOCAL.value}


def _strips(result: Mapping[str, Any]) -> StripData:
    """Return the strips of all points; the place of `time` is that of a point's number."""
    each, settings = [point['strips'] for point in result['points']], result['settings']
    surface, y = each[0]['surface'], np.array(each[0]['y_m'], dtype=float)
    names = list(dict.fromkeys(surface))
    groups = [StripGroup(name, slice(surface.index(name),
                                     surface.index(name) + surface.count(name)))
              for name in names]
    groups = [groups[number] for number in
              surface_order.by_span([group.strips for group in groups], y)]
    column = {key: np.array([strips[key] for strips in each])
              for key in ('cl', 'alpha_deg', 'delta_deg', 'stalled')}
    return StripData(
        time=np.arange(len(each), dtype=float), y=y, chord=None, cl=column['cl'],
        alpha=np.radians(column['alpha_deg']), delta=np.radians(column['delta_deg']),
        stalled=column['stalled'], cl_max=None, groups=tuple(groups),
        averaged=settings['decambering'] and settings['closure'] == Closure.NONLOCAL.value)


def _lattice(result: Mapping[str, Any], aircraft: Aircraft, strips: StripData) -> Lattice | None:
    """Return the lattice that the polar was computed on."""
    settings = result['settings']
    if [surface.name for surface in aircraft.surfaces] != list(settings['strips']):
        return None
    cut = replace(aircraft, surfaces=tuple(
        surface.cut(settings['strips'][surface.name])
        for surface in aircraft.surfaces))
    return matching(cut, settings['panels'], len(strips.y), strips.y)


def _events(points: list[Mapping[str, Any]], strips: StripData,
            chosen: np.ndarray) -> list[Data]:
    """Return where the wing stalls, lifts most, and where there is no or more than one answer."""
    share, found = strips.stalled_share, []
    before = np.concatenate([[0.0], share[:-1]])
    lift = [point['CL'] for point in points]
    for k, point in enumerate(points):
        if share[k] > 0.0 and before[k] == 0.0:
            found.append((k, 'stall', 'stall begins on the wing'))
        if share[k] >= 0.5 > before[k]:
            found.append((k, 'stall', 'half of the wing stalled'))
        if k and share[k] == 0.0 and before[k] > 0.0:
            found.append((k, 'recovery', 'the wing is attached'))
        if k == int(np.argmax(lift)):
            found.append((k, 'extreme', f'greatest lift, CL {lift[k]:.3f}'))
        if point['status'] != 'converged':
            found.append((k, 'failure', point['status'].replace('_', ' ')))
        elif point['flags']:
            found.append((k, 'failure', ', '.join(
                flag.lower().replace('_', ' ') for flag in point['flags'])))
    return [{'frame': int(np.argmin(np.abs(chosen - k))), 'kind': kind, 'text': what,
             'at': f'{points[k]["alpha_deg"]:g}\u00b0'} for k, kind, what in found]

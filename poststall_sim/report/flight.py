# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A flight as the page shows it: from a bag, or from what ``poststall fly`` writes as JSON."""

from collections.abc import Mapping
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from poststall_sim import fields, run_settings, silhouette
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.model import DEFAULTS
from poststall_sim.aircraft import Aircraft
from poststall_sim.frames import (
    FloatArray,
    quaternion_enu_flu,
    quaternion_from_euler,
    rotation,
)
from poststall_sim.plots import bag as bags
from poststall_sim.plots import style, trajectory
from poststall_sim.plots.bag import FlightData
from poststall_sim.plots.lookup import Pair, onto
from poststall_sim.plots.strips import matching
from poststall_sim.report import loading
from poststall_sim.report.page import (
    MOST_INSTANTS,
    Data,
    Table,
    frames,
    line,
    numbers,
    panel,
    readout,
    table,
    tables,
    thinned,
)

Happening = tuple[float, str, str]
"""When [s], of which kind, and what."""

_ONE_STALL = 0.5
"""Breaks in a stall that are shorter than this are not called a recovery [s]."""
_LINES = (style.CONTROL, style.SECOND, style.THIRD, style.LIMIT, style.ATTACHED)


def of_bag(path: Path, flight: FlightData) -> Data:
    """Return the page of a bag's flight."""
    share = None
    if flight.strips is not None and flight.strips.stalled is not None:
        share = (flight.strips.time, flight.strips.stalled_share)
    told = {name: values for name, values in flight.reported.items()
            if name.endswith(run_settings.ENDING)}
    settings: dict[str, Any] = {
        'bag': path.resolve().name, 'aircraft': flight.name,
        'closure': next((values['closure'] for values in flight.reported.values()
                         if 'closure' in values), 'not known'),
        'duration_s': float(flight.time[-1] - flight.time[0]),
        **{key: value for values in told.values() for key, value in values.items()}}
    if flight.strips is not None:
        settings['strips'] = {group.name: group.strips.stop - group.strips.start
                              for group in flight.strips.groups}
    found = [*tables('Run', settings | _definition(flight.aircraft)),
             _in_figures(flight),
             *(table(f'Diagnostics, {name}', values)
               for name, values in flight.reported.items() if name not in told)]
    ended = [_ended(flight, values['paused_reason']) for values in flight.reported.values()
             if values.get('paused_reason')]
    return _page(flight, share, found, ended) | {
        'averaged': settings['closure'] == Closure.NONLOCAL.value}


def of_json(result: Mapping[str, Any], aircraft: Aircraft | None) -> Data:
    """Return the page of what ``poststall fly`` wrote; it has no strips."""
    series = {key: np.array(values, dtype=float) for key, values in result['series'].items()}
    summary = result['summary']
    angles = np.radians([series[key] for key in ('roll_deg', 'pitch_deg', 'yaw_deg')]).T
    xyzw = np.array([quaternion_enu_flu(quaternion_from_euler(*each)) for each in angles])
    time = series['time_s']
    reference = result['reference']
    flight = FlightData(
        name=result['aircraft'], aircraft=aircraft, time=time,
        position=np.column_stack([series[f'{key}_m'] for key in ('east', 'north', 'altitude')]),
        attitude=np.array([rotation(each) for each in xyzw[:, [3, 0, 1, 2]]]),
        rates=np.radians([series[f'{key}_rate_deg_s'] for key in ('roll', 'pitch', 'yaw')]).T,
        airspeed=series['airspeed_m_s'], alpha=np.radians(series['alpha_deg']),
        beta=np.radians(series['beta_deg']), sink_rate=series['sink_rate_m_s'],
        load_factor=series['load_factor'], lift=series['CL'],
        deflections=_deflections(series),
        commands={key.removesuffix(_COMMANDED): (time, np.radians(values))
                  for key, values in series.items() if key.endswith(_COMMANDED)}, strips=None,
        solver={'not_converged': (time, series['not_converged_steps'])}
        if 'not_converged_steps' in series else {}, reported={},
        shape=silhouette.of_aircraft(aircraft) if aircraft else
        silhouette.generic(reference['span_m'], reference['chord_m']),
        notes=('the JSON of a flight has no strips: the report of a bag, flown with --record, '
               'has span loading and operating points',
               *([] if aircraft else [f'the aircraft {result["aircraft"]} is not known here: '
                                      'with its file its shape is'])))
    share = time, series['stalled_wing_strips'] / max(summary['wing_strips'], 1)
    head = {key: value for key, value in result.items() if key not in ('summary', 'series')}
    short = {key: value for key, value in summary.items() if key != 'outside_the_method'}
    found = [*tables('Run', head), table('Summary', short),
             _in_figures(flight)]
    told = [(each['from_s'], 'failure', f'outside the method: {each["worst"]}, '
             f'{each["steps"]} steps') for each in summary.get('outside_the_method', ())]
    if summary['ended_early']:
        told.append(_ended(flight, summary['ended_early']))
    return _page(flight, share, found, told)


def _in_figures(flight: FlightData) -> Table:
    """Return the extremes, rounded: what the solver leaves of a zero says nothing."""
    return table('In figures', {
        key: round(value, 2) for key, value in bags.extremes(flight).items()})


def _ended(flight: FlightData, reason: str) -> Happening:
    return float(flight.time[-1]), 'failure', f'ended early: {reason}'


_COMMANDED = '_commanded_deg'
_NOT_CONTROLS = {'alpha_deg', 'beta_deg', 'roll_deg', 'pitch_deg', 'yaw_deg'}


def _deflections(series: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the controls among the columns of a flight's JSON [rad], and the throttle."""
    found = {key.removesuffix('_deg'): np.radians(values) for key, values in series.items()
             if key.endswith('_deg') and key not in _NOT_CONTROLS
             and not key.endswith(_COMMANDED)}
    return found | {key: series[key] for key in (fields.THROTTLE,) if key in series}


def _definition(aircraft: Aircraft | None) -> dict[str, Any]:
    if aircraft is None:
        return {}
    reference = aircraft.reference
    return {'reference': {'area_m2': reference.area, 'chord_m': reference.chord,
                          'span_m': reference.span},
            'mass_kg': aircraft.mass.mass}


def _page(flight: FlightData, share: Pair | None, found: list[Table],
          told: list[Happening]) -> Data:
    """Return the page of a flight; share: times and share of the wing's strips past stall."""
    strips, aircraft, notes = flight.strips, flight.aircraft, list(flight.notes)
    base = flight.time if strips is None else strips.time
    chosen = frames(base, 1 if strips is None else len(strips.y))
    at = base[chosen]
    history = thinned(len(flight.time), MOST_INSTANTS)
    for count, kept, what in ((len(base), len(at), 'instants of the slider'),
                              (len(flight.time), len(history), 'samples of the histories')):
        if kept < count:
            notes.append(f'thinned: {kept} of {count} {what} are in this page')
    data: Data = {
        'title': f'Flight of {flight.name}',
        'subtitle': _subtitle(flight, share),
        'axis': {'label': 'simulated time', 'symbol': 't', 'unit': 's', 'digits': 2},
        'frames': numbers(at, 8), 'x': numbers(flight.time[history], 8),
        'rate': (len(at) - 1) / max(min(at[-1] - at[0], 60.0), 1e-9),
        'points': False, 'panels': _panels(flight, share, history),
        'readouts': _readouts(flight, share, at), 'shaded': _shaded(share),
        'view': _view(flight, share, at, history), 'strips': None, 'curves': [],
        'events': _events(flight, share, at, told), 'tables': found, 'notes': notes}
    data['first'] = next((event['frame'] for event in data['events']
                          if event['kind'] == 'deepest'), 0)
    if strips is not None:
        lattice = matching(aircraft, DEFAULTS.chordwise, len(strips.y), strips.y) \
            if aircraft else None
        angle = loading.angles(strips, lattice, aircraft, {
            name: (flight.time, values) for name, values in flight.deflections.items()})
        data['strips'] = loading.loading(strips, chosen, angle)
        if lattice is not None and angle is not None and flight.airspeed is not None:
            data['curves'] = loading.curves(
                lattice, strips, angle, airspeed=float(np.median(flight.airspeed)),
                altitude=0.0 if flight.position is None else
                float(np.median(flight.position[:, 2])))
            if lattice.tables is not None:
                notes.append('section curves: at the median airspeed and altitude in the standard '
                             'atmosphere, no flap down')
    return data


def _subtitle(flight: FlightData, share: Pair | None) -> str:
    said = [f'{flight.time[-1] - flight.time[0]:.1f} s']
    if flight.alpha is not None:
        said.append(f'alpha to {np.degrees(flight.alpha.max()):.1f} deg')
    if share is not None:
        said.append(f'{100.0 * share[1].max():.0f} % of the wing stalled at most'
                    if share[1].any() else 'the wing never stalled')
    if flight.position is not None:
        height = flight.position[:, 2]
        lost = float(np.max(np.maximum.accumulate(height) - height))
        said.append(f'{lost:.1f} m of altitude lost at most')
    return ', '.join(said)


def _panels(flight: FlightData, share: Pair | None, kept: np.ndarray) -> list[Data]:
    """Return the time histories, those that there is data for."""
    time = flight.time[kept]

    def control(name: str, factor: float, colour: str) -> list[Data]:
        found = []
        if name in flight.commands:
            found.append(line(f'{name} commanded', factor * np.interp(
                time, *flight.commands[name]), style.COMMAND, command=True))
        return [*found, line(name, factor * flight.deflections[name][kept], colour)]

    degrees = 180.0 / np.pi
    moved = [name for name in flight.deflections if name != fields.THROTTLE]
    panels = [panel('controls', 'deg', [
        each for name, colour in zip(moved, cycle(_LINES))
        for each in control(name, degrees, colour)])]
    if fields.THROTTLE in flight.deflections:
        panels.append(panel('throttle', '-', control(fields.THROTTLE, 1.0, style.CONTROL)))
    altitude = None if flight.position is None else flight.position[:, 2]
    for title, unit, factor, lines in (
            ('flow angles', 'deg', degrees, (('alpha', flight.alpha, style.ATTACHED),
                                             ('beta', flight.beta, style.THIRD))),
            ('attitude', 'deg', degrees, (('pitch', flight.pitch, style.ATTACHED),
                                          ('bank', flight.bank, style.THIRD))),
            ('airspeed', 'm/s', 1.0, (('airspeed', flight.airspeed, style.ATTACHED),)),
            ('altitude', 'm', 1.0, (('altitude', altitude, style.ATTACHED),)),
            ('lift coefficient', '-', 1.0, (('CL', flight.lift, style.SECOND),)),
            ('load factor', '-', 1.0, (('n', flight.load_factor, style.SECOND),))):
        panels.append(panel(title, unit, [
            line(name, factor * values[kept], colour)
            for name, values, colour in lines if values is not None]))
    if share is not None:
        panels.append(panel('wing strips stalled', '%', [
            line('stalled', 100.0 * np.interp(time, *share), style.STALLED)]))
    return [each for each in panels if each['lines']]


def _readouts(flight: FlightData, share: Pair | None, at: FloatArray) -> list[Data]:
    degrees = 180.0 / np.pi
    altitude = None if flight.position is None else flight.position[:, 2]
    found = [readout(label, unit, digits, factor * np.interp(at, flight.time, values))
             for label, unit, digits, factor, values in (
                 ('\u03b1', '\u00b0', 1, degrees, flight.alpha),
                 ('\u03b2', '\u00b0', 1, degrees, flight.beta),
                 ('V', ' m/s', 1, 1.0, flight.airspeed), ('h', ' m', 1, 1.0, altitude),
                 ('pitch', '\u00b0', 0, degrees, flight.pitch),
                 ('CL', '', 2, 1.0, flight.lift)) if values is not None]
    if share is not None:
        found.append(readout('stalled', ' %', 0, 100.0 * np.interp(at, *share)))
    return found


def _view(flight: FlightData, share: Pair | None, at: FloatArray,
          history: np.ndarray) -> Data | None:
    """Return path, attitudes and the aircraft's triangles; None for a flight without a path."""
    if flight.position is None or len(flight.time) < 2:
        return None
    path = flight.position[history]
    turning = Slerp(flight.time, Rotation.from_matrix(flight.attitude))
    attitude = turning(np.clip(at, flight.time[0], flight.time[-1])).as_matrix()
    low, high = trajectory.box(flight.position)
    ghosts = [int(np.argmin(np.abs(at - flight.time[i]))) for i in trajectory.moments(flight)]
    return {
        'path': numbers(path.T, 6),
        'share': numbers(np.zeros(len(history)) if share is None else
                         np.interp(flight.time[history], *share)),
        'position': numbers(onto(at, (flight.time, flight.position)), 6),
        'attitude': numbers(attitude.reshape(-1, 9)),
        'frame_share': numbers(np.zeros(len(at)) if share is None else np.interp(at, *share)),
        'corners': numbers(silhouette.triangles(flight.shape)),
        'scale': trajectory.scale_of(flight), 'ghosts': ghosts,
        'low': numbers(low), 'high': numbers(high),
        'camera': numbers(trajectory.camera(flight.position))}


def _runs(inside: np.ndarray) -> list[tuple[int, int]]:
    """Return first and last index of each run of true values."""
    turns = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in zip(turns[::2], turns[1::2])]


def _stalls(share: Pair) -> list[tuple[int, int]]:
    """Return the first and the last instant of each stall; short breaks do not end one."""
    joined: list[tuple[int, int]] = []
    for first, last in _runs(share[1] > 0.0):
        if joined and share[0][first] - share[0][joined[-1][1]] < _ONE_STALL:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return joined


def _shaded(share: Pair | None) -> list[list[float]]:
    """Return from when to when strips of the wing are past their stall, and half of them."""
    if share is None:
        return []
    return [[float(share[0][a]), float(share[0][b])]
            for least in (1e-9, 0.5) for a, b in _runs(share[1] >= least)]


def _events(flight: FlightData, share: Pair | None, at: FloatArray,
            told: list[Happening]) -> list[Data]:
    """Return what happened, with what was told of, in the order of time."""
    found = list(told)
    if share is not None and share[1].any():
        time, values = share
        for first, last in _stalls(share):
            found.append((time[first], 'stall', 'stall begins on the wing'))
            half = np.flatnonzero(values[first:last + 1] >= 0.5)
            if half.size:
                found.append((time[first + half[0]], 'stall', 'half of the wing stalled'))
            if last + 1 < len(time):
                found.append((time[last + 1], 'recovery', 'recovery: the wing is attached'))
        # Without strips the share is that of a JSON, at the instants of alpha.
        deepest = int(np.lexsort((flight.alpha, values))[-1]) if flight.strips is None \
            else flight.strips.deepest()
        found.append((time[deepest], 'deepest',
                      f'deepest stall: {100.0 * values[deepest]:.0f} % of the wing'))
    if flight.alpha is not None:
        top = int(np.argmax(flight.alpha))
        found.append((flight.time[top], 'extreme',
                      f'greatest alpha, {np.degrees(flight.alpha[top]):.1f} deg'))
    if 'not_converged' in flight.solver:
        time, counted = flight.solver['not_converged']
        for when, new in zip(time, np.diff(counted, prepend=0.0)):
            if new > 0.0:
                found.append((when, 'failure', f'{new:.0f} steps not converged'
                              if new > 1.0 else '1 step not converged'))
    return [{'frame': int(np.argmin(np.abs(at - when))), 'kind': kind, 'at': f'{when:.2f} s',
             'text': what} for when, kind, what in sorted(found, key=lambda each: each[0])]

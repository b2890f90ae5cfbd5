# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of polars and trims, from the results that the command line writes as JSON."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import surface_order
from poststall_sim.plots import style

Rows = list[Mapping[str, Any]]
Strips = Mapping[str, list]


def draw_polar(result: Mapping[str, Any], path: Path) -> Path:
    """Draw lift, drag, pitching moment and the spread of the stall over alpha."""
    points: Rows = result['points']
    alpha = _column(points, 'alpha_deg')
    strips = [point['strips'] for point in points]
    up = [k for k, point in enumerate(points) if point.get('way') != 'down']
    wing = _wing(strips[0])
    share = np.array([_columns(each, wing)['stalled'].mean() for each in strips])
    with style.canvas(10.0, 6.4, path) as figure:
        axes = figure.subplots(2, 2)
        lift, drag, moment, spread = axes.flat
        for panel, key, label in ((lift, 'CL', '$C_L$ [-]'), (moment, 'Cm', '$C_m$ (cg) [-]')):
            _curve(panel, alpha, _column(points, key), share, points)
            panel.set(xlabel=r'$\alpha$ [deg]', ylabel=label)
        _curve(drag, _column(points, 'CD'), _column(points, 'CL'), share, points)
        drag.set(xlabel='$C_D$ [-]', ylabel='$C_L$ [-]')
        _spread(figure, spread, alpha[up], [strips[k] for k in up], wing)
        lift.set_title(_title('Polar', result))
        handles = {label: handle for panel in axes.flat[:3]
                   for handle, label in zip(*panel.get_legend_handles_labels())}
        if len(handles) > 1:
            lift.legend(handles.values(), handles.keys(), loc='best')
    return path


def _column(rows: Rows, key: str) -> np.ndarray:
    return np.array([row[key] for row in rows], dtype=float)


def _title(what: str, result: Mapping[str, Any]) -> str:
    """Return a title that says what is not the default."""
    said = [f'{what}, {result["aircraft"]}']
    said += [f'{name} {value:g}\u00b0' for name, value in
             result.get('deflections_deg', {}).items()]
    beta = result['points'][0]['beta_deg'] if result.get('points') else 0.0
    if beta:
        said.append(f'\u03b2 {beta:g}\u00b0')
    if not result['settings']['decambering']:
        said.append('attached flow')
    return ', '.join(said)


def _wing(strips: Strips) -> str:
    """Return the name of the wing."""
    names = list(dict.fromkeys(strips['surface']))
    return names[surface_order.by_span(
        [np.array(strips['surface']) == name for name in names], np.array(strips['y_m']))[0]]


def _columns(strips: Strips, surface: str) -> dict[str, np.ndarray]:
    """Return the columns of one surface's strips."""
    chosen = np.array([name == surface for name in strips['surface']])
    return {key: np.asarray(values)[chosen] for key, values in strips.items()}


def _curve(axes, x: np.ndarray, y: np.ndarray, share: np.ndarray, points: Rows) -> None:
    """Draw a line with a marker for each point: attached, stalled, not converged."""
    top = sum(point.get('way') != 'down' for point in points)
    axes.plot(x[:top], y[:top], color='#9AA1A9', linewidth=1.2, zorder=1)
    if top < len(points):
        axes.plot(x[top - 1:], y[top - 1:], color='#9AA1A9', linewidth=1.2, zorder=1,
                  linestyle='--', label='alpha lowered')
    good = np.array([point['status'] == 'converged' for point in points])
    for chosen, colour, marker, label in (
            (good & (share == 0.0), style.ATTACHED, 'o', 'wing attached'),
            (good & (share > 0.0) & (share < 0.5), style.PARTLY_STALLED, 'v',
             'some strips stalled'),
            (good & (share >= 0.5), style.STALLED, 'v', 'half of the wing stalled'),
            (~good, style.CONTROL, 'x', 'not converged')):
        if chosen.any():
            axes.scatter(x[chosen], y[chosen], s=18, color=colour, marker=marker, label=label,
                         linewidth=1.0 if marker == 'x' else 0.0, zorder=2)


def _spread(figure, axes, alpha: np.ndarray, strips: list[Strips], wing: str) -> None:
    """Draw the wing's Cl over span for a few angles, coloured by alpha."""
    from matplotlib import colormaps
    chosen = np.unique(np.linspace(0, len(alpha) - 1, min(len(alpha), 7)).round().astype(int))
    colours = colormaps['cividis'](np.linspace(0.05, 0.9, len(chosen)))
    for k, colour in zip(chosen, colours):
        columns = _columns(strips[k], wing)
        place, cl, stalled = (columns[key] for key in ('y_m', 'cl', 'stalled'))
        axes.plot(place, cl, color=colour, linewidth=1.3, label=f'{alpha[k]:g}\u00b0')
        axes.scatter(place[stalled], cl[stalled], s=14, marker='v', color=style.STALLED,
                     linewidth=0.0, zorder=3)
    axes.invert_xaxis()
    axes.set(xlabel='$y$ in base_link [m], port on the left', ylabel=f'{wing} strip $C_l$ [-]')
    axes.legend(title=r'$\alpha$', loc='center left', bbox_to_anchor=(1.0, 0.5))


def draw_trims(result: Mapping[str, Any], path: Path) -> Path:
    """
    Draw what balances the aircraft, and what its wing carries there.

    Over airspeed where that was given, else over alpha; of the flights on one figure each kind in
    a column of its own.
    """
    kinds = [(kind, key, title) for kind, key, title in (
        ('powered', 'airspeed_m_s', 'Powered'), ('glide', 'alpha_deg', 'Glide'),
        ('at alpha', 'alpha_deg', 'Powered'), ('steady', _varied(result['trims']), 'Steady'))
        if any(row['kind'] == kind for row in result['trims'])]
    with style.canvas(5.4 * len(kinds), 8.4, path) as figure:
        columns = figure.subplots(4, len(kinds), squeeze=False).T
        for column, (kind, key, title) in zip(columns, kinds):
            rows = [row for row in result['trims'] if row['kind'] == kind]
            _balance(column[:3], rows, key)
            flown = [row for row in rows if row['trimmed']]
            if flown:
                strips = [row['strips'] for row in flown]
                _spread(figure, column[3], _column(flown, 'alpha_deg'), strips,
                        _wing(strips[0]))
            column[0].set_title(_title(title, result))
            figure.align_ylabels(list(column))
    return path


_LABELS = {'airspeed_m_s': 'airspeed [m/s]', 'alpha_deg': r'$\alpha$ [deg]',
           'elevator_deg': 'elevator [deg]', 'throttle': 'throttle [-]',
           'sink_rate_m_s': 'sink rate [m/s]', 'climb_angle_deg': 'climb angle [deg]'}
_BALANCED = {'powered': ('alpha_deg', 'elevator_deg', 'throttle'),
             'glide': ('elevator_deg', 'airspeed_m_s', 'climb_angle_deg'),
             'at alpha': ('elevator_deg', 'airspeed_m_s', 'throttle')}


def _varied(rows: Rows) -> str:
    """Return what differs from row to row."""
    return 'airspeed_m_s' if len({row['airspeed_m_s'] for row in rows}) > 1 else 'alpha_deg'


def _balance(column, rows: Rows, key: str) -> None:
    """Draw three quantities of trims, with lines where there is none."""
    flown = np.array([row['trimmed'] for row in rows])
    x = _column(rows, key)
    wanted = _BALANCED.get(rows[0]['kind'], ('alpha_deg', 'elevator_deg', 'throttle'))
    for axes, name in zip(column, wanted):
        y = _column(rows, name)
        axes.plot(x, np.where(flown, y, np.nan), color=style.ATTACHED, linewidth=1.3)
        axes.scatter(x[flown], y[flown], s=18, color=style.ATTACHED, linewidth=0,
                     label='trimmed')
        axes.set_ylabel(_LABELS[name])
        for place in x[~flown]:
            axes.axvline(place, color=style.STALLED, linewidth=0.9, linestyle=(0, (2, 2)),
                         zorder=0)
        axes.sharex(column[0])
    if (~flown).any():
        column[0].plot([], [], color=style.STALLED, linestyle=(0, (2, 2)), linewidth=0.9,
                       label='no trim')
        column[0].legend(loc='best')
    column[2].set_xlabel(_LABELS[key])

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Stability and control derivatives over alpha, from what the command line writes as JSON."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim.plots import style

_PANELS = (
    ('Pitch', ('Cm_alpha', 'Cm_q')),
    ('Sideslip', ('CY_beta', 'Cl_beta', 'Cn_beta')), ('Roll', ('Cl_p', 'Cl_r')),
    ('Yaw', ('Cn_p', 'Cn_r')))
_MOTION = ('alpha', 'beta', 'p', 'q', 'r')
_COLOURS = (style.ATTACHED, style.STALLED, style.SECOND, style.THIRD, style.LIMIT, style.INK)


def draw_derivatives(result: Mapping[str, Any], path: Path) -> Path:
    """Draw the derivatives that matter most; gaps where there is none."""
    points = result['points']
    alpha = [point['alpha_deg'] for point in points]
    with style.canvas(11.0, 6.4, path) as figure:
        panels = figure.subplots(2, 3)
        first = (f'Derivatives, {result["aircraft"]}', ('CL_alpha', 'CD_alpha'))
        for axes, (title, names) in zip(
                panels.flat, (first, *_PANELS, ('Controls', by_controls(points)))):
            for name, colour in zip(names, _COLOURS):
                values = [point['derivatives'][name] for point in points]
                axes.plot(alpha, np.array(values, dtype=float), 'o-', color=colour,
                          markersize=3.0, label=name)
            axes.axhline(0.0, color=style.FAINT, linewidth=0.8, zorder=0)
            axes.set(xlabel=r'$\alpha$ [deg]', ylabel='[1/rad]; by p, q, r [-]')
            axes.set_title(title)
            if names:
                axes.legend(loc='best')
    return path


def by_controls(points: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Return of each control the moment that it makes most of, at any of the points."""
    controls = [key.removeprefix('CL_') for key in points[0]['derivatives']
                if key.startswith('CL_') and key.removeprefix('CL_') not in _MOTION]
    return tuple(max((f'{moment}_{name}' for moment in ('Cl', 'Cm', 'Cn')),
                     key=lambda key: max(abs(point['derivatives'][key] or 0.0)
                                         for point in points)) for name in controls)

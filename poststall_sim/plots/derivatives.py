# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Stability and control derivatives over alpha, from what the command line writes as JSON."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim.plots import style

_PANELS = (
    ('Pitch', ('Cm_alpha', 'Cm_q')),
    ('Sideslip', ('CY_beta', 'Cl_beta', 'Cn_beta')), ('Roll', ('Cl_p', 'Cl_r')),
    ('Yaw', ('Cn_p', 'Cn_r')))
_COLOURS = (style.ATTACHED, style.STALLED, style.SECOND, style.THIRD, style.LIMIT, style.INK)


def draw_derivatives(result: Mapping[str, Any], path: Path) -> Path:
    """Draw the derivatives that matter most; gaps where there is none."""
    points = result['points']
    alpha = [point['alpha_deg'] for point in points]
    motion = ('alpha', 'beta', 'p', 'q', 'r')
    moments = [max((f'{key}_{name}' for key in ('Cl', 'Cm', 'Cn')),
                   key=lambda key: abs(points[0]['derivatives'][key] or 0.0))
               for name in (key.removeprefix('CL_') for key in points[0]['derivatives']
                            if key.startswith('CL_')) if name not in motion]
    with style.canvas(11.0, 6.4, path) as figure:
        panels = figure.subplots(2, 3)
        first = (f'Derivatives, {result["aircraft"]}', ('CL_alpha', 'CD_alpha'))
        for axes, (title, names) in zip(
                panels.flat, (first, *_PANELS, ('Controls', tuple(moments)))):
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

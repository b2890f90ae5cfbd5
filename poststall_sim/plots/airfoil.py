# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The figure of a section's curves, from the result that ``poststall airfoil`` writes as JSON."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim.plots import style

_LABELS = (('cl', '$c_l$ [-]'), ('cd', '$c_d$ [-]'), ('cm', '$c_m$ (c/4) [-]'))
_RANGES = ((-25.0, 45.0), (-180.0, 180.0))


def draw_airfoil(result: Mapping[str, Any], path: Path) -> Path:
    """Draw cl, cd and cm about the stall and over a full turn, with the points there are."""
    table = _arrays(result['table'])
    sets = [(label, _arrays(result[key]), colour, size) for key, label, colour, size in (
        ('points', 'given', style.COMMAND, 7.0),
        ('measured', (result.get('measured') or {}).get('name', ''), style.STALLED, 14.0))
        if result.get(key)]
    with style.canvas(11.0, 8.4, path) as figure:
        panels = figure.subplots(3, 2, sharex='col', width_ratios=(1.0, 1.2))
        for row, (key, label) in zip(panels, _LABELS):
            for axes, (low, high) in zip(row, _RANGES):
                for name, points, colour, size in sets:
                    if key in points:
                        here = (points['alpha_deg'] >= low) & (points['alpha_deg'] <= high)
                        axes.scatter(points['alpha_deg'][here], points[key][here], s=size,
                                     color=colour, linewidth=0.0, label=name, zorder=2)
                here = (table['alpha_deg'] >= low) & (table['alpha_deg'] <= high)
                axes.plot(table['alpha_deg'][here], table[key][here], color=style.ATTACHED,
                          linewidth=1.3, label='curve', zorder=3)
                axes.set(ylabel=label, xlim=(low, high))
                style.headroom(axes)
        for axes, ticks in zip(panels[-1], (np.arange(-20, 50, 10), np.arange(-180, 181, 60))):
            axes.set(xlabel=r'$\alpha$ [deg]', xticks=ticks)
        _stalls(panels[0, 0], result)
        reynolds = f', Re {result["reynolds"]:.3g}' if result.get('reynolds') else ''
        panels[0, 0].set_title(f'{result["airfoil"]}{reynolds}')
        panels[0, 0].legend(loc='best')
        figure.align_ylabels(panels)
    return path


def _arrays(columns: Mapping[str, Any]) -> dict[str, np.ndarray]:
    return {key: np.array(columns[key], dtype=float)
            for key in ('alpha_deg', 'cl', 'cd', 'cm') if columns.get(key) is not None}


def _stalls(axes, result: Mapping[str, Any]) -> None:
    """Mark the stalls."""
    for side in ('positive_stall', 'negative_stall'):
        stall = result[side]
        axes.annotate(f'{stall["cl"]:.2f} at {stall["alpha_deg"]:.1f}\u00b0',
                      (stall['alpha_deg'], stall['cl']), xytext=(6.0, 6.0),
                      textcoords='offset points', fontsize=8.0, color=style.INK)
        axes.plot(stall['alpha_deg'], stall['cl'], 'o', markersize=3.5, color=style.INK, zorder=4)

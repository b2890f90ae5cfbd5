# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Figures of lines: operating points, trajectories, lift curves, loadings, rates in time.

A figure is a row or a grid of `Panel`, a panel a few `Curve` on one kind of axes. Angles are in
degrees here.
"""

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from poststall_sim.aero.polars import SectionPolar
from poststall_sim.frames import FloatArray
from poststall_sim.plots import style

SCHEME_COLOURS = {'A': '#0072B2', 'B': '#E69F00', 'C': '#009E73', 'D': '#D55E00'}
"""Okabe & Ito, as in `style`."""
NONLOCAL_COLOUR = '#CC79A7'
REFERENCE_COLOUR = '#8A9099'
DEG = '\u00b0'


class Kind(enum.Enum):
    """What the axes of a panel are: their labels."""

    SECTION = (r'section $\alpha$ [deg]', 'section $C_l$ [-]')
    INPUT = (r'section $\alpha$ [deg]', 'section coefficients [-]')
    LIFT = (r'wing $\alpha$ [deg]', 'wing $C_L$ [-]')
    SURFACE = (r'wing $\alpha$ [deg]', '$C_L$ by its own area [-]')
    LOADING = ('$2y/b$ [-], port tip on the left', 'strip $C_l$ [-]')
    CHANGES = ('$2y/b$ [-], port tip on the left', 'change [deg]')
    SPAN = ('$y$ [wing chords], port on the left', 'strip $C_l$ [-]')
    SECTION_DRAG = (r'section $\alpha$ [deg]', 'section $C_d$ [-]')
    SECTION_MOMENT = (r'section $\alpha$ [deg]', 'section $C_m$ about c/4 [-]')
    COUNT = (r'wing $\alpha$ [deg]', 'distinct solutions found')
    POLE = (r'wing $\alpha$ [deg]', 'real part of the pole [1/s]')
    DAMPING = (r'wing $\alpha$ [deg]', r'$C_{lp}$ [-]')
    AIRSPEED = (r'$\alpha$ [deg]', 'airspeed [m/s]')
    CLIMB = (r'$\alpha$ [deg]', 'climb angle [deg]')
    ELEVATOR = (r'$\alpha$ [deg]', 'elevator [deg], down positive')
    ROLLING = ('time [s]', 'roll rate [deg/s]')
    SLOPE = ('aspect ratio [-]', r'$C_{L\alpha}$ [1/rad]')
    ROLL_DAMPING = ('aspect ratio [-]', r'$C_{lp}$ [-]')
    INDICIAL = ('$s = 2 V t / c$ [-]', 'share of the final lift [-]')
    AMPLITUDE = (r'$k = \omega c / 2 V$ [-]', r'lift over $2 \pi \alpha$ [-]')
    PHASE = (r'$k = \omega c / 2 V$ [-]', 'phase [deg]')
    RATES = ('time [s]', 'rate [deg/s]')
    ENERGY = ('time [s]', 'energy [J]')
    SPECTRUM = ('wave number [1/m]', 'spectrum [m$^3$/s$^2$]')
    PITCHING = ('time [s]', 'pitch rate [deg/s]')


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Places and values of a line, and how it looks; without a label it is not in the legend."""

    label: str
    x: FloatArray
    y: FloatArray
    colour: str = style.INK
    line: str | tuple = '-'
    marker: str = ''
    width: float = 1.5
    size: float = 4.0
    top: int = 3
    hollow: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """
    One pair of axes.

    limits : x from, to, y from, to, None where the data decides; texts : x, y and what stands
    there; bands : x, low, high and colour of areas; log : the y axis.
    """

    kind: Kind
    title: str
    curves: tuple[Curve, ...]
    limits: tuple[float | None, ...] = (None, None, None, None)
    texts: tuple[tuple[float, float, str], ...] = ()
    bands: tuple[tuple[FloatArray, FloatArray, FloatArray, str], ...] = ()
    log: bool = False


def draw(path: Path, panels: Sequence[Panel], *, columns: int | None = None,
         height: float = 3.4, shared: bool = False) -> Path:
    """
    Draw panels with one legend below them and return the file.

    height : of a row [inches]; shared : the panels of a row share their y axis.
    """
    columns = columns or len(panels)
    rows = math.ceil(len(panels) / columns)
    width = {1: 6.6, 2: 9.2}.get(columns, 3.2 * columns)
    with style.canvas(width, height * rows + 0.45, path) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharey='row' if shared else False)
        for axes, panel in zip(grid.flat, panels):
            _fill(axes, panel)
        for axes in grid.flat[len(panels):]:
            axes.remove()
        if shared:
            for axes in grid[:, 1:].flat:
                axes.set_ylabel('')
        _legend(figure, grid.flat[:len(panels)])
    return path


def _legend(figure, grid) -> None:
    """Put one legend of all panels below them."""
    handles = {label: handle for axes in grid
               for handle, label in zip(*axes.get_legend_handles_labels())}
    if handles:
        longest = max(len(label) for label in handles)
        room = int(figure.get_figwidth() * 13.0 / (longest + 6))
        lines = math.ceil(len(handles) / max(room, 1))
        figure.legend(handles.values(), handles.keys(), loc='outside lower center',
                      ncols=math.ceil(len(handles) / lines), columnspacing=1.6)


def _fill(axes, panel: Panel) -> None:
    _lines(axes, panel)
    axes.set(xlabel=panel.kind.value[0], ylabel=panel.kind.value[1])
    if panel.title:
        axes.set_title(panel.title)
    if panel.log:
        axes.set_yscale('log')
    axes.set_xlim(*panel.limits[:2])
    axes.set_ylim(*panel.limits[2:])
    for x, y, text in panel.texts:
        axes.annotate(text, (x, y), fontsize=8.0, color=style.INK, ha='left', va='center')


def _lines(axes, panel: Panel) -> None:
    for x, low, high, colour in panel.bands:
        axes.fill_between(x, low, high, color=colour, alpha=0.25, linewidth=0.0, zorder=1)
    for curve in panel.curves:
        axes.plot(curve.x, curve.y, color=curve.colour, linestyle=curve.line,
                  marker=curve.marker, markersize=curve.size, markeredgewidth=1.1,
                  markerfacecolor='none' if curve.hollow else curve.colour,
                  linewidth=curve.width, zorder=curve.top, label=curve.label or None)


def section_curves(polar: SectionPolar, *, low: float = -10.0, high: float = 40.0,
                   deltas: Sequence[float] = (0.0,)) -> tuple[Curve, ...]:
    """Return a section's curve and its potential lines with decambering [deg], small angles."""
    alpha = np.linspace(low, high, 401)
    curves = [Curve('section curve (input)', alpha, polar.at(np.radians(alpha))[:, 0],
                    width=2.0, top=2)]
    for delta, line in zip(deltas, ('-.', '--', ':')):
        curves.append(Curve(
            rf'potential flow, $\delta$ = {delta:g}' + DEG, alpha,
            2.0 * math.pi * (np.radians(alpha + delta) - polar.zero_lift), REFERENCE_COLOUR,
            line, width=1.1, top=1))
    return tuple(curves)


def draw_section(path: Path, polar: SectionPolar, angles: tuple[float, float], delta: float,
                 contour: tuple[FloatArray, FloatArray]) -> Path:
    """
    Draw two-dimensional decambering: lift curves, the section, and its camber line turned.

    angles [deg] : an attached and a stalled one, whose decambering is delta [deg]; contour :
    x, y (n,) of the section and its camber line x, y (m,), in chords.
    """
    outline, camber = contour
    plane = Panel(Kind.SECTION, '(a) lift curves', (
        *section_curves(polar, deltas=(0.0, round(delta, 2))),
        *(Curve(rf'$\alpha$ = {angle:g}' + DEG, np.array([angle]),
                polar.at(np.radians([angle]))[:, 0], colour, '', 'o', size=7.0)
          for angle, colour in zip(angles, (style.ATTACHED, style.STALLED)))),
        limits=(-10.0, 40.0, -0.6, 3.2))
    turned = camber[1] - camber[0] * math.tan(math.radians(delta))
    with style.canvas(9.2, 4.1, path) as figure:
        grid = figure.subplots(2, 2, width_ratios=(1.15, 1.0))
        left = grid[0, 0].get_gridspec()[:, 0]
        for axes in grid[:, 0]:
            axes.remove()
        first = figure.add_subplot(left)
        _fill(first, plane)
        above, below = grid[:, 1]
        above.plot(outline[0], outline[1], color=style.INK, linewidth=1.4)
        above.plot([0.0, 1.0], [0.0, -math.tan(math.radians(delta))], color=style.STALLED,
                   linestyle='--', label=rf'linear function, $\delta$ = {delta:.2f}' + DEG)
        above.set_title('(c) section, linear function')
        below.plot(camber[0], camber[1], color=style.ATTACHED, label='camber line')
        below.plot(camber[0], turned, color=style.STALLED, linestyle='--',
                   label='decambered')
        below.set_title('(d) camber lines')
        for axes in (above, below):
            axes.set(xlabel='$x/c$ [-]', ylabel='$z/c$ [-]', xlim=(-0.03, 1.03),
                     ylim=(-0.08, 0.29))
            axes.set_aspect('equal')
            axes.legend(loc='upper left', ncols=2)
        _legend(figure, [first])
    return path

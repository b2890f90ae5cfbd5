# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Figures of modes: root loci along the angle of attack, and damping and frequency over it.

Drawn from the points that the command line writes as JSON. Where the body has less than half of
a mode, and the wake the rest, markers and lines are faint. Angles are in degrees here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim.plots import style
from poststall_sim.stability.modes import plain

Points = Sequence[Mapping[str, Any]]

MODELS = ('fixed', 'variable', 'lagged', 'quasi-steady')
MARKERS = {'fixed': 's', 'variable': 'o', 'lagged': '^', 'quasi-steady': 'x'}
LINES = {'fixed': (0, (5, 2)), 'variable': '-', 'lagged': (0, (1, 1.3)),
         'quasi-steady': '-'}
WIDTHS = {'quasi-steady': 0.7}
COLOURS = {'short period': style.ATTACHED, 'phugoid': style.STALLED, 'Dutch roll': style.ATTACHED,
           'roll': style.STALLED, 'spiral': style.SECOND, 'lateral phugoid': style.THIRD}
"""By the classical name; others have ink."""
LONGITUDINAL = ('short period', 'phugoid')
HALF = 0.5
FAINT = 0.25
NEAR = 1.0
"""Eigenvalues below this [1/s] are drawn to scale, those above more and more closely."""
SHADE = '#FBEDE6'
_MAP = 'viridis'


@dataclass(frozen=True, slots=True)
class Look:
    """Which motion a panel shows, and its title."""

    longitudinal: bool
    title: str


LOOKS = (Look(True, 'longitudinal'), Look(False, 'lateral'))


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """A mode by one model along alpha (k,) [deg]: eigenvalues (k,) [1/s], body's shares (k,)."""

    name: str
    model: str
    alpha: np.ndarray
    eigenvalues: np.ndarray
    shares: np.ndarray

    @property
    def classical(self) -> str:
        """The name without what says that it is coupled or half of a split pair."""
        return plain(self.name.split(' + ')[0])


def branches(points: Points) -> list[Branch]:
    """Return the branches that have names; modes of the wake and what is left over have none."""
    gathered: dict[tuple[str, str], list[tuple[float, complex, float]]] = {}
    for point in points:
        for mode in point['modes']:
            name = mode['name'].removeprefix('coupled ')
            if not name.startswith(('wake', 'other')):
                gathered.setdefault((point['decambering'], name), []).append(
                    (point['alpha_deg'], complex(mode['real'], mode['imag']), mode['share']))
    return [Branch(name, model, *(np.array(column) for column in zip(*found)))
            for (model, name), found in gathered.items()]


def draw_modes(result: Mapping[str, Any], path: Path) -> Path:
    """Draw root loci above, real and imaginary parts over alpha below."""
    found = branches(result['points'])
    with style.canvas(10.5, 9.6, path) as figure:
        grid = figure.subplots(3, 2, height_ratios=(1.5, 1.0, 1.0))
        fill_loci(figure, grid[0], found)
        for axes, look in zip(grid[0], LOOKS):
            axes.set_title(f'{look.title.capitalize()} modes, {result["aircraft"]}')
        fill_parts(grid[1:].T, found)
        _say_models(figure, found)
    return path


def draw_loci(path: Path, points: Points, looks: Iterable[Look]) -> Path:
    """Draw root loci only, a panel for each look, with real and imaginary part below."""
    looks, found = tuple(looks), branches(points)
    with style.canvas(9.2, 4.4 * len(looks), path) as figure:
        grid = figure.subplots(len(looks), 2, squeeze=False, width_ratios=(1.45, 1.0))
        for (left, right), look in zip(grid, looks):
            fill_loci(figure, [left], found, (look,))
            left.set_title(f'{look.title.capitalize()} eigenvalues')
            gridspec = right.get_subplotspec().subgridspec(2, 1)
            right.remove()
            above = figure.add_subplot(gridspec[0])
            fill_parts([(above, figure.add_subplot(gridspec[1], sharex=above))], found, (look,))
        _say_models(figure, found)
    return path


def _seen(found: Sequence[Branch], look: Look) -> list[Branch]:
    return [each for each in found if (each.classical in LONGITUDINAL) is look.longitudinal]


def fill_loci(figure, panels: Sequence, found: Sequence[Branch],
              looks: Sequence[Look] = LOOKS) -> None:
    """Draw the upper half of the plane of eigenvalues, coloured by alpha, one panel a look."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    alphas = np.concatenate([each.alpha for each in found] or [np.zeros(1)])
    colour = ScalarMappable(Normalize(alphas.min(), max(alphas.max(), alphas.min() + 1e-9)),
                            colormaps[_MAP])
    for axes, look in zip(panels, looks):
        seen = _seen(found, look)
        for each in seen:
            _locus(axes, each, colour)
        axes.set_xscale('asinh', linear_width=NEAR)
        axes.set_yscale('asinh', linear_width=NEAR)
        axes.axvspan(0.0, 1e3, color=SHADE, zorder=0, linewidth=0.0)
        axes.axvline(0.0, color=style.INK, linewidth=0.8, zorder=1)
        _frame(axes, seen)
        _name(axes, seen)
        axes.set(xlabel='real part [1/s]', ylabel='imaginary part [1/s]')
    figure.colorbar(colour, ax=list(panels), label=r'$\alpha$ [deg]', pad=0.01, aspect=30)


def _locus(axes, branch: Branch, colour) -> None:
    x, y = branch.eigenvalues.real, branch.eigenvalues.imag
    axes.plot(x, y, color=style.FAINT, linewidth=0.8, linestyle=LINES[branch.model], zorder=2)
    for own in (False, True):
        chosen = (branch.shares >= HALF) == own
        axes.scatter(x[chosen], y[chosen], c=colour.to_rgba(branch.alpha[chosen]), s=20,
                     marker=MARKERS[branch.model], alpha=1.0 if own else FAINT, clip_on=False,
                     linewidth=1.1 if MARKERS[branch.model] == 'x' else 0.0, zorder=3 + own)


def _frame(axes, seen: Sequence[Branch]) -> None:
    """Set limits and ticks around the eigenvalues: a decade's 1, 2 and 5 to either side."""
    values = np.concatenate([each.eigenvalues for each in seen] or [np.zeros(1)])
    for low, high, limit, ticks in (
            (values.real.min(), values.real.max(), axes.set_xlim, axes.set_xticks),
            (0.0, values.imag.max(), axes.set_ylim, axes.set_yticks)):
        ends = np.arcsinh(np.array([low, max(high, 0.0)]) / NEAR)
        margin = 0.06 * max(np.ptp(ends), 0.5)
        ends = np.array([ends[0] - margin if low < 0.0 else 0.0, ends[1] + margin])
        limit(*np.sinh(ends) * NEAR)
        places = _ticks(*np.sinh(ends) * NEAR)
        ticks(places, [f'{place:g}' for place in places])
        axes.minorticks_off()


def _ticks(low: float, high: float) -> list[float]:
    """Return 1, 2 and 5 of each decade on both sides of 0, less of them on a longer axis."""
    long = np.ptp(np.arcsinh(np.array([low, high]) / NEAR)) > 5.0
    digits = (1, 3) if long else (1, 2, 5)
    steps = [size * digit for size in (0.1, 1.0, 10.0, 100.0) for digit in digits
             if size * digit >= (1.0 if long else 0.5)]
    return [place for place in (*(-step for step in steps[::-1]), 0.0, *steps)
            if low <= place <= high]


def _name(axes, seen: Sequence[Branch]) -> None:
    """Write each name once, beside the first point of the model that has most to show."""
    from matplotlib.patheffects import withStroke
    named: set[str] = set()
    for model in ('variable', 'lagged', 'fixed', 'quasi-steady'):
        for each in seen:
            if each.model == model and each.classical not in named:
                named.add(each.classical)
                place = each.eigenvalues[0]
                across = axes.transLimits.transform(
                    axes.transScale.transform((place.real, place.imag)))[0]
                axes.annotate(each.classical, (place.real, place.imag),
                              xytext=(-7 if across > 0.8 else 5, 7), zorder=6,
                              ha='right' if across > 0.8 else 'left',
                              textcoords='offset points', fontsize=8.5, color=style.INK,
                              path_effects=[withStroke(linewidth=2.5, foreground='white')])


def fill_parts(columns: Iterable[Sequence], found: Sequence[Branch],
               looks: Sequence[Look] = LOOKS) -> None:
    """Draw real and imaginary part over alpha, two panels a look, coloured by name."""
    for (real, imaginary), look in zip(columns, looks):
        seen = _seen(found, look)
        for each in seen:
            for axes, values in ((real, each.eigenvalues.real),
                                 (imaginary, each.eigenvalues.imag)):
                if axes is imaginary and not values.any():
                    continue
                _line(axes, each, values)
        for name in dict.fromkeys(each.classical for each in seen):
            real.plot([], [], color=COLOURS.get(name, style.INK), label=name)
        real.set_yscale('asinh', linear_width=NEAR)
        low, high = real.get_ylim()[0], max(real.get_ylim()[1], 0.2)
        real.axhspan(0.0, 1e3, color=SHADE, zorder=0, linewidth=0.0)
        real.axhline(0.0, color=style.INK, linewidth=0.8, zorder=1)
        real.set_ylim(low, high)
        places = _ticks(low, high)
        real.set_yticks(places, [f'{place:g}' for place in places])
        real.minorticks_off()
        real.set_ylabel('real part [1/s]')
        if seen:
            real.legend(loc='best', ncols=2)
        imaginary.set(xlabel=r'$\alpha$ [deg]', ylabel='imaginary part [1/s]')
        imaginary.set_ylim(0.0, None)


def _line(axes, branch: Branch, values: np.ndarray) -> None:
    """Draw a branch, faint between points that are mostly wake, broken where angles lack."""
    steps = np.abs(np.diff(branch.alpha))
    whole = steps <= 1.5 * steps.min() if steps.size else steps > 0.0
    own = np.minimum(branch.shares[1:], branch.shares[:-1]) >= HALF
    looks = {'color': COLOURS.get(branch.classical, style.INK), 'linestyle': LINES[branch.model],
             'linewidth': WIDTHS.get(branch.model, 1.5)}
    for chosen, strength in ((whole & own, 1.0), (whole & ~own, FAINT)):
        # Of a run of chosen steps both ends are drawn, what lies between runs is not.
        ends = np.append(chosen, False) | np.append(False, chosen)
        x, y = np.where(ends, branch.alpha, np.nan), np.where(ends, values, np.nan)
        cut = np.flatnonzero(~chosen) + 1
        axes.plot(np.insert(x, cut, np.nan), np.insert(y, cut, np.nan), alpha=strength, **looks)
    if len(values) == 1:
        axes.plot(branch.alpha, values, color=looks['color'], marker=MARKERS[branch.model],
                  markersize=4.0)


def _say_models(figure, found: Sequence[Branch]) -> None:
    """Say below what marker and line stand for which model."""
    from matplotlib.lines import Line2D
    models = [model for model in MODELS if any(each.model == model for each in found)]
    handles = [Line2D([], [], color=style.INK, marker=MARKERS[model], markersize=4.5,
                      linestyle=LINES[model], linewidth=WIDTHS.get(model, 1.5),
                      label=model if model == 'quasi-steady' else f'{model} decambering')
               for model in models]
    if any((each.shares < HALF).any() for each in found):
        handles.append(Line2D([], [], color=style.INK, marker='o', markersize=4.5, alpha=FAINT,
                              label='faint: more wake than body'))
    figure.legend(handles=handles, loc='outside lower center', ncols=len(handles),
                  handlelength=3.2)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of a campaign's table: distributions, scatter, envelope maps, what matters most."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim.plots import style

Columns = Mapping[str, Sequence[Any]]
_MOST_PANELS = 6


def draw_campaign(definition: Mapping[str, Any], rows: Columns, folder: Path) -> list[Path]:
    """Draw what a table has, and return the files; what cannot be drawn of it is left out."""
    inputs = [key for key, _ in definition['variables']]
    numbers = {key: column for key in definition['quantities']
               if (column := _number(rows[key])) is not None and _varies(column)}
    groups = {key: _group(rows[key]) for key in inputs}
    name, drawn = definition['name'], []
    ends = {each: list(rows['status']).count(each) for each in sorted(set(rows['status']))}
    told = f'{name}: ' + ', '.join(f'{count} {end}' for end, count in ends.items())
    if numbers:
        drawn += [_distributions(told, numbers, folder / 'distributions.png'),
                  _scatter(told, numbers, groups, folder / 'scatter.png'),
                  _ranking(told, numbers, groups, folder / 'sensitivity.png')]
    return drawn + _maps(told, numbers, rows, inputs, folder)


def _number(column: Sequence[Any]) -> np.ndarray | None:
    """Return a column as numbers, NaN where there is none; None for text."""
    if any(isinstance(value, str) for value in column):
        return None
    return np.array([np.nan if value is None else float(value) for value in column])


def _varies(column: np.ndarray) -> bool:
    known = column[np.isfinite(column)]
    return known.size > 1 and bool(np.ptp(known) > 0.0)


def _group(column: Sequence[Any]) -> tuple[np.ndarray, list[str] | None]:
    """Return an input as numbers; of texts, their places among the texts, and these."""
    numbers = _number(column)
    if numbers is not None:
        return numbers, None
    words = list(dict.fromkeys(column))
    return np.array([words.index(value) for value in column], dtype=float), words


def _distributions(title: str, numbers: Mapping[str, np.ndarray], path: Path) -> Path:
    shown = list(numbers.items())[:12]
    rows = -(-len(shown) // 3)
    with style.canvas(10.0, 2.4 * rows + 0.4, path) as figure:
        panels = figure.subplots(rows, 3, squeeze=False).ravel()
        for axes, (name, column) in itertools.zip_longest(panels, shown, fillvalue=('', None)):
            if column is None:
                axes.set_axis_off()
                continue
            known = column[np.isfinite(column)]
            axes.hist(known, bins=min(40, max(5, int(np.sqrt(known.size)))), color=style.ATTACHED)
            axes.set(xlabel=name, ylabel='cases')
            if known.size < column.size:
                axes.text(0.98, 0.95, f'{column.size - known.size} have none', fontsize=7.5,
                          transform=axes.transAxes, ha='right', va='top')
        figure.suptitle(title)
    return path


def _scatter(title: str, numbers: Mapping[str, np.ndarray], groups: Mapping[str, Any],
             path: Path) -> Path:
    down, across = list(numbers.items())[:_MOST_PANELS], list(groups.items())[:_MOST_PANELS]
    with style.canvas(2.6 * len(across) + 0.6, 1.9 * len(down) + 0.6, path) as figure:
        panels = figure.subplots(len(down), len(across), squeeze=False, sharex='col', sharey='row')
        for line, (name, column) in zip(panels, down):
            line[0].set_ylabel(name, fontsize=8.0)
            for axes, (_, (values, _)) in zip(line, across):
                axes.scatter(values, column, s=6.0, linewidth=0.0, alpha=0.5,
                             color=style.ATTACHED)
        for axes, (key, (_, words)) in zip(panels[-1], across):
            axes.set_xlabel(key, fontsize=8.0)
            if words:
                axes.set_xticks(range(len(words)), words)
        figure.suptitle(title)
    return path


def sensitivity(values: np.ndarray, column: np.ndarray, by_group: bool) -> float:
    """
    Return how much a quantity goes with an input, 0 to 1.

    For numbers Spearman's rank correlation, without its sign; for texts the correlation ratio of
    the ranks: the root of the share of their variance that lies between the groups.
    """
    from scipy.stats import rankdata, spearmanr
    known = np.isfinite(column)
    values, column = values[known], column[known]
    if column.size < 3 or not np.ptp(column) or not np.ptp(values):
        return 0.0
    if not by_group:
        return abs(float(spearmanr(values, column).statistic))
    ranks = rankdata(column)
    _, group = np.unique(values, return_inverse=True)
    means = (np.bincount(group, ranks) / np.bincount(group))[group]
    return float(np.sqrt(np.var(means) / np.var(ranks)))


def _ranking(title: str, numbers: Mapping[str, np.ndarray], groups: Mapping[str, Any],
             path: Path) -> Path:
    shown = list(numbers.items())[:9]
    rows = -(-len(shown) // 3)
    with style.canvas(10.0, (0.8 + 0.3 * len(groups)) * rows + 0.5, path) as figure:
        panels = figure.subplots(rows, 3, squeeze=False, sharex=True).ravel()
        for axes, (name, column) in itertools.zip_longest(panels, shown, fillvalue=('', None)):
            if column is None:
                axes.set_axis_off()
                continue
            ranked = sorted((sensitivity(values, column, words is not None), key)
                            for key, (values, words) in groups.items())
            axes.barh([key for _, key in ranked], [share for share, _ in ranked],
                      color=style.ATTACHED)
            axes.set(xlim=(0.0, 1.0))
            axes.tick_params(axis='y', labelsize=7.0)
            axes.set_title(name, fontsize=9.0)
        figure.suptitle(f'{title}; rank correlation with each input')
    return path


def _maps(title: str, numbers: Mapping[str, np.ndarray], rows: Columns, inputs: Sequence[str],
          folder: Path) -> list[Path]:
    """Draw means over the first two inputs that are grids of numbers, by those that are texts."""
    grids = [key for key in inputs if _number(rows[key]) is not None
             and 2 <= len(set(rows[key])) <= max(2, len(rows[key]) // 3)]
    wanted = [key for key in numbers if isinstance(_first(rows[key]), bool)] or list(numbers)[:1]
    if len(grids) < 2 or not wanted:
        return []
    first, second = (np.array(rows[key], dtype=float) for key in grids[:2])
    texts = [key for key in inputs if _number(rows[key]) is None]
    labels = np.array([', '.join(f'{key} {rows[key][i]}' for key in texts)
                       for i in range(len(first))])
    drawn = []
    for name in wanted:
        panels_of, path = list(dict.fromkeys(labels)), folder / f'envelope_{name}.png'
        with style.canvas(4.4 * len(panels_of) + 0.8, 4.0, path) as figure:
            panels = figure.subplots(1, len(panels_of), squeeze=False, sharey=True)[0]
            known = numbers[name][np.isfinite(numbers[name])]
            for axes, label in zip(panels, panels_of):
                x, y, mean = _mean(first, second, np.where(labels == label, numbers[name], np.nan))
                mesh = axes.pcolormesh(x, y, mean.T, shading='nearest', cmap='cividis',
                                       vmin=known.min(), vmax=known.max())
                axes.set(xlabel=grids[0], title=label)
                axes.grid(False)
            panels[0].set_ylabel(grids[1])
            figure.colorbar(mesh, ax=list(panels), label=f'{name}, mean')
            figure.suptitle(title)
        drawn.append(path)
    return drawn


def _first(column: Sequence[Any]) -> Any:
    return next((value for value in column if value is not None), None)


def _mean(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return grids and the means (x, y) there, NaN where no case has a number."""
    xs, ys = np.unique(x), np.unique(y)
    total, count = np.zeros((xs.size, ys.size)), np.zeros((xs.size, ys.size))
    known = np.isfinite(z)
    at = np.searchsorted(xs, x[known]), np.searchsorted(ys, y[known])
    np.add.at(total, at, z[known])
    np.add.at(count, at, 1.0)
    return xs, ys, np.where(count > 0.0, total / np.maximum(count, 1.0), np.nan)

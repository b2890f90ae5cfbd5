# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The job of the command `database`: steady coefficients over a grid, in a folder, written as found.

The grid is made of sweeps over alpha, each by continuation from its first angle. A build-up has
those of every sideslip with neutral controls and without rates, and, at zero sideslip, those of
each rate and of each control alone; a full grid has every combination.

The folder has ``manifest.json``, which says of what and how, and ``database.csv``, a row for each
condition in the order of the grid. A row is there once its line is whole, so that a run that was
broken off goes on behind the last one: the sweep that it stands in is computed again from its
start, since each point starts from the one before, and only what is missing is written.
"""

import csv
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import __version__, atomic_file, jobs
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import ConfigError
from poststall_sim.buildup import COEFFICIENTS, RATES, BuildUp, Increment
from poststall_sim.flight_file import fingerprint

FORMAT = 1
"""Goes up when a column changes its meaning."""
MANIFEST, TABLE = 'manifest.json', 'database.csv'
MOST_ROWS = 1_000_000
_RATE_HEADS = ('p b/2V [-]', 'q c/2V [-]', 'r b/2V [-]')
_FOUND_HEADS = (*(f'{key} [-]' for key in COEFFICIENTS), 'stalled strips [-]')


@dataclass(frozen=True, slots=True)
class Case:
    """What stays as it is in a sweep: beta [deg], p b/2V, q c/2V, r b/2V, deflections [deg]."""

    beta: float
    rates: tuple[float, float, float]
    deflections: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Grid:
    """
    Conditions: alpha, beta [deg], rates by `RATES` [-], deflections by control [deg].

    full : every combination of them; otherwise the sweeps of a build-up.
    """

    alpha: Sequence[float]
    beta: Sequence[float] = (0.0,)
    rates: Mapping[str, Sequence[float]] = field(default_factory=dict)
    deflections: Mapping[str, Sequence[float]] = field(default_factory=dict)
    full: bool = False

    def cases(self, controls: Sequence[str]) -> list[Case]:
        """Return the sweeps in order, for an aircraft with these controls."""
        for name in self.deflections:
            if name not in controls:
                raise ConfigError(f'there is no control {name!r}, there are '
                                  f'{", ".join(controls) or "none"}')
        rates = [self.rates.get(name, (0.0,)) for name in RATES]
        moved = [self.deflections.get(name, (0.0,)) for name in controls]
        if self.full:
            self._require_fewer(math.prod(map(len, (self.beta, *rates, *moved))))
            return [Case(beta, (p, q, r), tuple(deflected)) for beta, p, q, r, *deflected in
                    product(self.beta, *rates, *moved)]
        cases = [_single(beta, len(controls)) for beta in self.beta]
        cases += [_single(0.0, len(controls), axis, value)
                  for axis, values in enumerate((*rates, *moved)) for value in values if value]
        self._require_fewer(len(cases))
        return cases

    def _require_fewer(self, sweeps: int) -> None:
        rows = sweeps * len(self.alpha)
        if rows > MOST_ROWS:
            raise ConfigError(f'the grid has {rows} conditions, at most {MOST_ROWS}')

    def require_tables(self) -> None:
        """Refuse a grid that no tables can be made of: they are changes from zero."""
        every = [self.beta] if not self.full else [
            self.beta, *self.rates.values(), *self.deflections.values()]
        if len(self.alpha) < 2 or not all(0.0 in values for values in every):
            raise ConfigError('tables need at least two angles of attack and 0 among the '
                              'sideslips; of a full grid among rates and deflections too')


class Database:
    """
    A grid in a folder, as far as it has been computed.

    Raises `ConfigError` where the folder holds a database and resume is not asked for, or holds
    one of another aircraft, grid or way of computing.
    """

    def __init__(self, folder: Path, model: Model, grid: Grid, *, airspeed: float,
                 altitude: float, resume: bool = False) -> None:
        self._model, self._grid, self._folder = model, grid, folder
        self._airspeed, self._altitude = airspeed, altitude
        self._cases = grid.cases(model.aircraft.control_names)
        self.rows = len(self._cases) * len(grid.alpha)
        self._deflected = [jobs.deflections(model.aircraft, {
            name: math.radians(value)
            for name, value in zip(model.aircraft.control_names, case.deflections)})
            for case in self._cases]
        self.head = (
            'alpha [deg]', 'beta [deg]', *_RATE_HEADS,
            *(f'{name} [deg]' for name in model.aircraft.control_names), *_FOUND_HEADS,
            'residual [-]' if model.settings.closure is Closure.LOCAL else 'residual [rad]',
            'status')
        manifest = self._manifest()
        known, table = folder / MANIFEST, folder / TABLE
        if known.exists():
            if not resume:
                raise ConfigError(f'{folder} has a database already: --resume goes on with it')
            _require_same(known, manifest)
        elif table.exists() and table.read_text(encoding='utf-8').count('\n') > 1:
            raise ConfigError(f'{table} is there without a {MANIFEST}: it is not written over')
        folder.mkdir(parents=True, exist_ok=True)
        if not known.exists():
            _replace(table, _line(self.head))
            _replace(known, json.dumps(manifest, indent=1) + '\n')
        self.done = self._kept()

    def _manifest(self) -> dict[str, Any]:
        grid = self._grid
        return {
            'format': FORMAT, 'poststall_sim': __version__,
            'aircraft': self._model.aircraft.name,
            'fingerprint': fingerprint(self._model.aircraft),
            'settings': repr(self._model.settings),
            'atmosphere': repr(self._model.atmosphere), 'airspeed_m_s': self._airspeed,
            'altitude_m': self._altitude, 'axes': jobs.AXES,
            'grid': 'full' if grid.full else 'build-up', 'alpha_deg': list(grid.alpha),
            'beta_deg': list(grid.beta), 'rates': {k: list(v) for k, v in grid.rates.items()},
            'deflections_deg': {k: list(v) for k, v in grid.deflections.items()}}

    def _condition(self, row: int) -> tuple[float, ...]:
        case = self._cases[row // len(self._grid.alpha)]
        return (self._grid.alpha[row % len(self._grid.alpha)], case.beta, *case.rates,
                *case.deflections)

    def _kept(self) -> int:
        """Return how many rows are whole, and cut off what comes behind them."""
        path = self._folder / TABLE
        try:
            text = path.read_bytes()
        except FileNotFoundError:
            raise ConfigError(f'{self._folder} has a {MANIFEST} and no {TABLE}') from None
        whole = text[:text.rfind(b'\n') + 1]
        lines = list(csv.reader(whole.decode(errors='replace').splitlines()))
        if not lines or tuple(lines[0]) != self.head or len(lines) - 1 > self.rows:
            raise ConfigError(f'{path} is not the table of its {MANIFEST}')
        for row, cells in enumerate(lines[1:]):
            told = [repr(value) for value in self._condition(row)]
            if cells[:len(told)] != told or len(cells) != len(self.head):
                raise ConfigError(f'{path}: row {row + 1} is not of this grid')
        if len(whole) < len(text):
            os.truncate(path, len(whole))
        return len(lines) - 1

    def run(self) -> Iterator[str]:
        """Compute and write what is missing; yield the status of each row as it is written."""
        per_sweep = len(self._grid.alpha)
        alphas = np.radians(self._grid.alpha)
        with (self._folder / TABLE).open('a', encoding='utf-8', newline='') as table:
            for k in range(self.done // per_sweep, len(self._cases)):
                case = self._cases[k]
                conditions = jobs.conditions(
                    alphas, beta=math.radians(case.beta), rates=case.rates,
                    deflected=self._deflected[k])
                swept = jobs.polar(self._model, conditions, airspeed=self._airspeed,
                                   altitude=self._altitude)
                for row, point in enumerate(swept, k * per_sweep):
                    if row < self.done:
                        continue
                    table.write(_line([*map(repr, self._condition(row)), *_found(point)]))
                    table.flush()
                    self.done = row + 1
                    yield point['status']

    def statuses(self) -> list[str]:
        """Return the status of every row that is there."""
        return [row[-1] for row in self._rows()]

    def _rows(self) -> list[list[str]]:
        with (self._folder / TABLE).open(encoding='utf-8', newline='') as table:
            return list(csv.reader(table))[1:]

    def build_up(self) -> BuildUp:
        """Return the finished table as what is added up; it must have what that stands on."""
        rows = self._rows()
        first = self.head.index(_FOUND_HEADS[0])
        found_at = slice(first, first + len(COEFFICIENTS))
        if len(rows) < self.rows:
            raise ConfigError(f'{len(rows)} of {self.rows} conditions are computed')
        bad = [i for i, row in enumerate(rows, 1) if '' in row[found_at]]
        if bad:
            raise ConfigError(f'row {bad[0]} of {TABLE} diverged: no tables are made with it')
        per_sweep, grid = len(self._grid.alpha), self._grid
        order = np.argsort(grid.alpha)
        found = {case: np.array([[float(cell) for cell in row[found_at]] for row in
                                 rows[k * per_sweep:(k + 1) * per_sweep]])[order].T
                 for k, case in enumerate(self._cases)}
        names = self._model.aircraft.control_names

        def increment(values: Sequence[float], axis: int, unit: float) -> Increment:
            x = sorted({0.0, *values})
            return Increment(unit * np.array(x), np.stack(
                [found[_single(0.0, len(names), axis, value)] - found[_single(0.0, len(names))]
                 for value in x], axis=-1))

        aircraft, betas = self._model.aircraft, sorted(set(grid.beta))
        return BuildUp(
            aircraft.name, aircraft.reference, aircraft.mass.cg_G,
            self._model.atmosphere.at(self._altitude).density, np.radians(np.sort(grid.alpha)),
            np.radians(betas),
            np.stack([found[_single(beta, len(names))] for beta in betas], axis=-1),
            {name: increment(values, RATES.index(name), 1.0)
             for name, values in grid.rates.items() if any(values)},
            {name: increment(values, len(RATES) + names.index(name), math.radians(1.0))
             for name, values in grid.deflections.items() if any(values)})


def _single(beta: float, controls: int, axis: int | None = None, x: float = 0.0) -> Case:
    """Return the sweep of one rate or control alone, by its place among both."""
    values = [x if i == axis else 0.0 for i in range(len(RATES) + controls)]
    return Case(beta, tuple(values[:len(RATES)]), tuple(values[len(RATES):]))


def _found(point: jobs.Result) -> list[str]:
    """Return the cells of what was computed; blank what is not finite."""
    values = [*(point[key] for key in COEFFICIENTS), point['stalled_strips'],
              point['max_residual']]
    return [*(repr(value) if math.isfinite(value) else '' for value in values), point['status']]


def _line(cells: Sequence[str]) -> str:
    return ','.join(cells) + '\n'


def _replace(path: Path, text: str) -> None:
    with atomic_file.writing(path) as file:
        file.write(text.encode())


def _require_same(path: Path, manifest: Mapping[str, Any]) -> None:
    """Refuse to go on with a database of something else, and say what is different."""
    try:
        there = json.loads(path.read_text(encoding='utf-8'))
        different = [key for key in manifest if there[key] != manifest[key]]
    except (ValueError, TypeError, LookupError):
        raise ConfigError(f'{path} is not the manifest of a database') from None
    if different:
        key = different[0]
        if key == 'fingerprint':
            raise ConfigError(f'{path}: {manifest["aircraft"]} was defined otherwise when the '
                              'database was begun')
        raise ConfigError(f'{path}: {key} was {_short(there[key])} when the database was begun, '
                          f'now it is {_short(manifest[key])}')


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) < 80 else f'{text[:77]}...'

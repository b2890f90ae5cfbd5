# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A campaign's folder: rows as they come, and at the end the table.

`parts/` has rows with what they cost, a file for every few seconds, each there whole or not at
all; `table.parquet` has the rows by their case, `costs.parquet` what they cost. Histories are one
array in Zarr, a chunk a case, written before the case's row is.
"""

import hashlib
import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim.aircraft import ConfigError

PARTS, TABLE, COSTS, HISTORIES = 'parts', 'table.parquet', 'costs.parquet', 'histories.zarr'
_HEAD, _LOCK = 'campaign.json', 'lock'
EVERY_S, EVERY_ROWS = 5.0, 1000
"""A part is written after so long, or so many rows."""
COST_COLUMNS = {'cpu_s': float, 'wall_s': float, 'worker': str, 'tries': int}
_PREFIX = 'cost_'


def _arrow() -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ImportError("campaigns need pyarrow: pip install 'poststall_sim[campaign]'") \
            from None
    return pyarrow


def _schema(columns: Mapping[str, type]) -> Any:
    arrow = _arrow()
    kinds = {float: arrow.float64(), int: arrow.int64(), bool: arrow.bool_(), str: arrow.string()}
    return arrow.schema([(name, kinds[kind]) for name, kind in columns.items()])


class Store:
    """The folder of one campaign, held by one program at a time."""

    def __init__(self, folder: Path, columns: Mapping[str, type]) -> None:
        self.folder = folder
        self._columns = dict(columns)
        self._schema = _schema({**columns, **{_PREFIX + name: kind
                                              for name, kind in COST_COLUMNS.items()}})
        self._rows: list[dict[str, Any]] = []
        self._since = time.monotonic()
        self._histories: Any = None
        self._number = 1 + max((int(path.stem.split('-')[1]) for path in self._parts()),
                               default=-1)
        self.done = frozenset(self._read('case')) if self._number else frozenset()

    def _parts(self) -> list[Path]:
        return sorted((self.folder / PARTS).glob('part-*.parquet'))

    def _read(self, column: str) -> list[Any]:
        arrow = _arrow()
        return [value for path in self._parts() for value in
                arrow.parquet.read_table(path, columns=[column])[column].to_pylist()]

    def make_histories(self, cases: int, samples: int, columns: Sequence[str]) -> None:
        """Make room for the histories of all cases, or open it."""
        path = self.folder / HISTORIES
        try:
            import xarray
            import zarr
        except ImportError:
            raise ImportError("histories need xarray and zarr: pip install "
                              "'poststall_sim[campaign]'") from None
        if not path.exists():
            import dask.array
            data = dask.array.full((cases, samples, len(columns)), np.nan,
                                   chunks=(1, samples, len(columns)), dtype=np.float64)
            empty = xarray.Dataset(
                {'history': (('case', 'sample', 'quantity'), data)},
                coords={'case': np.arange(cases), 'quantity': list(columns)})
            unfinished = path.with_name('histories.tmp')
            shutil.rmtree(unfinished, ignore_errors=True)
            empty.to_zarr(unfinished, compute=False, consolidated=False, zarr_format=2,
                          encoding={'history': {'_FillValue': np.nan}})
            unfinished.rename(path)
        self._histories = zarr.open_group(path, mode='r+', use_consolidated=False)['history']

    def add(self, row: Mapping[str, Any], history: Any, cost: Mapping[str, Any]) -> None:
        """Take a row, and write what has come together if it is time."""
        if history is not None and self._histories is not None:
            room = self._histories.shape[1]
            block = np.full(self._histories.shape[1:], np.nan)
            block[:len(history)] = history[:room]
            self._histories[row['case']] = block
        self._rows.append({**row, **{_PREFIX + name: cost[name] for name in COST_COLUMNS}})
        if len(self._rows) >= EVERY_ROWS or time.monotonic() - self._since > EVERY_S:
            self.flush()

    def flush(self) -> None:
        """Write the rows that have come together."""
        if self._rows:
            arrow = _arrow()
            part = arrow.Table.from_pylist(self._rows, schema=self._schema)
            _write(part, self.folder / PARTS / f'part-{self._number:06d}.parquet')
            self._number += 1
        self._rows, self._since = [], time.monotonic()

    def finish(self) -> Any:
        """Write the table and the costs, sorted by case, and return the table."""
        self.flush()
        arrow = _arrow()
        parts = [arrow.parquet.read_table(path, schema=self._schema) for path in self._parts()]
        table = arrow.concat_tables(parts or [self._schema.empty_table()])
        table = table.sort_by('case').combine_chunks()
        costs = table.select(['case', *(_PREFIX + name for name in COST_COLUMNS)])
        _write(costs.rename_columns(['case', *COST_COLUMNS]), self.folder / COSTS)
        table = table.select(list(self._columns))
        _write(table, self.folder / TABLE)
        return table


def _write(table: Any, path: Path) -> None:
    """Write a table that is there whole, on the disk, or not at all."""
    unfinished = path.with_suffix('.tmp')
    with open(unfinished, 'wb') as file:
        _arrow().parquet.write_table(table, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(unfinished, path)


@contextmanager
def opened(folder: Path, definition: Mapping[str, Any], columns: Mapping[str, type], *,
           resume: bool) -> Iterator[Store]:
    """
    Give the store of a campaign in a folder, new or to go on with.

    definition : all that makes the campaign what it is; one of another is refused.
    """
    _arrow()
    text = json.dumps(definition, sort_keys=True)
    print_of = hashlib.sha256(text.encode()).hexdigest()
    head = folder / _HEAD
    if head.exists() and not resume:
        raise ConfigError(f'{folder} has a campaign already: give --resume to go on with it, or '
                          'another --output')
    if resume and not head.exists():
        raise ConfigError(f'{folder} has no campaign to go on with')
    if not head.exists() and folder.exists() and any(folder.iterdir()):
        raise ConfigError(f'{folder} is not empty')
    (folder / PARTS).mkdir(parents=True, exist_ok=True)
    with _held(folder / _LOCK):
        if head.exists():
            if json.loads(head.read_text())['fingerprint'] != print_of:
                raise ConfigError(f'{folder} has the rows of another definition, or of another '
                                  'version: give another --output')
        else:
            unfinished = head.with_suffix('.tmp')
            unfinished.write_text(json.dumps({'fingerprint': print_of, **definition}, indent=1))
            os.replace(unfinished, head)
        store = Store(folder, columns)
        try:
            yield store
        finally:
            store.flush()


@contextmanager
def _held(path: Path) -> Iterator[None]:
    """Keep a second program away; the lock goes with the process, however that ends."""
    try:
        import fcntl
    except ImportError:   # Windows
        yield
        return
    with open(path, 'w') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ConfigError(f'{path.parent}: another campaign is writing there') from None
        yield


def read(folder: Path) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Return what a campaign is, and its rows by column, whether it is through or not."""
    arrow = _arrow()
    try:
        definition = json.loads((folder / _HEAD).read_text())
    except (OSError, ValueError):
        raise ConfigError(f'{folder} has no campaign') from None
    if (folder / TABLE).exists():
        return definition, arrow.parquet.read_table(folder / TABLE).to_pydict()
    parts = [arrow.parquet.read_table(path)
             for path in sorted((folder / PARTS).glob('part-*.parquet'))]
    if not parts:
        raise ConfigError(f'{folder} has no rows yet')
    return definition, arrow.concat_tables(parts).sort_by('case').to_pydict()


def costs(folder: Path) -> dict[str, list[Any]]:
    """Return what the cases of a campaign that is through have cost, by column."""
    return _arrow().parquet.read_table(folder / COSTS).to_pydict()

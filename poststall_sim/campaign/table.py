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
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import atomic_file
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
        import pyarrow.compute
        import pyarrow.parquet
    except ImportError as error:   # it may be there, and too new for this NumPy
        raise ImportError("campaigns need pyarrow: pip install '.[campaign]' in the checkout "
                          f'({error})') from None
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
        self.done = np.unique(np.concatenate(
            [np.empty(0, dtype=np.int64), *(self._cases(path) for path in self._parts())]))

    def _parts(self) -> list[Path]:
        return sorted((self.folder / PARTS).glob('part-*.parquet'))

    @staticmethod
    def _cases(path: Path) -> np.ndarray:
        return _columns(path, ['case'])['case'].to_numpy()

    def make_histories(self, cases: int, samples: int, columns: Sequence[str]) -> None:
        """Make room for the histories of all cases, or open it."""
        path = self.folder / HISTORIES
        try:
            import xarray
            import zarr
        except ImportError:
            raise ImportError("histories need xarray and zarr: pip install '.[campaign]' in the "
                              'checkout') from None
        if not path.exists():
            import dask.array
            # One block, of which nothing is ever computed: blocks would be made, one a case.
            data = dask.array.full((cases, samples, len(columns)), np.nan, chunks=-1,
                                   dtype=np.float64)
            empty = xarray.Dataset(
                {'history': (('case', 'sample', 'quantity'), data)},
                coords={'case': np.arange(cases), 'quantity': list(columns)})
            unfinished = path.with_name('histories.tmp')
            shutil.rmtree(unfinished, ignore_errors=True)
            empty.to_zarr(unfinished, compute=False, consolidated=False, zarr_format=2,
                          encoding={'history': {'_FillValue': np.nan,
                                                'chunks': (1, samples, len(columns))}})
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
        # In this order: interrupted between the two, no row is written under a second number.
        self._rows, self._since = [], time.monotonic()
        self._number += 1

    def finish(self) -> tuple[dict[str, int], float]:
        """
        Write the table and the costs, sorted by case.

        Return how many cases ended how, and the mean processor time of those that took any [s].
        """
        self.flush()
        arrow = _arrow()
        parts = [_columns(path, schema=self._schema) for path in self._parts()]
        table = arrow.concat_tables(parts or [self._schema.empty_table()])
        table = table.sort_by('case').combine_chunks()
        costs = table.select(['case', *(_PREFIX + name for name in COST_COLUMNS)])
        _write(costs.rename_columns(['case', *COST_COLUMNS]), self.folder / COSTS)
        _write(table.select(list(self._columns)), self.folder / TABLE)
        # Counted as columns: as Python's lists the rows of a large campaign fill a memory.
        ends = {each['values']: each['counts'] for each in
                arrow.compute.value_counts(table['status']).to_pylist()}
        spent = costs[_PREFIX + 'cpu_s'].to_numpy()
        taken = spent[spent > 0.0]
        return dict(sorted(ends.items())), float(taken.mean()) if taken.size else 0.0


def _columns(path: Path, columns: Sequence[str] | None = None, schema: Any = None) -> Any:
    """Return a file of rows as a table of Arrow."""
    arrow = _arrow()
    try:
        return arrow.parquet.read_table(path, columns=columns, schema=schema)
    except (arrow.ArrowInvalid, arrow.ArrowKeyError) as error:
        raise ConfigError(f'{path}: no file of rows, remove it and go on with --resume: {error}') \
            from None


def _write(table: Any, path: Path) -> None:
    with atomic_file.writing(path) as file:
        _arrow().parquet.write_table(table, file)


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
    if begun(folder) and not resume:
        raise ConfigError(f'{folder} has a campaign already: give --resume to go on with it, or '
                          'another --output')
    if resume and not begun(folder):
        raise ConfigError(f'{folder} has no campaign to go on with')
    if not begun(folder) and not _fresh(folder):
        raise ConfigError(f'{folder} is not empty')
    (folder / PARTS).mkdir(parents=True, exist_ok=True)
    with _held(folder / _LOCK):
        if begun(folder):
            if _head(folder)['fingerprint'] != print_of:
                raise ConfigError(f'{folder} has the rows of another definition, or of another '
                                  'version: give another --output')
        else:
            with atomic_file.writing(head) as file:
                file.write(json.dumps({'fingerprint': print_of, **definition}, indent=1).encode())
        store = Store(folder, columns)
        try:
            yield store
        finally:
            store.flush()


def begun(folder: Path) -> bool:
    """Tell whether a folder has a campaign to go on with."""
    return (folder / _HEAD).exists()


def _fresh(folder: Path) -> bool:
    """Tell whether a folder has nothing but what a campaign leaves that was killed at once."""
    ours = {folder / _LOCK, atomic_file.unfinished(folder / _HEAD)}
    return not folder.exists() or not any(
        path not in ours and not (path.name == PARTS and path.is_dir() and not any(path.iterdir()))
        for path in folder.iterdir())


def _head(folder: Path) -> dict[str, Any]:
    """Return what the campaign in a folder is."""
    try:
        head = json.loads((folder / _HEAD).read_text())
        return {'fingerprint': head['fingerprint'], **head}
    except (OSError, ValueError, TypeError, LookupError):
        raise ConfigError(f'{folder} has no campaign') from None


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
    definition = _head(folder)
    if (folder / TABLE).exists():
        return definition, _columns(folder / TABLE).to_pydict()
    parts = [_columns(path, definition['columns'])   # what they cost stands beside them
             for path in sorted((folder / PARTS).glob('part-*.parquet'))]
    if not parts:
        raise ConfigError(f'{folder} has no rows yet')
    return definition, arrow.concat_tables(parts).sort_by('case').to_pydict()


def costs(folder: Path) -> dict[str, list[Any]]:
    """Return what the cases of a campaign that is through have cost, by column."""
    return _columns(folder / COSTS).to_pydict()

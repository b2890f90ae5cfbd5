# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Section curves from CSV files, and which of them an aircraft file names."""

import math
import os
import re
from pathlib import Path

import numpy as np

from poststall_sim.aircraft import Airfoil
from poststall_sim.reader import Place, Reader, file_text, place_of, scalar, shown, suggestion

_COLUMNS = ('alpha_deg', 'cl', 'cd', 'cm')
_REYNOLDS = re.compile(r'#\s*reynolds\s*:\s*(.*?)\s*')
_LOWEST, _HIGHEST = 1e2, 1e9
"""Reynolds numbers of sections that fly; others are a slip of the pen."""


def named(read: Reader, key: str) -> list[tuple[str, Place, float | None, float]]:
    """
    Return the tables of a section in an aircraft file: file, place, Reynolds number, deflection.

    One table or a list of them, each a file's name or a mapping of ``file``, ``reynolds`` (None
    where it is left to the file) and ``flap_deg``, here in radians.
    """
    found = []
    for name, where, rest in read.files(key):
        found.append((name, where, rest.number_if_any('reynolds', within=(_LOWEST, _HIGHEST)),
                      math.radians(rest.number('flap_deg', default=0.0, within=(-90, 90)))))
        rest.done()
    if len(found) > 1 and len({name for name, *_ in found}) < len(found):
        raise read.where.key(key).error('names a file twice')
    return found


def airfoil(path: str | os.PathLike[str], name: str | None = None,
            reynolds: float | None = None, deflection: float = 0.0) -> Airfoil:
    """
    Read a section's curves from a CSV file, named ``name`` or after the file.

    Lines that start with ``#`` are comments; the first other line names the columns alpha_deg,
    cl, cd, cm in any order; cm is about the quarter chord, nose-up positive. A comment such as
    ``# reynolds: 4.1e5`` says what Reynolds number they hold for; reynolds, if given, must not
    say otherwise. deflection : of the flap that the table was made with [rad].
    """
    where = place_of(path)
    text = file_text(path).splitlines()
    reynolds = _reynolds(text, where, reynolds)
    lines = [(number, [cell.strip() for cell in line.split(',')])
             for number, line in enumerate(text, start=1)
             if line.strip() and not line.lstrip().startswith('#')]
    if not lines:
        raise where.error(f'is empty, expected the columns {",".join(_COLUMNS)}')
    where_header, columns = where.line(lines[0][0]), lines[0][1]
    for column in columns:
        if column not in _COLUMNS or columns.count(column) > 1:
            raise where_header.error(
                f'column {shown(column)} is {"there twice" if column in _COLUMNS else "unknown"}, '
                f'expected {",".join(_COLUMNS)}{suggestion(column, _COLUMNS)}')
    for column in _COLUMNS:
        if column not in columns:
            raise where_header.error(f'column {column} is missing, expected '
                                     f'{",".join(_COLUMNS)}, got {shown(",".join(columns))}')
    rows: list[dict[str, float]] = []
    for number, cells in lines[1:]:
        row = where.line(number)
        if len(cells) != len(columns):
            raise row.error(f'must have {len(columns)} values, got {len(cells)}')
        rows.append({column: row.key(column).number(scalar(cell) if cell else cell)
                     for column, cell in zip(columns, cells)})
        if len(rows) > 1 and rows[-1]['alpha_deg'] <= rows[-2]['alpha_deg']:
            raise row.key('alpha_deg').error(
                f'must increase from row to row, got {rows[-1]["alpha_deg"]:g} after '
                f'{rows[-2]["alpha_deg"]:g}')
    alpha, cl, cd, cm = (np.array([row[column] for row in rows]) for column in _COLUMNS)
    if len(rows) and np.abs(alpha).max() <= 4.0:
        raise where.error(f'alpha_deg must run from -180 to 180 deg, got {alpha[0]:g} to '
                          f'{alpha[-1]:g} (are these radians?)')
    return where.build(Airfoil, name=Path(path).stem if name is None else name,
                       alpha=np.radians(alpha), cl=cl, cd=cd, cm=cm, reynolds=reynolds,
                       deflection=deflection)


def _reynolds(lines: list[str], where: Place, given: float | None) -> float | None:
    """Return the Reynolds number in a file's comments, or the one given besides it."""
    for number, line in enumerate(lines, start=1):
        if found := _REYNOLDS.fullmatch(line.strip()):
            at = where.line(number).key('reynolds')
            value = at.number(scalar(found[1]) if found[1] else '', within=(_LOWEST, _HIGHEST))
            if given is not None and abs(given - value) > 1e-6 * value:
                raise at.error(f'is {value:g} here, but the aircraft file says {given:g}')
            return value
    return given

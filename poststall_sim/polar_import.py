# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Points of a section from files of others: XFOIL's polars, those of airfoiltools.com, any CSV.

What such a file covers is a few degrees on either side of zero; `extension` makes curves over a
full turn of it. Angles in the files are in degrees.
"""

import enum
import os
import re
from dataclasses import dataclass

import numpy as np

from poststall_sim.frames import FloatArray
from poststall_sim.reader import Place, file_text, listed, place_of, scalar, shown

_ANGLES = ('alpha', 'alpha_deg', 'aoa')
_COEFFICIENTS = ('cl', 'cd', 'cm')
_XFOIL_REYNOLDS = re.compile(r'\bRe\s*=\s*([0-9.]+)\s*(?:e\s*([0-9]+))?')
_OWN_REYNOLDS = re.compile(r'#\s*reynolds\s*:\s*(\S+)')
_NOT_A_POINT = 1e3
"""A coefficient beyond this is a slip."""


class Format(enum.Enum):
    """Whose file it is."""

    XFOIL = 'xfoil'
    AIRFOILTOOLS = 'airfoiltools'
    CSV = 'csv'


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """
    Points in order of alpha (n,) [rad]; cl, cd, cm (n,) or None where the file has none.

    reynolds : None where the file does not say it.
    """

    format: Format
    alpha: FloatArray
    cl: FloatArray
    cd: FloatArray | None
    cm: FloatArray | None
    reynolds: float | None


def points(path: str | os.PathLike[str], form: Format | None = None, *,
           whole: bool = True) -> Imported:
    """
    Read a section's points; form : None, by how the file looks.

    whole : cd and cm must be there. Rows may be in any order; of those with one alpha the last
    counts, as XFOIL appends them.
    """
    where, text = place_of(path), file_text(path)
    form = _looks_like(text) if form is None else form
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), start=1)]
    read = _xfoil if form is Format.XFOIL else _columns
    names, rows, reynolds = read(lines, where)
    for column in _COEFFICIENTS[:3 if whole else 1]:
        if column not in names:
            raise where.error(f'has no column {column}, but {listed(names)}')
    by_alpha: dict[float, tuple[float, ...]] = {}
    for number, cells in rows:
        at = where.line(number)
        if len(cells) != len(names):
            raise at.error(f'must have {len(names)} values, got {len(cells)}')
        row = {name: at.key(name).number(scalar(cell) if cell else cell,
                                         within=(-_NOT_A_POINT, _NOT_A_POINT))
               for name, cell in zip(names, cells) if name in ('alpha', *_COEFFICIENTS)}
        alpha = row.pop('alpha')
        by_alpha[alpha] = tuple(row.values())
    if not by_alpha:
        raise where.error('has no points')
    values = np.array([by_alpha[alpha] for alpha in sorted(by_alpha)])
    kept = [name for name in names if name in _COEFFICIENTS]
    found = dict(zip(kept, values.T))
    return Imported(form, np.radians(sorted(by_alpha)), found['cl'], found.get('cd'),
                    found.get('cm'), reynolds)


def _looks_like(text: str) -> Format:
    if re.search(r'^\s*-{3,}(\s+-{3,})+', text, re.MULTILINE):
        return Format.XFOIL
    return Format.AIRFOILTOOLS if text.lstrip().startswith('Xfoil polar') else Format.CSV


_Lines = list[tuple[int, str]]
_Table = tuple[list[str], list[tuple[int, list[str]]], float | None]


def _xfoil(lines: _Lines, where: Place) -> _Table:
    """Return columns, rows and Reynolds number of a polar that XFOIL accumulated."""
    rule = next((k for k, (_, line) in enumerate(lines) if re.match(r'-{3,}(\s+-{3,})+', line)), 0)
    if not rule:
        raise where.error('is no polar of XFOIL: a line of names and one of dashes must come '
                          'before the points')
    names = [name.lower() for name in lines[rule - 1][1].split()]
    head = ' '.join(line for _, line in lines[:rule])
    found = _XFOIL_REYNOLDS.search(head)
    reynolds = None
    if found:
        reynolds = where.key('Re').number(
            float(found[1]) * 10.0 ** int(found[2] or 0), within=(0, 1e12)) or None
    if 'alpha' not in names:
        raise where.line(lines[rule - 1][0]).error(f'must name a column alpha, got '
                                                   f'{shown(lines[rule - 1][1])}')
    return names, [(n, line.split()) for n, line in lines[rule + 1:] if line], reynolds


def _columns(lines: _Lines, where: Place) -> _Table:
    """Return columns, rows and Reynolds number of a CSV with a line of names somewhere on top."""
    reynolds, names, rows = None, None, []
    for number, line in lines:
        if found := _OWN_REYNOLDS.fullmatch(line):
            reynolds = where.line(number).number(scalar(found[1]), above=0)
        if not line or line.startswith('#'):
            continue
        cells = [cell.strip() for cell in line.split(',')]
        if names is not None:
            rows.append((number, cells))
        elif cells[0].lower() == 'reynolds number' and len(cells) == 2:
            reynolds = where.line(number).number(scalar(cells[1]), above=0)
        elif any(cell.lower() in _ANGLES for cell in cells):
            names = ['alpha' if cell.lower() in _ANGLES else cell.lower() for cell in cells]
    if names is None:
        raise where.error('is no CSV of a polar: a line must name the columns alpha,cl,cd,cm')
    if len(set(names)) < len(names):
        raise where.error(f'names a column twice: {listed(names)}')
    return names, rows, reynolds

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The text of an AVL geometry file as records, in the file's own words: nothing is computed here.

Format: M. Drela, H. Youngren, AVL 3.3x User Primer, 2017. Lengths are in the file's unit, angles
in degrees. Comments begin with ``#`` or ``!``; of a keyword four letters count.
"""

import os
from dataclasses import dataclass, field
from typing import Any

from poststall_sim.reader import Place, file_text, place_of, shown

_KEYWORDS = {
    'SURF': 'SURFACE', 'YDUP': 'YDUPLICATE', 'COMP': 'COMPONENT', 'INDE': 'INDEX',
    'SCAL': 'SCALE', 'TRAN': 'TRANSLATE', 'ANGL': 'ANGLE', 'NOWA': 'NOWAKE', 'NOAL': 'NOALBE',
    'NOLO': 'NOLOAD', 'SECT': 'SECTION', 'NACA': 'NACA', 'AIRF': 'AIRFOIL', 'AFIL': 'AFILE',
    'CLAF': 'CLAF', 'CDCL': 'CDCL', 'DESI': 'DESIGN', 'CONT': 'CONTROL', 'BODY': 'BODY',
    'BFIL': 'BFILE'}


@dataclass(frozen=True, slots=True)
class Hinge:
    """A CONTROL of a section: how far it turns per unit, where, about what, and its image."""

    name: str
    gain: float
    place: float
    vector: tuple[float, float, float]
    image: float


@dataclass(frozen=True, slots=True)
class Station:
    """
    A SECTION.

    airfoil : kind, `NACA`, `AIRFOIL`, `AFILE` or none, and its digits, points or file name, at
    airfoil_where; strips, spacing : of the interval to the next one, 0 where the surface says
    it; drag : (cl, cd) of CDCL, three of them or none.
    """

    where: Place
    leading_edge: tuple[float, float, float]
    chord: float
    incidence: float
    strips: int
    spacing: float
    airfoil: tuple[str, Any]
    airfoil_where: Place
    slope: float
    drag: tuple[float, ...]
    hinges: tuple[Hinge, ...]


@dataclass(frozen=True, slots=True)
class Sheet:
    """A SURFACE with its sections in the order of the file; image : Ydupl, None without."""

    where: Place
    name: str
    rows: int
    row_spacing: float
    strips: int
    spacing: float
    image: float | None
    scale: tuple[float, float, float]
    shift: tuple[float, float, float]
    incidence: float
    drag: tuple[float, ...]
    stations: tuple[Station, ...]


@dataclass(frozen=True, slots=True)
class AvlFile:
    """
    The whole file.

    symmetry : iYsym, iZsym; reference : Sref, Cref, Bref; origin : Xref, Yref, Zref; drag : CDp;
    left_out : what stands in the file and is not read, a sentence each.
    """

    where: Place
    title: str
    mach: float
    symmetry: tuple[int, int]
    reference: tuple[float, float, float]
    origin: tuple[float, float, float]
    drag: float
    sheets: tuple[Sheet, ...]
    left_out: tuple[str, ...]


@dataclass(slots=True)
class _Lines:
    """The lines of a file that say something, with their numbers, and where reading stands."""

    where: Place
    lines: list[tuple[int, str]]
    at: int = 0
    left_out: list[str] = field(default_factory=list)

    def place(self) -> Place:
        """Return the place of the line that comes next, or of the last one."""
        return self.where.line(self.lines[min(self.at, len(self.lines) - 1)][0])

    def text(self, what: str) -> str:
        """Return the next line."""
        if self.at >= len(self.lines):
            raise self.place().error(f'the file ends where {what} must come')
        self.at += 1
        return self.lines[self.at - 1][1]

    def keyword(self) -> str | None:
        """Return the keyword that the next line begins with, if it does."""
        if self.at >= len(self.lines):
            return None
        return _KEYWORDS.get(self.lines[self.at][1].split()[0][:4].upper())

    def numbers(self, what: str, least: int, most: int, *, skip: int = 0) -> list[float]:
        """Return the numbers that the next line begins with, behind so many words."""
        place = self.place()
        words = self.text(what).replace(',', ' ').split()[skip:]
        values: list[float] = []
        for word in words[:most]:
            try:
                values.append(float(word.lower().replace('d', 'e')))
            except ValueError:
                break   # a remark without its mark, as AVL allows behind the numbers
        if len(values) < least:
            raise place.error(f'{what} must be {least} numbers, got {shown(" ".join(words))}')
        return [place.number(value) for value in values]

    def count(self, value: float, what: str, most: int) -> int:
        """Return a number of panels or strips that stands in the line before."""
        if value != int(value) or not 0 <= value <= most:
            raise self.where.line(self.lines[self.at - 1][0]).error(
                f'{what} must be a whole number from 0 to {most}, got {value:g}')
        return int(value)


def read(path: str | os.PathLike[str]) -> AvlFile:
    """Read an AVL geometry file."""
    where = place_of(path)
    lines = _Lines(where, [
        (number, text) for number, line in enumerate(file_text(path).splitlines(), start=1)
        if (text := line.split('!')[0].split('#')[0].strip())])
    if not lines.lines:
        raise where.error('is empty, expected an AVL geometry')
    title = lines.text('a title')
    mach = lines.numbers('Mach', 1, 1)[0]
    y, z = (int(value) for value in lines.numbers('iYsym iZsym Zsym', 3, 3)[:2])
    reference = lines.numbers('Sref Cref Bref', 3, 3)
    origin = lines.numbers('Xref Yref Zref', 3, 3)
    drag = 0.0
    if lines.keyword() is None and lines.at < len(lines.lines):
        drag = lines.numbers('CDp or a keyword', 1, 1)[0]
    sheets: list[Sheet] = []
    while lines.at < len(lines.lines):
        keyword = lines.keyword()
        if keyword == 'SURFACE':
            sheets.append(_sheet(lines))
        elif keyword == 'BODY':
            _body(lines)
        else:
            raise lines.place().error(
                f'expected SURFACE or BODY, got {shown(lines.text("a keyword"))}')
    if not sheets:
        raise where.error('has no SURFACE')
    return AvlFile(where, title, mach, (y, z), tuple(reference), tuple(origin), drag,
                   tuple(sheets), tuple(lines.left_out))


def _body(lines: _Lines) -> None:
    lines.text('BODY')
    lines.left_out.append(f'the body {lines.text("the name of a body")} is left out: bodies '
                          'carry no lift here')
    lines.numbers('Nbody Bspace', 1, 2)
    while (keyword := lines.keyword()) not in ('SURFACE', 'BODY', None):
        lines.text(keyword)
        if keyword == 'BFILE':
            lines.text('the name of a file')
        elif keyword in ('YDUPLICATE', 'SCALE', 'TRANSLATE'):
            lines.numbers(keyword, 1, 3)


def _sheet(lines: _Lines) -> Sheet:
    where = lines.place()
    lines.text('SURFACE')
    name = lines.text('the name of a surface')
    values = lines.numbers('Nchord Cspace', 1, 4) + [0.0] * 3
    rows = lines.count(values[0], 'Nchord', 100)
    strips, spacing = lines.count(values[2], 'Nspan', 1000), values[3]
    image, scale, shift, incidence = None, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), 0.0
    drag: tuple[float, ...] = ()
    stations: list[Station] = []
    while (keyword := lines.keyword()) not in ('SURFACE', 'BODY', None):
        place = lines.place()
        if keyword == 'SECTION':
            stations.append(_station(lines))
            continue
        lines.text(keyword)
        if keyword == 'YDUPLICATE':
            image = lines.numbers('Ydupl', 1, 1)[0]
        elif keyword in ('COMPONENT', 'INDEX'):
            lines.numbers('Lcomp', 1, 1)   # AVL's vortex cores; ours are by surface
        elif keyword == 'SCALE':
            scale = tuple(lines.numbers('Xscale Yscale Zscale', 3, 3))
        elif keyword == 'TRANSLATE':
            shift = tuple(lines.numbers('dX dY dZ', 3, 3))
        elif keyword == 'ANGLE':
            incidence = lines.numbers('dAinc', 1, 1)[0]
        elif keyword == 'CDCL':
            drag = tuple(lines.numbers('CL1 CD1 CL2 CD2 CL3 CD3', 6, 6))
        else:
            why = 'is not supported: take it out' if keyword.startswith('NO') else \
                'belongs to a SECTION'
            raise place.error(f'surface {name}: {keyword} {why}')
    if len(stations) < 2:
        raise where.error(f'surface {name}: needs at least 2 sections, got {len(stations)}')
    return Sheet(where, name, rows, values[1], strips, spacing, image, scale, shift, incidence,
                 drag, tuple(stations))


def _station(lines: _Lines) -> Station:
    where = lines.place()
    lines.text('SECTION')
    x, y, z, chord, *rest = lines.numbers('Xle Yle Zle Chord Ainc', 4, 7)
    incidence, strips, spacing = (rest + [0.0] * 3)[:3]
    count = lines.count(strips, 'Nspan', 1000)
    airfoil: tuple[str, Any] = ('none', None)
    airfoil_where = where
    slope, drag, hinges = 1.0, (), []
    while (keyword := lines.keyword()) in ('NACA', 'AIRFOIL', 'AFILE', 'CLAF', 'CDCL', 'DESIGN',
                                           'CONTROL'):
        if keyword in ('NACA', 'AIRFOIL', 'AFILE'):
            airfoil_where = lines.place()
            airfoil = (keyword, _airfoil(lines, keyword))
            continue
        lines.text(keyword)
        if keyword == 'CLAF':
            slope = where.number(lines.numbers('CLaf', 1, 1)[0], above=0)
        elif keyword == 'CDCL':
            drag = tuple(lines.numbers('CL1 CD1 CL2 CD2 CL3 CD3', 6, 6))
        elif keyword == 'DESIGN':
            lines.text('a design variable')   # zero in AVL too until its user sets it
        else:
            hinges.append(_hinge(lines))
    return Station(where, (x, y, z), where.number(chord, above=0), incidence, count, spacing,
                   airfoil, airfoil_where, slope, drag, tuple(hinges))


def _airfoil(lines: _Lines, keyword: str) -> Any:
    place = lines.place()
    words = lines.text(keyword).replace(',', ' ').split()[1:]
    if words and [float(word) for word in words[:2] if _is_number(word)] not in ([], [0.0, 1.0]):
        raise place.error(f'{keyword}: a part X1 X2 of an airfoil is not supported')
    if keyword == 'NACA':
        return lines.text('NACA digits').split()[0]
    if keyword == 'AFILE':
        return lines.text('the name of a file').strip('"\'')
    points = []
    while lines.keyword() is None and lines.at < len(lines.lines):
        points.append(tuple(lines.numbers('x/c y/c', 2, 2)))
    return tuple(points)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _hinge(lines: _Lines) -> Hinge:
    place = lines.place()
    values = lines.numbers('name gain Xhinge XYZhvec SgnDup', 2, 6, skip=1)
    name = lines.lines[lines.at - 1][1].split()[0]
    gain, hinge, x, y, z, image = values + [0.0, 0.0, 0.0, 0.0, 0.0, 1.0][len(values):]
    if hinge < 0.0:
        lines.left_out.append(
            f'{place.path}: {name} at Xhinge {hinge:g} is left out: a flap at the leading edge '
            'has no section data here')
    return Hinge(name, gain, hinge, (x, y, z), image)

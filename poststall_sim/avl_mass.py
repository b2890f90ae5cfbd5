# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Mass files of AVL: items with their places and inertias, and the unit of all lengths."""

import os
import re
from dataclasses import dataclass

import numpy as np

from poststall_sim.aircraft import MassProperties
from poststall_sim.frames import FloatArray, geometry_to_body
from poststall_sim.reader import Place, file_text, place_of, shown

_UNITS = {
    'Lunit': {'m': 1.0, 'cm': 0.01, 'mm': 0.001, 'ft': 0.3048, 'in': 0.0254},
    'Munit': {'kg': 1.0, 'g': 0.001, 'slug': 14.59390, 'lb': 0.45359237, 'lbm': 0.45359237},
    'Tunit': {'s': 1.0}}
_COLUMNS = 10


@dataclass(frozen=True, slots=True, eq=False)
class MassFile:
    """Masses [kg], centre of gravity and inertia, and the length [m] of one unit of both files."""

    mass: MassProperties
    length: float


def read(path: str | os.PathLike[str]) -> MassFile:
    """
    Read a mass file: mass x y z and up to six inertias Ixx Iyy Izz Ixy Ixz Iyz in each line.

    Axes are those of the geometry, products are the integrals themselves, inertias are about each
    item's own centre of gravity. A line that begins with ``*`` or ``+`` gives factors or
    additions for all that follow.
    """
    where = place_of(path)
    units = {'Lunit': 1.0, 'Munit': 1.0}
    factors, additions = np.ones(_COLUMNS), np.zeros(_COLUMNS)
    items: list[FloatArray] = []
    for number, line in enumerate(file_text(path).splitlines(), start=1):
        text, at = line.split('!')[0].split('#')[0].strip(), where.line(number)
        if not text:
            continue
        if '=' in text:
            _unit(text, units, at)
        elif text[0] == '*':
            factors = _filled(text[1:], factors, at)
        elif text[0] == '+':
            additions = _filled(text[1:], additions, at)
        else:
            if len(_leading(text)) < 4:
                raise at.error(f'must be mass x y z and up to six inertias, got {shown(text)}')
            items.append(_filled(text, np.zeros(_COLUMNS), at) * factors + additions)
    if not items:
        raise where.error('has no masses')
    length, mass = units['Lunit'], units['Munit']
    return MassFile(_whole(np.array(items) * np.r_[mass, [length] * 3, [mass * length ** 2] * 6],
                           where), length)


def _unit(text: str, units: dict[str, float], at: Place) -> None:
    """Take a line such as Lunit = 0.0254 m; g and rho are the flight's, not the aircraft's."""
    name, _, rest = (part.strip() for part in text.partition('='))
    if name in ('g', 'rho'):
        return
    words = rest.split()
    known = _UNITS.get(name)
    if known is None or not words or (len(words) > 1 and words[1].lower() not in known):
        raise at.error(f'must be Lunit, Munit, Tunit, g or rho = a number and a unit of '
                       f'{", ".join(known or _UNITS["Lunit"])}, got {shown(text)}')
    units[name] = at.number(_leading(words[0] + ' ')[0] if _leading(words[0]) else rest,
                            above=0) * (known[words[1].lower()] if len(words) > 1 else 1.0)


def _leading(text: str) -> list[float]:
    """Return the numbers that a text begins with; an item's name may follow them."""
    values: list[float] = []
    for word in re.split(r'[\s,]+', text.strip()):
        try:
            values.append(float(word.lower().replace('d', 'e')))
        except ValueError:
            break
    return values


def _filled(text: str, row: FloatArray, at: Place) -> FloatArray:
    """Return a row (10,) with the numbers of a text in front."""
    values = [at.number(value) for value in _leading(text)][:_COLUMNS]
    return np.concatenate([values, row[len(values):]])


def _whole(items: FloatArray, where: Place) -> MassProperties:
    """Return what all items (n, 10) [kg, m, kg m^2] are together."""
    mass, place = items[:, 0], items[:, 1:4]
    total = float(mass.sum())
    cg = mass @ place / total if total > 0.0 else np.zeros(3)
    inertia = np.zeros((3, 3))
    for each, arm, (xx, yy, zz, xy, xz, yz) in zip(mass, place - cg, items[:, 4:]):
        inertia += each * (arm @ arm * np.eye(3) - np.outer(arm, arm)) \
            + np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])
    return where.build(MassProperties, mass=total, cg_G=tuple(map(float, cg)),
                       inertia_B=inertia_turned(inertia))


def inertia_turned(inertia: FloatArray) -> FloatArray:
    """Turn a tensor (3, 3) from geometry axes into body axes, or back."""
    return geometry_to_body(geometry_to_body(inertia).T).T


def text(mass: MassProperties, name: str) -> str:
    """Return a mass file of one item that holds the whole, in metres and kilograms."""
    inertia = inertia_turned(mass.inertia_B)
    row = [mass.mass, *mass.cg_G, *np.diag(inertia), -inertia[0, 1], -inertia[0, 2],
           -inertia[1, 2]]
    return '\n'.join([
        f'# {name}', 'Lunit = 1.0 m', 'Munit = 1.0 kg', 'Tunit = 1.0 s', 'g = 9.80665',
        'rho = 1.225', '# mass x y z Ixx Iyy Izz Ixy Ixz Iyz, axes of the geometry',
        ' '.join(f'{value + 0.0:.17g}' for value in row), ''])

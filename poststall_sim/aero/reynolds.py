# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The curves that strips fly: between sections along the span, Reynolds numbers, flap deflections.

A section may have several tables, each of a Reynolds number. Between two of them a coefficient is
linear in ln(Re), beyond the first and the last it is held. The Reynolds number of a strip is made
with its own chord and the airspeed of the aircraft, V c / nu: one for the whole flight condition,
continuous in it, so that loads do not jump, and a function of the present state alone, so that
nothing has to be saved.

A section may also have tables with its flap deflected. A strip with a flap reads them at the angle
that its lattice has with the flap down (its own plus the flap's shift of the zero-lift angle), and
a table is moved by that shift, so that at its own deflection it is read at the strip's angle, and
lift lines of attached flow lie on each other where two are mixed. Its moment is taken without what
the lattice's own flap has already, in proportion to the deflection. With a table of the section
alone it is read at the shifted angle at any deflection; so is the last one beyond its deflection.

What a mixture of curves is, its zero-lift angle is not quite: that is interpolated like the
curves, and so are the stall angles. The zero-lift angle only divides a strip's turn between camber
and decambering, which enter the flow as their sum; the stall angles mark strips as stalled.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from poststall_sim.aero import polars
from poststall_sim.aircraft import Airfoil, read_only
from poststall_sim.frames import FloatArray

ALIKE = 1e-9
"""Chords and places that differ by no more of themselves fly the same curve."""
LANDMARKS = ('zero_lift', 'stall_high', 'stall_low', 'separated_high', 'separated_low')


@dataclass(frozen=True, slots=True)
class Level:
    """Tables first to last, of rising Reynolds number, with a flap deflected [rad]."""

    deflection: float
    first: int
    last: int


@dataclass(frozen=True, slots=True, eq=False)
class Tables:
    """
    The tables of all sections, and what each of the strips' curves (g) is mixed from.

    curves (t, 3, 2, GRID + 1), landmarks (t, 5) : see `polars.SectionPolar`; log_reynolds (t,), 0
    where a table does not say; sides : of each curve the levels of the two sections that it lies
    between, by rising deflection; share (g,) of the second one; chord (g,) [m]; turn (g,
    parts) : deflection of the strips' flap per unit angle of each movable part.
    """

    curves: FloatArray
    landmarks: FloatArray
    log_reynolds: FloatArray
    sides: tuple[tuple[tuple[Level, ...], tuple[Level, ...]], ...]
    share: FloatArray
    chord: FloatArray
    turn: FloatArray

    def at(self, reynolds: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return curves (g, 3, 2, GRID + 1), landmarks (g, 5) at Reynolds numbers (g,)."""
        index, weight = self._mixture(
            np.log(np.maximum(reynolds, 1e-9)), self.turn @ angles)
        out = np.empty((len(index), *self.curves.shape[1:]))
        _mix(self.curves, index, weight, out)
        return out, np.einsum('gk,gkl->gl', weight, self.landmarks[index])

    def middle(self) -> FloatArray:
        """Return Reynolds numbers (g,) in the middle of what the nearer section's tables span."""
        known = [sides[int(share > 0.5)][0] for sides, share in zip(self.sides, self.share)]
        return np.exp([0.5 * (self.log_reynolds[level.first] + self.log_reynolds[level.last])
                       for level in known])

    def _mixture(self, logs: FloatArray, flaps: FloatArray) -> tuple[np.ndarray, FloatArray]:
        """Return tables (g, 8) and weights (g, 8): two sections, deflections, Reynolds numbers."""
        index, weight = np.zeros((len(logs), 8), dtype=np.int64), np.zeros((len(logs), 8))
        for g, (log, flap) in enumerate(zip(logs, flaps)):
            k = 0
            for levels, of_all in zip(self.sides[g], (1.0 - self.share[g], self.share[g])):
                for level, of_level in _shares([each.deflection for each in levels], flap):
                    tables = levels[level]
                    known = self.log_reynolds[tables.first:tables.last + 1]
                    for table, of_table in _shares(known, log):
                        index[g, k] = tables.first + table
                        weight[g, k] = of_all * of_level * of_table
                        k += 1
        return index, weight


def _shares(known: Sequence[float], wanted: float) -> tuple[tuple[int, float], ...]:
    """Return those of rising values that another lies between, with weights; ends are held."""
    if len(known) == 1:
        return ((0, 1.0),)
    k = min(max(int(np.searchsorted(known, wanted)), 1), len(known) - 1)
    above = min(max((wanted - known[k - 1]) / (known[k] - known[k - 1]), 0.0), 1.0)
    return (k - 1, 1.0 - above), (k, above)


@njit(cache=True, nogil=True)
def _mix(curves, index, weight, out):
    """Fill out (g, 3, 2, m) with sums of curves; index, weight (g, k)."""
    for g in range(index.shape[0]):
        for c in range(3):
            for s in range(2):
                row = out[g, c, s]
                row[:] = 0.0
                for k in range(index.shape[1]):
                    share = weight[g, k]
                    if share != 0.0:
                        of = curves[index[g, k], c, s]
                        for i in range(row.size):
                            row[i] += share * of[i]


@dataclass(frozen=True, slots=True, eq=False)
class StripCurves:
    """
    What the strips (n) of an aircraft fly.

    curves (g, 3, 2, GRID + 1) and polar_index (n,) into them; landmarks (5, n) in the order of
    `LANDMARKS`; reynolds_range (n, 2) : of the tables, NaN where they do not say; tables : None
    where no section has several.
    """

    curves: FloatArray
    polar_index: np.ndarray
    landmarks: FloatArray
    reynolds_range: FloatArray
    tables: Tables | None


Between = tuple[str, str, float]
"""The sections that a strip lies between, and its share of the second one."""


def strip_curves(airfoils: Sequence[Airfoil], between: Sequence[Between], chord: FloatArray,
                 turn: FloatArray, shift: FloatArray, moment: FloatArray) -> StripCurves:
    """
    Return the curves of strips between two sections each, by name; chord (n,) [m].

    turn, shift, moment (parts, n) : deflection of a strip's flap, change of its zero-lift angle
    and of the moment that the lattice has of it, per unit of each movable part. Where sections
    have several tables the curves are those in the middle of these with flaps up, until
    `Tables.at` is asked.
    """
    families: dict[str, list[Airfoil]] = {}
    for airfoil in airfoils:
        families.setdefault(airfoil.name, []).append(airfoil)
    for family in families.values():
        family.sort(key=lambda each: (each.deflection, each.reynolds or 0.0))
    between = [(first, second, 0.0 if first == second else share)
               for first, second, share in between]
    ranges = []
    for first, second, share in between:
        plain = [each for each in families[second if share > 0.5 else first]
                 if each.deflection == 0.0]
        ranges.append([each.reynolds or math.nan for each in (plain[0], plain[-1])])
    if all(len(family) == 1 for family in families.values()):
        polar_of = {name: polars.section_polar(family[0]) for name, family in families.items()}
        curves, index, landmarks = _of_one_table(
            [polars.mixture(polar_of[first], polar_of[second], share)
             for first, second, share in between])
        return StripCurves(curves, index, landmarks, read_only(ranges), None)
    tables, index = _of_several(families, between, chord, turn, shift, moment)
    curves, landmarks = tables.at(tables.middle(), np.zeros(len(turn)))
    return StripCurves(read_only(curves), index, read_only(landmarks[index].T),
                       read_only(ranges), tables)


def _of_one_table(flown: list[polars.SectionPolar]) -> tuple[FloatArray, np.ndarray, FloatArray]:
    """Return the distinct curves of strips, the index into them (n,) and the landmarks (5, n)."""
    distinct: list[polars.SectionPolar] = []
    index = []
    for polar in flown:
        if not any(polar is known for known in distinct):
            distinct.append(polar)
        index.append(next(i for i, known in enumerate(distinct) if known is polar))
    landmarks = np.array([[getattr(polar, key) for polar in flown] for key in LANDMARKS])
    return read_only(np.stack([p.curve for p in distinct])), np.array(index), read_only(landmarks)


def _of_several(families: dict[str, list[Airfoil]], between: Sequence[Between],
                chord: FloatArray, turn: FloatArray, shift: FloatArray,
                moment: FloatArray) -> tuple[Tables, np.ndarray]:
    """Return the tables of all sections and the index (n,) of each strip's mixture."""
    turned = np.abs(turn).sum(axis=0)
    per_turn = np.where(turned > 0.0, turned, 1.0)
    # Of the strip's flap, or of the mean of several that it has.
    lever, own = (np.abs(each).sum(axis=0) / per_turn for each in (shift, moment))
    polar_of = {name: [polars.section_polar(each) for each in family]
                for name, family in families.items()}
    made: list[polars.SectionPolar] = []
    logs: list[float] = []

    def levels_of(name: str, effect: float, cm: float) -> tuple[Level, ...]:
        """Add a section's tables, moved as said above and without the lattice's own moment."""
        found: dict[float, list[int]] = {}
        # What separation leaves of a flap is in the tables of it, if there are any.
        measured = effect > 0.0 and any(each.deflection for each in families[name])
        for airfoil, polar in zip(families[name], polar_of[name]):
            if airfoil.deflection == 0.0 or effect > 0.0:
                found.setdefault(airfoil.deflection, []).append(len(made))
                made.append(polars.moved(polar, effect * airfoil.deflection,
                                         cm * airfoil.deflection))
                if measured:
                    made[-1] = replace(made[-1], separated_high=polars.NEVER,
                                       separated_low=-polars.NEVER)
                logs.append(math.log(airfoil.reynolds) if airfoil.reynolds else 0.0)
        return tuple(Level(each, rows[0], rows[-1]) for each, rows in found.items())

    known: dict[tuple[str, float, float], tuple[Level, ...]] = {}
    keys: list[tuple] = []
    sides, index = [], []
    for j, (one, other, share) in enumerate(between):
        flapped = any(each.deflection for name in (one, other) for each in families[name])
        numbers = np.array([share, chord[j], *(flapped * np.array(
            [lever[j], own[j], *turn[:, j]]))])
        k = next((k for k, key in enumerate(keys) if key[:2] == (one, other) and np.all(
            np.abs(key[2] - numbers) <= ALIKE * (1.0 + np.abs(numbers)))), len(keys))
        if k == len(keys):
            keys.append((one, other, numbers))
            flap = round(float(numbers[2]), 9), round(float(numbers[3]), 9)
            for name in (one, other):
                if (name, *flap) not in known:
                    known[name, *flap] = levels_of(name, *flap)
            sides.append((known[one, *flap], known[other, *flap]))
        index.append(k)
    numbers = np.array([key[2] for key in keys])
    return Tables(
        curves=read_only(np.stack([polar.curve for polar in made])),
        landmarks=read_only([[getattr(polar, key) for key in LANDMARKS] for polar in made]),
        log_reynolds=read_only(logs), sides=tuple(sides), share=read_only(numbers[:, 0]),
        chord=read_only(numbers[:, 1]), turn=read_only(numbers[:, 4:])), np.array(index)

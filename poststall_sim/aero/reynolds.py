# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The curves that strips fly: between two sections along the span, between two Reynolds numbers.

A section may have several tables, each of a Reynolds number. Between two of them a coefficient is
linear in ln(Re), beyond the first and the last it is held. The Reynolds number of a strip is made
with its own chord and the airspeed of the aircraft, V c / nu: one for the whole flight condition,
continuous in it, so that loads do not jump, and a function of the present state alone, so that
nothing has to be saved.

What a mixture of curves is, its zero-lift angle is not quite: that is interpolated like the
curves, and so are the stall angles. The zero-lift angle only divides a strip's turn between camber
and decambering, which enter the flow as their sum; the stall angles mark strips as stalled.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from poststall_sim.aero import polars
from poststall_sim.aircraft import Airfoil, read_only
from poststall_sim.frames import FloatArray

ALIKE = 1e-9
"""Chords and places that differ by no more of themselves fly the same curve."""
LANDMARKS = ('zero_lift', 'stall_high', 'stall_low')


@dataclass(frozen=True, slots=True, eq=False)
class Tables:
    """
    The tables of all sections, and what each of the strips' curves (g) is mixed from.

    curves (t, 3, 2, GRID + 1), landmarks (t, 3) : see `polars.SectionPolar`; log_reynolds (t,),
    rising within a section, 0 where it has one table only; first, last (g, 2) : tables of the
    two sections that a curve lies between; share (g,) of the second one; chord (g,) [m].
    """

    curves: FloatArray
    landmarks: FloatArray
    log_reynolds: FloatArray
    first: np.ndarray
    last: np.ndarray
    share: FloatArray
    chord: FloatArray

    def at(self, reynolds: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return curves (g, 3, 2, GRID + 1) and landmarks (g, 3) at Reynolds numbers (g,)."""
        index, weight = self._mixture(np.log(np.maximum(reynolds, 1e-9)))
        out = np.empty((len(index), *self.curves.shape[1:]))
        _mix(self.curves, index, weight, out)
        return out, np.einsum('gk,gkl->gl', weight, self.landmarks[index])

    def middle(self) -> FloatArray:
        """Return Reynolds numbers (g,) in the middle of what the nearer section's tables span."""
        low, high = _nearer(self.first, self.share), _nearer(self.last, self.share)
        return np.exp(0.5 * (self.log_reynolds[low] + self.log_reynolds[high]))

    def _mixture(self, wanted: FloatArray) -> tuple[np.ndarray, FloatArray]:
        """Return tables (g, 4) and weights (g, 4) for ln(Re) (g,): two of either section."""
        index, weight = np.empty((len(wanted), 4), dtype=np.int64), np.empty((len(wanted), 4))
        for g, log in enumerate(wanted):
            for side, of_all in enumerate((1.0 - self.share[g], self.share[g])):
                first, last = self.first[g, side], self.last[g, side]
                known = self.log_reynolds[first:last + 1]
                k = min(max(int(np.searchsorted(known, log)), 1), len(known) - 1)
                above, place = 0.0, first
                if len(known) > 1:
                    place = first + k - 1
                    above = min(max((log - known[k - 1]) / (known[k] - known[k - 1]), 0.0), 1.0)
                index[g, 2 * side:2 * side + 2] = place, min(place + 1, last)
                weight[g, 2 * side:2 * side + 2] = of_all * (1.0 - above), of_all * above
        return index, weight


@njit(cache=True, nogil=True)
def _mix(curves, index, weight, out):
    """Fill out (g, 3, 2, m) with the sums of four curves each; index, weight (g, 4)."""
    for g in range(index.shape[0]):
        for c in range(3):
            for s in range(2):
                row = out[g, c, s]
                row[:] = 0.0
                for k in range(4):
                    share = weight[g, k]
                    if share != 0.0:
                        of = curves[index[g, k], c, s]
                        for i in range(row.size):
                            row[i] += share * of[i]


@dataclass(frozen=True, slots=True, eq=False)
class StripCurves:
    """
    What the strips (n) of an aircraft fly.

    curves (g, 3, 2, GRID + 1) and polar_index (n,) into them; landmarks (3, n) in the order of
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


def strip_curves(airfoils: Sequence[Airfoil], between: Sequence[Between],
                 chord: FloatArray) -> StripCurves:
    """
    Return the curves of strips between two sections each, by name; chord (n,) [m].

    Where sections have several tables the curves are those in the middle of these, until
    `Tables.at` is asked.
    """
    families: dict[str, list[Airfoil]] = {}
    for airfoil in airfoils:
        families.setdefault(airfoil.name, []).append(airfoil)
    for family in families.values():
        family.sort(key=lambda each: each.reynolds or 0.0)
    between = [(first, second, 0.0 if first == second else share)
               for first, second, share in between]
    ranges = np.array([
        [each.reynolds or math.nan for each in (family[0], family[-1])]
        for first, second, share in between
        for family in [families[second if share > 0.5 else first]]])
    if all(len(family) == 1 for family in families.values()):
        polar_of = {name: polars.section_polar(family[0]) for name, family in families.items()}
        curves, index, landmarks = _of_one_table(
            [polars.mixture(polar_of[first], polar_of[second], share)
             for first, second, share in between])
        return StripCurves(curves, index, landmarks, read_only(ranges), None)
    tables, index = _of_several(families, between, chord)
    curves, landmarks = tables.at(tables.middle())
    return StripCurves(read_only(curves), index, read_only(landmarks[index].T),
                       read_only(ranges), tables)


def excess(reynolds: FloatArray, reynolds_range: FloatArray) -> FloatArray:
    """
    Return how many times Reynolds numbers (n,) are above what tables (n, 2) cover.

    1 within; below 1 where they are too low, NaN where the tables do not say theirs.
    """
    low, high = reynolds_range.T
    return reynolds / np.clip(reynolds, low, high)


def _of_one_table(flown: list[polars.SectionPolar]) -> tuple[FloatArray, np.ndarray, FloatArray]:
    """Return the distinct curves of strips, the index into them (n,) and the landmarks (3, n)."""
    distinct: list[polars.SectionPolar] = []
    index = []
    for polar in flown:
        if not any(polar is known for known in distinct):
            distinct.append(polar)
        index.append(next(i for i, known in enumerate(distinct) if known is polar))
    landmarks = np.array([[getattr(polar, key) for polar in flown] for key in LANDMARKS])
    return read_only(np.stack([p.curve for p in distinct])), np.array(index), read_only(landmarks)


def _of_several(families: dict[str, list[Airfoil]], between: Sequence[Between],
                chord: FloatArray) -> tuple[Tables, np.ndarray]:
    """Return the tables of all sections and the index (n,) of each strip's mixture."""
    found = {name: [polars.section_polar(each) for each in family]
             for name, family in families.items()}
    last = dict(zip(families, np.cumsum([len(family) for family in families.values()]) - 1))
    first = {name: last[name] + 1 - len(family) for name, family in families.items()}
    keys: list[tuple[str, str, float, float]] = []
    index = []
    for (one, other, share), length in zip(between, chord):
        k = next((k for k, key in enumerate(keys) if key[:2] == (one, other)
                  and abs(key[2] - share) <= ALIKE and abs(key[3] - length) <= ALIKE * length),
                 len(keys))
        if k == len(keys):
            keys.append((one, other, share, float(length)))
        index.append(k)
    return Tables(
        curves=read_only(np.stack([p.curve for each in found.values() for p in each])),
        landmarks=read_only([[getattr(p, key) for key in LANDMARKS]
                             for each in found.values() for p in each]),
        log_reynolds=read_only([math.log(each.reynolds) if each.reynolds else 0.0
                                for family in families.values() for each in family]),
        first=np.array([[first[name] for name in key[:2]] for key in keys]),
        last=np.array([[last[name] for name in key[:2]] for key in keys]),
        share=read_only([key[2] for key in keys]),
        chord=read_only([key[3] for key in keys])), np.array(index)


def _nearer(pairs: np.ndarray, share: FloatArray) -> np.ndarray:
    """Return of pairs (g, 2) those of the section that has the greater share."""
    return np.where(share > 0.5, pairs[:, 1], pairs[:, 0])

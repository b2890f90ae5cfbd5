# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What the CONTROLs of an AVL surface move, in our terms.

AVL turns a flap about its hinge vector by the right-hand rule, by default along the hinge line in
the order of the sections; we say trailing edge down, on an upright surface trailing edge left.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim.aircraft import Section
from poststall_sim.avl_file import Hinge, Sheet
from poststall_sim.controls import Effector
from poststall_sim.frames import FloatArray, control_sign
from poststall_sim.reader import Place

_COMMON = {'elev': 'elevator', 'ail': 'aileron', 'ailerons': 'aileron', 'rud': 'rudder',
           'rudd': 'rudder', 'flaps': 'flap'}


@dataclass(frozen=True, slots=True)
class Flap:
    """
    A piece of a surface that a control moves, along the span in the file's order, 0 to 1.

    gain : ours, of the surface as drawn; image_gain : of its image.
    """

    where: Place
    control: str
    low: float
    high: float
    hinge: float
    gain: float
    image_gain: float

    def image(self) -> 'Flap':
        """Return the flap on the surface's image."""
        return replace(self, gain=self.image_gain)

    def effector(self, surface: str, side: int, backwards: bool) -> Effector:
        """Return the effector; backwards: our surface goes against the file's order."""
        span = (1.0 - self.high, 1.0 - self.low) if backwards else (self.low, self.high)
        return self.where.build(Effector, surface=surface, span=span, side=side,
                                hinge=self.hinge, gain=self.gain)


def flaps(sheet: Sheet, sections: Sequence[Section], places: FloatArray,
          edges: FloatArray) -> list[Flap]:
    """
    Return the flaps of a surface.

    places : of the sections along the span, edges : of the strips, both 0 to 1. A flap whose gain
    or hinge changes along the span is cut into strips, each with the values at its middle, as AVL
    has it.
    """
    found: list[Flap] = []
    for i, (inner, outer) in enumerate(zip(sheet.stations, sheet.stations[1:])):
        others = {hinge.name: hinge for hinge in outer.hinges}
        for hinge in inner.hinges:
            other = others.get(hinge.name)
            if other is None or min(hinge.place, other.place) < 0.0:
                continue
            ends = np.array([[hinge.gain, hinge.place], [other.gain, other.place]])
            cuts = np.array(places[i:i + 2])
            if not np.allclose(*ends, rtol=1e-12, atol=0.0):
                cuts = edges[(edges > cuts[0] - 1e-9) & (edges < cuts[1] + 1e-9)]
            for low, high in zip(cuts, cuts[1:]):
                share = (0.5 * (low + high) - places[i]) / (places[i + 1] - places[i])
                gain = (1.0 - share) * ends[0, 0] + share * ends[1, 0]
                place = between(ends[:, 1], [s.chord for s in sections[i:i + 2]], share)
                ours, mirror = _turn(hinge, ends[:, 1], place, sections[i:i + 2])
                if gain != 0.0:
                    found.append(Flap(
                        inner.where, as_control(hinge.name), float(low), float(high),
                        float(place), float(gain * ours),
                        float(gain * ours * mirror * hinge.image)))
    return found


def between(places: Sequence[float], chords: Sequence[float], share: float) -> float:
    """Return where on the chord a straight hinge line is that goes between two sections."""
    if places[0] == places[1]:
        return float(places[0])
    inner, outer = (1.0 - share) * chords[0], share * chords[1]
    return float((places[0] * inner + places[1] * outer) / (inner + outer))


def _turn(hinge: Hinge, places: Sequence[float], place: float,
          ends: Sequence[Section]) -> tuple[float, float]:
    """
    Return our gain for a unit of AVL's, and what of it its mirror image has.

    places : of the hinge at both ends, place : here. Only what a turn does to
    the wash along x counts: with e the span's direction across x, h the hinge vector and l the
    line of our flap's hinge it is h . e over l . e.
    """
    line, across = hinge_line(ends, [place, place])
    vector = np.array(hinge.vector)
    about = vector / np.linalg.norm(vector) if vector.any() else hinge_line(ends, places)[0]
    ratio = float(about @ across / (line @ across))
    normal = np.cross([1.0, 0.0, 0.0], across)
    # Positive for us does not depend on the order of the sections, as AVL's hinge line does.
    same = control_sign(normal)
    mirror = same * control_sign(normal * [1.0, -1.0, 1.0])
    return same * round(ratio, 14), mirror


def hinge_line(ends: Sequence[Section], places: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors along a hinge between two sections, and along the span across x."""
    first, last = (np.array(s.leading_edge_G) + [place * s.chord, 0.0, 0.0]
                   for s, place in zip(ends, places))
    line = (last - first) / np.linalg.norm(last - first)
    return line, np.array([0.0, line[1], line[2]]) / math.hypot(line[1], line[2])


def joined(effectors: Sequence[Effector]) -> tuple[Effector, ...]:
    """Return effectors with neighbours in one, and both sides of a symmetric surface in one."""
    found: list[Effector] = []
    for each in sorted(effectors, key=lambda e: (e.surface, e.side, e.span)):
        last = found[-1] if found else None
        if last is not None and abs(last.span[1] - each.span[0]) < 1e-12 \
                and replace(last, span=each.span) == each:
            found[-1] = replace(each, span=(last.span[0], each.span[1]))
        else:
            found.append(each)
    both = [replace(each, side=0) for each in found
            if each.side > 0 and replace(each, side=-1) in found]
    single = [each for each in found
              if not each.side or replace(each, side=-each.side) not in found]
    return tuple(sorted(both + single, key=lambda e: (e.surface, e.side, e.span)))


def as_name(title: str) -> str:
    """Return a title as a name of letters, digits and _."""
    name = re.sub(r'\W+', '_', title, flags=re.ASCII).strip('_')
    return name if name[:1].isalpha() else f'x{name}'


def as_control(title: str) -> str:
    """Return the name of a control, its common abbreviations written out."""
    name = as_name(title).lower()
    return _COMMON.get(name, name)

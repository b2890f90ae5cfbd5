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
from poststall_sim.controls import ACROSS, Effector
from poststall_sim.frames import FloatArray, control_sign
from poststall_sim.reader import Place

_COMMON = {'elev': 'elevator', 'ail': 'aileron', 'ailerons': 'aileron', 'rud': 'rudder',
           'rudd': 'rudder', 'flaps': 'flap'}


@dataclass(frozen=True, slots=True)
class Flap:
    """
    A piece of a surface that a control moves, along the span in the file's order, 0 to 1.

    axis : of the hinge as drawn, None along the hinge line; gain : ours, of the surface as drawn;
    image_gain : of its image, 0 where that stands still.
    """

    where: Place
    control: str
    low: float
    high: float
    hinge: float
    axis: tuple[float, float, float] | None
    gain: float
    image_gain: float

    def image(self) -> 'Flap':
        """Return the flap on the surface's image."""
        return replace(self, gain=self.image_gain, axis=_mirrored(self.axis))

    def effector(self, surface: str, side: int, backwards: bool) -> Effector:
        """Return the effector; backwards: our surface goes against the file's order."""
        span = (1.0 - self.high, 1.0 - self.low) if backwards else (self.low, self.high)
        return self.where.build(Effector, surface=surface, span=span, side=side,
                                hinge=self.hinge, gain=self.gain,
                                hinge_axis=_mirrored(self.axis) if side < 0 else self.axis)


def flaps(sheet: Sheet, sections: Sequence[Section], places: FloatArray,
          edges: FloatArray) -> list[Flap]:
    """
    Return the flaps of a surface.

    places : of the sections along the span, edges : of the strips and between them their control
    points, both 0 to 1. A flap whose gain or hinge changes along the span is cut into strips, each
    with the values at its control point, as AVL has it.
    """
    found: list[Flap] = []
    for i, (inner, outer) in enumerate(zip(sheet.stations, sheet.stations[1:])):
        others = {hinge.name: hinge for hinge in outer.hinges}
        for hinge in inner.hinges:
            other = others.get(hinge.name)
            if other is None or min(hinge.place, other.place) < 0.0:
                continue
            ends = np.array([[hinge.gain, hinge.place], [other.gain, other.place]])
            cuts, points = places[i:i + 2], places[i:i + 1]
            if not np.allclose(*ends, rtol=1e-12, atol=0.0):
                inside = edges[(edges > cuts[0] - 1e-9) & (edges < cuts[1] + 1e-9)]
                cuts, points = inside[::2], inside[1::2]
            for low, at, high in zip(cuts, points, cuts[1:]):
                share = (at - places[i]) / (places[i + 1] - places[i])
                gain = (1.0 - share) * ends[0, 0] + share * ends[1, 0]
                place = between(ends[:, 1], [s.chord for s in sections[i:i + 2]], share)
                axis, ours, mirror = _axis(sheet, hinge, ends[:, 1], sections[i:i + 2])
                if gain * ours != 0.0:
                    found.append(Flap(
                        inner.where, as_control(hinge.name), float(low), float(high),
                        float(place), axis, float(gain * ours),
                        float(gain * ours * mirror * hinge.image)))
    return found


def alone(sheet: Sheet) -> list[str]:
    """Return the controls that stand at a section and at none of its neighbours: no flap."""
    named = [[hinge.name for hinge in station.hinges] for station in sheet.stations]
    flapped = {name for inner, outer in zip(named, named[1:]) for name in inner if name in outer}
    return [name for name in dict.fromkeys(sum(named, [])) if name not in flapped]


def between(places: Sequence[float], chords: Sequence[float], share: float) -> float:
    """Return where on the chord a straight hinge line is that goes between two sections."""
    if places[0] == places[1]:
        return float(places[0])
    inner, outer = (1.0 - share) * chords[0], share * chords[1]
    return float((places[0] * inner + places[1] * outer) / (inner + outer))


def _axis(sheet: Sheet, hinge: Hinge, places: Sequence[float], ends: Sequence[Section],
          ) -> tuple[tuple[float, float, float] | None, float, float]:
    """
    Return the axis of a hinge, our gain for a unit of AVL's, and what of it its image has.

    places : of the hinge at both ends of it. No axis where it is the hinge line of our flap, no
    gain where the axis crosses the span: it turns nothing.
    """
    line, across = hinge_line(ends, places)
    axis = None
    if any(hinge.vector):
        axis = tuple(x * scale for x, scale in zip(hinge.vector, sheet.scale))
    elif places[0] != places[1]:
        axis = tuple(map(float, line))
    about = line if axis is None else np.array(axis) / math.hypot(*axis)
    normal = np.cross([1.0, 0.0, 0.0], across)
    # Positive for us does not depend on the order of the sections, as AVL's hinge line does.
    same = control_sign(normal)
    mirror = same * control_sign(normal * [1.0, -1.0, 1.0])
    along = float(about @ across)
    return axis, same * math.copysign(1.0, along) if abs(along) > ACROSS else 0.0, mirror


def _mirrored(axis: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
    return None if axis is None else (axis[0], -axis[1] + 0.0, axis[2])


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

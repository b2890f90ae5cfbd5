# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Section curves over a full turn from what an AVL file says of a section: a camber line.

Attached, thin-airfoil theory; past it, a plate in separated flow, the same for all: a stand-in
until the section's own table is there.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from poststall_sim.aircraft import Airfoil
from poststall_sim.frames import FloatArray
from poststall_sim.reader import Place, file_text, shown
from poststall_sim.separated_flow import generic_plate

STALL = math.radians(10.0)
"""Half the zero-lift angle may be exceeded by this before the flow begins to separate."""
WIDTH = math.radians(20.0)
"""Over which it separates: so wide that lift falls no steeper than a lattice of strips bears."""
_ROWS = 361

Slope = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True)
class ThinAirfoil:
    """Zero-lift angle [rad] and moment coefficient about the quarter chord of a camber line."""

    zero_lift: float
    moment: float

    def swept(self, cosine: float) -> 'ThinAirfoil':
        """Return what a camber line that stands along x is across a line swept by an angle."""
        return ThinAirfoil(math.atan(math.tan(self.zero_lift) / cosine), self.moment / cosine)


def thin_airfoil(slope: Slope, rows: int, spacing: float = 0.0) -> ThinAirfoil:
    """
    Return what thin-airfoil theory says of a camber line's slope dz/dx at x/c, on AVL's panels.

    rows, spacing : Nchord and Cspace. On few even panels a camber line lifts more than it does in
    the limit (NACA 2412 by 0.2 deg on five); the file's own panels give the file's own lift.

    References
    ----------
    J. Katz, A. Plotkin, Low-Speed Aerodynamics, 2nd ed., sec. 11.1.1.

    """
    size = min(abs(spacing), 3.0)
    i = min(int(size), 2)
    k = np.arange(rows)

    def panels(place: int) -> FloatArray:
        """Return the quarter points of all panels, in AVL's spacings and those between."""
        even = (4 * k + place) / (4.0 * rows)
        cosine = 0.5 - 0.5 * np.cos((4 * k + 1 + place) * math.pi / (4 * rows + 2))
        sine = 1.0 - np.cos((4 * k + 1 + place) * math.pi / (8 * rows + 2))
        known = (even, cosine, sine, even)
        return (i + 1 - size) * known[i] + (size - i) * known[i + 1]

    vortex, control = panels(1), panels(3)
    wash = 1.0 / (2.0 * math.pi * (control[:, None] - vortex))
    plate, line = np.linalg.solve(wash, np.column_stack([np.ones(rows), -slope(control)])).T
    zero_lift = -line.sum() / plate.sum()
    return ThinAirfoil(float(zero_lift), -2.0 * float(
        (line + zero_lift * plate) @ (vortex - 0.25)))


def naca(digits: str, where: Place) -> list[tuple[float, float]]:
    """
    Return the outline of a four-digit NACA section: thickness is laid off across the camber line.

    References
    ----------
    I. H. Abbott, A. E. von Doenhoff, Theory of Wing Sections, 1959, sec. 6.4.

    """
    if not (len(digits) == 4 and digits.isdigit() and (digits[:2] == '00' or '0' not in
                                                       digits[:2])):
        raise where.error(f'NACA must be four digits such as 2412, as AVL knows them; give others '
                          f'as AFILE; got {shown(digits)}')
    height, top, thickness = int(digits[0]) / 100.0, int(digits[1]) / 10.0, int(digits[2:]) / 100.0
    x = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, 201))
    half = 5.0 * thickness * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x ** 2
                              + 0.2843 * x ** 3 - 0.1015 * x ** 4)
    side = np.where(x < top, top, 1.0 - top)
    line = height * (2.0 * top * x - x * x + np.where(x < top, 0.0, 1.0 - 2.0 * top)) / side ** 2
    angle = np.arctan(2.0 * height * (top - x) / side ** 2)
    upper, lower = (np.column_stack([x - sign * half * np.sin(angle),
                                     line + sign * half * np.cos(angle)]) for sign in (1.0, -1.0))
    return [tuple(map(float, point)) for point in np.vstack([upper[::-1], lower[1:]])]


def coordinates(path: Path) -> list[tuple[float, float]]:
    """Return the points of an airfoil file: x y in each line, other lines are its title."""
    points = []
    for line in file_text(path).splitlines():
        words = line.replace(',', ' ').split()
        try:
            x, y = (float(word) for word in words)
        except ValueError:
            continue
        if abs(x) <= 2.0 and abs(y) <= 2.0:   # else the counts that some formats begin with
            points.append((x, y))
    return points


def camber(points: Sequence[tuple[float, float]], where: Place) -> Slope:
    """
    Return the slope of the camber line of an airfoil given by its outline.

    The outline goes from the trailing edge over one side round the nose to the trailing edge.
    """
    outline = np.array(points, dtype=float).reshape(-1, 2)
    nose = int(np.argmin(outline[:, 0])) if len(outline) else 0
    if len(outline) < 5 or not 1 < nose < len(outline) - 2:
        raise where.error('an airfoil must be at least 5 points from the trailing edge round the '
                          f'nose to the trailing edge, got {len(outline)}')
    start, chord = outline[nose], np.ptp(outline[:, 0])
    sides = [(side - start) / chord for side in (outline[nose::-1], outline[nose:])]
    t = np.linspace(0.0, math.pi, 101)
    x = 0.5 - 0.5 * np.cos(t)
    height = 0.5 * sum(np.interp(x, side[:, 0], side[:, 1]) for side in sides)
    return lambda place: np.interp(place, 0.5 * (x[1:] + x[:-1]), np.diff(height) / np.diff(x))


def outline(line: ThinAirfoil, rows: int) -> list[tuple[float, float]]:
    """
    Return an airfoil without thickness that has a zero-lift angle and a moment on so many panels.

    A parabola and a cubic that both end where they begin; both enter linearly.
    """
    x = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, 101))
    heights = np.stack([x * (1.0 - x), x * (1.0 - x) * (1.0 - 2.0 * x)])
    there = Place('camber line')
    each = [thin_airfoil(camber(_doubled(x, height), there), rows) for height in heights]
    parts = np.linalg.lstsq(np.array([[one.zero_lift, one.moment] for one in each]).T,
                            np.array([line.zero_lift, line.moment]), rcond=None)[0]
    return _doubled(x, parts @ heights)


def _doubled(x: FloatArray, height: FloatArray) -> list[tuple[float, float]]:
    """Return a line as an outline, to the nose and back."""
    points = np.column_stack([x, height])
    return [tuple(map(float, point)) for point in np.vstack([points[:0:-1], points])]


def section(name: str, line: ThinAirfoil, slope: float, drag: Sequence[float]) -> Airfoil:
    """
    Return the curves of a section: attached near its zero-lift angle, then a separated plate.

    slope : of the attached lift over 2 pi; drag : cl and cd of AVL's three points, or one cd.

        cl = k 2 pi slope sin(a - a0) + (1 - k) cl_plate
        cd = k cd(cl) + (1 - k) cd_plate
        cm = k cm + (1 - k) cn (0.1 (1 - 2 |a|/pi) - 0.25),   cn = cl cos a + cd sin a

    with the attached share k falling from 1 to 0. The plate is `generic_plate`, its centre of
    pressure goes from 0.4 to 0.5 of the chord.
    """
    alpha = np.linspace(-math.pi, math.pi, _ROWS * 2 - 1)
    gone = np.clip((np.abs(alpha - 0.5 * line.zero_lift) - STALL) / WIDTH, 0.0, 1.0)
    k = 1.0 - gone * gone * (3.0 - 2.0 * gone)
    attached = 2.0 * math.pi * slope * np.sin(alpha - line.zero_lift)
    plate_lift, plate_drag = generic_plate(alpha)
    plate_normal = plate_lift * np.cos(alpha) + plate_drag * np.sin(alpha)
    behind = 0.1 * (1.0 - 2.0 * np.abs(alpha) / math.pi) - 0.25
    curves = np.stack([
        k * attached + (1.0 - k) * plate_lift,
        k * _profile_drag(attached, drag) + (1.0 - k) * plate_drag,
        k * line.moment + (1.0 - k) * plate_normal * behind])
    curves[:, -1] = curves[:, 0]
    return Airfoil(name, alpha, *curves)


def _profile_drag(lift: FloatArray, drag: Sequence[float]) -> FloatArray:
    """Return cd(cl): two parabolas with their vertex at AVL's middle point, flat beyond it."""
    if len(drag) == 1:
        return np.full_like(lift, drag[0])
    low, at_low, middle, least, high, at_high = drag
    lift = np.clip(lift, low, high)
    end, at_end = np.where(lift < middle, low, high), np.where(lift < middle, at_low, at_high)
    return least + (at_end - least) * ((lift - middle) / (end - middle)) ** 2

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

STALL = math.radians(10.0)
"""Half the zero-lift angle may be exceeded by this before the flow begins to separate."""
WIDTH = math.radians(20.0)
"""Over which it separates: so wide that lift falls no steeper than a lattice of strips bears."""
_STEPS = 2000
_ROWS = 361

Slope = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True)
class ThinAirfoil:
    """Zero-lift angle [rad] and moment coefficient about the quarter chord of a camber line."""

    zero_lift: float
    moment: float


def thin_airfoil(slope: Slope) -> ThinAirfoil:
    """
    Return what thin-airfoil theory says of a camber line's slope dz/dx at x/c.

        alpha_0 = 1/pi int dz/dx (1 - cos t) dt,   cm = -1/2 int dz/dx (cos t - cos 2t) dt

    over 0 < t < pi with x/c = (1 - cos t)/2.

    References
    ----------
    J. D. Anderson, Fundamentals of Aerodynamics, 5th ed., sec. 4.8.

    """
    t = (np.arange(_STEPS) + 0.5) * math.pi / _STEPS   # the midpoint rule: the ends are singular
    rise = slope(0.5 - 0.5 * np.cos(t)) * math.pi / _STEPS
    return ThinAirfoil(
        zero_lift=float(np.sum(rise * (1.0 - np.cos(t)))) / math.pi,
        moment=-0.5 * float(np.sum(rise * (np.cos(t) - np.cos(2.0 * t)))))


def naca(digits: str, where: Place) -> Slope:
    """Return the slope of the camber line of a four- or five-digit NACA section."""
    if digits.isdigit() and len(digits) == 4:
        height, place = int(digits[0]) / 100.0, int(digits[1]) / 10.0
        if height == 0.0:
            return np.zeros_like
        if place > 0.0:
            return lambda x: 2.0 * height * (place - x) / np.where(
                x < place, place, 1.0 - place) ** 2
    if digits.isdigit() and len(digits) == 5 and digits[2] == '0' and digits[1] in '12345':
        # Jacobs, Pinkerton, Greenberg, NACA Report 537: m and k1 for a design lift of 0.3.
        m, k = {'1': (0.0580, 361.4), '2': (0.1260, 51.64), '3': (0.2025, 15.957),
                '4': (0.2900, 6.643), '5': (0.3910, 3.230)}[digits[1]]
        k *= int(digits[0]) / 2.0
        return lambda x: k / 6.0 * (np.where(
            x < m, 3.0 * x * x - 6.0 * m * x + m * m * (3.0 - m), -m ** 3))
    raise where.error(f'NACA must be a four- or five-digit section such as 2412 or 23012, got '
                      f'{shown(digits)}')


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


def outline(zero_lift: float, moment: float) -> list[tuple[float, float]]:
    """
    Return an airfoil without thickness that has a zero-lift angle [rad] and a moment.

    Its slope is A0 + A1 cos t + A2 cos 2t, t as in `thin_airfoil`, with A2 = 0 for a parabola and
    the part of the moment that a parabola of this zero-lift angle has not: cm = -pi/4 (A1 - A2)
    and alpha_0 = A0 - A1/2. A0 closes the line at the trailing edge.
    """
    # z(1) = 0: the integral of the slope times sin(t)/2 is A0 - A2/3.
    a2 = (2.0 * zero_lift - 4.0 * moment / math.pi) / (2.0 / 3.0 - 1.0)
    a1 = a2 - 4.0 * moment / math.pi
    t = np.linspace(0.0, math.pi, 101)
    height = 0.5 * (a2 / 3.0 * (1.0 - np.cos(t)) + 0.5 * a1 * np.sin(t) ** 2
                    + a2 * ((1.0 - np.cos(3.0 * t)) / 6.0 - (1.0 - np.cos(t)) / 2.0))
    points = np.column_stack([0.5 - 0.5 * np.cos(t), height])
    return [tuple(map(float, point)) for point in np.vstack([points[:0:-1], points])]


def section(name: str, line: ThinAirfoil, slope: float, drag: Sequence[float]) -> Airfoil:
    """
    Return the curves of a section: attached near its zero-lift angle, then a separated plate.

    slope : of the attached lift over 2 pi; drag : cl and cd of AVL's three points, or one cd.

        cl = k 2 pi slope sin(a - a0) + (1 - k) 1.1 sin 2a
        cd = k cd(cl) + (1 - k) (0.01 + 1.9 sin^2 a)
        cm = k cm + (1 - k) cn (0.1 (1 - 2 |a|/pi) - 0.25),   cn = cl cos a + cd sin a

    with the attached share k falling from 1 to 0. The plate: 1.9 is the drag of a wide plate
    across the stream, its centre of pressure goes from 0.4 to 0.5 of the chord.

    References
    ----------
    S. F. Hoerner, Fluid-Dynamic Drag, 1965, ch. 3.

    """
    alpha = np.linspace(-math.pi, math.pi, _ROWS * 2 - 1)
    gone = np.clip((np.abs(alpha - 0.5 * line.zero_lift) - STALL) / WIDTH, 0.0, 1.0)
    k = 1.0 - gone * gone * (3.0 - 2.0 * gone)
    attached = 2.0 * math.pi * slope * np.sin(alpha - line.zero_lift)
    plate_lift, plate_drag = 1.1 * np.sin(2.0 * alpha), 0.01 + 1.9 * np.sin(alpha) ** 2
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

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Three section curves that differ in their stall only, the aircraft that carry them, random flows.

What is asked of the decambering is asked of these curves, because how hard it is depends on how
steeply lift falls: -1, -5 and -11 per radian at the steepest, 0.15, 0.5 and 0.6 of lift lost.
"""

import dataclasses
import math
import os
import secrets
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from poststall_sim import definition
from poststall_sim.aero.model import Onset
from poststall_sim.aircraft import Aircraft, Airfoil, MassProperties, Reference, Section, Surface
from poststall_sim.controls import Control, Effector
from poststall_sim.frames import body_to_geometry, velocity_from_flow_angles

CONFIG = Path(__file__).resolve().parents[1] / 'config'
DENSITY = 1.225
SPEED = 40.0
"""Airspeed of all flows made here [m/s]; coefficients do not depend on it."""
ZERO_LIFT = math.radians(-4.2)


@dataclass(frozen=True)
class Stall:
    """Steepest fall of lift [1/rad], lift lost in it, and how sharply its corners are [rad]."""

    steepest: float
    lost: float
    corner: float


STALLS = {
    'gentle': Stall(-1.0, 0.15, math.radians(0.8)),
    'normal': Stall(-5.0, 0.50, math.radians(0.5)),
    'sharp': Stall(-11.0, 0.60, math.radians(0.3))}


def airfoil(name):
    """
    Return the section of one of `STALLS`, a table at every quarter of a degree.

    Lift is a polygon with rounded corners: with corners at a_i where the slope changes by c_i,

        cl = line + sum_i c_i w_i ln(1 + exp((a - a_i)/w_i)),

    so that no slope is steeper than the steepest side. Attached it is 2 pi (a - alpha_0L); past
    the stall there is a shelf that rises slowly to +-30 deg, from 62 deg on all three are one;
    lift falls at under 1 per radian through 114 deg, is reversed, and rises through 180 deg as a
    section flying backwards. The negative stall loses 0.6 of what the other does, at 0.8 of its
    slope. Drag and moment go from attached to a plate's with the share s that has separated,

        cd = 0.008 + 0.01 cl^2 (1 - s) + s 1.9 sin^2 a,   cm = -0.09 (1 - s) - s 0.45 sin a,

    s rising from 0 to 1 over the fall of lift, so that it, too, differs in the stall only.
    """
    stall = STALLS[name]
    alpha = np.radians(np.linspace(-180.0, 180.0, 1441))
    corners, high, low = _corners(stall)
    cl = _rounded(corners, alpha)
    s = 1.0 / (1.0 + np.exp(-(alpha - high[0]) / high[1])) \
        + 1.0 / (1.0 + np.exp((alpha - low[0]) / low[1]))
    cd = 0.008 + 0.01 * cl ** 2 * (1.0 - s) + 1.9 * s * np.sin(alpha) ** 2
    cm = -0.09 * (1.0 - s) - 0.45 * s * np.sin(alpha)
    for values in (cl, cd, cm):
        values[-1] = values[0]
    return Airfoil(name, alpha, cl, cd, cm)


def _corners(stall):
    """Return the polygon, rows of (alpha, cl, width), and middle and width of both stalls."""
    deg = math.radians

    def attached(alpha):
        return 2.0 * math.pi * (alpha - ZERO_LIFT)

    def fall(lost, slope):
        # Rounding takes of it about as much at both ends together.
        length = lost / slope + 0.5 * math.log(2.0) * stall.corner
        return length, slope * length

    wide = deg(0.8)
    length, lost = fall(stall.lost, -stall.steepest * 1.02)
    top = attached(deg(10.3)) + 0.04
    shelf = top - lost
    high = deg(15.0) + length
    length_low, lost_low = fall(0.6 * stall.lost, -0.8 * stall.steepest)
    bottom = attached(deg(-13.8)) - 0.02
    shelf_low = bottom + lost_low
    low = deg(-16.5) - length_low
    corners = [
        (deg(-168.0), 0.48, deg(2.0)),
        (deg(-150.0), 0.48, deg(4.0)),
        (deg(-62.0), -0.92, deg(4.0)),
        (deg(-30.0), shelf_low - 0.1 * (deg(30.0) + low), deg(1.5)),
        (low, shelf_low, stall.corner),
        (deg(-16.5), bottom, stall.corner),
        (deg(-13.8), attached(deg(-13.8)), wide),
        (deg(10.3), attached(deg(10.3)), wide),
        (deg(15.0), top, stall.corner),
        (high, shelf, stall.corner),
        (deg(30.0), shelf + 0.1 * (deg(30.0) - high), deg(1.5)),
        (deg(62.0), 0.93, deg(4.0)),
        (deg(142.0), -0.42, deg(4.0)),
        (deg(168.0), -0.48, deg(2.0))]
    return np.array(corners), (deg(15.0) + 0.5 * length, 0.25 * length), \
        (deg(-16.5) - 0.5 * length_low, 0.25 * length_low)


def _rounded(corners, alpha):
    """Return the rounded polygon at angles; it closes over a full turn."""
    turn = np.array([2.0 * math.pi, 0.0, 0.0])
    corners = np.concatenate([corners - turn, corners, corners + turn])
    slope = np.diff(corners[:, 1]) / np.diff(corners[:, 0])
    cl = corners[0, 1] + slope[0] * (alpha - corners[0, 0])
    for (place, _, width), change in zip(corners[1:-1], np.diff(slope)):
        cl += change * width * np.logaddexp(0.0, (alpha - place) / width)
    return cl


def wing_tail(foil):
    """Return the configuration of Figure 2.2 of Paul 2015 with another section throughout."""
    return with_airfoil(definition.aircraft(CONFIG / 'aircraft' / 'wing_tail.yaml'), foil)


def with_airfoil(machine, foil):
    """Return an aircraft with all its sections exchanged."""
    surfaces = tuple(
        dataclasses.replace(surface, sections=tuple(
            dataclasses.replace(section, airfoil=foil.name) for section in surface.sections))
        for surface in machine.surfaces)
    return dataclasses.replace(machine, airfoils=(foil,), surfaces=surfaces)


def with_strips(machine, **strips):
    """Return an aircraft with its surfaces cut into other numbers of strips, by name."""
    return dataclasses.replace(machine, surfaces=tuple(
        dataclasses.replace(surface, strips=strips.get(surface.name, surface.strips))
        for surface in machine.surfaces))


def wing_alone(foil, strips=20, *, aspect_ratio=12.0):
    """Return a rectangular wing of chord 1 m."""
    half = 0.5 * aspect_ratio
    wing = Surface('wing', (Section((0.0, 0.0, 0.0), 1.0, foil.name),
                            Section((0.0, half, 0.0), 1.0, foil.name)), strips, symmetric=True)
    return _machine('wing', (wing,), foil, Reference(2.0 * half, 1.0, 2.0 * half))


def swept(foil, strips=20, *, fin_strips=6):
    """
    Return a swept, tapered wing with dihedral, and a fin whose quarter chord is swept 45 deg.

    The wing: span 10 m, chords 1.2 and 0.6 m, leading edge swept 25 deg, dihedral 6 deg, strips
    crowded at its tips. Ailerons and a rudder. The fin has the wing's section, cambered or not;
    with fin_strips 0 there is none.
    """
    half, back = 5.0, 5.0 * math.tan(math.radians(25.0))
    wing = Surface('wing', (
        Section((0.0, 0.0, 0.0), 1.2, foil.name),
        Section((back, half, half * math.tan(math.radians(6.0))), 0.6, foil.name)),
        strips, symmetric=True, spacing_cosine=True)
    ailerons = Control('aileron', (-0.35, 0.35), (
        Effector('wing', (0.6, 1.0), side=1, gain=-1.0),
        Effector('wing', (0.6, 1.0), side=-1, gain=1.0)))
    reference = Reference(9.0, 0.9, 10.0)
    if not fin_strips:
        return _machine('swept', (wing,), foil, reference, (ailerons,))
    height, root, tip = 1.3, 0.9, 0.5
    fin = Surface('fin', (
        Section((4.0, 0.0, 0.1), root, foil.name),
        # At 45 deg the quarter chord goes back as far as it goes up.
        Section((4.0 + 0.25 * (root - tip) + height, 0.0, 0.1 + height), tip, foil.name)),
        fin_strips)
    rudder = Control('rudder', (-0.35, 0.35), (Effector('fin', hinge=0.65),))
    return _machine('swept', (wing, fin), foil, reference, (ailerons, rudder))


def _machine(name, surfaces, foil, reference, controls=()):
    mass = MassProperties(100.0, (0.25, 0.0, 0.0), np.diag([100.0, 200.0, 250.0]))
    return Aircraft(name, surfaces, (foil,), reference, mass, controls)


@dataclass(frozen=True)
class Flow:
    """An airspeed direction [rad], body rates [rad/s] and deflections [rad]: one problem."""

    alpha: float
    beta: float
    rates_B: np.ndarray
    deflections: np.ndarray

    @property
    def onset(self):
        """The air past the aircraft, at `SPEED`."""
        velocity_B = velocity_from_flow_angles(SPEED, self.alpha, self.beta)
        return Onset(body_to_geometry(-velocity_B), body_to_geometry(self.rates_B))

    def __str__(self):
        return (f'alpha {math.degrees(self.alpha)!r} deg, beta {math.degrees(self.beta)!r} deg, '
                f'rates_B {self.rates_B.tolist()} rad/s, deflections {self.deflections.tolist()}')


def level_flow(machine, alpha):
    """Return the flow of straight flight at an incidence [rad] without sideslip."""
    return Flow(alpha, 0.0, np.zeros(3), np.zeros(len(machine.controls)))


def random_flows(machine, count, seed, *, alpha=(-30.0, 60.0), beta=15.0, rate=0.1):
    """
    Return random flows: alpha between two angles [deg], +-beta [deg], controls in their limits.

    rate : largest p, q, r times span over 2 V.
    """
    rng = np.random.default_rng(seed)
    low = np.array([control.limits[0] for control in machine.controls])
    high = np.array([control.limits[1] for control in machine.controls])
    largest = rate * 2.0 * SPEED / machine.reference.span
    return [Flow(math.radians(rng.uniform(*alpha)), math.radians(rng.uniform(-beta, beta)),
                 rng.uniform(-largest, largest, 3), rng.uniform(low, high))
            for _ in range(count)]


def fresh_seed():
    """Return a seed of this run's own, or the one in POSTSTALL_SEED; print it either way."""
    seed = int(os.environ.get('POSTSTALL_SEED', secrets.randbits(32)))
    print(f'POSTSTALL_SEED={seed}')
    return seed

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A conventional aircraft from a few numbers: wing, tail, fin, three controls, an engine.

Proportions are those of ordinary aircraft (D. P. Raymer, Aircraft Design, 6th ed., ch. 6); where
the centre of gravity stands is asked of the lattice, so that the static margin is what was wanted.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim import survey
from poststall_sim.aero import model as models
from poststall_sim.aircraft import (
    Aircraft,
    Airfoil,
    MassProperties,
    Reference,
    Section,
    Surface,
    level_airspeed,
    usual_radii,
)
from poststall_sim.controls import Control, Effector
from poststall_sim.engines import LinearThrust
from poststall_sim.frames import GRAVITY
from poststall_sim.records import ConfigError, require_positive

STATIC_MARGIN = 0.10
TAIL_ARM = 2.7
"""Of the tail's quarter chord behind the wing's, in chords."""
VERTICAL_VOLUME = 0.04
CRUISE_LIFT = 0.5
THRUST = 0.4
"""At rest, over weight; none at `FASTEST` times the airspeed at `CRUISE_LIFT`."""
FASTEST = 2.0
DIGITS = 3
"""Of lengths: people draw and build to the millimetre, and small aircraft to a part of it."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """Span and mean chord [m], mass [kg] and horizontal tail volume [-] of an aircraft."""

    span: float
    chord: float
    mass: float
    tail_volume: float = 0.55

    def __post_init__(self) -> None:
        """Refuse what is no aeroplane of ordinary shape."""
        for name, unit in (('span', 'm'), ('chord', 'm'), ('mass', 'kg'), ('tail_volume', '')):
            require_positive(name, getattr(self, name), unit)
        if not 3.0 <= self.span / self.chord <= 30.0:
            raise ConfigError(f'span over chord must be 3 to 30, got {self.span:g} over '
                              f'{self.chord:g} m')
        if not 0.2 <= self.tail_volume <= 1.5:
            raise ConfigError(f'tail volume must be 0.2 to 1.5, got {self.tail_volume:g}')


def rounded(value: float) -> float:
    """Return a guess to three digits: more would say that it is known."""
    return float(f'{value:.3g}')


def engine(mass: float, area: float, position_G: tuple[float, float, float]) -> LinearThrust:
    """Return an engine for a mass [kg] on a wing area [m^2] that holds it up to `FASTEST`."""
    fastest = FASTEST * level_airspeed(mass, area, 1.225, CRUISE_LIFT)
    return LinearThrust(rounded(THRUST * mass * GRAVITY), rounded(fastest), position_G)


def conventional(name: str, numbers: Numbers, wing_airfoil: Airfoil,
                 tail_airfoil: Airfoil) -> Aircraft:
    """Return an aircraft of these numbers, balanced at `STATIC_MARGIN`."""
    span, chord = numbers.span, numbers.chord
    digits = max(DIGITS, DIGITS - 1 - math.floor(math.log10(chord)))

    def point(x: float, y: float, z: float) -> tuple[float, float, float]:
        return round(x, digits), round(y, digits), round(z, digits)

    area, arm = span * chord, TAIL_ARM * chord
    tail_area = numbers.tail_volume * area * chord / arm
    tail_chord = round(math.sqrt(0.25 * tail_area), digits)
    tail_span = tail_area / tail_chord
    fin_area = VERTICAL_VOLUME * area * span / arm
    fin_height = round(math.sqrt(1.6 * fin_area), digits)
    fin_chord = fin_area / fin_height
    below = -0.3 * chord
    quarter = 0.25 * chord + arm
    even = 2 * math.ceil(span / chord / 0.8)    # strips of four tenths of a chord
    surfaces = (
        Surface('wing', (
            Section((0.0, 0.0, 0.0), chord, wing_airfoil.name),
            Section((0.0, 0.5 * span,
                     round(0.5 * span * math.tan(math.radians(3.0)), digits)), chord,
                    wing_airfoil.name)), strips=even, symmetric=True),
        Surface('tail', (
            Section(point(quarter - 0.25 * tail_chord, 0.0, below), tail_chord,
                    tail_airfoil.name),
            Section(point(quarter - 0.25 * tail_chord, 0.5 * tail_span, below), tail_chord,
                    tail_airfoil.name)), strips=8, symmetric=True),
        Surface('fin', (
            Section(point(quarter - 0.35 * fin_chord, 0.0, below + 0.02 * chord),
                    round(1.2 * fin_chord, digits), tail_airfoil.name),
            Section(point(quarter + 0.05 * fin_chord, 0.0, below + fin_height),
                    round(0.8 * fin_chord, digits), tail_airfoil.name)), strips=5))
    controls = (
        Control('aileron', (math.radians(-20.0), math.radians(20.0)), (
            Effector('wing', (0.6, 1.0), side=1, gain=-1.0),
            Effector('wing', (0.6, 1.0), side=-1, gain=1.0))),
        Control('elevator', (math.radians(-30.0), math.radians(20.0)), (
            Effector('tail', hinge=0.6),)),
        Control('rudder', (math.radians(-25.0), math.radians(25.0)), (
            Effector('fin', hinge=0.55),)))
    length = arm + 1.5 * chord
    inertia = [rounded(each) for each in numbers.mass * usual_radii(span, length) ** 2]
    low = -0.1 * chord

    def balanced(x: float) -> Aircraft:
        return Aircraft(
            name, surfaces, tuple({each.name: each for each in (wing_airfoil,
                                                                tail_airfoil)}.values()),
            Reference(area, chord, span),
            MassProperties(numbers.mass, point(x, 0.0, low), np.diag(inertia)),
            controls, (engine(numbers.mass, area, point(-chord, 0.0, low)),))

    # The neutral point does not move with the centre of gravity but for its height.
    start = balanced(0.25 * chord)
    neutral = survey.survey(models.build(start)).neutral_point
    return replace(start, mass=balanced(neutral - STATIC_MARGIN * chord).mass)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The wing and tail of the dissertation's Figure 2.2, as the figures of docs/figures.md take them.

The lattice is the Weissinger arrangement (one panel along the chord) with small angles, as in the
dissertation's chapter 3. Angles are in degrees here.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from poststall_sim import definition, polar
from poststall_sim.aero import model as models
from poststall_sim.aero import polars, solver
from poststall_sim.aero.decambering import AngleForm, Closure
from poststall_sim.aero.model import Model
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.plots import decambering as plots
from poststall_sim.plots.decambering import Curve
from poststall_sim.state import Status

AIR = {'airspeed': 1.0, 'density': 1.0}
LOCAL = {'chordwise': 1, 'angle_form': AngleForm.LINEAR, 'closure': Closure.LOCAL,
         'tolerance': 1e-4, 'limit': 1000, 'unsteady': False}
NONLOCAL = {'chordwise': 1, 'angle_form': AngleForm.LINEAR, 'unsteady': False}
ALPHAS = np.arange(0.0, 41.0)
DEG = plots.DEG


@cache
def model(strips: int = 20, tail: bool = True, sweep: float = 0.0,
          airfoil: str = 'naca4415_re3e6', **settings) -> Model:
    """Return the wing, with its tail or alone, sheared back by a sweep [deg]."""
    aircraft = definition.aircraft(definition.find(definition.Kind.AIRCRAFT, 'wing_tail'))
    wing, horizontal = aircraft.surfaces
    back = math.tan(math.radians(sweep))
    sections = tuple(
        replace(s, leading_edge_G=(s.leading_edge_G[0] + back * s.leading_edge_G[1],
                                   *s.leading_edge_G[1:])) for s in wing.sections)
    wing = replace(wing, strips=strips, sections=sections)
    curves = definition.airfoil(definition.find(definition.Kind.AIRFOIL, airfoil),
                                aircraft.airfoils[0].name)
    return models.build(replace(
        aircraft, surfaces=(wing, horizontal) if tail else (wing,), airfoils=(curves,),
        controls=aircraft.controls if tail else ()), models.Settings(**settings))


def scheme(letter: str, start: Start = Start.ZERO, damping: float = 1.0, **lattice) -> Model:
    """Return the model that a scheme of the dissertation solves, mirrored strips alike."""
    return model(**lattice, **LOCAL, scheme=Scheme(letter), start=start, damping=damping,
                 symmetric=True)


def named(name: str, **lattice) -> Model:
    """Return scheme D by its start: D raised in alpha, D0 from zero, D1 from scheme A."""
    start = {'D': Start.GIVEN, 'D0': Start.ZERO, 'D1': Start.SCHEME_A}[name]
    return scheme('D', start, **lattice)


def section(airfoil: str = 'naca4415_re3e6') -> polars.SectionPolar:
    """Return the curve of the wing's section."""
    return polars.section_polar(
        definition.airfoil(definition.find(definition.Kind.AIRFOIL, airfoil)))


def sweep(chosen: Model, alphas: Sequence[float] = ALPHAS) -> list[polar.Point]:
    """Return the points at angles of attack [deg], raised in this order."""
    return list(polar.sweep(
        chosen, [polar.Condition(math.radians(a)) for a in alphas], **AIR))


def at(chosen: Model, alpha: float) -> polar.Point:
    """Return the point at an angle of attack [deg], reached from 0 in steps of a degree."""
    if chosen.settings.start is Start.GIVEN:
        return sweep(chosen, np.arange(0.0, alpha + 0.5))[-1]
    return sweep(chosen, [alpha])[-1]


def path(chosen: Model, alpha: float, steps: int,
         delta0: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return section angles [deg] and cl of all strips, (steps + 1, n) each, as they iterate."""
    n = chosen.lattice.strips
    taken = np.full((steps + 1, 2 * n), np.nan)
    condition = polar.Condition(math.radians(alpha))
    solver.steady(chosen, polar.onset(chosen, condition, 1.0),
                  np.zeros(len(chosen.aircraft.controls)), density=1.0, delta0=delta0, path=taken)
    return np.degrees(taken[:, :n]), taken[:, n:]


def converged(points: Sequence[polar.Point]) -> np.ndarray:
    """Tell which points converged."""
    return np.array([each.aero.status is Status.CONVERGED for each in points])


def wing_lift(chosen: Model, points: Sequence[polar.Point]) -> np.ndarray:
    """Return the wing's CL at points, NaN where the closure was not solved."""
    lift = np.array([polar.surface_lift(chosen, p.aero.strips.cl, 'wing') for p in points])
    return np.where(converged(points), lift, np.nan)


def loading(chosen: Model, point: polar.Point) -> tuple[np.ndarray, np.ndarray]:
    """Return 2y/b and the strips' cl in the stream's direction on the wing."""
    lattice, strips = chosen.lattice, chosen.lattice.grids[0].strips
    place = lattice.quarter_chord[strips, 1]
    cl = point.aero.strips.cl[strips] * lattice.chord_axis[strips, 0] ** 2
    return place / 6.0, cl


def lift_curve(label: str, chosen: Model, alphas: Sequence[float] = ALPHAS, **looks) -> Curve:
    """Return the wing's lift curve."""
    return Curve(label, np.asarray(alphas), wing_lift(chosen, sweep(chosen, alphas)), **looks)


def section_reference() -> Curve:
    """Return the section's curve as a lift curve to compare with."""
    return replace(plots.section_curves(section(), low=0.0, deltas=())[0],
                   colour=plots.REFERENCE_COLOUR, width=1.2, top=1)


def nonlocal_reference(**lattice) -> Curve:
    """Return the wing's lift curve by the non-local closure."""
    return lift_curve('non-local closure (this package)', model(**lattice, **NONLOCAL),
                      colour=plots.NONLOCAL_COLOUR, line=(0, (6, 2)), width=1.3, top=2)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Steady loads over conditions: one point, a sweep, up and down, and how many solutions there are.

Past stall a closure may have several solutions at one condition, so where the solver starts from
is part of the question: a sweep hands the decambering of each point to the next, and
`distinct_solutions` starts from many places at random and counts where they lead.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from poststall_sim.aero import far_field, operating, solver
from poststall_sim.aero.decambering import wrap
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.schemes import Start
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aircraft import Aircraft, level_airspeed, read_only
from poststall_sim.frames import (
    FloatArray,
    body_to_geometry,
    body_to_stability,
    geometry_to_body,
    velocity_from_flow_angles,
)
from poststall_sim.state import Status

START_LOW, START_HIGH = math.radians(-20.0), math.radians(10.0)
"""Between these is the decambering of each strip at a random start: what separated flow asks of
a section (-10 deg at 20 deg, -20 deg at 35), and as much again the wrong way."""
APART = math.radians(0.1)
"""Two solutions are distinct if the decambering of a strip differs by more: saw-tooth states
differ by degrees, what tolerances leave is far less."""


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """
    A steady flow past the aircraft, and its controls.

    alpha, beta [rad]; rates (3,) : p b/2V, q c/2V, r b/2V about the body axes through the centre
    of gravity, with the reference span and chord [-]; deflections (controls,) [rad], neutral if
    empty.
    """

    alpha: float
    beta: float = 0.0
    rates: FloatArray = field(default_factory=lambda: np.zeros(3))
    deflections: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for key in ('rates', 'deflections'):
            object.__setattr__(self, key, read_only(getattr(self, key)))


@dataclass(frozen=True, slots=True)
class Coefficients:
    """Lift and drag in stability axes; the rest in body axes, moments about the CG [-]."""

    CL: float
    CD: float
    CY: float
    Cl: float
    Cm: float
    Cn: float


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """
    The loads at one condition, and how they came about.

    induced_far : coefficient of the induced drag in the far field, see `far_field`; uniqueness :
    see `operating.uniqueness`, NaN where no closure is at work.
    """

    condition: Condition
    coefficients: Coefficients
    aero: AeroResult
    induced_far: float
    uniqueness: float

    @property
    def may_not_be_unique(self) -> bool:
        """Tell whether the closure may have another solution here."""
        return self.uniqueness < 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """
    The distinct solutions that random starts led to, the most frequent first.

    points : one a solution; counts (k,) : how many starts led to each; starts : all of them;
    failed : those that did not converge.
    """

    points: tuple[Point, ...]
    counts: tuple[int, ...]
    starts: int
    failed: int


@dataclass(frozen=True, slots=True)
class Stall:
    """
    Where the lift of a polar is greatest: alpha [rad], CL [-].

    airspeed : at which that lift carries the weight, in level flight at 1 g, power off [m/s].
    """

    alpha: float
    lift: float
    airspeed: float


def stall(aircraft: Aircraft, alphas: Sequence[float], lifts: Sequence[float],
          density: float) -> Stall | None:
    """
    Return the stall of a polar from its angles (n,) [rad] and CL (n,), None if it has none.

    Lift that is greatest at an end of the polar has not been seen to fall. density [kg/m^3].
    """
    if not len(lifts):
        return None
    most = int(np.argmax(lifts))
    alpha, lift = float(alphas[most]), float(lifts[most])
    if not (lift > 0.0 and min(alphas) < alpha < max(alphas)):
        return None
    return Stall(alpha, lift, level_airspeed(
        aircraft.mass.mass, aircraft.reference.area, density, lift))


def onset(model: Model, condition: Condition, airspeed: float) -> Onset:
    """Return the onset of a condition at an airspeed [m/s]."""
    reference = model.aircraft.reference
    length = np.array([reference.span, reference.chord, reference.span])
    rates_B = 2.0 * airspeed * condition.rates / length
    velocity_B = velocity_from_flow_angles(airspeed, condition.alpha, condition.beta)
    return Onset(body_to_geometry(-velocity_B), body_to_geometry(rates_B))


def coefficients(model: Model, aero: AeroResult, alpha: float, pressure: float) -> Coefficients:
    """Return the coefficients of loads at a dynamic pressure [Pa]."""
    reference = model.aircraft.reference
    force, moment = geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)
    drag, side, lift = body_to_stability(force, alpha) / (pressure * reference.area)
    roll, pitch, yaw = moment / (pressure * reference.area)
    return Coefficients(
        CL=-float(lift), CD=-float(drag), CY=float(side), Cl=float(roll / reference.span),
        Cm=float(pitch / reference.chord), Cn=float(yaw / reference.span))


def surface_lift(model: Model, cl: FloatArray, surface: str) -> float:
    """
    Return the lift coefficient of one surface on its own area, from its strips' cl (n,).

    A strip's cl is made with the flow across its span: sweep takes cos^2 of it.
    """
    lattice = model.lattice
    strips, = (grid.strips for grid in lattice.grids if grid.name == surface)
    area = lattice.strip_chord[strips] * lattice.strip_width[strips]
    across = lattice.chord_axis[strips, 0] ** 2
    return float(np.sum(cl[strips] * across * area) / np.sum(area))


def point(model: Model, condition: Condition, *, airspeed: float, density: float,
          delta0: FloatArray | None = None) -> Point:
    """
    Return the loads at one condition, at an airspeed [m/s] and in air of a density [kg/m^3].

    delta0 (n,) : where the decambering starts if the settings say Start.GIVEN.
    """
    flow, deflections = onset(model, condition, airspeed), _deflections(model, condition)
    aero = solver.steady(model, flow, deflections, density=density, delta0=delta0)
    uniqueness = math.nan
    if model.settings.decambering and aero.status is not Status.DIVERGED:
        problem = operating.steady_problem(model, flow, deflections)
        uniqueness = operating.uniqueness(model, problem, aero.strips.delta)
    pressure = 0.5 * density * airspeed ** 2
    induced = far_field.induced_drag(
        model.lattice, aero.circulation[model.lattice.te_panel],
        operating.steady_wake(model, flow), density)
    return Point(condition, coefficients(model, aero, condition.alpha, pressure), aero,
                 induced / (pressure * model.aircraft.reference.area), uniqueness)


def _deflections(model: Model, condition: Condition) -> FloatArray:
    if condition.deflections.size:
        return condition.deflections
    return np.zeros(len(model.aircraft.controls))


def sweep(model: Model, conditions: Iterable[Condition], *, airspeed: float, density: float,
          starts: Sequence[FloatArray] | None = None) -> Iterator[Point]:
    """
    Yield the point at each condition, each from the decambering of the one before.

    starts : a decambering (n,) for each condition instead. Settings that do not say Start.GIVEN
    take neither.
    """
    delta0 = None
    for i, condition in enumerate(conditions):
        found = point(model, condition, airspeed=airspeed, density=density,
                      delta0=delta0 if starts is None else starts[i])
        if found.aero.status is not Status.DIVERGED:
            delta0 = found.aero.strips.delta
        yield found


def up_and_down(model: Model, conditions: Sequence[Condition], *, airspeed: float,
                density: float) -> Iterator[Point]:
    """
    Yield the points up to the last condition and back to the first, 2 n - 1 of them.

    Where the way back differs there is hysteresis: more than one solution, and memory.
    """
    conditions = tuple(conditions)
    yield from sweep(model, (*conditions, *conditions[-2::-1]), airspeed=airspeed,
                     density=density)


def distinct_solutions(model: Model, condition: Condition, *, starts: int,
                       generator: np.random.Generator, airspeed: float,
                       density: float) -> Solutions:
    """
    Return the solutions that the closure has at one condition, as far as random starts find them.

    Each start draws the decambering of every strip on its own. What is counted is a lower bound:
    a rare solution may be missed; a state and its mirror image are two.
    """
    model = replace(model, settings=replace(model.settings, start=Start.GIVEN))
    problem = operating.steady_problem(
        model, onset(model, condition, airspeed), _deflections(model, condition))
    found: list[FloatArray] = []
    counts: list[int] = []
    failed = 0
    for _ in range(starts):
        delta0 = generator.uniform(START_LOW, START_HIGH, model.lattice.strips)
        end = operating.decamber(
            model, problem.boundary, problem.operator, delta0, operating.NO_PATH)
        if not np.abs(end.residual).max() <= model.settings.tolerance:
            failed += 1
            continue
        known = [np.abs(wrap(end.delta - delta)).max() < APART for delta in found]
        if any(known):
            counts[known.index(True)] += 1
        else:
            found.append(end.delta)
            counts.append(1)
    order = sorted(range(len(found)), key=lambda k: -counts[k])
    return Solutions(
        tuple(point(model, condition, airspeed=airspeed, density=density, delta0=found[k])
              for k in order),
        tuple(counts[k] for k in order), starts, failed)

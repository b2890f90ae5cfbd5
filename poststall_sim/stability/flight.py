# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Modes of trimmed flight along the angle of attack, past the stall."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from poststall_sim import simulation
from poststall_sim import trim as trims
from poststall_sim.aero import solver
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import Air
from poststall_sim.frames import FloatArray
from poststall_sim.polar import APART
from poststall_sim.stability import bodies, derivatives, linear, modes, motion
from poststall_sim.stability.modes import Mode
from poststall_sim.stability.motion import Decambering, System
from poststall_sim.state import Status
from poststall_sim.trim import Trim

SHORTEST = 0.1
"""Least step, as a share of the time in which the aircraft flies a panel's length."""
OWN = 0.1
"""A mode in which the body has less of a share is one of the wake, and left out."""
RIGID = len(bodies.STATES)
"""States of the airframe; shafts come after them."""


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """
    A trimmed flight and its linear systems, one for each kind of decambering asked for.

    condition : of the closure's Jacobian, see `linear.LinearFlow`; status and message say whether
    the systems are there, and why not.
    """

    trim: Trim
    systems: dict[Decambering, System]
    condition: float
    status: Status
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class FlightModes:
    """
    The modes of a trimmed flight, by name and the classical ones first.

    model : a kind of `Decambering`, or QUASI_STEADY; shares (k,) : the body's in each mode, 0 to
    1, see `motion.Spectrum`; residual : the greatest of the eigenvalues; departed : the branch
    of the trim before has ended on the way here, at a fold, and these modes are another branch's;
    dt [s] and rows of wake of the linear system, if there is one.
    """

    trim: Trim
    model: str
    modes: tuple[Mode, ...]
    shares: FloatArray
    residual: float
    status: Status
    message: str
    departed: bool = False
    dt: float | None = None
    rows: int | None = None


QUASI_STEADY = 'quasi-steady'
"""The name of the model without a wake, from derivatives of steady loads."""


def linearise(model: Model, trim: Trim, *, altitude: float,
              decamberings: Iterable[Decambering], dt: float | None = None,
              rows: int | None = None) -> Linearised:
    """
    Return the linear systems about a straight trim, whose slipstreams stay as they are in it.

    altitude [m]; dt [s], by default the flight's own; rows : of wake, by default as many as the
    flight has. What the trim lacks in balance is left out, and so is what a change of airspeed
    does to the sections by their Reynolds number. Raises `ConfigError` where there is no
    lattice flow, see `linear.linearise`.
    """
    if trim.status is not Status.CONVERGED:
        return Linearised(trim, {}, math.nan, trim.status, trim.message)
    panel = simulation.automatic_dt_ns(model, trim.airspeed) * 1e-9
    dt = panel if dt is None else dt
    if not SHORTEST * panel <= dt <= 2.0 * panel:
        raise ConfigError(f'dt must be {SHORTEST:g} to 2 times {panel:g} s, the way of a panel at '
                          f'{trim.airspeed:.1f} m/s, got {dt:g} s')
    air = model.atmosphere.at(altitude)
    onset = trims.onset_of(model, trim, air.density)
    flow = linear.linearise(_flown(model, trim, air), onset,
                            trim.controls.deflections, trim.aero,
                            density=air.density, dt=dt, rows=rows)
    if flow.at_fold:
        return Linearised(trim, {}, flow.condition, Status.NOT_CONVERGED,
                          f'at a fold of the decambering, condition {flow.condition:.1e}: there '
                          'is no derivative, the flow departs')
    body = _body(model, trim, altitude)
    return Linearised(
        trim, {each: motion.assemble(flow, body, model.aircraft.control_names, each,
                                     model.settings.lag) for each in decamberings},
        flow.condition, Status.CONVERGED, 'linearised')


def _flown(model: Model, trim: Trim, air: Air) -> Model:
    return model.at(trim.airspeed, air.kinematic_viscosity, trim.controls.deflections)


def _body(model: Model, trim: Trim, altitude: float) -> bodies.Body:
    return bodies.free_body(
        model.aircraft, velocity_B=trim.velocity_B, pitch=trim.pitch, bank=trim.bank,
        throttle=trim.controls.throttle, density=model.atmosphere.at(altitude).density)


def flight_modes(model: Model, system: System, trim: Trim, decambering: Decambering,
                 branches: Sequence[Mode] = (), count: int = 24,
                 ) -> tuple[FlightModes, tuple[Mode, ...]]:
    """
    Return the modes of a linear system, and the quasi-steady ones they are named after.

    Of an aircraft so light that its quick modes die away as fast as the wake, the lattice has
    no one eigenvalue for them. The same body in quasi-steady air has, and the modes of the lattice
    take their names from those they are most like; what is left over is `wake 1`, `wake 2`, by
    the body's share. branches : the quasi-steady modes at the trim
    before, whose names these continue; count : see `motion.spectrum`.
    """
    found = motion.spectrum(system, count)
    # Far above 1 in two modes of the wake that all but coincide: their parts are opposite.
    shares = np.minimum(found.participation, 1.0 / np.maximum(found.participation, OWN))
    own = shares >= OWN
    shares, values = shares[own], found.eigenvalues[own]
    matrix = motion.quasi_steady(system)
    plain = _classify(model, trim, *_eigen(matrix))
    if branches:
        plain = tuple(modes.track(branches, plain))

    def share(mode: Mode) -> float:
        return float(shares[np.argmin(np.abs(values - mode.eigenvalue))])

    lattice = _classify(model, trim, values, found.vectors[:RIGID, own], shares)
    named = _named_after(plain, lattice, 1.0 - np.array([share(mode) for mode in lattice]))
    wake = sorted(named[len(plain):], key=lambda mode: -share(mode))
    named[len(plain):] = [replace(mode, name=f'wake {i}') for i, mode in enumerate(wake, 1)]
    return FlightModes(
        trim, decambering.value, tuple(named), np.array([share(mode) for mode in named]),
        float(found.residual[own].max()), Status.CONVERGED, 'found', dt=system.flow.dt,
        rows=len(system.flow.wake)), plain


def _named_after(patterns: Sequence[Mode], current: Sequence[Mode],
                doubt: FloatArray) -> list[Mode]:
    """
    Return modes under the names of those they are most like, and those left over by their own.

    One to one, with the least sum of the distance that `modes.track` has and of what is said
    against each of the current ones, doubt (k,) from 0 to 1. Those of the patterns come first.
    """
    cost = np.array([[modes.unlike(next(modes.slots(a)), next(modes.slots(b))) for b in current]
                     for a in patterns]).reshape(len(patterns), len(current)) + doubt
    matched = dict(zip(*linear_sum_assignment(cost)))
    rest = [mode for i, mode in enumerate(current) if i not in matched.values()]
    return [replace(current[i], name=patterns[a].name) for a, i in matched.items()] + rest


def quasi_steady_modes(model: Model, trim: Trim, *, altitude: float) -> FlightModes:
    """Return the modes of the classical equations with derivatives of steady loads."""
    air = model.atmosphere.at(altitude)
    found = derivatives.quasi_steady(
        _flown(model, trim, air), trim, density=air.density)
    if found.status is not Status.CONVERGED:
        return FlightModes(trim, QUASI_STEADY, (), np.zeros(0), math.nan, found.status,
                           found.message)
    matrix = derivatives.state_matrix(_body(model, trim, altitude), found.motion)
    values, vectors = np.linalg.eig(matrix)
    error = np.linalg.norm(matrix @ vectors - vectors * values, axis=0)
    named = _classify(model, trim, *_eigen(matrix))
    return FlightModes(trim, QUASI_STEADY, named, np.ones(len(named)),
                       float(error.max() / np.linalg.norm(matrix)), Status.CONVERGED, 'found')


def _eigen(matrix: FloatArray) -> tuple[np.ndarray, np.ndarray, FloatArray]:
    """Return eigenvalues, the airframe's part of the eigenvectors, and its share in each."""
    values, vectors = np.linalg.eig(matrix)
    shares = np.ones(len(values))
    if len(values) > RIGID:   # shafts
        factors = np.abs(np.linalg.pinv(vectors).T * vectors)
        shares = factors[:RIGID].sum(axis=0) / factors.sum(axis=0)
    return values, vectors[:RIGID], shares


def _classify(model: Model, trim: Trim, eigenvalues: np.ndarray, vectors: np.ndarray,
              shares: FloatArray) -> tuple[Mode, ...]:
    reference = model.aircraft.reference
    return modes.classify(
        eigenvalues, vectors, airspeed=trim.airspeed, span=reference.span, chord=reference.chord,
        participation=shares)


def trims_along(model: Model, alphas: Iterable[float], *, altitude: float,
                climb_angle: float | None = None) -> Iterator[Trim]:
    """
    Yield the trim at each angle of attack [rad], each on the branch of the one before.

    climb_angle [rad] : powered along it; None, a glide.
    """
    delta0 = None
    for alpha in alphas:
        trim = trims.glide(model, alpha=alpha, altitude=altitude, delta0=delta0) \
            if climb_angle is None else trims.powered(
                model, alpha=alpha, altitude=altitude, climb_angle=climb_angle, delta0=delta0)
        if trim.status is Status.CONVERGED:
            delta0 = trim.aero.strips.delta
        yield trim


def modes_along(model: Model, flown: Iterable[Trim], *, altitude: float,
                decamberings: tuple[Decambering, ...], quasi_steady: bool = False,
                dt: float | None = None, rows: int | None = None,
                ) -> Iterator[tuple[FlightModes, ...]]:
    """
    Yield the modes of each trim by each model, under the names of the branches they continue.

    Where a flow cannot be linearised the modes are none and the message says why; the names go on
    from the last that could. A fold is looked for by going back from each trim to the one before.
    """
    branches: dict[str, tuple[Mode, ...]] = {}
    before: Trim | None = None
    for trim in flown:
        departed = False
        if trim.status is Status.CONVERGED:
            departed = before is not None and _departed(model, before, trim, altitude)
            before = trim
        at = linearise(model, trim, altitude=altitude, decamberings=decamberings, dt=dt, rows=rows)
        found = []
        for each in decamberings:
            if at.systems:
                one, branches[each.value] = flight_modes(
                    model, at.systems[each], trim, each, branches.get(each.value, ()))
            else:
                one = FlightModes(trim, each.value, (), np.zeros(0), math.nan, at.status,
                                  at.message)
            found.append(one)
        if quasi_steady:
            one = quasi_steady_modes(model, trim, altitude=altitude)
            if one.modes:
                named = modes.track(branches.get(QUASI_STEADY, one.modes), one.modes)
                one = replace(one, modes=tuple(named))
                branches[QUASI_STEADY] = one.modes
            found.append(one)
        if departed:
            found = [replace(each, departed=True, message=f'{each.message}; the branch before '
                             'has ended at a fold') for each in found]
        yield tuple(found)


def _departed(model: Model, before: Trim, trim: Trim, altitude: float) -> bool:
    """Tell whether the decambering on the way back is not that of the trim before."""
    air = model.atmosphere.at(altitude)
    back = solver.steady(
        _flown(model, before, air),
        trims.onset_of(model, before, air.density),
        before.controls.deflections, density=air.density,
        delta0=trim.aero.strips.delta)
    return bool(np.abs(back.strips.delta - before.aero.strips.delta).max() > APART)

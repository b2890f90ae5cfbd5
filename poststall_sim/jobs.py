# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The jobs of the command line: polars and flights as plain results.

What is returned is what ``--json`` writes: dicts of numbers, angles in degrees, the unit in
every key that has one. Lift and drag are in stability axes, side force and moments in body axes
about the centre of gravity (roll right, nose up, nose right positive).
"""

import json
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import envelope, failure_reader, failures, flight_file, survey, topics
from poststall_sim import polar as polars
from poststall_sim.aero.model import Model
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.failures import Failure
from poststall_sim.frames import (
    FloatArray,
    body_to_stability,
    euler_from_quaternion,
    rotation,
)
from poststall_sim.polar import Condition, Stall
from poststall_sim.scenario import Scenario
from poststall_sim.simulation import Flight
from poststall_sim.state import Controls, Snapshot, Status

AXES = 'CL, CD: stability axes; CY, Cl, Cm, Cn: body axes, moments about the centre of gravity'

STRIP_AXES = 'y_m to the left as in base_link; alpha_deg where the section works'
COEFFICIENTS = ('CL', 'CD', 'CY', 'Cl', 'Cm', 'Cn')

Result = dict[str, Any]


class NoResultError(RuntimeError):
    """The input is good, but there is no solution: not trimmed, not converged, diverged."""


def deflections(aircraft: Aircraft, by_name: Mapping[str, float]) -> FloatArray:
    """Return deflections [rad] in the aircraft's order; unknown names and limits are refused."""
    controls = {control.name: control for control in aircraft.controls}
    for name, value in by_name.items():
        if name not in controls:
            raise ConfigError(f'{aircraft.name} has no control {name!r}, it has '
                              f'{", ".join(controls) or "none"}')
        if complaint := _beyond(name, controls[name].limits, value):
            raise ConfigError(complaint)
    return np.array([by_name.get(name, 0.0) for name in controls], dtype=float)


def _beyond(name: str, limits: tuple[float, float], value: float) -> str | None:
    """Return what is wrong with a deflection [rad] beyond its limits."""
    low, high = limits
    if low - 1e-12 <= value <= high + 1e-12:
        return None
    return (f'{name} goes from {math.degrees(low):g} to {math.degrees(high):g} deg, '
            f'got {math.degrees(value):g}')


def conditions(alphas: Sequence[float], *, beta: float, rates: Sequence[float],
               deflected: FloatArray) -> list[Condition]:
    """Return the conditions of a polar, angles in radians; rates : p b/2V, q c/2V, r b/2V."""
    return [Condition(alpha, beta, np.array(rates), deflected) for alpha in alphas]


def polar(model: Model, flown: Sequence[Condition], *, airspeed: float, altitude: float,
          up_and_down: bool = False, starts: Sequence[FloatArray] | None = None,
          random_starts: int = 0, seed: int = 0) -> Iterator[Result]:
    """
    Yield the steady loads at each condition; see `poststall_sim.polar` for what starts where.

    All with the same deflections. random_starts : besides, count the distinct solutions that so
    many lead to.
    """
    here = model.atmosphere.at(altitude)
    air = {'airspeed': airspeed, 'density': here.density}
    neutral = np.zeros(len(model.aircraft.controls))
    deflected = next((each.deflections for each in flown if each.deflections.size), neutral)
    model = model.at(airspeed, here.kinematic_viscosity, deflected)
    generator = np.random.default_rng(seed)
    points = polars.up_and_down(model, flown, **air) if up_and_down else \
        polars.sweep(model, flown, starts=starts, **air)
    for i, found in enumerate(points):
        row = _point(model, found)
        if up_and_down:
            row['way'] = 'up' if i < len(flown) else 'down'
        if random_starts:
            row['solutions'] = _solutions(polars.distinct_solutions(
                model, found.condition, starts=random_starts, generator=generator, **air))
        yield row


def stall(model: Model, points: Sequence[Result], *, altitude: float) -> Stall | None:
    """Return the stall of a polar from those of its points that converged; see `polar.stall`."""
    good = [each for each in points if each['status'] == Status.CONVERGED.name.lower()]
    return polars.stall(
        model.aircraft, [math.radians(each['alpha_deg']) for each in good],
        [each['CL'] for each in good], model.atmosphere.at(altitude).density)


def stalled(found: Stall) -> Result:
    """Return a stall as the JSON has it."""
    return {'alpha_deg': round(math.degrees(found.alpha), 10), 'CL': found.lift,
            'airspeed_m_s': found.airspeed}


def stall_words(found: Stall, model: Model, altitude: float) -> str:
    """Return a stall at an altitude [m] in words."""
    return (f'stall speed {found.airspeed:.3g} m/s: {model.aircraft.mass.mass:.4g} kg in level '
            f'flight at 1 g, power off, altitude {altitude:g} m; greatest CL {found.lift:.3f} at '
            f'alpha {math.degrees(found.alpha):.3g} deg')


def _point(model: Model, found: polars.Point) -> Result:
    condition, aero = found.condition, found.aero
    return {
        'alpha_deg': round(math.degrees(condition.alpha), 10),
        'beta_deg': round(math.degrees(condition.beta), 10), **asdict(found.coefficients),
        'CDi_far': found.induced_far, **solved(aero),
        'uniqueness': found.uniqueness if math.isfinite(found.uniqueness) else None,
        'flags': ['MAY_NOT_BE_UNIQUE'] if found.may_not_be_unique else [],
        'strips': strip_columns(model, aero)}


def _solutions(found: polars.Solutions) -> Result:
    lift = [each.coefficients.CL for each in found.points]
    return {'starts': found.starts, 'not_converged': found.failed, 'distinct': len(lift),
            'CL': lift, 'times_found': list(found.counts)}


def strip_columns(model: Model, aero: AeroResult) -> Result:
    """Return what the strips do, in the order of the topics; y to the left as in base_link."""
    lattice, strips = model.lattice, aero.strips
    return {
        'surface': [grid.name for grid in lattice.grids
                    for _ in range(grid.strips.start, grid.strips.stop)],
        'y_m': (-lattice.quarter_chord[:, 1]).tolist(),
        'alpha_deg': np.degrees(strips.alpha).tolist(), 'cl': strips.cl.tolist(),
        'delta_deg': np.degrees(strips.delta).tolist(), 'residual': strips.residual.tolist(),
        'stalled': strips.stalled.tolist()}


def given_starts(model: Model, flown: Sequence[Condition], path: Path) -> list[FloatArray]:
    """Return the decambering of an earlier run at the angle of attack nearest to each."""
    surfaces = [grid.name for grid in model.lattice.grids
                for _ in range(grid.strips.start, grid.strips.stop)]
    try:
        points = json.loads(path.read_text())['points']
        alphas = np.radians([float(each['alpha_deg']) for each in points])
        deltas = np.radians([each['strips']['delta_deg'] for each in points])
        fits = all(each['strips']['surface'] == surfaces for each in points) \
            and deltas.shape == (len(points), len(surfaces)) and np.isfinite(deltas).all()
    except (ValueError, TypeError, LookupError):
        raise ConfigError(f'{path} is not the JSON of a polar') from None
    if not (points and fits):
        raise ConfigError(f'{path} is of another lattice: it must have the strips of '
                          f'{model.aircraft.name}, {len(surfaces)} on '
                          f'{", ".join(grid.name for grid in model.lattice.grids)}')
    return [deltas[np.argmin(np.abs(alphas - each.alpha))] for each in flown]


def solved(aero: AeroResult) -> Result:
    """Return how the decambering of a flow was found."""
    return {'iterations': int(aero.iterations), 'status': aero.status.name.lower(),
            'max_residual': float(aero.max_residual),
            'stalled_strips': int(np.count_nonzero(aero.strips.stalled))}


class FlightLog:
    """A flight as it goes: totals of every step, and a time series at the rate of the state."""

    def __init__(self, flight: Flight) -> None:
        self._model = flight.model
        self._wing = flight.model.lattice.grids[survey.wing_of(flight.model)].strips
        self._schedule = topics.Schedule({})
        self._tally = topics.SolverTally()
        self._begin = time.perf_counter()
        self._deepest: Result = {'stalled_wing_strips': 0}
        self._depth = (0, 0.0)
        self._top = self._lost = 0.0
        self._outside: dict[str, Result] = {}
        self.series: dict[str, list[float]] = {}
        self.add(flight.snapshot)
        self._steps_before = self._tally.steps

    def add(self, snapshot: Snapshot) -> None:
        """Take note of a step."""
        self._tally.add(snapshot)
        self._top = max(self._top, snapshot.body.altitude)
        self._lost = max(self._lost, self._top - snapshot.body.altitude)
        stalled = int(np.count_nonzero(snapshot.strips.stalled[self._wing]))
        if stalled and (stalled, snapshot.alpha) > self._depth:
            self._depth = (stalled, snapshot.alpha)
            self._deepest = {'stalled_wing_strips': stalled, 'time_s': snapshot.time,
                             'alpha_deg': math.degrees(snapshot.alpha),
                             'CL': self._lift(snapshot)}
        for each in envelope.exceeded(snapshot, self._model):
            noted = self._outside.setdefault(each.quantity, {
                'from_s': snapshot.time, 'steps': 0, 'beyond': 0.0, 'worst': ''})
            noted['steps'] += 1
            if each.beyond > noted['beyond']:
                noted.update(beyond=each.beyond, worst=each.text)
        if any(topic.rate is topics.Rate.STATE for topic in
               self._schedule.due(snapshot.time_ns)):
            for key, value in self.row(snapshot).items():
                self.series.setdefault(key, []).append(value)

    def _lift(self, snapshot: Snapshot) -> float:
        pressure = 0.5 * snapshot.density * snapshot.airspeed ** 2
        lift = -float(body_to_stability(snapshot.force_B, snapshot.alpha)[2])
        return lift / max(pressure * self._model.aircraft.reference.area, 1e-9)

    def row(self, snapshot: Snapshot) -> dict[str, float]:
        """Return one instant of the time series."""
        body = snapshot.body
        roll, pitch, yaw = np.degrees(euler_from_quaternion(body.q_NB))
        p, q, r = np.degrees(body.rates_B)
        names = self._model.aircraft.control_names
        return {
            'time_s': snapshot.time, 'north_m': float(body.position_N[0]),
            'east_m': float(body.position_N[1]), 'altitude_m': body.altitude,
            'airspeed_m_s': float(snapshot.airspeed),
            'sink_rate_m_s': float((rotation(body.q_NB) @ body.velocity_B)[2]),
            'alpha_deg': math.degrees(snapshot.alpha), 'beta_deg': math.degrees(snapshot.beta),
            'roll_deg': float(roll), 'pitch_deg': float(pitch), 'yaw_deg': float(yaw),
            'roll_rate_deg_s': float(p), 'pitch_rate_deg_s': float(q), 'yaw_rate_deg_s': float(r),
            'load_factor': float(snapshot.load_factor), 'CL': self._lift(snapshot),
            **{f'{name}_deg': math.degrees(value)
               for name, value in zip(names, snapshot.controls.deflections)},
            **{f'{name}_commanded_deg': math.degrees(value)
               for name, value in zip(names, snapshot.commanded.deflections)},
            'throttle': float(snapshot.controls.throttle),
            'stalled_wing_strips': int(np.count_nonzero(snapshot.strips.stalled[self._wing])),
            'iterations': int(snapshot.iterations), 'residual': float(snapshot.max_residual),
            'not_converged_steps': self._tally.statuses[Status.NOT_CONVERGED]}

    def summary(self, flight: Flight) -> Result:
        """Return how the flight went."""
        tally, wall = self._tally, time.perf_counter() - self._begin
        steps = tally.steps - self._steps_before
        flown = steps * flight.dt_ns * 1e-9
        return {
            'flown_s': flown, 'steps': steps, 'dt_s': flight.dt_ns * 1e-9, 'wall_time_s': wall,
            'real_time_factor': flown / max(wall, 1e-9),
            'iterations_mean': tally.iterations_sum / max(tally.steps, 1),
            'iterations_max': tally.iterations_max, 'residual_max': float(tally.residual_max),
            'not_converged_steps': tally.statuses[Status.NOT_CONVERGED],
            'wing_strips': self._wing.stop - self._wing.start, 'deepest_stall': self._deepest,
            'stalled_strips_at_end': int(np.count_nonzero(flight.snapshot.strips.stalled)),
            'altitude_lost_m': self._lost, 'failed': failure_reader.words(flight.failures),
            'outside_the_method': [{'quantity': name, **noted}
                                   for name, noted in self._outside.items()],
            'ended_early': flight.paused_reason}


def fitted(aircraft: Aircraft, scenario: Scenario) -> Scenario:
    """Return a scenario as an aircraft flies it: one without engines leaves out the throttle."""
    return scenario if aircraft.engines else scenario.without(topics.THROTTLE)


def require_controls(aircraft: Aircraft, scenario: Scenario) -> None:
    """Refuse a scenario that moves what the aircraft does not have, too far or after the end."""
    limits = {each.name: each.limits for each in aircraft.controls}
    names = (*limits, *([topics.THROTTLE] if aircraft.engines else []))
    unknown = [each.control for each in scenario.channels if each.control not in names]
    if unknown:
        raise ConfigError(f'scenario {scenario.name} moves {", ".join(unknown)}: '
                          f'{aircraft.name} has {", ".join(names) or "no controls"}')
    for channel in scenario.channels:
        name, last = channel.control, channel.points[-1][0]
        if last > scenario.duration:
            raise ConfigError(f'scenario {scenario.name}: {name} has a point at {last:g} s, the '
                              f'scenario ends at {scenario.duration:g} s')
        if channel.relative or name not in limits:   # the definition knows those of the throttle
            continue
        for _, value in channel.points:
            if complaint := _beyond(name, limits[name], value):
                raise ConfigError(f'scenario {scenario.name}: {complaint}')
    for fault in scenario.faults:
        try:
            failures.of_parts(aircraft, scenario.failures(fault.time))
        except ConfigError as error:
            raise ConfigError(f'scenario {scenario.name}: {error}') from None


def resumed(model: Model, path: Path, duration: float) -> Flight:
    """Return the flight saved in a file, which must have some of its duration [s] left."""
    flight = flight_file.load_state(model, path)
    if flight.paused_reason:
        raise ConfigError(f'{path}: the flight has ended, {flight.paused_reason}')
    if flight.snapshot.time >= duration:
        raise ConfigError(f'{path}: saved at {flight.snapshot.time:g} s, the flight ends at '
                          f'{duration:g} s: give --duration')
    return flight


def fly(flight: Flight, scenario: Scenario, duration: float,
        recorder: Any = None) -> Iterator[Snapshot]:
    """
    Fly a scenario as fast as the machine can and yield each step.

    recorder : a `recording.FlightRecorder` that is told of each step, or None. Ends after
    duration [s], or where the flight does: ``flight.paused_reason`` says why.
    """
    layout = topics.layout(flight)
    trim = topics.command_values(flight.trim, layout)
    failed: dict[str, Failure] = {}
    while flight.snapshot.time_ns < round(duration * 1e9) and flight.paused_reason is None:
        # The controls of a step are those at its end.
        commands = scenario.commands((flight.snapshot.time_ns + flight.dt_ns) * 1e-9, trim)
        told = trim | commands
        if failed != (failed := scenario.failures(flight.snapshot.time)):
            flight.failures = failed
        before = flight.snapshot
        snapshot = flight.step(Controls(
            np.array([told[name] for name in layout.control_names]),
            told.get(topics.THROTTLE, 0.0)))
        if snapshot is not before:
            if recorder is not None:
                recorder.add(snapshot, commands)
            yield snapshot

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Steady flights as plain results: along airspeed or angle of attack, and all that there are.

Each comes as it was found and as what ``--json`` writes; see `jobs`.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, replace

import numpy as np

from poststall_sim import failure_reader, failures, jobs, manoeuvre, turning
from poststall_sim import polar as polars
from poststall_sim import trim as trims
from poststall_sim.aero.model import Model
from poststall_sim.frames import GRAVITY
from poststall_sim.jobs import Result
from poststall_sim.manoeuvre import Task
from poststall_sim.stability import flight
from poststall_sim.state import Status
from poststall_sim.trim import Trim

Found = tuple[Trim, Result]
SEARCHED = np.radians(np.arange(-8.0, 61.0, 2.0))
"""Angles of attack along which the branches of trims are followed [rad]."""


def explained(message: str) -> str:
    """Return why there is no trim at an airspeed, with what to think of where it is unclear."""
    unclear = 'no balance found' in message
    return message + ('; too slow or too fast?' if unclear else '')


def straight_trims(model: Model, airspeeds: Sequence[float], *, altitude: float,
                   climb_angle: float, failed: frozenset[str] = trims.ALL_WORK,
                   ) -> Iterator[Found]:
    """
    Yield the trim at each airspeed [m/s], each searched from the angle of the one before.

    Without an engine that works they are glides, and climb_angle [rad] is found instead of given;
    failed : names of those that do not.
    """
    alpha0 = math.radians(4.0)
    for airspeed in airspeeds:
        found = trims.straight(model, airspeed=airspeed, altitude=altitude,
                               climb_angle=climb_angle, alpha0=alpha0, failed=failed)
        if found.status is Status.CONVERGED:
            alpha0 = found.alpha
        else:
            found = _nearest(model, found, climb_angle, altitude, failed)
        row = trim_result(model, found, _kind(model, failed), altitude)
        yield found, {**row, 'message': explained(row['message'])}


def _nearest(model: Model, missed: Trim, climb_angle: float, altitude: float,
             failed: frozenset[str]) -> Trim:
    """Return the flight nearest to a trim that the controls do not reach, within their limits."""
    powered = _kind(model, failed) == 'powered'
    found = manoeuvre.steady(model, Task(
        airspeed=missed.airspeed, climb_angle=climb_angle if powered else None,
        throttle=None if powered else 0.0, failed=failed), altitude=altitude)
    if found.status is Status.CONVERGED:
        return found
    return replace(found, message=f'{missed.message}; within the limits {found.message}')


def _kind(model: Model, failed: frozenset[str] = trims.ALL_WORK) -> str:
    return 'powered' if set(model.aircraft.engine_names) - failed else 'glide'


def along_alpha(model: Model, alphas: Sequence[float], *, altitude: float,
                climb_angle: float | None = None) -> Iterator[Found]:
    """Yield the glide at each alpha [rad], or the flight along a climb angle."""
    for found in flight.trims_along(model, alphas, altitude=altitude, climb_angle=climb_angle):
        kind = 'glide' if climb_angle is None else 'at alpha'
        yield found, trim_result(model, found, kind, altitude)


def manoeuvres(model: Model, tasks: Iterable[Task], *, altitude: float) -> Iterator[Found]:
    """Yield the steady flight of each task, each searched from the one before."""
    before = None
    for task in tasks:
        found = turning.steady(model, task, altitude=altitude, start=before)
        if before is not None and found.status is not Status.CONVERGED:
            found = turning.steady(model, task, altitude=altitude)
        before = found if found.status is Status.CONVERGED else None
        row = trim_result(model, found, 'steady', altitude)
        parts = failures.of_parts(model.aircraft, task.failures)
        dead = failures.dead(model.aircraft, parts)
        yield found, {
            **row, 'message': row['message'] + _advice(task, found, dead),
            'failed': failure_reader.words(task.failures),
            'failed_parts': {f'{part.name}_deg': math.degrees(angle) for part, gone, angle in
                             zip(model.aircraft.movables, parts, found.angles) if gone}}


def _advice(task: Task, missed: Trim, dead: Sequence[str]) -> str:
    """Return what to try where a stuck elevator does not fly what is asked for."""
    stuck = trims.PITCH_CONTROL in (*task.held, *dead) and missed.status is not Status.CONVERGED
    if not stuck or (task.airspeed is None and task.alpha is None):
        return ''
    return ('; with a stuck elevator flight along a line has hardly more than one airspeed and '
            'one angle of attack: leave both open to find them, or bank')


def pulling(task: Task, load_factor: float) -> Task:
    """Return the task at the lowest point of a pull-up with a load factor; it has an airspeed."""
    excess = load_factor - math.cos(task.climb_angle or 0.0)
    return replace(task, pull_rate=excess * GRAVITY / task.airspeed)


def all_trims(model: Model, airspeed: float, *, altitude: float, climb_angle: float,
              told: Callable[[], None]) -> Iterator[Found]:
    """Yield all straight trims at an airspeed [m/s]; see `manoeuvre.branches`."""
    for found in manoeuvre.branches(model, airspeed=airspeed, altitude=altitude, alphas=SEARCHED,
                                    climb_angle=climb_angle, told=told):
        yield found, trim_result(model, found, _kind(model), altitude)


def trim_result(model: Model, found: Trim, kind: str, altitude: float) -> Result:
    """Return a trim; kind : `powered` or `glide` if it is straight, else `steady`."""
    density = model.atmosphere.at(altitude).density
    controls = {f'{name}_deg': math.degrees(value) for name, value in
                zip(model.aircraft.control_names, found.controls.deflections)}
    return {'kind': kind, 'trimmed': found.status is Status.CONVERGED, 'message': found.message,
            'airspeed_m_s': float(found.airspeed), 'alpha_deg': math.degrees(found.alpha),
            'elevator_deg': controls[f'{trims.PITCH_CONTROL}_deg'],
            'throttle': float(found.controls.throttle),
            'climb_angle_deg': math.degrees(found.climb_angle),
            'sink_rate_m_s': -float(found.airspeed) * math.sin(found.climb_angle),
            'beta_deg': math.degrees(found.beta), 'bank_deg': math.degrees(found.bank),
            'turn_rate_deg_s': math.degrees(found.turn_rate),
            'pull_rate_deg_s': math.degrees(found.pull_rate),
            'wake': 'of the turn' if found.turning else 'straight',
            'residual': float(np.abs(found.residual).max()),
            **asdict(polars.coefficients(
                model, found.aero, found.alpha, 0.5 * density * found.airspeed ** 2)),
            **jobs.solved(found.aero), 'controls': controls,
            'strips': jobs.strip_columns(model, found.aero)}

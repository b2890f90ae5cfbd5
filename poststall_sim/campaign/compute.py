# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A case computed: the same numbers wherever and whenever, whatever was computed before.

Models and trims that many cases share are kept, a few of them: to make them takes longer than a
short flight.
"""

import math
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from poststall_sim import jobs, modal_analysis, trim, trim_jobs
from poststall_sim import polar as polars
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import ConfigError
from poststall_sim.campaign import pilots, starting
from poststall_sim.campaign.case import Case, Flying, Initial, Outcome, Result, Steady
from poststall_sim.campaign.measures import Measures
from poststall_sim.failures import Failure
from poststall_sim.simulation import Flight
from poststall_sim.stability.modes import CLASSICAL, plain
from poststall_sim.stability.motion import Decambering
from poststall_sim.state import Status
from poststall_sim.trim import Trim

KEPT = 4
"""Models and trims a process keeps: what is kept longer is memory that grows."""
STEPS_BETWEEN = 16
"""So many steps are flown between two looks at the clock."""


@dataclass(slots=True)
class Kept:
    """The last few of what is dear to make."""

    items: OrderedDict = field(default_factory=OrderedDict)
    lock: Any = field(default_factory=threading.Lock)

    def get(self, key: Any, make: Callable[[], Any]) -> Any:
        """Return what is kept under a key, made where it is not."""
        with self.lock:   # a worker of a cluster may have several threads
            found = self.items.pop(key, None)
        found = make() if found is None else found
        with self.lock:
            self.items[key] = found
            while len(self.items) > KEPT:
                self.items.popitem(last=False)
        return found


_models, _trims = Kept(), Kept()


def compute(case: Case) -> Result:
    """
    Return what a case comes to.

    What is wrong with it, and no result, is a result too; only a user's own function may raise.
    """
    try:
        model = _models.get(case.model_key, lambda: _built(case))
        if isinstance(case.task, Flying):
            return _flown(model, case, case.task)
        found, complaint = _STEADY[case.task.kind](model, case.task)
    except ConfigError as error:
        return Result(Outcome.NO_RESULT, str(error), {})
    if complaint:
        return Result(Outcome.NO_RESULT, complaint, found)
    return Result(Outcome.DONE, '', found)


def _built(case: Case) -> Model:
    return models.build(case.aircraft, case.settings, case.atmosphere)


def warm(case: Case) -> None:
    """Compute a case, of a flight a few steps, so that all of it is compiled, on disk."""
    if not isinstance(case.task, Flying):
        compute(case)
        return
    try:
        flight = _started(_built(case), case.model_key, case.task)
    except ConfigError:
        return   # it becomes a row that says so
    for _ in range(3):
        flight.step(flight.trim)


def _trimmed(model: Model, key: str, initial: Initial) -> Trim:
    wanted = (key, initial.trim_airspeed, initial.altitude)
    return _trims.get(wanted, lambda: trim.straight(
        model, airspeed=initial.trim_airspeed, altitude=initial.altitude))


def _started(model: Model, key: str, task: Flying) -> Flight:
    initial = task.initial
    found = _trimmed(model, key, initial)
    if found.status is not Status.CONVERGED:
        raise ConfigError(f'no trim at {initial.trim_airspeed:g} m/s: '
                          + trim_jobs.explained(found.message))
    return starting.flight(model, found, task)


def _flown(model: Model, case: Case, task: Flying) -> Result:
    flight = _started(model, case.model_key, task)
    if flight.snapshot.status is Status.DIVERGED:
        return Result(Outcome.DIVERGED, 'the loads where it begins are not finite', {})
    command = pilots.commanding(flight, task, case.seed)
    measures, begun, end = Measures(flight, task), time.thread_time(), round(task.duration * 1e9)
    outcome, reason, steps = Outcome.DONE, '', 0
    failed: Mapping[str, Failure] = {}
    while flight.snapshot.time_ns < end:
        before = flight.snapshot
        if task.scenario is not None and \
                failed != (failed := task.scenario.failures(before.time)):
            flight.failures = failed
        snapshot = flight.step(command(before))
        steps += 1
        if snapshot is not before:
            measures.add(snapshot)
        if flight.paused_reason is not None:
            diverged = flight.paused_reason.startswith('diverged')
            outcome = Outcome.DIVERGED if diverged else Outcome.GROUND
            reason = flight.paused_reason
            break
        if stopped := measures.stopped:
            outcome, reason = Outcome.STOPPED, stopped
            break
        # Processor time: a machine that is busy with other things changes no row.
        if steps % STEPS_BETWEEN == 0 and time.thread_time() - begun > task.cpu_limit:
            outcome = Outcome.TIMED_OUT
            reason = f'took more than {task.cpu_limit:g} s of processor time'
            # How far it came depends on the machine: its numbers are no result.
            return Result(outcome, reason, {})
    return Result(outcome, reason, measures.quantities(), measures.history())


def _polar(model: Model, task: Steady) -> tuple[dict[str, Any], str]:
    deflected = jobs.deflections(model.aircraft, dict(task.deflections))
    at = polars.Condition(task.alpha, task.beta, np.array(task.rates), deflected)
    air = model.atmosphere.at(task.altitude)
    found = polars.point(model.at(task.airspeed, air.kinematic_viscosity, deflected), at,
                         airspeed=task.airspeed, density=air.density)
    numbers = {name: getattr(found.coefficients, name) for name in jobs.COEFFICIENTS}
    numbers |= jobs.solved(found.aero)
    converged = found.aero.status is Status.CONVERGED
    return numbers, '' if converged else found.aero.status.value


def _trim(model: Model, task: Steady) -> tuple[dict[str, Any], str]:
    if task.alpha is None:
        found = trim.straight(model, airspeed=task.airspeed, altitude=task.altitude,
                              climb_angle=task.climb_angle or 0.0)
    elif task.climb_angle is None:
        found = trim.glide(model, alpha=task.alpha, altitude=task.altitude)
    else:
        found = trim.powered(model, alpha=task.alpha, altitude=task.altitude,
                             climb_angle=task.climb_angle)
    numbers = trim_jobs.trim_result(model, found, 'steady', task.altitude)
    return numbers, '' if found.status is Status.CONVERGED else found.message


def _modes(model: Model, task: Steady) -> tuple[dict[str, Any], str]:
    [[point]] = modal_analysis.modes(
        model, [task.alpha], altitude=task.altitude, climb_angle=task.climb_angle,
        kinds=(Decambering.VARIABLE,))
    numbers: dict[str, Any] = {key: point['trim'][key] for key in ('airspeed_m_s', 'elevator_deg')}
    for mode in point['modes']:
        name = plain(mode['name']).replace(' ', '_').lower()
        if f'{name}_real' not in numbers:
            numbers |= {f'{name}_real': mode['real'], f'{name}_imag': mode['imag']}
    growth = [mode['real'] for mode in point['modes']]
    numbers['largest_growth'] = max(growth, default=math.nan)
    good = point['status'] == Status.CONVERGED.name.lower()
    return numbers, '' if good else point['message']


_STEADY = {'polar': _polar, 'trim': _trim, 'modes': _modes}

_SOLVED = ('iterations', 'max_residual', 'stalled_strips')
STEADY_QUANTITIES = {
    'polar': (*jobs.COEFFICIENTS, *_SOLVED),
    'trim': ('airspeed_m_s', 'alpha_deg', 'elevator_deg', 'throttle', 'climb_angle_deg',
             'sink_rate_m_s', 'residual', *jobs.COEFFICIENTS, *_SOLVED),
    'modes': ('airspeed_m_s', 'elevator_deg', 'largest_growth',
              *(f'{name.replace(" ", "_").lower()}_{part}' for name in CLASSICAL
                for part in ('real', 'imag')))}
"""Names of what may be kept of steady flight, by kind; real and imag [1/s]."""
WHOLE = ('iterations', 'stalled_strips')
"""Of those that are whole numbers."""

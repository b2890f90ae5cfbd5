# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Who flies a case: nobody, a scenario, the example law, or a function of the user's."""

import importlib
import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from poststall_sim import autopilot_law, topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.autopilot_law import Memory, Seen
from poststall_sim.campaign.case import Flying
from poststall_sim.frames import euler_from_quaternion
from poststall_sim.simulation import Flight
from poststall_sim.state import Controls, Snapshot

Pilot = Callable[[Snapshot], Mapping[str, float]]
"""What is commanded after a snapshot: deflections [rad] and throttle by name; the rest is trim."""


def imported(name: str) -> Callable[..., Pilot]:
    """Return the function that MODULE:FUNCTION names."""
    module, _, function = name.partition(':')
    try:
        found = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError, SyntaxError, NameError, TypeError,
            LookupError, OSError) as error:
        raise ConfigError(f'autopilot {name}: {error}') from None
    if not callable(found):
        raise ConfigError(f'autopilot {name}: expected a function, got {found!r}')
    return found


def source(name: str) -> Path:
    """Return the file of the module that MODULE:FUNCTION names."""
    imported(name)
    file = getattr(sys.modules[name.partition(':')[0]], '__file__', None)
    if file is None:
        raise ConfigError(f'autopilot {name}: its module has no file')
    return Path(file)


def commanding(flight: Flight, task: Flying, seed: int) -> Callable[[Snapshot], Controls]:
    """Return what commands the controls of a flight, step by step, from what is measured."""
    trim = topics.command_values(flight.trim, topics.layout(flight))
    pilot = _pilot(flight, task, seed, trim)
    names = flight.model.aircraft.control_names

    def command(snapshot: Snapshot) -> Controls:
        told = trim | dict(pilot(snapshot))
        return Controls(np.array([told[name] for name in names], dtype=float),
                        float(told.get(topics.THROTTLE, 0.0)))
    return command


def _pilot(flight: Flight, task: Flying, seed: int, trim: dict[str, float]) -> Pilot:
    dt = flight.dt_ns * 1e-9
    if task.scenario is not None:
        scenario = task.scenario
        # The controls of a step are those at its end; in whole nanoseconds, as `jobs.fly` has it.
        return lambda snapshot: scenario.commands(
            (snapshot.time_ns + flight.dt_ns) * 1e-9, trim)
    if task.law is not None:
        return _example(task.law, trim, dt)
    if task.autopilot is not None:
        return _checked(imported(task.autopilot)(trim=trim, dt=dt, seed=seed), trim)
    return lambda snapshot: {}


def _checked(pilot: Pilot, trim: Mapping[str, float]) -> Pilot:
    """Return a pilot of the user's that raises what it commands amiss."""
    known = {*trim, topics.THROTTLE}   # of an aircraft without engines it moves nothing

    def command(snapshot: Snapshot) -> Mapping[str, float]:
        told = pilot(snapshot)
        for name, value in told.items():
            if name not in known:
                raise ValueError(f'the autopilot commands {name!r}, there are {", ".join(trim)}')
            if not math.isfinite(value):
                raise ValueError(f'the autopilot commands {value} for {name}')
        return told
    return command


def _example(law: autopilot_law.Law, trim: dict[str, float], dt: float) -> Pilot:
    memory = Memory(**{name: trim.get(name, 0.0) for name in ('aileron', 'elevator', 'throttle')})

    def pilot(snapshot: Snapshot) -> dict[str, float]:
        nonlocal memory
        answer, memory = autopilot_law.answer(law, memory, seen(snapshot), dt)
        return {name: getattr(answer, name) for name in ('aileron', 'elevator', 'rudder',
                                                         'throttle') if name in trim}
    return pilot


def seen(snapshot: Snapshot) -> Seen:
    """Return what the example law sees of an instant, without errors."""
    roll, pitch, _ = euler_from_quaternion(snapshot.body.q_NB)
    p, q, r = snapshot.body.rates_B.tolist()
    return Seen(roll=float(roll), pitch=float(pitch), p=p, q=q, r=r,
                airspeed=float(snapshot.airspeed), alpha=float(snapshot.alpha),
                beta=float(snapshot.beta), stalled=float(np.mean(snapshot.strips.stalled)))

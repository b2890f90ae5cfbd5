# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
One case of a campaign, all that is needed to compute it, and the row that it becomes.

A case knows no file: it can be sent to another machine. Angles are in radians here; in rows, as
in all results, in degrees where the name says so.
"""

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from poststall_sim.aero.model import Settings
from poststall_sim.aircraft import Aircraft
from poststall_sim.atmosphere import Atmosphere
from poststall_sim.autopilot_law import Law
from poststall_sim.campaign.sampling import Value
from poststall_sim.frames import FloatArray
from poststall_sim.scenario import Scenario
from poststall_sim.weather import Weather


class Outcome(enum.Enum):
    """How a case ended; only the first two are results."""

    DONE = 'done'
    STOPPED = 'stopped'
    GROUND = 'ground'
    DIVERGED = 'diverged'
    NO_RESULT = 'no_result'
    TIMED_OUT = 'timed_out'
    ERROR = 'error'
    LOST = 'lost'


@dataclass(frozen=True, slots=True)
class Initial:
    """
    Where a flight begins: altitude [m], airspeed [m/s], the rest [rad, rad/s].

    trim_airspeed : of the straight trim that gives the controls, and whatever is None here.
    """

    trim_airspeed: float
    altitude: float
    airspeed: float
    alpha: float | None = None
    beta: float = 0.0
    roll: float = 0.0
    pitch: float | None = None
    heading: float = 0.0
    rates_B: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Recovered:
    """Within these for so long [s], a flight has recovered: |alpha|, |roll| [rad], rates."""

    alpha: float = math.radians(12.0)
    roll: float = math.radians(30.0)
    rate: float = math.radians(30.0)
    hold: float = 0.5


@dataclass(frozen=True, slots=True)
class Stop:
    """What ends a flight before its time; height_lost [m]."""

    recovered: bool = False
    spun: bool = False
    height_lost: float = math.inf


@dataclass(frozen=True, slots=True)
class Flying:
    """
    A flight: how it begins, who flies it, how long [s], in what air, and what is looked for.

    Of scenario, law and autopilot (`module:name`) at most one is there; with none the controls
    stay at trim. spin_alpha [rad] : turns are counted above it; history_every [s], None for no
    histories; cpu_limit : processor time [s].
    """

    initial: Initial
    duration: float
    weather: Weather
    dt: float | None
    scenario: Scenario | None
    law: Law | None
    autopilot: str | None
    recovered: Recovered
    spin_alpha: float
    stop: Stop
    history_every: float | None
    cpu_limit: float


@dataclass(frozen=True, slots=True)
class Steady:
    """
    A polar's point, a trim or its modes: flow angles, climb angle [rad], airspeed [m/s].

    For a trim, that of airspeed and alpha which is None is found; climb_angle None : a glide.
    """

    kind: str
    altitude: float
    airspeed: float | None = None
    alpha: float | None = None
    beta: float = 0.0
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0)
    deflections: tuple[tuple[str, float], ...] = ()
    climb_angle: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A case: its number and seed, what it was given by key path, and what that comes to."""

    index: int
    seed: int
    inputs: Mapping[str, Value]
    aircraft: Aircraft
    settings: Settings
    task: Flying | Steady
    quantities: tuple[str, ...]
    atmosphere: Atmosphere
    model_key: str


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """
    What a case came to: quantities by name (None: there is no such number), and why.

    history : (samples, columns), or None.
    """

    outcome: Outcome
    reason: str
    quantities: Mapping[str, Value | None]
    history: FloatArray | None = None


def row(case: Case, result: Result, versions: Mapping[str, str]) -> dict[str, Any]:
    """Return the row of a table: number, seed, inputs, status, quantities, versions."""
    return {'case': case.index, 'seed': case.seed, **case.inputs,
            'status': result.outcome.value, 'reason': result.reason,
            **{name: _plain(result.quantities.get(name)) for name in case.quantities},
            **versions}


def _plain(value: Any) -> Any:
    """Return a number as Python has it; what is not finite is no number."""
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value

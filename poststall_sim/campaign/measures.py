# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What is measured of a flight as it goes: named quantities, and a history."""

import copy
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from poststall_sim.campaign.case import Flying
from poststall_sim.frames import FloatArray, euler_from_quaternion, rotation
from poststall_sim.simulation import Flight
from poststall_sim.state import Snapshot, Status

COLUMNS = ('time_s', 'north_m', 'east_m', 'altitude_m', 'airspeed_m_s', 'alpha_deg', 'beta_deg',
           'roll_deg', 'pitch_deg', 'yaw_deg', 'roll_rate_deg_s', 'pitch_rate_deg_s',
           'yaw_rate_deg_s', 'load_factor', 'stalled_share', 'throttle')
"""Of every history; the deflections [deg] follow, named after their controls."""


def columns(control_names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the columns of a history of an aircraft with these controls."""
    return (*COLUMNS, *(f'{name}_deg' for name in control_names))


class Measures:
    """
    Totals of every step of one flight.

    A flight has recovered once alpha, roll and rates have been within their limits for a while:
    the time to recover is that at which this while begins. It has spun when it has turned by
    360 deg about the vertical without coming below the spin's angle of attack in between.
    """

    def __init__(self, flight: Flight, task: Flying) -> None:
        self._task, self._dt = task, flight.dt_ns * 1e-9
        first = flight.snapshot
        self._top = first.body.altitude
        self._peaks = dict.fromkeys(('alpha', 'beta', 'rate', 'load', 'stalled'), 0.0)
        self._least_airspeed = first.airspeed
        self._lost = self._turn = self._turned = self._residual = 0.0
        self._steps = self._not_converged = 0
        self._since: float | None = None
        self._recovered_at: float | None = None
        self._last = first
        self._samples: list[FloatArray] = []
        self._next = 0
        self._look(first)

    def add(self, snapshot: Snapshot) -> None:
        """Take note of a step."""
        self._steps += 1
        self._not_converged += snapshot.status is Status.NOT_CONVERGED
        self._residual = max(self._residual, float(snapshot.max_residual))
        vertical = float((rotation(snapshot.body.q_NB) @ snapshot.body.rates_B)[2])
        deep = abs(snapshot.alpha) > self._task.spin_alpha
        self._turn = self._turn + vertical * self._dt if deep else 0.0
        self._turned = max(self._turned, abs(self._turn))
        self._look(snapshot)

    def copy(self) -> 'Measures':
        """Return measures that go on from here by themselves."""
        other = copy.copy(self)
        other._peaks, other._samples = dict(self._peaks), list(self._samples)
        return other

    def _look(self, snapshot: Snapshot) -> None:
        self._last = snapshot
        rates = snapshot.body.rates_B
        for name, value in (('alpha', abs(snapshot.alpha)), ('beta', abs(snapshot.beta)),
                            ('rate', float(np.abs(rates).max())),
                            ('load', abs(snapshot.load_factor)),
                            ('stalled', float(np.mean(snapshot.strips.stalled)))):
            self._peaks[name] = max(self._peaks[name], value)
        self._least_airspeed = min(self._least_airspeed, snapshot.airspeed)
        self._top = max(self._top, snapshot.body.altitude)
        self._lost = max(self._lost, self._top - snapshot.body.altitude)
        if self._recovered_at is None:
            self._watch(snapshot, rates)
        every = self._task.history_every
        if every is not None and snapshot.time_ns >= self._next:
            self._samples.append(_sample(snapshot))
            self._next += round(every * 1e9)

    def _watch(self, snapshot: Snapshot, rates: FloatArray) -> None:
        wanted = self._task.recovered
        roll = float(euler_from_quaternion(snapshot.body.q_NB)[0])
        back = (abs(snapshot.alpha) < wanted.alpha and abs(roll) < wanted.roll
                and float(np.abs(rates).max()) < wanted.rate)
        if not back:
            self._since = None
        elif self._since is None:
            self._since = snapshot.time
        if self._since is not None and snapshot.time - self._since >= wanted.hold - 1e-9:
            self._recovered_at = self._since

    @property
    def recovered(self) -> bool:
        """Tell whether the flight has recovered."""
        return self._recovered_at is not None

    @property
    def height_lost(self) -> float:
        """The greatest height below the highest place before it [m]."""
        return self._lost

    @property
    def stopped(self) -> str | None:
        """What ends the flight, by the conditions of its task."""
        stop = self._task.stop
        if stop.recovered and self.recovered:
            return 'recovered'
        if stop.spun and self._turned >= 2.0 * math.pi:
            return 'spun'
        if self._lost > stop.height_lost:
            return f'lost more than {stop.height_lost:g} m'
        return None

    def quantities(self) -> dict[str, Any]:
        """Return all quantities by name."""
        return {name: value(self) for name, value in QUANTITIES.items()}

    def history(self) -> FloatArray | None:
        """Return the samples (n, columns), None where none were asked for."""
        return np.array(self._samples) if self._samples else None


QUANTITIES: dict[str, Callable[[Measures], Any]] = {
    'peak_alpha_deg': lambda m: math.degrees(m._peaks['alpha']),
    'peak_beta_deg': lambda m: math.degrees(m._peaks['beta']),
    'peak_rate_deg_s': lambda m: math.degrees(m._peaks['rate']),
    'peak_load_factor': lambda m: m._peaks['load'],
    'peak_stalled_share': lambda m: m._peaks['stalled'],
    'least_airspeed_m_s': lambda m: float(m._least_airspeed),
    'height_lost_m': lambda m: m.height_lost,
    'recovered': lambda m: m.recovered,
    'time_to_recover_s': lambda m: m._recovered_at,
    'spun': lambda m: m._turned >= 2.0 * math.pi,
    'stalled_turn_deg': lambda m: math.degrees(m._turned),
    'flown_s': lambda m: m._last.time,
    'steps': lambda m: m._steps,
    'not_converged_steps': lambda m: m._not_converged,
    'residual_max': lambda m: m._residual,
    'final_alpha_deg': lambda m: math.degrees(m._last.alpha),
    'final_roll_deg': lambda m: math.degrees(euler_from_quaternion(m._last.body.q_NB)[0]),
    'final_airspeed_m_s': lambda m: float(m._last.airspeed),
    'final_altitude_m': lambda m: m._last.body.altitude,
}
"""Names of what may be kept of a flight."""
KINDS = {'recovered': bool, 'spun': bool, 'steps': int, 'not_converged_steps': int}
"""Of those that are no real numbers."""


def _sample(snapshot: Snapshot) -> FloatArray:
    body = snapshot.body
    return np.array([
        snapshot.time, body.position_N[0], body.position_N[1], body.altitude, snapshot.airspeed,
        *np.degrees([snapshot.alpha, snapshot.beta, *euler_from_quaternion(body.q_NB),
                     *body.rates_B]),
        snapshot.load_factor, np.mean(snapshot.strips.stalled), snapshot.controls.throttle,
        *np.degrees(snapshot.controls.deflections)])

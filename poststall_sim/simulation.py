# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A flight: a model and its state, stepped, reset, put elsewhere, saved and resumed."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from poststall_sim import failures
from poststall_sim import trim as trims
from poststall_sim.aero import model as models
from poststall_sim.aero.model import DEFAULTS, Model, Settings
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.atmosphere import STANDARD, Atmosphere
from poststall_sim.coupling import (
    ALL_WORK,
    NO_WIND,
    FlightState,
    Gusts,
    air_velocity,
    begin,
    limited,
    step,
)
from poststall_sim.failures import Failure, Kind
from poststall_sim.frames import FloatArray, quaternion_from_euler, rotation
from poststall_sim.state import BodyState, Controls, Snapshot, Status
from poststall_sim.weather import CALM, Weather


@dataclass(frozen=True, slots=True, eq=False)
class SavedFlight:
    """
    A flight at one instant, all that `Flight.resumed` needs to go on from it.

    first : where and how fast through the air it began; delta0, turning : its decambering there,
    and whether its wake was that of a turn; began_ns, carried_N : see `Flight`; failed_engines
    (2, k) : 1 for those of `Flight.failed_engines` alone, and for those that are off by
    `Flight.failures`, else 0; failed_parts : see `failures.as_array`.
    """

    dt_ns: int
    atmosphere: Atmosphere
    weather: Weather
    began_ns: int
    carried_N: FloatArray
    trim: Controls
    first: BodyState
    delta0: FloatArray | None
    turning: bool
    failed_engines: FloatArray
    failed_parts: FloatArray
    state: FlightState
    snapshot: Snapshot
    paused_reason: str | None


class Flight:
    """
    A model in flight: the present state, and the one it can go back to.

    ``weather`` may be set at any time. ``gusts`` may be set to what the air has more than that,
    from place to place and time to time; it is not saved. ``failures`` by name of a part, a
    control or an engine, and ``failed_engines``, may be set at any time, and stay through a reset.
    ``carried_N`` [m] is how far the mean wind has gone where the aircraft is, ``began_ns`` the
    time when that was nothing. ``paused_reason`` is None, or says why the flight does not go on:
    ground contact (flat ground at altitude 0; there is no landing gear) or divergence, with the
    last good state kept.
    """

    def __init__(self, model: Model, body: BodyState, controls: Controls, *, dt_ns: int,
                 weather: Weather = CALM, delta0: FloatArray | None = None,
                 failed: frozenset[str] = ALL_WORK, turning: bool = False):
        """
        Start at a body state with controls, in the mean wind; see `begin`.

        turning : with the wake of a motion steady in the body's rates, for trims that have it.
        """
        self.model = model
        self.dt_ns = dt_ns
        self.trim = limited(model.aircraft, controls)
        self.weather = weather
        self.gusts: Gusts | None = None
        self.failures = {}
        self.failed_engines = failed
        # Through the air: a reset in another wind is as trimmed as the start was.
        self._first = replace(
            body, velocity_B=air_velocity(body, weather.mean_N(body.altitude)))
        self._delta0, self._turning = delta0, turning
        self.reset(time_ns=0)

    @property
    def wind_N(self) -> FloatArray:
        """The weather's wind (3,) [m/s], at its reference height if it is sheared."""
        return self.weather.wind_N

    @wind_N.setter
    def wind_N(self, wind_N: FloatArray) -> None:
        self.weather = replace(self.weather, wind_N=wind_N)

    @property
    def failed_engines(self) -> frozenset[str]:
        """Names of engines that do not work, their throttle is 0; set beside `failures`."""
        return self._failed_engines | failures.engines_off(self._failures)

    @failed_engines.setter
    def failed_engines(self, names: frozenset[str]) -> None:
        self.model.aircraft.require_engines(names)
        self._failed_engines = names

    @property
    def failures(self) -> Mapping[str, Failure]:
        """What has failed, by name; set all of it at once, unknown names are refused."""
        return MappingProxyType(dict(self._failures))

    @failures.setter
    def failures(self, by_name: Mapping[str, Failure]) -> None:
        self._failed_parts = failures.of_parts(self.model.aircraft, by_name)
        self._failures = dict(by_name)

    @property
    def _failed(self) -> dict:
        """What has failed, as `begin` and `step` are told."""
        return {'failed_engines': self.failed_engines, 'failed_parts': self._failed_parts}

    def reset(self, time_ns: int | None = None) -> Snapshot:
        """Go back to the first place and airspeed with a fresh wake; time goes on unless given."""
        first = self._first
        wind_N = self.weather.mean_N(first.altitude)
        body = replace(first, velocity_B=first.velocity_B + rotation(first.q_NB).T @ wind_N)
        self.paused_reason: str | None = None
        self.began_ns = self.snapshot.time_ns if time_ns is None else time_ns
        self.carried_N = NO_WIND
        self.state, self.snapshot = begin(
            self.model, body, self.trim, dt_ns=self.dt_ns, wind_N=wind_N, delta0=self._delta0,
            time_ns=self.began_ns, turning=self._turning, **self._failed)
        return self.snapshot

    def place(self, body: BodyState, controls: Controls, *,
              delta0: FloatArray | None = None) -> Snapshot:
        """
        Go on from another body state with a fresh wake; time stays.

        Raises `ConfigError`, with the flight as it was, where that or the loads there are not
        finite.
        """
        if not body.is_finite():
            raise ConfigError('a number of this state is not finite')
        state, snapshot = begin(
            self.model, body, controls, dt_ns=self.dt_ns, delta0=delta0,
            wind_N=self.weather.mean_N(body.altitude), charge=self.state.engines.charge,
            time_ns=self.snapshot.time_ns, **self._failed)
        if snapshot.status is Status.DIVERGED:
            raise ConfigError('the loads in this state are not finite')
        self.paused_reason = None
        self.state, self.snapshot = state, snapshot
        return snapshot

    def set_time(self, time_ns: int) -> None:
        """Call the present instant by another time [ns]; nothing else changes."""
        self.began_ns += time_ns - self.state.time_ns
        self.state = replace(self.state, time_ns=time_ns)
        self.snapshot = replace(self.snapshot, time_ns=time_ns)

    def saved(self) -> SavedFlight:
        """Return the flight as it is now."""
        flow = replace(self.state.flow, wake=self.state.flow.wake.alone())
        return SavedFlight(
            dt_ns=self.dt_ns, atmosphere=self.model.atmosphere, weather=self.weather,
            began_ns=self.began_ns, carried_N=self.carried_N, trim=self.trim, first=self._first,
            delta0=self._delta0, turning=self._turning,
            state=replace(self.state, flow=flow), snapshot=self.snapshot,
            paused_reason=self.paused_reason, failed_engines=np.array([
                [float(name in names) for name in self.model.aircraft.engine_names]
                for names in (self._failed_engines, failures.engines_off(self._failures))]),
            failed_parts=failures.as_array(self._failed_parts))

    @classmethod
    def resumed(cls, model: Model, saved: SavedFlight) -> 'Flight':
        """
        Return a flight that goes on from a saved instant with the model it was saved with.

        The air is the saved one.
        """
        first, weather = saved.first, saved.weather
        blown = first.velocity_B + rotation(first.q_NB).T @ weather.mean_N(first.altitude)
        failed, off = ([name for name, gone in zip(model.aircraft.engine_names, each) if gone]
                       for each in saved.failed_engines)
        flight = cls(replace(model, atmosphere=saved.atmosphere),
                     replace(first, velocity_B=blown), saved.trim, dt_ns=saved.dt_ns,
                     weather=weather, delta0=saved.delta0, turning=saved.turning,
                     failed=frozenset(failed))
        # To the bit: what was added to the velocity and taken from it again is not.
        flight._first = saved.first
        flight.began_ns, flight.carried_N = saved.began_ns, saved.carried_N
        flight.state, flight.snapshot = saved.state, saved.snapshot
        flight._failed_parts = failures.from_array(saved.failed_parts)
        flight._failures = failures.by_name(model.aircraft, flight._failed_parts) \
            | {name: Failure(Kind.OFF) for name in off}
        flight.paused_reason = saved.paused_reason
        return flight

    def step(self, controls: Controls) -> Snapshot:
        """Advance by one step and return what is measured; never raises."""
        if self.paused_reason is not None:
            return self.snapshot
        mean_N = self.weather.mean_N(self.state.body.altitude)
        carried_N = self.carried_N + 1e-9 * self.dt_ns * mean_N
        try:
            state, snapshot = step(
                self.model, self.state, controls, dt_ns=self.dt_ns, wind_N=mean_N,
                gusts=self._beyond(mean_N, carried_N), **self._failed)
        except np.linalg.LinAlgError:   # what was not finite has come as far as an inversion
            snapshot = replace(self.snapshot, status=Status.DIVERGED)
        if snapshot.status is Status.DIVERGED:
            self.paused_reason = (f'diverged after {self.state.time_ns * 1e-9:.3f} s: a value '
                                  'is not finite; the last good state is kept')
        else:
            self.state, self.snapshot, self.carried_N = state, snapshot, carried_N
            if state.body.altitude <= 0.0:
                speed = float(np.linalg.norm(state.body.velocity_B))
                self.paused_reason = (f'ground contact at {snapshot.time:.3f} s with '
                                      f'{speed:.1f} m/s; there is no landing gear')
        return self.snapshot

    def _beyond(self, mean_N: FloatArray, carried_N: FloatArray) -> Gusts | None:
        """Return what the air has more than the mean wind, None for nothing."""
        weather, began, more = self.weather, 1e-9 * self.began_ns, self.gusts
        if weather.uniform:
            return more

        def gusts(time: float, points_N: FloatArray) -> FloatArray:
            velocity = weather.beyond_N(time - began, points_N, carried_N, mean_N)
            return velocity if more is None else velocity + more(time, points_N)
        return gusts


def automatic_dt_ns(model: Model, airspeed: float) -> int:
    """
    Return the step [ns]: the reference chord's panel over the airspeed, in whole milliseconds.

    Rounded down, so that a wake row is no longer than a panel of the wing.
    """
    panel = model.aircraft.reference.chord / model.settings.chordwise
    return max(1, math.floor(1e3 * panel / airspeed + 1e-9)) * 1_000_000


def trimmed(model: Model, trim: trims.Trim, *, altitude: float,
            failed: frozenset[str] = ALL_WORK,
            broken: Mapping[str, Failure] = MappingProxyType({})) -> Flight:
    """
    Return a flight that begins in a steady flight, with the wake of its turn if that has it.

    altitude [m]; failed : engines, broken : parts that did not work when it was found.
    """
    body = BodyState(np.array([0.0, 0.0, -altitude]), trim.velocity_B, trim.rates_B, trim.q_NB)
    flight = Flight(model, body, trim.controls, dt_ns=automatic_dt_ns(model, trim.airspeed),
                    delta0=trim.aero.strips.delta, failed=failed, turning=trim.turning)
    if broken:
        flight.failures = broken
        flight.reset(time_ns=0)
    return flight


def start(aircraft: Aircraft, settings: Settings = DEFAULTS, *, airspeed: float,
          altitude: float, atmosphere: Atmosphere = STANDARD, weather: Weather = CALM,
          dt: float | None = None, failed: frozenset[str] = ALL_WORK,
          north_east: tuple[float, float] = (0.0, 0.0), heading: float = 0.0,
          attitude: FloatArray | None = None,
          progress: Callable[[str], None] = lambda text: None) -> Flight:
    """
    Return a flight in straight trim, ready to step: everything is compiled or loaded.

    Level with engines, gliding without.

    airspeed [m/s]; altitude [m]; dt [s], None for `automatic_dt_ns`; failed : names of engines
    that do not work; north_east [m], heading [rad] : where, and whereto; attitude (4,) q_NB,
    instead of that of trim, at its airspeed, flow angles and controls; progress is told what takes
    the time. Raises `ConfigError` where no trim exists, or no such engine.
    """
    aircraft.require_engines(failed)
    progress('building the lattice (compiling on the first run, up to a minute)')
    model = models.build(aircraft, settings, atmosphere)
    dt_ns = automatic_dt_ns(model, airspeed) if dt is None else round(dt * 1e9)
    longest = 2 * automatic_dt_ns(model, airspeed)
    if not 0 < dt_ns <= longest:
        raise ConfigError(f'dt must be above 0 and at most {longest * 1e-9:g} s (twice the panel '
                          f'chord over the airspeed), got {dt_ns * 1e-9:g} s')
    progress(f'trimming at {airspeed:g} m/s')
    trim = trims.straight(model, airspeed=airspeed, altitude=altitude, failed=failed)
    if trim.status is not Status.CONVERGED:
        raise ConfigError(f'no {"level trim" if aircraft.engines else "glide"} at {airspeed:g} '
                          f'm/s: {trim.message}')
    q_NB = attitude if attitude is not None else \
        quaternion_from_euler(trim.bank, trim.pitch, heading)
    body = BodyState(np.array([*north_east, -altitude]),
                     trim.velocity_B + rotation(q_NB).T @ weather.mean_N(altitude),
                     np.zeros(3), q_NB)
    flight = Flight(model, body, trim.controls, dt_ns=dt_ns, weather=weather,
                    delta0=trim.aero.strips.delta, failed=failed)
    progress('warming up')
    flight.step(trim.controls)
    flight.reset(time_ns=0)
    return flight

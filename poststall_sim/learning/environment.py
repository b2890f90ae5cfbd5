# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flights past the stall as an environment of `gymnasium`.

A step holds the action for some steps of the simulation, in lock step: no clock runs, actuators
are those of the flight. The same seed and the same actions give the same bits.
"""

import multiprocessing
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box

from poststall_sim import definition, simulation, threads, trim, trim_jobs
from poststall_sim.aero import model as models
from poststall_sim.aero.model import DEFAULTS, Settings
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.campaign import starting
from poststall_sim.campaign.case import Flying, Recovered, Stop
from poststall_sim.campaign.measures import Measures
from poststall_sim.definition import Kind
from poststall_sim.frames import FloatArray
from poststall_sim.learning import observing
from poststall_sim.learning.rewards import End, Reward, Transition, height_kept
from poststall_sim.learning.starts import Starts
from poststall_sim.simulation import Flight, SavedFlight
from poststall_sim.state import Controls, Status

SPIN_ALPHA = 0.28
"""Angle of attack above which turns count as those of a spin [rad], in `info`."""


@dataclass(frozen=True, slots=True, eq=False)
class SavedEpisode:
    """An episode at one instant, to branch from: the flight, what was measured, how it ended."""

    flight: SavedFlight
    measures: Measures
    over: bool


class RecoveryEnv(gymnasium.Env):
    """
    Thrown into the air past the stall: bring it back with the least loss of height.

    Observations and actions are those of `observing`, in SI units and radians: `observed` and
    `commanded` have their names and bounds. An action beyond its bounds is cut to them. An
    episode ends (terminated) once it has recovered, on the ground, or where it diverges; after
    its duration it is truncated. `info` has the quantities of a campaign, and `end`.
    """

    metadata = {'render_modes': []}

    def __init__(self, aircraft: str | Aircraft = 'trainer', *, settings: Settings = DEFAULTS,
                 trim_airspeed: float = 12.0, starts: Starts | Mapping[str, Any] | None = None,
                 reward: Reward = height_kept, duration: float = 8.0, steps_per_action: int = 5,
                 recovered: Recovered = Recovered(), until_recovered: bool = True) -> None:  # noqa: B008
        """
        Make it ready to be reset.

        aircraft : a name, a file, or the record; trim_airspeed [m/s] : of the straight trim whose
        controls an episode begins with, and which sets the step of the simulation; starts : where
        episodes begin, or what of `Starts` is to be otherwise; duration [s]; steps_per_action :
        steps of the simulation that an action is held for; recovered : when it counts as that;
        until_recovered : whether that ends the episode. Raises `ConfigError`.
        """
        if multiprocessing.parent_process() is not None:
            threads.one_blas_thread()   # a worker beside others: each has a core, not all of them
        if not (isinstance(steps_per_action, Integral) and 1 <= steps_per_action <= 10_000):
            raise ConfigError('steps_per_action must be a whole number of 1 to 10000, got '
                              f'{steps_per_action!r}')
        if not 0.0 < duration <= 86400.0:
            raise ConfigError(f'duration must be above 0 and at most 86400 s, got {duration!r}')
        if not isinstance(aircraft, Aircraft):
            aircraft = definition.aircraft(definition.find(Kind.AIRCRAFT, aircraft))
        self.starts = starts if isinstance(starts, Starts) else Starts().changed(starts)
        self.observed = observing.quantities(aircraft)
        self.commanded = observing.commanded(aircraft)
        self.observation_space, self.action_space = _box(self.observed), _box(self.commanded)
        self._model = models.build(aircraft, settings)
        self._trim_airspeed = trim_airspeed
        self._trim = trim.straight(self._model, airspeed=trim_airspeed,
                                   altitude=float(np.mean(self.starts.altitude)))
        if self._trim.status is not Status.CONVERGED:
            raise ConfigError(f'no trim at {trim_airspeed:g} m/s: '
                              + trim_jobs.explained(self._trim.message))
        self._dt = 1e-9 * simulation.automatic_dt_ns(
            self._model, max(trim_airspeed, self.starts.airspeed[1]))
        self._duration, self._held = duration, steps_per_action
        self._reward, self._recovered = reward, recovered
        self._until_recovered = until_recovered
        self._observe = observing.observing(aircraft)
        self._flight: Flight | None = None
        self._measures: Measures | None = None
        self._over = True

    @property
    def dt(self) -> float:
        """How long a step takes [s of simulated time]."""
        return self._held * self._dt

    @property
    def trim_action(self) -> FloatArray:
        """The action that holds the controls where the trim has them."""
        return self._action(self._trim.controls)

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
              ) -> tuple[FloatArray, dict[str, Any]]:
        """
        Begin an episode; options : what of `Starts` is otherwise in this one, by name.

        Raises `ConfigError` for what is no range, or a start whose loads are not finite.
        """
        super().reset(seed=seed)
        initial, weather = self.starts.changed(options).drawn(self.np_random, self._trim_airspeed)
        task = Flying(
            initial=initial, duration=self._duration, weather=weather, dt=self._dt, scenario=None,
            law=None, autopilot=None, recovered=self._recovered, spin_alpha=SPIN_ALPHA,
            stop=Stop(), history_every=None, cpu_limit=float('inf'))
        self._over = True
        self._flight = starting.flight(self._model, self._trim, task)
        if self._flight.snapshot.status is Status.DIVERGED:
            raise ConfigError(f'the loads where an episode begins are not finite: {initial}')
        self._measures, self._over = Measures(self._flight, task), False
        return self._observe(self._flight.snapshot), self._info(None)

    def step(self, action: FloatArray
             ) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Hold an action for a step: observation, reward, terminated, truncated, info."""
        if self._over:
            raise ResetNeeded('reset first: no episode has begun, or it is over')
        action = np.asarray(action, dtype=float)
        if action.shape != self.action_space.shape or not np.isfinite(action).all():
            raise ConfigError(f'an action has {len(self.commanded)} finite numbers, '
                              f'{", ".join(each.name for each in self.commanded)}; got {action}')
        flight, measures = self._flight, self._measures
        controls = self._controls(action)
        before, lost = flight.snapshot, measures.height_lost
        for _ in range(self._held):
            last = flight.snapshot
            if flight.step(controls) is not last:
                measures.add(flight.snapshot)
            if flight.paused_reason is not None:
                break
        end = self._end()
        reward = self._reward(Transition(
            before, flight.snapshot, action, measures.height_lost - lost, measures.recovered, end))
        truncated = end is None and flight.snapshot.time >= self._duration - 1e-9
        self._over = end is not None or truncated
        return (self._observe(flight.snapshot), float(reward), end is not None, truncated,
                self._info(end))

    def get_state(self) -> SavedEpisode:
        """Return the episode as it is now; that of the generator of starts is not in it."""
        if self._flight is None:
            raise ResetNeeded('reset first: no episode has begun')
        return SavedEpisode(self._flight.saved(), self._measures.copy(), self._over)

    def set_state(self, state: SavedEpisode) -> FloatArray:
        """Go on from an instant, of this environment or of one made alike; return what is seen."""
        self._flight = Flight.resumed(self._model, state.flight)
        self._measures, self._over = state.measures.copy(), state.over
        return self._observe(self._flight.snapshot)

    def _end(self) -> End | None:
        paused = self._flight.paused_reason
        if paused is not None:
            return End.DIVERGED if paused.startswith('diverged') else End.GROUND
        return End.RECOVERED if self._until_recovered and self._measures.recovered else None

    def _info(self, end: End | None) -> dict[str, Any]:
        numbers = self._measures.quantities()
        return {**{name: value for name, value in numbers.items() if value is not None},
                'end': '' if end is None else end.value}

    def _controls(self, action: FloatArray) -> Controls:
        count = len(self._model.aircraft.controls)
        return Controls(action[:count], float(action[count]) if len(action) > count else 0.0)

    def _action(self, controls: Controls) -> FloatArray:
        throttle = [controls.throttle] if self._model.aircraft.engines else []
        return np.array([*controls.deflections, *throttle])


def _box(quantities: tuple[observing.Quantity, ...]) -> Box:
    return Box(np.array([each.low for each in quantities]),
               np.array([each.high for each in quantities]), dtype=np.float64)

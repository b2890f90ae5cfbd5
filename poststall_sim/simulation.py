# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flight: flow and body advanced together in steps of dt.

One step goes from t to t + dt: the body is moved with the old loads held (predictor), the flow is
advanced to where that puts it, and the body is moved again with loads linear in time between old
and new (corrector). The coupling is of second order in dt with quasi-steady loads; the shed wake
itself is of second order where a step is a panel's way, and of first order in dt else.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim import propulsion, rigid_body, slipstream
from poststall_sim import trim as trims
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.model import DEFAULTS, Model, Onset, Settings
from poststall_sim.aero.solver import AeroResult, FlowState
from poststall_sim.aero.wake import Placement
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import (
    GRAVITY,
    FloatArray,
    body_to_geometry,
    body_to_stability,
    cross,
    flow_angles,
    geometry_to_body,
    rotation,
)
from poststall_sim.propulsion import Meeting, Push
from poststall_sim.state import BodyState, Controls, EngineState, Snapshot, Status

CALM = np.zeros(3)
ALL_WORK: frozenset[str] = frozenset()

Gusts = Callable[[float, FloatArray], FloatArray]
"""Velocity of the air (k, 3) in N [m/s] at a time [s] and at points (k, 3) in N [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightState:
    """
    Everything a step starts from.

    load : (6,) aerodynamics and engines in B with the added mass taken out [N, N m]; motion,
    previous_motion : (6,) velocity and rates in B that the flow of this step and of the one
    before was computed with, for the added mass.
    """

    time_ns: int
    body: BodyState
    controls: Controls
    flow: FlowState
    engines: EngineState
    load: FloatArray
    motion: FloatArray
    previous_motion: FloatArray


def limited(aircraft: Aircraft, controls: Controls) -> Controls:
    """Return the controls within their limits."""
    limits = np.array([control.limits for control in aircraft.controls]).reshape(-1, 2)
    return Controls(np.minimum(np.maximum(controls.deflections, limits[:, 0]), limits[:, 1]),
                    min(max(controls.throttle, 0.0), 1.0))


def placement(aircraft: Aircraft, body: BodyState) -> Placement:
    """Return where the geometry axes of an aircraft are."""
    rotation_NG = rotation(body.q_NB) * geometry_to_body(np.ones(3))
    return Placement(body.position_N - rotation_NG @ np.array(aircraft.mass.cg_G), rotation_NG)


def _air_velocity(body: BodyState, wind_N: FloatArray) -> FloatArray:
    """Return the velocity through the air (3,) in B [m/s]."""
    return body.velocity_B - rotation(body.q_NB).T @ wind_N


def _onset(model: Model, body: BodyState, wind_N: FloatArray, push: Push, density: float,
           gust: Callable[[FloatArray], FloatArray] | None = None) -> Onset:
    streams = slipstream.streams(model.aircraft, model.lattice, push.readings, density)
    return Onset(body_to_geometry(-_air_velocity(body, wind_N)), body_to_geometry(body.rates_B),
                 slipstream.blown(streams, gust))


def begin(model: Model, body: BodyState, controls: Controls, *, dt_ns: int,
          wind_N: FloatArray = CALM, delta0: FloatArray | None = None,
          charge: FloatArray | None = None, failed: frozenset[str] = ALL_WORK,
          time_ns: int = 0) -> tuple[FlightState, Snapshot]:
    """Return the first state of a flight: steady wake, settled shafts, batteries full or given."""
    controls = limited(model.aircraft, controls)
    air = standard_air(body.altitude)
    density = air.density
    meeting = _meeting(model, _air_velocity(body, wind_N), body.rates_B, controls, density, failed)
    engines = propulsion.settled(model.aircraft, meeting, charge)
    push = propulsion.loads(model.aircraft, engines, meeting, failed)
    onset = _onset(model, body, wind_N, push, density)
    flow, aero = solver.start(
        model.at(onset.airspeed, air.kinematic_viscosity, controls.deflections), onset,
        placement(model.aircraft, body), controls.deflections,
        density=density, dt=dt_ns * 1e-9, delta0=delta0)
    motion = np.concatenate([body.velocity_B, body.rates_B])
    load = _load(aero) + push.load
    state = FlightState(time_ns, body, controls, flow, engines, load, motion, motion)
    added, rigid = _inertia(model, density)
    change = rigid_body.acceleration(body, load, **rigid)
    still = Controls(np.zeros_like(controls.deflections))
    return state, _snapshot(model, state, still, aero, push, wind_N, change, -added @ change)


def step(model: Model, state: FlightState, controls: Controls, *, dt_ns: int,
         wind_N: FloatArray = CALM, gusts: Gusts | None = None,
         failed: frozenset[str] = ALL_WORK) -> tuple[FlightState, Snapshot]:
    """
    Return state and snapshot one step later; nothing is changed in place.

    controls are those of the step's end, limited here. gusts : what the air has more than wind_N
    at a time and at places; the aircraft, its engines and its wake feel them; failed : names of
    engines that do not work from here on. A value that is not
    finite makes the snapshot's status DIVERGED; it is for the caller to go back to the old state.
    """
    dt = dt_ns * 1e-9
    aircraft = model.aircraft
    controls = limited(aircraft, controls)
    air = standard_air(state.body.altitude)
    density = air.density
    added, rigid = _inertia(model, density)

    guess = rigid_body.advance(state.body, state.load, state.load, dt, **rigid)
    place, gust, drift_at = placement(aircraft, guess), None, None
    if gusts is not None:
        time, calm = 1e-9 * (state.time_ns + dt_ns), np.asarray(wind_N)
        here = gusts(time, guess.position_N[None])[0]
        wind_N = calm + here

        def gust(arm_G: FloatArray) -> FloatArray:
            return (gusts(time, guess.position_N + arm_G @ place.rotation_NG.T) - here) \
                @ place.rotation_NG

        def drift_at(points_N: FloatArray) -> FloatArray:
            return dt * (gusts(time, points_N) - here)
    air_B = _air_velocity(guess, wind_N)
    halfway = _meeting(
        model, 0.5 * (_air_velocity(state.body, wind_N) + air_B),
        0.5 * (state.body.rates_B + guess.rates_B), controls, density, failed)
    engines = propulsion.advance(aircraft, state.engines, halfway, dt)
    push = propulsion.loads(
        aircraft, engines, _meeting(model, air_B, guess.rates_B, controls, density, failed),
        failed)
    onset = _onset(model, guess, wind_N, push, density, gust)
    flow, aero = solver.advance(
        model.at(onset.airspeed, air.kinematic_viscosity, controls.deflections), state.flow,
        onset, place, controls.deflections,
        density=density, dt=dt, drift_N=wind_N * dt, drift_at=drift_at)
    motion = np.concatenate([guess.velocity_B, guess.rates_B])
    # The same difference formula as dG/dt, so that the added mass cancels exactly.
    rate = (3.0 * motion - 4.0 * state.motion + state.previous_motion) / (2.0 * dt)
    load = _load(aero) + added @ rate + push.load
    body = rigid_body.advance(state.body, state.load, load, dt, **rigid)

    new = FlightState(
        state.time_ns + dt_ns, body, controls, flow, engines, load, motion, state.motion)
    change = rigid_body.acceleration(body, load, **rigid)
    moved = Controls((controls.deflections - state.controls.deflections) / dt,
                     (controls.throttle - state.controls.throttle) / dt)
    return new, _snapshot(model, new, moved, aero, push, wind_N, change,
                          added @ (rate - change))


def _inertia(model: Model, density: float) -> tuple[FloatArray, dict]:
    """Return the added mass (6, 6) in B and what `rigid_body` is told of the aircraft."""
    mass = model.aircraft.mass
    added = density * model.added_mass if model.settings.unsteady else np.zeros((6, 6))
    inverse = rigid_body.mass_matrix_inverse(mass.mass, mass.inertia_B, added)
    return added, {'mass': mass.mass, 'inertia_B': mass.inertia_B, 'inverse': inverse}


def _load(aero: AeroResult) -> FloatArray:
    return np.concatenate([geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)])


def _meeting(model: Model, velocity_B: FloatArray, rates_B: FloatArray, controls: Controls,
             density: float, failed: frozenset[str]) -> Meeting:
    return Meeting(velocity_B, rates_B, density,
                   propulsion.throttles(model.aircraft, controls.throttle, failed))


def _snapshot(model: Model, state: FlightState, control_rates: Controls, aero: AeroResult,
              push: Push, wind_N: FloatArray, change: FloatArray,
              correction: FloatArray) -> Snapshot:
    """
    Return what can be measured at a state.

    push : of the engines; change (6,) : d(nu)/dt in B; correction (6,) : what the added mass
    makes of the difference between that acceleration and the one the loads were computed with.
    """
    body = state.body
    air_B = _air_velocity(body, wind_N)
    airspeed, alpha, beta = flow_angles(air_B)
    aerodynamic = _load(aero) + correction
    status = aero.status
    if not (body.is_finite() and np.isfinite(change).all()):
        status = Status.DIVERGED
    specific = body_to_stability(aerodynamic[:3] + push.force_B, alpha) / model.aircraft.mass.mass
    return Snapshot(
        time_ns=state.time_ns, body=body, controls=state.controls,
        control_rates=control_rates, velocity_air_B=air_B,
        airspeed=airspeed, alpha=alpha, beta=beta,
        acceleration_B=change[:3] + cross(body.rates_B, body.velocity_B),
        rate_change_B=change[3:], load_factor=-float(specific[2]) / GRAVITY,
        force_B=aerodynamic[:3], moment_B=aerodynamic[3:], thrust_B=push.force_B,
        thrust_moment_B=push.moment_B, engines=push.readings, wind_N=wind_N,
        density=standard_air(body.altitude).density, strips=aero.strips,
        iterations=aero.iterations, max_residual=aero.max_residual, status=status)


@dataclass(frozen=True, slots=True, eq=False)
class SavedFlight:
    """
    A flight at one instant, all that `Flight.resumed` needs to go on from it.

    first : where and how fast through the air it began; delta0 : its decambering there; failed
    (k,) : 1 for engines that have failed, else 0.
    """

    dt_ns: int
    wind_N: FloatArray
    trim: Controls
    first: BodyState
    delta0: FloatArray | None
    state: FlightState
    snapshot: Snapshot
    paused_reason: str | None
    failed: FloatArray


class Flight:
    """
    A model in flight: the present state, and the one it can go back to.

    ``gusts`` may be set to what the air has more than the wind, from place to place and time to
    time; it is not saved. ``paused_reason`` is None, or says why the flight does not go on: ground
    contact (flat ground at altitude 0; there is no landing gear) or divergence, with the last good
    state kept.
    """

    def __init__(self, model: Model, body: BodyState, controls: Controls, *, dt_ns: int,
                 wind_N: FloatArray = CALM, delta0: FloatArray | None = None,
                 failed: frozenset[str] = ALL_WORK):
        """Start at a body state with controls; see `begin`."""
        self.model = model
        self.dt_ns = dt_ns
        self.trim = limited(model.aircraft, controls)
        self.wind_N = np.array(wind_N, dtype=float)
        self.gusts: Gusts | None = None
        self.failed_engines = failed
        # Through the air: a reset in another wind is as trimmed as the start was.
        self._first = replace(body, velocity_B=_air_velocity(body, self.wind_N))
        self._delta0 = delta0
        self.reset(time_ns=0)

    @property
    def failed_engines(self) -> frozenset[str]:
        """Names of engines that do not work, which may be set: their throttle is 0."""
        return self._failed

    @failed_engines.setter
    def failed_engines(self, names: frozenset[str]) -> None:
        self.model.aircraft.require_engines(names)
        self._failed = names

    def reset(self, time_ns: int | None = None) -> Snapshot:
        """Go back to the first place and airspeed with a fresh wake; time goes on unless given."""
        first = self._first
        body = replace(
            first, velocity_B=first.velocity_B + rotation(first.q_NB).T @ self.wind_N)
        self.paused_reason: str | None = None
        self.state, self.snapshot = begin(
            self.model, body, self.trim, dt_ns=self.dt_ns, wind_N=self.wind_N,
            delta0=self._delta0, failed=self.failed_engines,
            time_ns=self.snapshot.time_ns if time_ns is None else time_ns)
        return self.snapshot

    def place(self, body: BodyState, controls: Controls, *,
              delta0: FloatArray | None = None) -> Snapshot:
        """
        Go on from another body state with a fresh wake; time stays.

        Raises `ConfigError`, with the flight as it was, where the loads there are not finite.
        """
        state, snapshot = begin(self.model, body, controls, dt_ns=self.dt_ns, wind_N=self.wind_N,
                                delta0=delta0, charge=self.state.engines.charge,
                                failed=self.failed_engines, time_ns=self.snapshot.time_ns)
        if snapshot.status is Status.DIVERGED:
            raise ConfigError('the loads in this state are not finite')
        self.paused_reason = None
        self.state, self.snapshot = state, snapshot
        return snapshot

    def set_time(self, time_ns: int) -> None:
        """Call the present instant by another time [ns]; nothing else changes."""
        self.state = replace(self.state, time_ns=time_ns)
        self.snapshot = replace(self.snapshot, time_ns=time_ns)

    def saved(self) -> SavedFlight:
        """Return the flight as it is now."""
        flow = replace(self.state.flow, wake=self.state.flow.wake.alone())
        return SavedFlight(
            dt_ns=self.dt_ns, wind_N=self.wind_N.copy(), trim=self.trim, first=self._first,
            delta0=self._delta0, state=replace(self.state, flow=flow), snapshot=self.snapshot,
            paused_reason=self.paused_reason, failed=np.array([
                float(name in self.failed_engines) for name in self.model.aircraft.engine_names]))

    @classmethod
    def resumed(cls, model: Model, saved: SavedFlight) -> 'Flight':
        """Return a flight that goes on from a saved instant with the model it was saved with."""
        first = replace(saved.first, velocity_B=saved.first.velocity_B
                        + rotation(saved.first.q_NB).T @ saved.wind_N)
        failed = [name for name, gone in zip(model.aircraft.engine_names, saved.failed) if gone]
        flight = cls(model, first, saved.trim, dt_ns=saved.dt_ns, wind_N=saved.wind_N,
                     delta0=saved.delta0, failed=frozenset(failed))
        # To the bit: what was added to the velocity and taken from it again is not.
        flight._first = saved.first
        flight.state, flight.snapshot = saved.state, saved.snapshot
        flight.paused_reason = saved.paused_reason
        return flight

    def step(self, controls: Controls) -> Snapshot:
        """Advance by one step and return what is measured; never raises."""
        if self.paused_reason is not None:
            return self.snapshot
        state, snapshot = step(
            self.model, self.state, controls, dt_ns=self.dt_ns, wind_N=self.wind_N,
            gusts=self.gusts, failed=self.failed_engines)
        if snapshot.status is Status.DIVERGED:
            self.paused_reason = (f'diverged after {self.state.time_ns * 1e-9:.3f} s: a value '
                                  'is not finite; the last good state is kept')
        else:
            self.state, self.snapshot = state, snapshot
            if state.body.altitude <= 0.0:
                speed = float(np.linalg.norm(state.body.velocity_B))
                self.paused_reason = (f'ground contact at {snapshot.time:.3f} s with '
                                      f'{speed:.1f} m/s; there is no landing gear')
        return self.snapshot


def automatic_dt_ns(model: Model, airspeed: float) -> int:
    """
    Return the step [ns]: the reference chord's panel over the airspeed, in whole milliseconds.

    Rounded down, so that a wake row is no longer than a panel of the wing.
    """
    panel = model.aircraft.reference.chord / model.settings.chordwise
    return max(1, math.floor(1e3 * panel / airspeed + 1e-9)) * 1_000_000


def start(aircraft: Aircraft, settings: Settings = DEFAULTS, *, airspeed: float,
          altitude: float, wind_N: FloatArray = CALM, dt: float | None = None,
          failed: frozenset[str] = ALL_WORK,
          progress: Callable[[str], None] = lambda text: None) -> Flight:
    """
    Return a flight in straight trim, ready to step: everything is compiled or loaded.

    Level with engines, gliding without.

    airspeed [m/s]; altitude [m]; dt [s], None for `automatic_dt_ns`; failed : names of engines
    that do not work; progress is told what takes the time. Raises `ConfigError` where no trim
    exists, or no such engine.
    """
    aircraft.require_engines(failed)
    progress('building the lattice (compiling on the first run, up to a minute)')
    model = models.build(aircraft, settings)
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
    q_NB = trim.q_NB
    body = BodyState(np.array([0.0, 0.0, -altitude]),
                     trim.velocity_B + rotation(q_NB).T @ np.asarray(wind_N, dtype=float),
                     np.zeros(3), q_NB)
    flight = Flight(model, body, trim.controls, dt_ns=dt_ns, wind_N=wind_N,
                    delta0=trim.aero.strips.delta, failed=failed)
    progress('warming up')
    flight.step(trim.controls)
    flight.reset(time_ns=0)
    return flight

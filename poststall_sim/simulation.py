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
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from poststall_sim import control_system, failures, rigid_body
from poststall_sim import trim as trims
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.model import DEFAULTS, Model, Onset, Settings
from poststall_sim.aero.solver import AeroResult, FlowState
from poststall_sim.aero.wake import Placement
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.control_system import ControlState
from poststall_sim.failures import Failed, Failure
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
from poststall_sim.propulsion import thrust
from poststall_sim.state import BodyState, Controls, Snapshot, Status

CALM = np.zeros(3)

Gusts = Callable[[float, FloatArray], FloatArray]
"""Velocity of the air (k, 3) in N [m/s] at a time [s] and at points (k, 3) in N [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightState:
    """
    Everything a step starts from.

    controls : as they stand, control_system : with all that moves them; load : (6,) aerodynamics
    and thrust in B with the added mass taken out [N, N m]; motion,
    previous_motion : (6,) velocity and rates in B that the flow of this step and of the one
    before was computed with, for the added mass.
    """

    time_ns: int
    body: BodyState
    controls: Controls
    control_system: ControlState
    flow: FlowState
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


def _onset(body: BodyState, wind_N: FloatArray,
           gust: Callable[[FloatArray], FloatArray] | None = None) -> Onset:
    return Onset(body_to_geometry(-_air_velocity(body, wind_N)), body_to_geometry(body.rates_B),
                 gust)


def begin(model: Model, body: BodyState, controls: Controls, *, dt_ns: int,
          wind_N: FloatArray = CALM, delta0: FloatArray | None = None, failed: Failed = (),
          time_ns: int = 0) -> tuple[FlightState, Snapshot]:
    """Return the first state of a flight, on the steady wake of its onset."""
    told = limited(model.aircraft, controls)
    air = standard_air(body.altitude)
    density, onset = air.density, _onset(body, wind_N)
    moved = control_system.at_rest(model, told.deflections, failed, dt_ns * 1e-9)
    controls = Controls(control_system.shown(model, moved), told.throttle)
    flow, aero = solver.start(
        model.at(onset.airspeed, air.kinematic_viscosity, told.deflections, moved.angles), onset,
        placement(model.aircraft, body), told.deflections,
        density=density, dt=dt_ns * 1e-9, delta0=delta0, angles=moved.angles)
    moved = control_system.in_flow(model, moved, aero.strips.alpha)
    motion = np.concatenate([body.velocity_B, body.rates_B])
    push = _thrust(model, body, controls, wind_N)
    load = _load(aero) + push
    state = FlightState(time_ns, body, controls, moved, flow, load, motion, motion)
    added, rigid = _inertia(model, density)
    change = rigid_body.acceleration(body, load, **rigid)
    still = Controls(np.zeros_like(controls.deflections))
    return state, _snapshot(model, state, told, still, np.zeros_like(moved.angles), aero, push,
                            wind_N, change, -added @ change)


def step(model: Model, state: FlightState, controls: Controls, *, dt_ns: int,
         wind_N: FloatArray = CALM, gusts: Gusts | None = None,
         failed: Failed = ()) -> tuple[FlightState, Snapshot]:
    """
    Return state and snapshot one step later; nothing is changed in place.

    controls are told throughout the step, limited here; without actuators they are where they are
    told at its end. gusts : what the air has more than wind_N at a time and at places; the
    aircraft, its engines and its wake feel them. failed : of each movable part. A value that is
    not finite makes the snapshot's status DIVERGED; it is for the caller to go back to the old
    state.
    """
    dt = dt_ns * 1e-9
    aircraft = model.aircraft
    told = limited(aircraft, controls)
    control_state = control_system.advance(
        model, state.control_system, told.deflections, failed, dt)
    controls = Controls(control_system.shown(model, control_state), told.throttle)
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
    onset = _onset(guess, wind_N, gust)
    flow, aero = solver.advance(
        model.at(onset.airspeed, air.kinematic_viscosity, told.deflections, control_state.angles),
        state.flow, onset, place, told.deflections,
        density=density, dt=dt, drift_N=wind_N * dt, drift_at=drift_at,
        angles=control_state.angles)
    control_state = control_system.in_flow(model, control_state, aero.strips.alpha)
    motion = np.concatenate([guess.velocity_B, guess.rates_B])
    # The same difference formula as dG/dt, so that the added mass cancels exactly.
    rate = (3.0 * motion - 4.0 * state.motion + state.previous_motion) / (2.0 * dt)
    push = _thrust(model, guess, controls, wind_N)
    load = _load(aero) + added @ rate + push
    body = rigid_body.advance(state.body, state.load, load, dt, **rigid)

    new = FlightState(state.time_ns + dt_ns, body, controls, control_state, flow, load, motion,
                      state.motion)
    change = rigid_body.acceleration(body, load, **rigid)
    moved = Controls((controls.deflections - state.controls.deflections) / dt,
                     (controls.throttle - state.controls.throttle) / dt)
    turned = (control_state.angles - state.control_system.angles) / dt
    return new, _snapshot(model, new, told, moved, turned, aero, push, wind_N, change,
                          added @ (rate - change))


def _inertia(model: Model, density: float) -> tuple[FloatArray, dict]:
    """Return the added mass (6, 6) in B and what `rigid_body` is told of the aircraft."""
    mass = model.aircraft.mass
    added = density * model.added_mass if model.settings.unsteady else np.zeros((6, 6))
    inverse = rigid_body.mass_matrix_inverse(mass.mass, mass.inertia_B, added)
    return added, {'mass': mass.mass, 'inertia_B': mass.inertia_B, 'inverse': inverse}


def _load(aero: AeroResult) -> FloatArray:
    return np.concatenate([geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)])


def _thrust(model: Model, body: BodyState, controls: Controls, wind_N: FloatArray) -> FloatArray:
    return np.concatenate(
        thrust(model.aircraft, _air_velocity(body, wind_N), controls.throttle))


def _snapshot(model: Model, state: FlightState, told: Controls, control_rates: Controls,
              angle_rates: FloatArray, aero: AeroResult, push: FloatArray, wind_N: FloatArray,
              change: FloatArray, correction: FloatArray) -> Snapshot:
    """
    Return what can be measured at a state.

    push (6,) : of the engines; change (6,) : d(nu)/dt in B; correction (6,) : what the added
    mass makes of the difference between that acceleration and the one the loads were computed
    with.
    """
    body = state.body
    air_B = _air_velocity(body, wind_N)
    airspeed, alpha, beta = flow_angles(air_B)
    aerodynamic = _load(aero) + correction
    status = aero.status
    if not (body.is_finite() and np.isfinite(change).all()):
        status = Status.DIVERGED
    specific = body_to_stability((aerodynamic + push)[:3], alpha) / model.aircraft.mass.mass
    return Snapshot(
        time_ns=state.time_ns, body=body, controls=state.controls,
        control_rates=control_rates, commanded=told, angles=state.control_system.angles,
        angle_rates=angle_rates, velocity_air_B=air_B,
        airspeed=airspeed, alpha=alpha, beta=beta,
        acceleration_B=change[:3] + cross(body.rates_B, body.velocity_B),
        rate_change_B=change[3:], load_factor=-float(specific[2]) / GRAVITY,
        force_B=aerodynamic[:3], moment_B=aerodynamic[3:], thrust_B=push[:3],
        thrust_moment_B=push[3:], wind_N=wind_N,
        density=standard_air(body.altitude).density, strips=aero.strips,
        iterations=aero.iterations, max_residual=aero.max_residual, status=status)


@dataclass(frozen=True, slots=True, eq=False)
class SavedFlight:
    """
    A flight at one instant, all that `Flight.resumed` needs to go on from it.

    first : where and how fast through the air it began; delta0 : its decambering there; failed :
    see `failures.as_array`.
    """

    dt_ns: int
    wind_N: FloatArray
    trim: Controls
    first: BodyState
    delta0: FloatArray | None
    failed: FloatArray
    state: FlightState
    snapshot: Snapshot
    paused_reason: str | None


class Flight:
    """
    A model in flight: the present state, and the one it can go back to.

    ``gusts`` may be set to what the air has more than the wind, from place to place and time to
    time; it is not saved. ``failures`` by name of a part or a control may be set at any time, and
    stay through a reset. ``paused_reason`` is None, or says why the flight does not go on: ground
    contact (flat ground at altitude 0; there is no landing gear) or divergence, with the last good
    state kept.
    """

    def __init__(self, model: Model, body: BodyState, controls: Controls, *, dt_ns: int,
                 wind_N: FloatArray = CALM, delta0: FloatArray | None = None):
        """Start at a body state with controls; see `begin`."""
        self.model = model
        self.dt_ns = dt_ns
        self.trim = limited(model.aircraft, controls)
        self.wind_N = np.array(wind_N, dtype=float)
        self.gusts: Gusts | None = None
        self.failures = {}
        # Through the air: a reset in another wind is as trimmed as the start was.
        self._first = replace(body, velocity_B=_air_velocity(body, self.wind_N))
        self._delta0 = delta0
        self.reset(time_ns=0)

    @property
    def failures(self) -> Mapping[str, Failure]:
        """What has failed, by name; set all of it at once, unknown names are refused."""
        return MappingProxyType(dict(self._failures))

    @failures.setter
    def failures(self, by_name: Mapping[str, Failure]) -> None:
        self._failed = failures.of_parts(self.model.aircraft, by_name)
        self._failures = dict(by_name)

    def reset(self, time_ns: int | None = None) -> Snapshot:
        """Go back to the first place and airspeed with a fresh wake; time goes on unless given."""
        first = self._first
        body = replace(
            first, velocity_B=first.velocity_B + rotation(first.q_NB).T @ self.wind_N)
        self.paused_reason: str | None = None
        self.state, self.snapshot = begin(
            self.model, body, self.trim, dt_ns=self.dt_ns, wind_N=self.wind_N,
            delta0=self._delta0, failed=self._failed,
            time_ns=self.snapshot.time_ns if time_ns is None else time_ns)
        return self.snapshot

    def place(self, body: BodyState, controls: Controls, *,
              delta0: FloatArray | None = None) -> Snapshot:
        """
        Go on from another body state with a fresh wake; time stays.

        Raises `ConfigError`, with the flight as it was, where the loads there are not finite.
        """
        state, snapshot = begin(self.model, body, controls, dt_ns=self.dt_ns, wind_N=self.wind_N,
                                delta0=delta0, failed=self._failed,
                                time_ns=self.snapshot.time_ns)
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
            delta0=self._delta0, failed=failures.as_array(self._failed),
            state=replace(self.state, flow=flow), snapshot=self.snapshot,
            paused_reason=self.paused_reason)

    @classmethod
    def resumed(cls, model: Model, saved: SavedFlight) -> 'Flight':
        """Return a flight that goes on from a saved instant with the model it was saved with."""
        first = replace(saved.first, velocity_B=saved.first.velocity_B
                        + rotation(saved.first.q_NB).T @ saved.wind_N)
        flight = cls(model, first, saved.trim, dt_ns=saved.dt_ns, wind_N=saved.wind_N,
                     delta0=saved.delta0)
        # To the bit: what was added to the velocity and taken from it again is not.
        flight._first = saved.first
        flight.state, flight.snapshot = saved.state, saved.snapshot
        flight._failed = failures.from_array(saved.failed)
        flight._failures = failures.by_name(model.aircraft, flight._failed)
        flight.paused_reason = saved.paused_reason
        return flight

    def step(self, controls: Controls) -> Snapshot:
        """Advance by one step and return what is measured; never raises."""
        if self.paused_reason is not None:
            return self.snapshot
        state, snapshot = step(
            self.model, self.state, controls, dt_ns=self.dt_ns, wind_N=self.wind_N,
            gusts=self.gusts, failed=self._failed)
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
          progress: Callable[[str], None] = lambda text: None) -> Flight:
    """
    Return a flight in straight trim, ready to step: everything is compiled or loaded.

    Level with engines, gliding without.

    airspeed [m/s]; altitude [m]; dt [s], None for `automatic_dt_ns`; progress is told what
    takes the time. Raises `ConfigError` where no trim exists.
    """
    progress('building the lattice (compiling on the first run, up to a minute)')
    model = models.build(aircraft, settings)
    dt_ns = automatic_dt_ns(model, airspeed) if dt is None else round(dt * 1e9)
    longest = 2 * automatic_dt_ns(model, airspeed)
    if not 0 < dt_ns <= longest:
        raise ConfigError(f'dt must be above 0 and at most {longest * 1e-9:g} s (twice the panel '
                          f'chord over the airspeed), got {dt_ns * 1e-9:g} s')
    progress(f'trimming at {airspeed:g} m/s')
    trim = trims.straight(model, airspeed=airspeed, altitude=altitude)
    if trim.status is not Status.CONVERGED:
        raise ConfigError(f'no {"level trim" if aircraft.engines else "glide"} at {airspeed:g} '
                          f'm/s: {trim.message}')
    q_NB = trim.q_NB
    body = BodyState(np.array([0.0, 0.0, -altitude]),
                     trim.velocity_B + rotation(q_NB).T @ np.asarray(wind_N, dtype=float),
                     np.zeros(3), q_NB)
    flight = Flight(model, body, trim.controls, dt_ns=dt_ns, wind_N=wind_N,
                    delta0=trim.aero.strips.delta)
    progress('warming up')
    flight.step(trim.controls)
    flight.reset(time_ns=0)
    return flight

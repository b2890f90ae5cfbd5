# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
One step of a flight: flow and body advanced together by dt.

One step goes from t to t + dt: the body is moved with the old loads held (predictor), the flow is
advanced to where that puts it, and the body is moved again with loads linear in time between old
and new (corrector). The coupling is of second order in dt with quasi-steady loads; the shed wake
itself is of second order where a step is a panel's way, and of first order in dt else.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from poststall_sim import control_system, propulsion, rigid_body, slipstream
from poststall_sim import trim as trims
from poststall_sim.aero import solver, steady_motion
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.solver import AeroResult, FlowState
from poststall_sim.aero.wake import Placement
from poststall_sim.aircraft import Aircraft
from poststall_sim.control_system import ControlState
from poststall_sim.failures import Failed
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

NO_WIND = np.zeros(3)
ALL_WORK: frozenset[str] = frozenset()

Gusts = Callable[[float, FloatArray], FloatArray]
"""Velocity of the air (k, 3) in N [m/s] at a time [s] and at points (k, 3) in N [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightState:
    """
    Everything a step starts from.

    controls : as they stand, control_system : with all that moves them; load : (6,) aerodynamics
    and engines in B with the added mass taken out [N, N m]; motion, previous_motion :
    (6,) velocity and rates in B that the flow of this step and of the one before was computed
    with, for the added mass.
    """

    time_ns: int
    body: BodyState
    controls: Controls
    control_system: ControlState
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
    rotation_NG = geometry_to_body(rotation(body.q_NB))   # the columns turn as components do
    return Placement(body.position_N - rotation_NG @ np.array(aircraft.mass.cg_G), rotation_NG)


def air_velocity(body: BodyState, wind_N: FloatArray) -> FloatArray:
    """Return the velocity through the air (3,) in B [m/s]."""
    return body.velocity_B - rotation(body.q_NB).T @ wind_N


def _onset(model: Model, air_B: FloatArray, rates_B: FloatArray, push: Push, density: float,
           gust: Callable[[FloatArray], FloatArray] | None = None) -> Onset:
    streams = slipstream.streams(model.aircraft, model.lattice, push.readings, density)
    return Onset(body_to_geometry(-air_B), body_to_geometry(rates_B),
                 slipstream.blown(streams, gust))


def begin(model: Model, body: BodyState, controls: Controls, *, dt_ns: int,
          wind_N: FloatArray = NO_WIND, delta0: FloatArray | None = None,
          charge: FloatArray | None = None, failed_engines: frozenset[str] = ALL_WORK,
          failed_parts: Failed = (), time_ns: int = 0,
          turning: bool = False) -> tuple[FlightState, Snapshot]:
    """
    Return the first state of a flight: steady wake, settled shafts, batteries full or given.

    The wake is straight, or turning : it lies along the path of a motion that has long been steady
    with the body's velocity and rates, see `steady_motion`.
    """
    told = limited(model.aircraft, controls)
    air = model.atmosphere.at(body.altitude)
    air_B = air_velocity(body, wind_N)
    meeting = _meeting(model, air_B, body.rates_B, told, air.density, failed_engines)
    engines = propulsion.settled(model.aircraft, meeting, charge)
    push = propulsion.loads(model.aircraft, engines, meeting, failed_engines)
    onset = _onset(model, air_B, body.rates_B, push, air.density)
    moved = control_system.at_rest(model, told.deflections, failed_parts, dt_ns * 1e-9)
    controls = Controls(control_system.shown(model, moved), told.throttle)
    flown = model.at(onset.airspeed, air.kinematic_viscosity, told.deflections, moved.angles)
    # As close as the trim: what a step's tolerance leaves would add up along the march.
    flow, aero = (steady_motion.march if turning else solver.start)(
        trims.tight(flown) if turning else flown, onset, placement(model.aircraft, body),
        told.deflections, density=air.density, dt=dt_ns * 1e-9, delta0=delta0,
        angles=moved.angles)
    moved = control_system.in_flow(model, moved, aero.strips.alpha)
    motion = np.concatenate([body.velocity_B, body.rates_B])
    load = _load(aero) + push.load
    state = FlightState(time_ns, body, controls, moved, flow, engines, load, motion, motion)
    added, rigid = _inertia(model, air.density)
    change = rigid_body.acceleration(body, load, **rigid)
    still = Controls(np.zeros_like(controls.deflections))
    return state, _snapshot(model, state, told, still, np.zeros_like(moved.angles), aero, push,
                            wind_N, change, -added @ change)


def step(model: Model, state: FlightState, controls: Controls, *, dt_ns: int,
         wind_N: FloatArray = NO_WIND, gusts: Gusts | None = None,
         failed_engines: frozenset[str] = ALL_WORK,
         failed_parts: Failed = ()) -> tuple[FlightState, Snapshot]:
    """
    Return state and snapshot one step later; nothing is changed in place.

    controls are told throughout the step, limited here; without actuators they are where they are
    told at its end. gusts : what the air has more than wind_N at a time and at places; the
    aircraft, its engines and its wake feel them; failed_engines : names of those that do not work
    from here on; failed_parts : of each movable part. A value that is not finite makes the
    snapshot's status DIVERGED; it is for the caller to go back to the old state.
    """
    dt = dt_ns * 1e-9
    aircraft = model.aircraft
    told = limited(aircraft, controls)
    control_state = control_system.advance(
        model, state.control_system, told.deflections, failed_parts, dt)
    controls = Controls(control_system.shown(model, control_state), told.throttle)
    air = model.atmosphere.at(state.body.altitude)
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
    air_B = air_velocity(guess, wind_N)
    halfway = _meeting(
        model, 0.5 * (air_velocity(state.body, wind_N) + air_B),
        0.5 * (state.body.rates_B + guess.rates_B), controls, density, failed_engines)
    engines = propulsion.advance(aircraft, state.engines, halfway, dt)
    push = propulsion.loads(
        aircraft, engines,
        _meeting(model, air_B, guess.rates_B, controls, density, failed_engines), failed_engines)
    onset = _onset(model, air_B, guess.rates_B, push, density, gust)
    flow, aero = solver.advance(
        model.at(onset.airspeed, air.kinematic_viscosity, told.deflections, control_state.angles),
        state.flow, onset, place, told.deflections,
        density=density, dt=dt, drift_N=wind_N * dt, drift_at=drift_at,
        angles=control_state.angles)
    control_state = control_system.in_flow(model, control_state, aero.strips.alpha)
    motion = np.concatenate([guess.velocity_B, guess.rates_B])
    # The same difference formula as dG/dt, so that the added mass cancels exactly.
    rate = (3.0 * motion - 4.0 * state.motion + state.previous_motion) / (2.0 * dt)
    load = _load(aero) + added @ rate + push.load
    body = rigid_body.advance(state.body, state.load, load, dt, **rigid)

    new = FlightState(state.time_ns + dt_ns, body, controls, control_state, flow, engines, load,
                      motion, state.motion)
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


def _meeting(model: Model, velocity_B: FloatArray, rates_B: FloatArray, controls: Controls,
             density: float, failed: frozenset[str]) -> Meeting:
    return Meeting(velocity_B, rates_B, density,
                   propulsion.throttles(model.aircraft, controls.throttle, failed))


def _snapshot(model: Model, state: FlightState, told: Controls, control_rates: Controls,
              angle_rates: FloatArray, aero: AeroResult, push: Push, wind_N: FloatArray,
              change: FloatArray, correction: FloatArray) -> Snapshot:
    """
    Return what can be measured at a state.

    push : of the engines; change (6,) : d(nu)/dt in B; correction (6,) : what the added mass
    makes of the difference between that acceleration and the one the loads were computed with.
    """
    body = state.body
    air_B = air_velocity(body, wind_N)
    airspeed, alpha, beta = flow_angles(air_B)
    aerodynamic = _load(aero) + correction
    status = aero.status
    if not (body.is_finite() and np.isfinite(change).all()):
        status = Status.DIVERGED
    specific = body_to_stability(aerodynamic[:3] + push.force_B, alpha) / model.aircraft.mass.mass
    return Snapshot(
        time_ns=state.time_ns, body=body, controls=state.controls,
        control_rates=control_rates, commanded=told, angles=state.control_system.angles,
        angle_rates=angle_rates, velocity_air_B=air_B,
        airspeed=airspeed, alpha=alpha, beta=beta,
        acceleration_B=change[:3] + cross(body.rates_B, body.velocity_B),
        rate_change_B=change[3:], load_factor=-float(specific[2]) / GRAVITY,
        force_B=aerodynamic[:3], moment_B=aerodynamic[3:], thrust_B=push.force_B,
        thrust_moment_B=push.moment_B, engines=push.readings, wind_N=wind_N,
        air=model.atmosphere.at(body.altitude), strips=aero.strips,
        iterations=aero.iterations, max_residual=aero.max_residual, status=status)

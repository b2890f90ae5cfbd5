# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Straight trimmed flight at an airspeed or at an angle of attack, powered or gliding.

The residual is the sum of forces and moments over weight (and weight times mean chord), from the
same steady loads that the flight starts from.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, root

from poststall_sim.aero import solver
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import Air, standard_air
from poststall_sim.frames import (
    GRAVITY,
    FloatArray,
    body_to_geometry,
    body_to_stability,
    geometry_to_body,
    quaternion_from_euler,
    rotation,
    velocity_from_flow_angles,
)
from poststall_sim.propulsion import thrust
from poststall_sim.state import Controls, Status

ACCEPTED = 1e-6
"""Largest residual of a trim, in weights and weights times mean chord."""
PITCH_CONTROL = 'elevator'
"""The control that trims the pitching moment."""


@dataclass(frozen=True, slots=True, eq=False)
class Trim:
    """
    A flight whose forces and moments balance, straight and wings level unless it says otherwise.

    airspeed [m/s]; alpha, climb_angle [rad]; controls; residual : X, Z over weight and M over
    weight times chord, (3,), or of all three axes, (6,), where sideways balances were asked for;
    aero: the loads; status and message say whether it can be flown; beta, bank [rad]; turn_rate
    of the heading, pull_rate of pitch beyond it [rad/s].
    """

    airspeed: float
    alpha: float
    climb_angle: float
    controls: Controls
    residual: FloatArray
    aero: AeroResult
    status: Status
    message: str
    beta: float = 0.0
    bank: float = 0.0
    turn_rate: float = 0.0
    pull_rate: float = 0.0

    @property
    def q_NB(self) -> FloatArray:
        """Attitude, heading north."""
        pitch = pitch_angle(self.alpha, self.beta, self.bank, self.climb_angle)
        return quaternion_from_euler(self.bank, pitch, 0.0)

    @property
    def velocity_B(self) -> FloatArray:
        """Velocity through the air (3,) [m/s]."""
        return velocity_from_flow_angles(self.airspeed, self.alpha, self.beta)

    @property
    def rates_B(self) -> FloatArray:
        """Rates (3,) [rad/s]."""
        return rotation(self.q_NB).T @ [0.0, 0.0, self.turn_rate] + [0.0, self.pull_rate, 0.0]


def pitch_angle(alpha: float, beta: float, bank: float, climb_angle: float) -> float:
    """
    Return the pitch angle of a flight along a climb angle, all [rad].

    The nearest where a bank or sideslip allows none: sin(climb) = a sin(pitch) - b cos(pitch),
    Stevens & Lewis, Aircraft Control and Simulation, 2003, sec. 3.4.
    """
    a = math.cos(alpha) * math.cos(beta)
    b = math.sin(bank) * math.sin(beta) + math.cos(bank) * math.sin(alpha) * math.cos(beta)
    return math.asin(min(max(math.sin(climb_angle) / math.hypot(a, b), -1.0), 1.0)) \
        + math.atan2(b, a)


SPEED_LIMIT, SAME_SPEED = 30, 1e-9
"""How often a glide's airspeed is put into its Reynolds numbers, and when that is enough."""
TIGHT = 1e-9
"""Residual of the closure in a search: what it leaves must not pass for a change of balance."""


def tight(model: Model) -> Model:
    """Return the model with its closure solved as closely as a balance of `ACCEPTED` asks."""
    settings = replace(model.settings, tolerance=min(TIGHT, model.settings.tolerance))
    return replace(model, settings=settings)


def _elevator(model: Model) -> int:
    names = model.aircraft.control_names
    if PITCH_CONTROL not in names:
        raise ConfigError(f'trim moves the control named {PITCH_CONTROL}, there are '
                          f'{list(names) or "none"}')
    return names.index(PITCH_CONTROL)


def _loads(model: Model, airspeed: float, alpha: float, elevator: float, air: Air,
           delta0: FloatArray | None, curves_at: float | None = None) -> AeroResult:
    """Return steady loads; curves_at : the airspeed of the section curves, if it is another."""
    deflections = np.zeros(len(model.aircraft.controls))
    deflections[_elevator(model)] = elevator
    onset = Onset(body_to_geometry(-velocity_from_flow_angles(airspeed, alpha, 0.0)), np.zeros(3))
    flown = model.at(curves_at or airspeed, air.kinematic_viscosity, deflections)
    return solver.steady(flown, onset, deflections, density=air.density, delta0=delta0)


def _finish(model: Model, airspeed: float, alpha: float, climb_angle: float, elevator: float,
            throttle: float, aero: AeroResult) -> Trim:
    """Return the trim with its residual, and whether controls and solver allow it."""
    aircraft = model.aircraft
    deflections = np.zeros(len(aircraft.controls))
    deflections[_elevator(model)] = elevator
    residual = _residual(model, airspeed, alpha, climb_angle, throttle, aero)
    low, high = aircraft.controls[_elevator(model)].limits
    message = 'trimmed'
    if aero.status is not Status.CONVERGED:
        message = f'the aerodynamics did not converge, residual {aero.max_residual:.1e}'
    elif np.abs(residual).max() > ACCEPTED:
        message = f'no balance found, residual {np.abs(residual).max():.1e} of the weight'
        if elevator in (low, high):
            message += f', with the elevator at its limit of {math.degrees(elevator):g} deg'
    elif not low <= elevator <= high:
        message = (f'the elevator would have to stand at {math.degrees(elevator):.1f} deg, its '
                   f'limits are {math.degrees(low):g} and {math.degrees(high):g}')
    elif not 0.0 <= throttle <= 1.0:
        full = float(np.linalg.norm(
            thrust(aircraft, velocity_from_flow_angles(airspeed, alpha, 0.0), 1.0)[0]))
        message = (f'the throttle would have to stand at {throttle:.2f}, it goes from 0 to 1 '
                   f'({full:.1f} N at full throttle and this airspeed)')
    status = Status.CONVERGED if message == 'trimmed' else Status.NOT_CONVERGED
    return Trim(airspeed, alpha, climb_angle, Controls(deflections, throttle), residual, aero,
                status, message)


def _residual(model: Model, airspeed: float, alpha: float, climb_angle: float, throttle: float,
              aero: AeroResult) -> FloatArray:
    aircraft = model.aircraft
    weight = aircraft.mass.mass * GRAVITY
    push, turn = thrust(aircraft, velocity_from_flow_angles(airspeed, alpha, 0.0), throttle)
    gravity_B = rotation(quaternion_from_euler(0.0, alpha + climb_angle, 0.0)).T[:, 2] * weight
    force = geometry_to_body(aero.force_G) + push + gravity_B
    moment = geometry_to_body(aero.moment_G) + turn
    return np.array([force[0] / weight, force[2] / weight,
                     moment[1] / (weight * aircraft.reference.chord)])


def _balanced(model: Model, airspeed: float, alpha: float, air: Air,
              state: dict) -> tuple[float, AeroResult]:
    """Return the elevator that balances the pitching moment, or its better limit, and loads."""
    low, high = model.aircraft.controls[_elevator(model)].limits

    def pitching(elevator: float) -> float:
        aero = _loads(model, airspeed, alpha, elevator, air, state['delta'])
        state['aero'], state['delta'] = aero, aero.strips.delta
        return float(geometry_to_body(aero.moment_G)[1])

    at_low, at_high = pitching(low), pitching(high)
    if at_low * at_high > 0.0:
        elevator = low if abs(at_low) < abs(at_high) else high
    else:
        elevator = brentq(pitching, low, high, xtol=1e-13)
    pitching(elevator)
    return elevator, state['aero']


def straight(model: Model, *, airspeed: float, altitude: float, climb_angle: float = 0.0,
             alpha0: float = math.radians(4.0)) -> Trim:
    """
    Return the trim at an airspeed [m/s]: powered along a climb angle [rad], or gliding.

    Elevator and throttle balance an aircraft with engines; without, elevator and climb angle do.
    alpha0 [rad] is where the search starts: it chooses the branch where there are several.
    """
    model, air = tight(model), standard_air(altitude)
    engines = bool(model.aircraft.engines)
    state = {'delta': None}

    def flown(unknown: FloatArray) -> tuple[float, float, float, float]:
        alpha, elevator, third = (float(x) for x in unknown)
        return (alpha, elevator, climb_angle, third) if engines else (alpha, elevator, third, 0.0)

    def imbalance(unknown: FloatArray) -> FloatArray:
        alpha, elevator, climb, throttle = flown(unknown)
        aero = _loads(model, airspeed, alpha, elevator, air, state['delta'])
        state['aero'], state['delta'] = aero, aero.strips.delta
        return _residual(model, airspeed, alpha, climb, throttle, aero)

    # From where the moments balance: far beyond its limits an elevator stalls, and does nothing.
    elevator0, _ = _balanced(model, airspeed, alpha0, air, state)
    start = np.array([alpha0, elevator0, 0.3 if engines else -0.1])
    found = root(imbalance, start, method='hybr', tol=1e-12)
    imbalance(found.x)
    alpha, elevator, climb, throttle = flown(found.x)
    return _finish(model, airspeed, alpha, climb, elevator, throttle, state['aero'])


def glide(model: Model, *, alpha: float, altitude: float,
          delta0: FloatArray | None = None) -> Trim:
    """
    Return the glide at an angle of attack [rad], without thrust.

    The elevator balances the pitching moment; then tan(climb_angle) = -CD / CL and the airspeed
    follows from the weight. delta0 (n,) carries the decambering of a neighbouring alpha along.
    """
    model, air = tight(model), standard_air(altitude)
    airspeed = 20.0
    for _ in range(SPEED_LIMIT):
        found = _glide(model, airspeed, alpha, air, delta0)
        # Coefficients know nothing of the airspeed but the Reynolds number.
        if model.lattice.tables is None or \
                abs(found.airspeed - airspeed) < SAME_SPEED * airspeed:
            break
        airspeed, delta0 = found.airspeed, found.aero.strips.delta
    return found


def _glide(model: Model, trial_speed: float, alpha: float, air: Air,
           delta0: FloatArray | None) -> Trim:
    """Return the glide with the section curves of a trial speed [m/s], whatever the airspeed."""
    weight = model.aircraft.mass.mass * GRAVITY
    state = {'delta': delta0}
    elevator, aero = _balanced(model, trial_speed, alpha, air, state)
    stability = body_to_stability(geometry_to_body(aero.force_G), alpha)
    lift, drag = -float(stability[2]), -float(stability[0])
    airspeed = trial_speed * math.sqrt(weight / math.hypot(lift, drag))
    aero = _loads(model, airspeed, alpha, elevator, air, state['delta'], trial_speed)
    return _finish(model, airspeed, alpha, -math.atan2(drag, lift), elevator, 0.0, aero)


def powered(model: Model, *, alpha: float, altitude: float, climb_angle: float = 0.0,
            delta0: FloatArray | None = None) -> Trim:
    """
    Return the flight at an angle of attack along a climb angle [rad], level by default.

    Elevator, throttle and airspeed balance it, from those of the glide at this angle. delta0 (n,)
    carries the decambering of a neighbouring alpha along.
    """
    if not model.aircraft.engines:
        raise ConfigError(f'{model.aircraft.name} has no engine to hold a climb angle with')
    gliding = glide(model, alpha=alpha, altitude=altitude, delta0=delta0)
    model, air = tight(model), standard_air(altitude)
    elevator0 = float(gliding.controls.deflections[_elevator(model)])
    state = {'delta': gliding.aero.strips.delta}

    def imbalance(unknown: FloatArray) -> FloatArray:
        share, elevator, throttle = (float(x) for x in unknown)
        airspeed = gliding.airspeed * share
        aero = _loads(model, airspeed, alpha, elevator, air, state['delta'])
        state['aero'], state['delta'] = aero, aero.strips.delta
        return _residual(model, airspeed, alpha, climb_angle, throttle, aero)

    found = root(imbalance, np.array([1.0, elevator0, 0.5]), method='hybr', tol=1e-12)
    imbalance(found.x)
    share, elevator, throttle = (float(x) for x in found.x)
    return _finish(model, gliding.airspeed * share, alpha, climb_angle, elevator, throttle,
                   state['aero'])

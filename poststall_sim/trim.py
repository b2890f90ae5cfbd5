# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Straight trimmed flight at an airspeed or at an angle of attack, powered or gliding.

The residual is the sum of forces and moments over weight (and weight times mean chord), from the
same steady loads that the flight starts from. Shafts stand in balance, batteries are full.

Without propellers and with all engines at work, X, Z and M are balanced and the wings are level.
Propellers turn the aircraft and a failed engine leaves the others to pull it round: then Y, L and
N are balanced too, by bank, aileron and rudder, without sideslip.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, root

from poststall_sim import propulsion, slipstream
from poststall_sim.aero import solver
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.engines import Propeller
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
from poststall_sim.propulsion import Meeting, Push
from poststall_sim.state import Controls, Status

ACCEPTED = 1e-6
"""Largest residual of a trim, in weights and weights times mean chord."""
PITCH_CONTROL = 'elevator'
"""The control that trims the pitching moment."""
LATERAL_CONTROLS = ('aileron', 'rudder')
"""The controls that trim rolling and yawing moments where there are any."""
ALL_WORK: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, eq=False)
class Trim:
    """
    A straight flight without acceleration.

    airspeed [m/s]; alpha, climb_angle, bank [rad]; controls; residual (3,): X, Z over weight and
    M over weight times chord, (6,) with Y, L, N where those are balanced too; aero: the loads;
    status and message say whether it can be flown.
    """

    airspeed: float
    alpha: float
    climb_angle: float
    controls: Controls
    residual: FloatArray
    aero: AeroResult
    status: Status
    message: str
    bank: float = 0.0

    @property
    def pitch(self) -> float:
        """Pitch angle [rad]."""
        return pitch_angle(self.alpha, self.climb_angle, self.bank)

    @property
    def q_NB(self) -> FloatArray:
        """Attitude, heading north."""
        return quaternion_from_euler(self.bank, self.pitch, 0.0)

    @property
    def velocity_B(self) -> FloatArray:
        """Velocity through the air (3,) [m/s]."""
        return velocity_from_flow_angles(self.airspeed, self.alpha, 0.0)


def pitch_angle(alpha: float, climb_angle: float, bank: float) -> float:
    """
    Return the pitch angle [rad] of straight flight without sideslip.

    From sin(climb) = a sin(pitch) - b cos(pitch), a = cos(alpha), b = cos(bank) sin(alpha).
    (Stevens & Lewis, Aircraft Control and Simulation, 2nd ed., 2003, sec. 3.6)
    """
    if bank == 0.0:
        return alpha + climb_angle
    a, b = math.cos(alpha), math.cos(bank) * math.sin(alpha)
    return math.asin(min(max(math.sin(climb_angle) / math.hypot(a, b), -1.0), 1.0)) \
        + math.atan2(b, a)


TIGHT = 1e-9
"""Residual of the closure in a search: what it leaves must not pass for a change of balance."""


def _tight(model: Model) -> Model:
    """Return the model with its closure solved as closely as a balance of `ACCEPTED` asks."""
    settings = replace(model.settings, tolerance=min(TIGHT, model.settings.tolerance))
    return replace(model, settings=settings)


def _elevator(model: Model) -> int:
    names = model.aircraft.control_names
    if PITCH_CONTROL not in names:
        raise ConfigError(f'trim moves the control named {PITCH_CONTROL}, there are '
                          f'{list(names) or "none"}')
    return names.index(PITCH_CONTROL)


def _lateral(model: Model, failed: frozenset[str]) -> tuple[str, ...]:
    """Return what balances Y, L and N, nothing where they are left alone."""
    aircraft = model.aircraft
    turns = failed or any(isinstance(engine, Propeller) for engine in aircraft.engines)
    able = all(name in aircraft.control_names for name in LATERAL_CONTROLS)
    return (*LATERAL_CONTROLS, 'bank') if turns and able else ()


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """A flight that may or may not be in balance; deflections (controls,) [rad]."""

    airspeed: float
    alpha: float
    climb_angle: float
    throttle: float
    deflections: FloatArray
    bank: float = 0.0

    def moved(self, model: Model, values: dict[str, float]) -> '_Trial':
        """Return it with other values of its fields and of controls, by name."""
        deflections = self.deflections.copy()
        fields = {}
        for name, value in values.items():
            if name in model.aircraft.control_names:
                deflections[model.aircraft.control_names.index(name)] = value
            else:
                fields[name] = value
        return replace(self, deflections=deflections, **fields)


class _Search:
    """The loads of one trial after another, each from the decambering of the one before."""

    def __init__(self, model: Model, density: float, failed: frozenset[str],
                 delta0: FloatArray | None) -> None:
        self.model = _tight(model)
        self.density = density
        self.failed = failed
        self.delta = delta0
        self.lateral = _lateral(model, failed)

    def push(self, trial: _Trial) -> Push:
        """Return what the engines do, their shafts in balance."""
        aircraft = self.model.aircraft
        meeting = Meeting(
            velocity_from_flow_angles(trial.airspeed, trial.alpha, 0.0), np.zeros(3),
            self.density, propulsion.throttles(aircraft, trial.throttle, self.failed))
        return propulsion.loads(aircraft, propulsion.settled(aircraft, meeting), meeting,
                                self.failed)

    def loads(self, trial: _Trial, push: Push | None) -> AeroResult:
        """Return the loads of the air, with the slipstream of a push."""
        streams = [] if push is None else slipstream.streams(
            self.model.aircraft, self.model.lattice, push.readings, self.density)
        velocity_B = velocity_from_flow_angles(trial.airspeed, trial.alpha, 0.0)
        onset = Onset(body_to_geometry(-velocity_B), np.zeros(3), slipstream.blown(streams))
        aero = solver.steady(self.model, onset, trial.deflections, density=self.density,
                             delta0=self.delta)
        self.delta = aero.strips.delta
        return aero

    def residual(self, trial: _Trial) -> tuple[FloatArray, AeroResult]:
        """Return X, Z over weight and M over weight times chord; where balanced Y, L, N."""
        aircraft, push = self.model.aircraft, self.push(trial)
        aero = self.loads(trial, push)
        weight = aircraft.mass.mass * GRAVITY
        q_NB = quaternion_from_euler(
            trial.bank, pitch_angle(trial.alpha, trial.climb_angle, trial.bank), 0.0)
        force = geometry_to_body(aero.force_G) + push.force_B + rotation(q_NB).T[:, 2] * weight
        moment = (geometry_to_body(aero.moment_G) + push.moment_B) / aircraft.reference.chord
        along = [force[0] / weight, force[2] / weight, moment[1] / weight]
        across = [force[1] / weight, moment[0] / weight, moment[2] / weight]
        return np.array(along + across if self.lateral else along), aero

    def balanced(self, trial: _Trial, free: dict[str, float],
                 scale: dict[str, float] | None = None) -> Trim:
        """
        Return the trim that some fields and controls find, from where they are to start.

        scale : what a unit of some of them stands for.
        """
        start = {**free, **dict.fromkeys(self.lateral, 0.0)}
        units = np.array([(scale or {}).get(name, 1.0) for name in start])

        def at(unknown: FloatArray) -> _Trial:
            return trial.moved(self.model, dict(zip(start, (unknown * units).tolist())))

        found = root(lambda unknown: self.residual(at(unknown))[0],
                     np.array(list(start.values())), method='hybr', tol=1e-12)
        return self.finish(at(found.x))

    def finish(self, trial: _Trial) -> Trim:
        """Return the trim with its residual, and whether controls and solver allow it."""
        residual, aero = self.residual(trial)
        message = self._complaint(trial, residual, aero) or 'trimmed'
        status = Status.CONVERGED if message == 'trimmed' else Status.NOT_CONVERGED
        return Trim(trial.airspeed, trial.alpha, trial.climb_angle,
                    Controls(trial.deflections, trial.throttle), residual, aero, status, message,
                    trial.bank)

    def _complaint(self, trial: _Trial, residual: FloatArray, aero: AeroResult) -> str:
        if aero.status is not Status.CONVERGED:
            return f'the aerodynamics did not converge, residual {aero.max_residual:.1e}'
        at_limit, beyond = '', ''
        for name in (PITCH_CONTROL, *self.lateral[:-1]):
            i = self.model.aircraft.control_names.index(name)
            low, high = self.model.aircraft.controls[i].limits
            value = float(trial.deflections[i])
            if value in (low, high):
                at_limit += f', with the {name} at its limit of {math.degrees(value):g} deg'
            elif not low <= value <= high and not beyond:
                beyond = (f'the {name} would have to stand at {math.degrees(value):.1f} deg, its '
                          f'limits are {math.degrees(low):g} and {math.degrees(high):g}')
        if np.abs(residual).max() > ACCEPTED:
            return (f'no balance found, residual {np.abs(residual).max():.1e} of the weight'
                    + at_limit)
        if not beyond and not 0.0 <= trial.throttle <= 1.0:
            full = float(np.linalg.norm(self.push(replace(trial, throttle=1.0)).force_B))
            return (f'the throttle would have to stand at {trial.throttle:.2f}, it goes from 0 to '
                    f'1 ({full:.1f} N at full throttle and this airspeed)')
        return beyond


def straight(model: Model, *, airspeed: float, altitude: float, climb_angle: float = 0.0,
             alpha0: float = math.radians(4.0), failed: frozenset[str] = ALL_WORK) -> Trim:
    """
    Return the trim at an airspeed [m/s]: powered along a climb angle [rad], or gliding.

    Elevator and throttle balance an aircraft with engines; without, or with all of them failed,
    elevator and climb angle do. alpha0 [rad] is where the search starts: it chooses the branch
    where there are several; failed : names of engines that do not work.
    """
    _elevator(model)
    search = _Search(model, standard_air(altitude).density, failed, None)
    powered = bool(set(model.aircraft.engine_names) - failed)
    trial = _Trial(airspeed, alpha0, climb_angle, 0.0, np.zeros(len(model.aircraft.controls)))
    third = {'throttle': 0.3} if powered else {'climb_angle': -0.1}
    return search.balanced(trial, {'alpha': alpha0, PITCH_CONTROL: 0.0, **third})


def glide(model: Model, *, alpha: float, altitude: float,
          delta0: FloatArray | None = None) -> Trim:
    """
    Return the glide at an angle of attack [rad], without thrust.

    The elevator balances the pitching moment; then tan(climb_angle) = -CD / CL and the airspeed
    follows from the weight. Propellers are idle, and the balance with what they brake is looked
    for from there. delta0 (n,) carries the decambering of a neighbouring alpha along.
    """
    search, trial = _gliding(model, alpha, altitude, delta0)
    if not any(isinstance(engine, Propeller) for engine in model.aircraft.engines):
        return search.finish(trial)
    names = model.aircraft.control_names
    return search.balanced(
        trial, {'airspeed': 1.0, PITCH_CONTROL: trial.deflections[names.index(PITCH_CONTROL)],
                'climb_angle': trial.climb_angle}, {'airspeed': trial.airspeed})


def _gliding(model: Model, alpha: float, altitude: float,
             delta0: FloatArray | None) -> tuple[_Search, _Trial]:
    """Return the glide at an angle of attack [rad] without any engines."""
    search = _Search(model, standard_air(altitude).density, ALL_WORK, delta0)
    weight = model.aircraft.mass.mass * GRAVITY
    low, high = model.aircraft.controls[_elevator(model)].limits
    trial = _Trial(20.0, alpha, 0.0, 0.0, np.zeros(len(model.aircraft.controls)))

    def at(elevator: float) -> AeroResult:
        return search.loads(trial.moved(model, {PITCH_CONTROL: elevator}), None)

    elevator = _crossing(lambda x: float(geometry_to_body(at(x).moment_G)[1]), low, high)
    stability = body_to_stability(geometry_to_body(at(elevator).force_G), alpha)
    lift, drag = -float(stability[2]), -float(stability[0])
    return search, trial.moved(model, {
        PITCH_CONTROL: elevator, 'climb_angle': -math.atan2(drag, lift),
        'airspeed': trial.airspeed * math.sqrt(weight / math.hypot(lift, drag))})


def _crossing(moment: Callable[[float], float], low: float, high: float) -> float:
    """Return where a moment is none, or the end at which it is less."""
    at_low, at_high = moment(low), moment(high)
    if at_low * at_high > 0.0:
        return low if abs(at_low) < abs(at_high) else high
    return brentq(moment, low, high, xtol=1e-13)


def powered(model: Model, *, alpha: float, altitude: float, climb_angle: float = 0.0,
            delta0: FloatArray | None = None) -> Trim:
    """
    Return the flight at an angle of attack along a climb angle [rad], level by default.

    Elevator, throttle and airspeed balance it, from those of the glide at this angle. delta0 (n,)
    carries the decambering of a neighbouring alpha along.
    """
    if not model.aircraft.engines:
        raise ConfigError(f'{model.aircraft.name} has no engine to hold a climb angle with')
    search, trial = _gliding(model, alpha, altitude, delta0)
    elevator = float(trial.deflections[_elevator(model)])
    return search.balanced(
        replace(trial, climb_angle=climb_angle),
        {'airspeed': 1.0, PITCH_CONTROL: elevator, 'throttle': 0.5},
        {'airspeed': trial.airspeed})

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Straight trimmed flight at an airspeed or at an angle of attack, powered or gliding.

The residual is the sum of forces and moments over weight (and weight times mean chord), from the
same steady loads that the flight starts from. Shafts stand in balance, batteries are full.

Without propellers and with all engines at work, X, Z and M are balanced and the wings are level.
Propellers turn the aircraft and a failed engine leaves the others to pull it round: then Y, L and
N are balanced too, by bank, aileron and rudder, without sideslip. `manoeuvre` has the others.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, root

from poststall_sim import failures, propulsion, slipstream
from poststall_sim.aero import solver
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aircraft import ConfigError
from poststall_sim.atmosphere import Air
from poststall_sim.engines import Propeller
from poststall_sim.failures import Failed
from poststall_sim.frames import (
    GRAVITY,
    FloatArray,
    body_to_geometry,
    body_to_stability,
    cross,
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
    A flight whose forces and moments balance, straight and wings level unless it says otherwise.

    airspeed [m/s]; alpha, climb_angle [rad]; controls; residual : X, Z over weight and M over
    weight times chord, (3,), or of all three axes, (6,), where sideways balances were asked for;
    aero: the loads; push: what the engines do; status and message say whether it can be flown;
    beta, bank [rad]; turn_rate of the heading, pull_rate of pitch beyond it [rad/s]; turning : the
    loads are those with a wake that curves with the path, see `turning`; angles (k,) of the
    movable parts [rad], once it has loads.
    """

    airspeed: float
    alpha: float
    climb_angle: float
    controls: Controls
    residual: FloatArray
    aero: AeroResult | None
    status: Status
    message: str
    beta: float = 0.0
    bank: float = 0.0
    turn_rate: float = 0.0
    pull_rate: float = 0.0
    push: Push | None = None
    turning: bool = False
    angles: FloatArray | None = None

    @property
    def pitch(self) -> float:
        """Pitch angle [rad]."""
        return pitch_angle(self.alpha, self.beta, self.bank, self.climb_angle)

    @property
    def q_NB(self) -> FloatArray:
        """Attitude, heading north."""
        return quaternion_from_euler(self.bank, self.pitch, 0.0)

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
FLOATING_LIMIT = 40
"""How often a part that floats is put where the flow about it leaves it without a moment."""
_LENGTHWAYS = [0, 2, 4]
"""X, Z and M among the six balances."""
_SAMPLES = np.linspace(0.05, 1.0, 20)
"""Throttles among which a search with propellers looks for where to begin."""


def tight(model: Model) -> Model:
    """Return the model with its closure solved as closely as a balance of `ACCEPTED` asks."""
    settings = replace(model.settings, tolerance=min(TIGHT, model.settings.tolerance))
    return replace(model, settings=settings)


def pushed(model: Model, trial: Trim, density: float, failed: frozenset[str]) -> Push:
    """Return what the engines do in a flight, their shafts in balance and their batteries full."""
    aircraft = model.aircraft
    meeting = Meeting(trial.velocity_B, trial.rates_B, density,
                      propulsion.throttles(aircraft, trial.controls.throttle, failed))
    return propulsion.balanced(aircraft, meeting, failed)


def onset_of(model: Model, flown: Trim, density: float) -> Onset:
    """Return the air that a flight meets, the slipstream of its push in it."""
    streams = [] if flown.push is None else slipstream.streams(
        model.aircraft, model.lattice, flown.push.readings, density)
    return Onset(body_to_geometry(-flown.velocity_B), body_to_geometry(flown.rates_B),
                 slipstream.blown(streams))


def in_air(model: Model, trial: Trim, air: Air, delta0: FloatArray | None,
           failed: Failed = ()) -> Trim:
    """Return a flight with the loads of the air; failed : what has failed of each part."""
    asked = model.lattice.angles(trial.controls.deflections)
    free = asked if trial.angles is None else trial.angles
    for _ in range(FLOATING_LIMIT):
        angles = failures.angles(failed, asked, asked, free)
        flown = model.at(trial.airspeed, air.kinematic_viscosity, trial.controls.deflections,
                         angles)
        aero = solver.steady(
            flown, onset_of(model, trial, air.density), trial.controls.deflections,
            density=air.density, delta0=delta0, angles=angles)
        free = model.lattice.floating_angles(angles, aero.strips.alpha)
        if np.abs(failures.angles(failed, asked, asked, free) - angles).max(initial=0.0) < TIGHT:
            break
        delta0 = aero.strips.delta
    return replace(trial, aero=aero, angles=angles)


def balance(model: Model, found: Trim) -> tuple[FloatArray, float]:
    """
    Return what is left of the six balances of a flight with push and air, and the side force felt.

    Forces over weight, moments over weight times chord, in B about the centre of gravity.
    """
    mass = model.aircraft.mass
    weight = mass.mass * GRAVITY
    felt = geometry_to_body(found.aero.force_G) + found.push.force_B
    rates = found.rates_B
    force = felt + weight * rotation(found.q_NB)[2] \
        - mass.mass * cross(rates, found.velocity_B)
    moment = geometry_to_body(found.aero.moment_G) + found.push.moment_B \
        - cross(rates, mass.inertia_B @ rates)
    return np.concatenate([force, moment / model.aircraft.reference.chord]) / weight, \
        float(felt[1]) / weight


def first_throttle(model: Model, airspeed: float, density: float, failed: frozenset[str],
                   otherwise: float = 0.3) -> float:
    """
    Return the throttle at which a search begins, without propellers one given.

    A propeller that is turned by the air answers to no throttle: with those, the least that pulls
    with a twelfth of the weight, as much as the drag of many an aircraft.
    """
    if not _propellers(model):
        return otherwise
    pull = propulsion.pull(model.aircraft, airspeed, density, failed)
    wanted = model.aircraft.mass.mass * GRAVITY / 12.0
    return next((each for each in map(float, _SAMPLES) if pull(each) > wanted), 1.0)


def _propellers(model: Model) -> bool:
    return any(isinstance(engine, Propeller) for engine in model.aircraft.engines)


def _elevator(model: Model) -> int:
    names = model.aircraft.control_names
    if PITCH_CONTROL not in names:
        raise ConfigError(f'trim moves the control named {PITCH_CONTROL}, there are '
                          f'{list(names) or "none"}')
    return names.index(PITCH_CONTROL)


class _Search:
    """The flights of a search, each from the decambering of the one before."""

    def __init__(self, model: Model, air: Air, failed: frozenset[str],
                 delta0: FloatArray | None) -> None:
        names = model.aircraft.control_names
        self.model = tight(model)
        self.air, self.failed, self.delta = air, failed, delta0
        able = all(name in names for name in LATERAL_CONTROLS)
        self.lateral = (*LATERAL_CONTROLS, 'bank') \
            if (failed or _propellers(model)) and able else ()

    def trial(self, airspeed: float, alpha: float, climb_angle: float = 0.0) -> Trim:
        """Return a flight with its controls at rest that nothing is known of yet."""
        controls = Controls(np.zeros(len(self.model.aircraft.controls)))
        return Trim(airspeed, alpha, climb_angle, controls, np.zeros(0), None,
                    Status.NOT_CONVERGED, '')

    def moved(self, trial: Trim, values: dict[str, float]) -> Trim:
        """Return a flight with other values of its fields and controls, by name."""
        names = self.model.aircraft.control_names
        deflections, fields = trial.controls.deflections.copy(), dict(values)
        for name in set(names) & set(values):
            deflections[names.index(name)] = fields.pop(name)
        throttle = fields.pop('throttle', trial.controls.throttle)
        return replace(trial, controls=Controls(deflections, throttle), **fields)

    def in_air(self, trial: Trim) -> Trim:
        """Return a flight with the loads of the air."""
        found = in_air(self.model, trial, self.air, self.delta)
        self.delta = found.aero.strips.delta
        return found

    def flown(self, trial: Trim) -> Trim:
        """Return a flight with its engines, loads and residual."""
        push = pushed(self.model, trial, self.air.density, self.failed)
        found = self.in_air(replace(trial, push=push))
        residual, _ = balance(self.model, found)
        return replace(found, residual=residual if self.lateral else residual[_LENGTHWAYS])

    def elevator(self, trial: Trim) -> float:
        """Return what balances the pitching moment of the air, or the limit that is nearer."""
        low, high = self.model.aircraft.controls[_elevator(self.model)].limits
        return crossing(lambda x: float(geometry_to_body(self.in_air(
            self.moved(trial, {PITCH_CONTROL: x})).aero.moment_G)[1]), low, high)

    def balanced(self, trial: Trim, free: dict[str, float], airspeed: float = 1.0) -> Trim:
        """
        Return the trim that some fields and controls find, from where they are to start.

        airspeed : what a unit of an unknown airspeed stands for [m/s].
        """
        start = {**free, **dict.fromkeys(self.lateral, 0.0)}
        units = np.array([airspeed if name == 'airspeed' else 1.0 for name in start])

        def at(unknown: FloatArray) -> Trim:
            return self.moved(trial, dict(zip(start, (unknown * units).tolist())))

        found = root(lambda unknown: self.flown(at(unknown)).residual,
                     np.array(list(start.values())), method='hybr', tol=1e-12)
        return self.judged(self.flown(at(found.x)))

    def judged(self, found: Trim) -> Trim:
        """Return a flight with whether controls and solver allow it."""
        complaint = self._complaint(found)
        return replace(found, message=complaint or 'trimmed',
                       status=Status.NOT_CONVERGED if complaint else Status.CONVERGED)

    def _complaint(self, found: Trim) -> str:
        if found.aero.status is not Status.CONVERGED:
            return f'the aerodynamics did not converge, residual {found.aero.max_residual:.1e}'
        at_limit, beyond = '', ''
        for name in (PITCH_CONTROL, *self.lateral[:-1]):
            i = self.model.aircraft.control_names.index(name)
            low, high = self.model.aircraft.controls[i].limits
            value = float(found.controls.deflections[i])
            if value in (low, high):
                at_limit += f', with the {name} at its limit of {math.degrees(value):g} deg'
            elif not low <= value <= high and not beyond:
                beyond = (f'the {name} would have to stand at {math.degrees(value):.1f} deg, its '
                          f'limits are {math.degrees(low):g} and {math.degrees(high):g}')
        worst, throttle = np.abs(found.residual).max(), found.controls.throttle
        if worst > ACCEPTED:
            idle = set(self.model.aircraft.engine_names) - self.failed and not self._full(found)
            return (f'no balance found, residual {worst:.1e} of the weight' + at_limit
                    + f', without any thrust at {found.airspeed:.1f} m/s' * bool(idle))
        if not beyond and not 0.0 <= throttle <= 1.0:
            push = self._full(found)
            return (f'the throttle would have to stand at {throttle:.2f}, it goes from 0 to 1 '
                    f'({push:.1f} N at full throttle and this airspeed)')
        return beyond

    def _full(self, found: Trim) -> float:
        """Return the thrust at full throttle [N], below 0 where it brakes."""
        full = pushed(self.model, self.moved(found, {'throttle': 1.0}), self.air.density,
                      self.failed).force_B
        return math.copysign(float(np.linalg.norm(full)), full[0])


def straight(model: Model, *, airspeed: float, altitude: float, climb_angle: float = 0.0,
             alpha0: float = math.radians(4.0), failed: frozenset[str] = ALL_WORK) -> Trim:
    """
    Return the trim at an airspeed [m/s]: powered along a climb angle [rad], or gliding.

    Elevator and throttle balance an aircraft with engines; without, or with all of them failed,
    elevator and climb angle do. alpha0 [rad] is where the search starts: it chooses the branch
    where there are several; failed : names of engines that do not work.
    """
    _elevator(model)
    model.aircraft.require_engines(failed)
    search = _Search(model, model.atmosphere.at(altitude), failed, None)
    trial = search.trial(airspeed, alpha0, climb_angle)
    third = {'throttle': first_throttle(model, airspeed, search.air.density, failed)} \
        if set(model.aircraft.engine_names) - failed else {'climb_angle': -0.1}
    # From where the moments balance: far beyond its limits an elevator stalls, and does nothing.
    return search.balanced(
        trial, {'alpha': alpha0, PITCH_CONTROL: search.elevator(trial), **third})


def glide(model: Model, *, alpha: float, altitude: float,
          delta0: FloatArray | None = None) -> Trim:
    """
    Return the glide at an angle of attack [rad], without thrust.

    The elevator balances the pitching moment; then tan(climb_angle) = -CD / CL and the airspeed
    follows from the weight. Propellers are idle, and the balance with what they brake is looked
    for from there. delta0 (n,) carries the decambering of a neighbouring alpha along.
    """
    search, trial = _gliding(model, alpha, altitude, delta0)
    if not _propellers(model):
        return search.judged(search.flown(trial))
    elevator = float(trial.controls.deflections[_elevator(model)])
    return search.balanced(trial, {'airspeed': 1.0, PITCH_CONTROL: elevator,
                                   'climb_angle': trial.climb_angle}, trial.airspeed)


def _gliding(model: Model, alpha: float, altitude: float,
             delta0: FloatArray | None) -> tuple[_Search, Trim]:
    """Return the glide at an angle of attack [rad] without any engines."""
    search = _Search(model, model.atmosphere.at(altitude), ALL_WORK, delta0)
    weight = model.aircraft.mass.mass * GRAVITY
    trial = search.trial(20.0, alpha)
    for _ in range(SPEED_LIMIT):
        before = trial.airspeed
        trial = search.moved(trial, {PITCH_CONTROL: search.elevator(trial)})
        stability = body_to_stability(
            geometry_to_body(search.in_air(trial).aero.force_G), alpha)
        lift, drag = -float(stability[2]), -float(stability[0])
        trial = replace(trial, climb_angle=-math.atan2(drag, lift),
                        airspeed=before * math.sqrt(weight / math.hypot(lift, drag)))
        # Coefficients know nothing of the airspeed but the Reynolds number.
        if model.lattice.tables is None or \
                abs(trial.airspeed - before) < SAME_SPEED * before:
            break
    return search, trial


def crossing(balance: Callable[[float], float], low: float, high: float) -> float:
    """Return where a balance is none, or the end at which it is less."""
    at_low, at_high = balance(low), balance(high)
    if at_low * at_high > 0.0:
        return low if abs(at_low) < abs(at_high) else high
    known = {low: at_low, high: at_high}
    return brentq(lambda x: known[x] if x in known else balance(x), low, high, xtol=1e-13)


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
    elevator = float(trial.controls.deflections[_elevator(model)])
    throttle = first_throttle(model, trial.airspeed, search.air.density, ALL_WORK, otherwise=0.5)
    return search.balanced(
        replace(trial, climb_angle=climb_angle),
        {'airspeed': 1.0, PITCH_CONTROL: elevator, 'throttle': throttle}, trial.airspeed)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Engines at work: thrust, torque and shafts.

About a shaft with the inertia I, turned by its drive and held back by the air,

    I d(Omega)/dt = Q_drive - Q_air.

With h = +-I Omega along the thrust (plus: clockwise, seen from behind) the airframe feels the
thrust at its place, the drive's reaction -+Q_drive along the thrust, so that a propeller that
turns clockwise rolls it to the left, and -omega x h as it turns: the rotor is a part of the
aircraft whose angular momentum the inertia of the aircraft does not hold. (Etkin & Reid, Dynamics
of Flight, 3rd ed., 1996, sec. 4.6)
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import bisect, brentq

from poststall_sim.aircraft import Aircraft
from poststall_sim.engines import Coefficients, ElectricMotor, Engine, Propeller, ThrustTable
from poststall_sim.frames import FloatArray, cross, geometry_to_body
from poststall_sim.state import EngineReadings, EngineState

_SAMPLES = 64
"""Shaft speeds at which a balance of torques is looked for."""
_ANY = 0.01
"""A throttle that engines answer to, if they answer to all."""


@dataclass(frozen=True, slots=True, eq=False)
class Meeting:
    """
    What the engines meet: air, and what is asked of them.

    velocity_B (3,) of the centre of gravity through the air [m/s]; rates_B (3,) [rad/s]; density
    [kg/m^3]; throttles (k,) 0..1 in the order of ``aircraft.engines``.
    """

    velocity_B: FloatArray
    rates_B: FloatArray
    density: float
    throttles: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Push:
    """Force (3,) [N] and moment (3,) about the centre of gravity [N m] in B, and each engine."""

    force_B: FloatArray
    moment_B: FloatArray
    readings: EngineReadings

    @property
    def load(self) -> FloatArray:
        """Force and moment (6,)."""
        return np.concatenate([self.force_B, self.moment_B])


def throttles(aircraft: Aircraft, throttle: float, failed: frozenset[str]) -> FloatArray:
    """Return the throttle of each engine (k,): 0 for those that have failed."""
    return np.array([0.0 if name in failed else throttle for name in aircraft.engine_names])


def loads(aircraft: Aircraft, state: EngineState, meeting: Meeting,
          failed: frozenset[str] = frozenset()) -> Push:
    """Return what all engines do to the aircraft."""
    force, moment = np.zeros(3), np.zeros(3)
    count = len(aircraft.engines)
    axial, thrust, torque, voltage, current = (np.zeros(count) for _ in range(5))
    for i, engine in enumerate(aircraft.engines):
        direction_B, arm_B = _line(aircraft, engine)
        throttle = float(meeting.throttles[i])
        axial[i] = _axial(aircraft, engine, meeting)
        if isinstance(engine, Propeller):
            speed, sign = float(state.speed[i]), engine.rotation.value
            thrust[i], torque[i] = of_air(engine, speed, axial[i], meeting.density)
            driving = _driving(engine, speed, torque[i], throttle, float(state.charge[i]))
            if isinstance(engine.drive, ElectricMotor):
                current[i] = throttle * _current(engine.drive, speed, throttle, state.charge[i])
                voltage[i] = _open_voltage(engine.drive, state.charge[i]) \
                    - current[i] * engine.drive.battery.resistance
            momentum_B = sign * engine.inertia * speed * direction_B
            moment -= sign * driving * direction_B + cross(meeting.rates_B, momentum_B)
        elif isinstance(engine, ThrustTable):
            thrust[i] = _from_table(engine, throttle, axial[i])
        else:
            # Past its zero-thrust airspeed the line would brake, the harder the more throttle.
            share = min(max(1.0 - axial[i] / engine.zero_thrust_airspeed, 0.0), 1.0)
            thrust[i] = throttle * engine.static_thrust * share
        push = thrust[i] * direction_B
        force += push
        moment += cross(arm_B, push)
    return Push(force, moment, EngineReadings(
        speed=state.speed, charge=state.charge, axial=axial, thrust=thrust, torque=torque,
        voltage=voltage, current=current,
        failed=np.array([float(name in failed) for name in aircraft.engine_names])))


def balanced(aircraft: Aircraft, meeting: Meeting,
             failed: frozenset[str] = frozenset()) -> Push:
    """Return what all engines do with their shafts in balance and their batteries full."""
    return loads(aircraft, settled(aircraft, meeting), meeting, failed)


def pull(aircraft: Aircraft, airspeed: float, density: float,
         failed: frozenset[str] = frozenset()) -> Callable[[float], float]:
    """Return the force forward [N] by throttle in flight straight ahead, shafts in balance."""
    ahead = np.array([airspeed, 0.0, 0.0])
    return lambda throttle: float(balanced(aircraft, Meeting(
        ahead, np.zeros(3), density, throttles(aircraft, throttle, failed)), failed).force_B[0])


def idle_throttle(aircraft: Aircraft, airspeed: float, density: float,
                  failed: frozenset[str] = frozenset()) -> float:
    """
    Return the throttle up to which engines answer to none; 0 where they answer to all.

    The air turns a propeller faster than its motor would: the controller passes no current back.
    """
    force = pull(aircraft, airspeed, density, failed)
    closed, full = force(0.0), force(1.0)
    least = closed + 1e-9 * abs(full - closed)
    if force(_ANY) > least or full <= closed:
        return 0.0
    return bisect(lambda throttle: 1.0 if force(throttle) > least else -1.0, _ANY, 1.0, xtol=1e-6)


def advance(aircraft: Aircraft, state: EngineState, meeting: Meeting, dt: float) -> EngineState:
    """
    Return the engines a time [s] later, in air and under throttles that stay the same.

    A governed shaft follows its exponential exactly; one with a motor goes by the exponential
    Rosenbrock-Euler rule, of second order and stable however stiff. (Hochbruck & Ostermann, Acta
    Numerica 19, 2010, sec. 2.4)
    """
    speed, charge = state.speed.copy(), state.charge.copy()
    for i, engine in enumerate(aircraft.engines):
        if not isinstance(engine, Propeller):
            continue
        throttle, before = float(meeting.throttles[i]), float(speed[i])
        if not isinstance(engine.drive, ElectricMotor):
            target = throttle * engine.drive.greatest_speed
            speed[i] = target + (before - target) * math.exp(-dt / engine.drive.spool_time)
            continue
        axial = _axial(aircraft, engine, meeting)
        rate = spin(engine, before, axial, meeting.density, throttle, charge[i])
        slope = _spin_slope(engine, before, axial, meeting.density, throttle, charge[i])
        z = min(slope * dt, 50.0)   # a value that is not finite must not raise
        growth = math.expm1(z) / z if abs(z) > 1e-9 else 1.0
        speed[i] = max(before + dt * growth * rate, 0.0)
        share = throttle * dt / engine.drive.battery.capacity
        first = share * _current(engine.drive, before, throttle, charge[i])
        last = share * _current(engine.drive, float(speed[i]), throttle, charge[i] - first)
        charge[i] = max(charge[i] - 0.5 * (first + last), 0.0)
    return EngineState(speed, charge)


def settled(aircraft: Aircraft, meeting: Meeting,
            charge: FloatArray | None = None) -> EngineState:
    """
    Return the engines with their shafts in balance, the batteries full or at a charge (k,).

    Where several speeds balance, as of a propeller that the air can turn, the greatest.
    """
    charge = np.ones(len(aircraft.engines)) if charge is None else charge
    return EngineState(np.array([
        _settled_speed(engine, _axial(aircraft, engine, meeting), meeting.density,
                       float(meeting.throttles[i]), float(charge[i]))
        if isinstance(engine, Propeller) else 0.0
        for i, engine in enumerate(aircraft.engines)]), charge)


def _settled_speed(engine: Propeller, axial: float, density: float, throttle: float,
                   charge: float) -> float:
    if not isinstance(engine.drive, ElectricMotor):
        return throttle * engine.drive.greatest_speed

    def rate(speed: float) -> float:
        return spin(engine, speed, axial, density, throttle, charge)

    # No faster than without load, or than the air turns it.
    free = throttle * _open_voltage(engine.drive, charge) * engine.drive.speed_constant \
        / engine.drive.gear
    blown = 2.0 * math.pi * max(axial, 0.0) / (
        _free_advance_ratio(engine.coefficients) * engine.diameter)
    highest = 1.01 * max(free, blown)
    speeds = np.linspace(0.0, highest, _SAMPLES)
    for low, high in zip(speeds[-2::-1], speeds[:0:-1]):
        if rate(low) > 0.0:
            return brentq(rate, low, high, xtol=1e-13 * highest)
    return 0.0


def _free_advance_ratio(table: Coefficients) -> float:
    """Return the least advance ratio at which the air turns the propeller."""
    ratio, power = table.advance_ratio, table.power
    below = np.flatnonzero(power < 0.0)
    if below.size:
        i = below[0] - 1
    elif power[-1] < power[-2]:
        i = -2
    else:
        return math.inf
    steps = power[i] / (power[i] - power[i + 1])
    return float(ratio[i] + steps * (ratio[i + 1] - ratio[i]))


def spin(engine: Propeller, speed: float, axial: float, density: float, throttle: float,
         charge: float) -> float:
    """Return d(Omega)/dt of a shaft [rad/s^2]."""
    drive = engine.drive
    if not isinstance(drive, ElectricMotor):
        return (throttle * drive.greatest_speed - speed) / drive.spool_time
    _, torque = of_air(engine, speed, axial, density)
    return (_motor_torque(drive, speed, throttle, charge) - torque) / engine.inertia


def spins(aircraft: Aircraft, state: EngineState, meeting: Meeting) -> FloatArray:
    """Return d(Omega)/dt of the shafts (k,) [rad/s^2], 0 where there is none."""
    return np.array([
        spin(engine, float(state.speed[i]), _axial(aircraft, engine, meeting), meeting.density,
             float(meeting.throttles[i]), float(state.charge[i]))
        if isinstance(engine, Propeller) else 0.0 for i, engine in enumerate(aircraft.engines)])


def _spin_slope(engine: Propeller, speed: float, axial: float, density: float, throttle: float,
                charge: float) -> float:
    """Return the change of `spin` with the speed [1/s], on the side where the shaft turns."""
    step = 1e-5 * max(speed, 1.0)
    low, high = max(speed - step, 0.0), speed + step
    return (spin(engine, high, axial, density, throttle, charge)
            - spin(engine, low, axial, density, throttle, charge)) / (high - low)


def of_air(engine: Propeller, speed: float, axial: float, density: float) -> tuple[float, float]:
    """Return thrust [N] and torque [N m] of the air on a propeller at a shaft speed [rad/s]."""
    n = speed / (2.0 * math.pi)
    if n * engine.diameter <= 1e-12 * abs(axial) or n == 0.0:
        return 0.0, 0.0   # the lines beyond the last row have no more than that at rest
    ct, cp = coefficients(engine.coefficients, axial / (n * engine.diameter))
    pressure = density * n * n * engine.diameter ** 4
    return pressure * ct, pressure * engine.diameter * cp / (2.0 * math.pi)


def coefficients(table: Coefficients, ratio: float) -> tuple[float, float]:
    """Return CT and CP at an advance ratio."""
    known = table.advance_ratio
    if ratio <= known[-1]:
        return (float(np.interp(ratio, known, table.thrust)),
                float(np.interp(ratio, known, table.power)))
    beyond = (ratio - known[-1]) / (known[-1] - known[-2])
    return (float(table.thrust[-1] + beyond * (table.thrust[-1] - table.thrust[-2])),
            float(table.power[-1] + beyond * (table.power[-1] - table.power[-2])))


def _from_table(engine: ThrustTable, throttle: float, axial: float) -> float:
    """Return thrust [N] by straight lines over airspeed, then over throttle."""
    at = [float(np.interp(axial, engine.airspeed, row)) for row in engine.thrust]
    return float(np.interp(throttle, engine.throttle, at))


def _open_voltage(drive: ElectricMotor, charge: float) -> float:
    battery = drive.battery
    if charge <= 0.0:
        return 0.0
    return float(battery.empty_voltage + charge * (battery.voltage - battery.empty_voltage))


def _current(drive: ElectricMotor, speed: float, throttle: float, charge: float) -> float:
    """
    Return the current through a motor [A].

    The controller gives the share d of the battery's voltage on, and takes d times the current:

        d (E - d i R_battery) = i R + Omega_motor / Kv,   and no less than none.
    """
    across = throttle * _open_voltage(drive, charge) \
        - drive.gear * speed / drive.speed_constant
    return max(across / (drive.resistance + throttle ** 2 * drive.battery.resistance), 0.0)


def _motor_torque(drive: ElectricMotor, speed: float, throttle: float, charge: float) -> float:
    """Return the torque of a motor on its propeller's shaft [N m]: friction holds it at rest."""
    torque = drive.gear * (_current(drive, speed, throttle, charge) - drive.no_load_current) \
        / drive.speed_constant
    return torque if speed > 0.0 else max(torque, 0.0)


def _driving(engine: Propeller, speed: float, torque: float, throttle: float,
             charge: float) -> float:
    """Return the torque of the drive [N m], whose reaction the airframe feels."""
    if isinstance(engine.drive, ElectricMotor):
        return _motor_torque(engine.drive, speed, throttle, charge)
    # The governor's is what the air and the change of speed ask for.
    return torque + engine.inertia * spin(engine, speed, 0.0, 0.0, throttle, charge)


def _line(aircraft: Aircraft, engine: Engine) -> tuple[FloatArray, FloatArray]:
    """Return the direction of the thrust and its place from the centre of gravity, (3,) in B."""
    arm = np.array(engine.position_G) - np.array(aircraft.mass.cg_G)
    return geometry_to_body(np.array(engine.direction_G)), geometry_to_body(arm)


def _axial(aircraft: Aircraft, engine: Engine, meeting: Meeting) -> float:
    """Return the airspeed along the thrust where the engine is [m/s]."""
    direction_B, arm_B = _line(aircraft, engine)
    return float((meeting.velocity_B + cross(meeting.rates_B, arm_B)) @ direction_B)

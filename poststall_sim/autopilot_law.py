# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The law of the example autopilot: pitch, bank and airspeed held, and a way out of the stall.

One pure function, `answer`: what is seen and remembered gives what is commanded and what is to be
remembered. Attitudes, rates and angles of flow are those of B, deflections have the signs of
`frames`: elevator down pushes, aileron rolls to the right, rudder left turns to the left.
"""

import math
from dataclasses import dataclass, replace

from poststall_sim.frames import GRAVITY


@dataclass(frozen=True, slots=True)
class Law:
    """
    What is to be held, gains and limits; as they are, they suit the trainer from 11 to 18 m/s.

    An attitude error asks for a rate of so much per radian (``*_gain`` [1/s]), within
    ``*_rate_limit`` [rad/s]; the control moves by so much per rate that is lacking
    (``*_rate_gain`` [s]) and per its integral (``*_integral_gain`` [-]). A pull is given no more
    rate than ``pitch_alpha_gain`` [1/s] per angle of attack that is left to ``recovered_alpha``.
    """

    pitch: float = 0.09
    roll: float = 0.0
    airspeed: float = 12.0
    pitch_gain: float = 1.5
    pitch_rate_limit: float = 0.7
    pitch_alpha_gain: float = 4.0
    pitch_rate_gain: float = 0.25
    pitch_integral_gain: float = 0.8
    roll_gain: float = 1.5
    roll_rate_limit: float = 0.8
    roll_rate_gain: float = 0.15
    roll_integral_gain: float = 0.5
    yaw_rate_gain: float = 0.1
    sideslip_gain: float = 0.5
    airspeed_gain: float = 0.2
    airspeed_integral_gain: float = 0.06
    stall_alpha: float = 0.25
    stall_share: float = 0.3
    recovered_alpha: float = 0.16
    recovered_airspeed: float = 11.0
    recovery_alpha: float = 0.08
    recovery_alpha_gain: float = 1.0
    recovery_rudder_gain: float = 0.5
    recovery_throttle: float = 1.0
    elevator_limit: float = 0.35
    aileron_limit: float = 0.35
    rudder_limit: float = 0.4


@dataclass(frozen=True, slots=True)
class Seen:
    """
    One state: roll, pitch, alpha, beta [rad]; rates p, q, r [rad/s]; airspeed [m/s].

    stalled : share of the strips that are, 0..1.
    """

    roll: float
    pitch: float
    p: float
    q: float
    r: float
    airspeed: float
    alpha: float
    beta: float
    stalled: float = 0.0


@dataclass(frozen=True, slots=True)
class Memory:
    """What the law remembers: which controls hold the aircraft, and whether it is in a stall."""

    aileron: float = 0.0
    elevator: float = 0.0
    throttle: float = 0.0
    recovering: bool = False


@dataclass(frozen=True, slots=True)
class Answer:
    """Deflections [rad] and throttle 0..1; the names are those of the controls."""

    aileron: float
    elevator: float
    rudder: float
    throttle: float


def answer(law: Law, memory: Memory, seen: Seen, dt: float) -> tuple[Answer, Memory]:
    """Return what to command in a state and what to remember; dt [s] since the state before."""
    memory = replace(memory, recovering=is_recovering(law, memory, seen))
    return (_recover if memory.recovering else _hold)(law, memory, seen, dt)


def is_recovering(law: Law, memory: Memory, seen: Seen) -> bool:
    """Tell whether the law is to leave a stall: it begins at once and ends when all is back."""
    if seen.alpha > law.stall_alpha or seen.stalled > law.stall_share:
        return True
    back = seen.alpha < law.recovered_alpha and seen.airspeed > law.recovered_airspeed
    return memory.recovering and not back


def _hold(law: Law, memory: Memory, seen: Seen, dt: float) -> tuple[Answer, Memory]:
    """Hold pitch and bank by their rates, the airspeed by throttle, the ball in the middle."""
    wanted = min(_within(law.pitch_gain * (law.pitch - seen.pitch), law.pitch_rate_limit),
                 law.pitch_alpha_gain * (law.recovered_alpha - seen.alpha))
    lacking = wanted - (seen.q * math.cos(seen.roll) - seen.r * math.sin(seen.roll))
    held = _within(memory.elevator - law.pitch_integral_gain * lacking * dt, law.elevator_limit)
    aileron, memory = _bank(law, memory, seen, law.roll, dt)
    slow = law.airspeed - seen.airspeed
    throttle = memory.throttle + law.airspeed_gain * slow
    power = memory.throttle
    if 0.0 < throttle < 1.0:   # else, as in a dive, it would add up what it cannot answer
        power = _throttle(power + law.airspeed_integral_gain * slow * dt)
    return Answer(
        aileron=aileron,
        elevator=_within(held - law.pitch_rate_gain * lacking, law.elevator_limit),
        rudder=_rudder(law, seen),
        throttle=_throttle(throttle),
    ), replace(memory, elevator=held, throttle=power)


def _recover(law: Law, memory: Memory, seen: Seen, dt: float) -> tuple[Answer, Memory]:
    """Push until alpha is back, level the wings, by rudder alone while stalled; full power."""
    push = law.recovery_alpha_gain * (seen.alpha - law.recovery_alpha)
    if seen.alpha > law.recovered_alpha:
        # Past the stall an aileron that goes down stalls its wing the more.
        memory = replace(memory, aileron=0.0)
        aileron, rudder = 0.0, _within(
            law.recovery_rudder_gain * seen.roll + law.yaw_rate_gain * seen.r, law.rudder_limit)
    else:
        aileron, memory = _bank(law, memory, seen, 0.0, dt)
        rudder = _rudder(law, seen)
    return Answer(
        aileron=aileron,
        elevator=_within(memory.elevator + push + law.pitch_rate_gain * seen.q,
                         law.elevator_limit),
        rudder=rudder, throttle=_throttle(law.recovery_throttle)), memory


def _bank(law: Law, memory: Memory, seen: Seen, roll: float,
          dt: float) -> tuple[float, Memory]:
    """Return the aileron that goes to a bank [rad] the short way round, and what it held."""
    error = math.remainder(roll - seen.roll, 2.0 * math.pi)
    heading_rate = (seen.q * math.sin(seen.roll) + seen.r * math.cos(seen.roll)) \
        / max(math.cos(seen.pitch), 0.1)
    lacking = _within(law.roll_gain * error, law.roll_rate_limit) \
        - (seen.p + heading_rate * math.sin(seen.pitch))
    held = _within(memory.aileron + law.roll_integral_gain * lacking * dt, law.aileron_limit)
    return (_within(held + law.roll_rate_gain * lacking, law.aileron_limit),
            replace(memory, aileron=held))


def _rudder(law: Law, seen: Seen) -> float:
    """Return the rudder against sideslip and against any yaw but that of the turn."""
    turn = GRAVITY * math.sin(seen.roll) * math.cos(seen.pitch) / max(seen.airspeed, 1.0)
    return _within(law.yaw_rate_gain * (seen.r - turn) - law.sideslip_gain * seen.beta,
                   law.rudder_limit)


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def _throttle(value: float) -> float:
    return min(max(value, 0.0), 1.0)

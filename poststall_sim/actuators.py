# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Actuators: how a control gets from where it is to where it is told to go.

A command arrives after the dead time and is held for a step; from it follows the position

* at once, but no faster than the rate limit;
* by a first-order lag, dx/dt = (u - x) / tau;
* by a second-order lag, d2x/dt2 = omega^2 (u - x) - 2 zeta omega dx/dt,

with |dx/dt| within the rate limit. A step is the exact solution for a command that is held, the
rate limit included: a position does not depend on how time is cut into steps. A second-order
actuator whose rate is limited keeps that rate until its own acceleration would slow it down, so
that it carries nothing over to pay back; one that overshoots into its control's limit stops there.
Rates in rad/s, times in s.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from poststall_sim.frames import FloatArray
from poststall_sim.records import ConfigError

_LONGEST = 0.25
"""A second-order actuator at its rate limit is looked at this often [1/omega]."""


@dataclass(frozen=True, slots=True)
class Actuator:
    """
    What drives one control: rate_limit [rad/s], one lag or none, and a dead_time [s].

    time_constant [s], 0 for none; natural_frequency [rad/s], 0 for none, and its damping [-].
    """

    rate_limit: float = math.inf
    time_constant: float = 0.0
    natural_frequency: float = 0.0
    damping: float = 1.0
    dead_time: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what does not move, or moves in two ways."""
        if not self.rate_limit > 0.0:
            raise ConfigError(f'rate limit must be above 0, got {self.rate_limit!r} rad/s')
        for name, value, most, unit in (
                ('time constant', self.time_constant, 10.0, 's'),
                ('natural frequency', self.natural_frequency, 1e4, 'rad/s'),
                ('dead time', self.dead_time, 1.0, 's')):
            if not 0.0 <= value <= most:
                raise ConfigError(f'{name} must be 0 to {most:g} {unit}, got {value!r}')
        if self.time_constant and self.natural_frequency:
            raise ConfigError('an actuator has a time constant or a natural frequency, not both')
        if not 0.05 <= self.damping <= 20.0:
            raise ConfigError(f'damping must be 0.05 to 20, got {self.damping!r}')


IDEAL = Actuator()
"""Goes where it is told at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Actuation:
    """
    Where the actuators of all controls are: position (c,) [rad], rate (c,) [rad/s].

    pending (steps, c) : the commands of the last steps, the newest first, as many as the longest
    dead time is waiting for.
    """

    position: FloatArray
    rate: FloatArray
    pending: FloatArray


def at_rest(actuators: Sequence[Actuator], position: FloatArray, dt: float) -> Actuation:
    """Return actuators that have been at a position (c,) for long, for steps of dt [s]."""
    waiting = [_wait(actuator, dt)[0] + 1 for actuator in actuators if actuator.dead_time > 0.0]
    return Actuation(position, np.zeros_like(position),
                     np.tile(position, (max(waiting, default=0), 1)))


def advance(actuators: Sequence[Actuator], limits: Sequence[tuple[float, float]],
            before: Actuation, command: FloatArray, dt: float) -> Actuation:
    """
    Return the actuators a step of dt [s] later.

    command (c,) : within the limits [rad], given at the beginning of the step and held.
    """
    if all(actuator is IDEAL or actuator == IDEAL for actuator in actuators):
        return Actuation(command, (command - before.position) / dt, before.pending)
    given = np.vstack([command, before.pending])
    position, rate = before.position.copy(), before.rate.copy()
    for c, actuator in enumerate(actuators):
        steps, share = _wait(actuator, dt)
        parts = ((given[steps, c], (1.0 - share) * dt),)
        if share > 0.0:
            parts = ((given[steps + 1, c], share * dt), *parts)
        x, v = float(position[c]), float(rate[c])
        for asked, time in parts:
            x, v = _moved(actuator, x, v, float(asked), time)
        low, high = limits[c]
        if not low <= x <= high:
            x, v = min(max(x, low), high), 0.0
        position[c], rate[c] = x, v
    return Actuation(position, rate, given[:len(before.pending)])


def _wait(actuator: Actuator, dt: float) -> tuple[int, float]:
    """Return the dead time in whole steps and the share of one that is left over."""
    steps = actuator.dead_time / dt
    whole = math.floor(steps + 1e-9)
    return whole, max(steps - whole, 0.0) if steps - whole > 1e-9 else 0.0


def _moved(actuator: Actuator, x: float, v: float, asked: float,
           time: float) -> tuple[float, float]:
    """Return position and rate after a time [s] with the same command."""
    if actuator.natural_frequency:
        return _second_order(actuator, x, v, asked, time)
    limit, tau = actuator.rate_limit, actuator.time_constant
    gap = asked - x
    follows = limit * tau if tau else 0.0   # a gap below this is closed within the rate limit
    if abs(gap) > follows and math.isfinite(limit):
        whole = (abs(gap) - follows) / limit
        if whole >= time:
            return x + math.copysign(limit * time, gap), math.copysign(limit, gap)
        gap, time = math.copysign(follows, gap), time - whole
    left = gap * math.exp(-time / tau) if tau else 0.0
    return asked - left, left / tau if tau else 0.0


def _second_order(actuator: Actuator, x: float, v: float, asked: float,
                  time: float) -> tuple[float, float]:
    limit, omega, zeta = actuator.rate_limit, actuator.natural_frequency, actuator.damping
    if not math.isfinite(limit):
        return _free(omega, zeta, x, v, asked, time)
    while time > 0.0:
        way = math.copysign(1.0, v)
        if abs(v) >= limit * (1.0 - 1e-12):
            # It would go on faster until this much is left, where it begins to slow down.
            whole = (way * (asked - x) - 2.0 * zeta * limit / omega) / limit
            if whole > 0.0:
                held = min(whole, time)
                x, v, time = x + way * limit * held, way * limit, time - held
                continue
        part = min(time, _LONGEST / omega)
        later = _free(omega, zeta, x, v, asked, part)
        if abs(later[1]) > limit * (1.0 + 1e-12):
            way = math.copysign(1.0, later[1])

            def beyond(t: float, way=way, x=x, v=v) -> float:
                return way * _free(omega, zeta, x, v, asked, t)[1] - limit
            if beyond(0.0) < 0.0:
                part = brentq(beyond, 0.0, part, xtol=1e-15, rtol=1e-14)
                later = _free(omega, zeta, x, v, asked, part)[0], way * limit
            else:   # at the limit, and a hair from where it slows down
                later = x + way * limit * part, way * limit
        x, v = later
        time -= part
    return x, v


def _free(omega: float, zeta: float, x: float, v: float, asked: float,
          time: float) -> tuple[float, float]:
    """Return position and rate of the second-order lag after a time, without limits."""
    y, decay = x - asked, zeta * omega
    square = omega * omega * (1.0 - zeta * zeta)
    if square > 0.0:
        wave, fall = math.sqrt(square), math.exp(-decay * time)
        even, odd = fall * math.cos(wave * time), fall * math.sin(wave * time) / wave
    elif square < 0.0:
        wave = math.sqrt(-square)
        slow, fast = (math.exp(-(decay + sign * wave) * time) for sign in (-1.0, 1.0))
        even, odd = 0.5 * (slow + fast), 0.5 * (slow - fast) / wave
    else:
        even = math.exp(-decay * time)
        odd = even * time
    return (asked + y * even + (v + decay * y) * odd,
            v * even - (omega * omega * y + decay * v) * odd)

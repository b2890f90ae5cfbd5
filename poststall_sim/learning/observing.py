# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a learner sees of an instant: names, units, bounds, and the numbers."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from poststall_sim.aircraft import Aircraft
from poststall_sim.campaign.pilots import seen
from poststall_sim.frames import FloatArray, rotation
from poststall_sim.state import Snapshot


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number that is seen: its name, unit and bounds."""

    name: str
    unit: str
    low: float
    high: float


_STATE = (
    Quantity('airspeed', 'm/s', 0.0, 400.0),
    Quantity('alpha', 'rad', -math.pi, math.pi),
    Quantity('beta', 'rad', -math.pi / 2, math.pi / 2),
    Quantity('roll', 'rad', -math.pi, math.pi),
    Quantity('pitch', 'rad', -math.pi / 2, math.pi / 2),
    Quantity('p', 'rad/s', -20.0, 20.0),
    Quantity('q', 'rad/s', -20.0, 20.0),
    Quantity('r', 'rad/s', -20.0, 20.0),
    Quantity('stalled', 'share of the strips', 0.0, 1.0),
    Quantity('load_factor', '-', -20.0, 20.0),
    Quantity('sink_rate', 'm/s', -400.0, 400.0),
    Quantity('altitude', 'm', -10.0, 30_000.0),
)
_SEEN = tuple(each.name for each in _STATE[:9])


def commanded(aircraft: Aircraft) -> tuple[Quantity, ...]:
    """Return what can be commanded: deflections within limits, and throttle with engines."""
    deflections = tuple(Quantity(each.name, 'rad', *each.limits) for each in aircraft.controls)
    throttle = (Quantity('throttle', '0..1', 0.0, 1.0),) if aircraft.engines else ()
    return deflections + throttle


def quantities(aircraft: Aircraft) -> tuple[Quantity, ...]:
    """Return what is seen: the state, and the controls as they stand."""
    return _STATE + commanded(aircraft)


def observing(aircraft: Aircraft) -> Callable[[Snapshot], FloatArray]:
    """Return what makes an observation of a snapshot: `quantities`, cut to their bounds."""
    bounds = np.array([(each.low, each.high) for each in quantities(aircraft)])
    throttle = bool(aircraft.engines)

    def observed(snapshot: Snapshot) -> FloatArray:
        state = seen(snapshot)
        body = snapshot.body
        sink = float((rotation(body.q_NB) @ body.velocity_B)[2])
        numbers = np.array([
            *(getattr(state, name) for name in _SEEN), snapshot.load_factor, sink, body.altitude,
            *snapshot.controls.deflections, *([snapshot.controls.throttle] if throttle else [])])
        return np.clip(numbers, bounds[:, 0], bounds[:, 1])
    return observed

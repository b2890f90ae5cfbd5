# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Controls, actuators and failures as the parameters of a simulator have them."""

import math
from collections.abc import Sequence
from dataclasses import replace

from poststall_sim import failure_reader, failures
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.failures import Failure
from poststall_sim.ros.parameters import SimulatorSettings


def with_controls(aircraft: Aircraft, settings: SimulatorSettings) -> Aircraft:
    """Return an aircraft with the limits and actuators that the parameters ask for."""
    limits = _by_control(aircraft, 'surface_limits_deg', settings.surface_limits_deg)
    rates = _by_control(aircraft, 'surface_rate_limits_deg', settings.surface_rate_limits_deg)
    taus = _by_control(aircraft, 'servo_tau', settings.servo_tau)
    controls = []
    for control, limit, rate, tau in zip(aircraft.controls, limits, rates, taus):
        if limit > 0.0:
            control = replace(control, limits=(-math.radians(limit), math.radians(limit)))
        actuator = control.actuator
        if rate > 0.0:
            actuator = replace(actuator, rate_limit=math.radians(rate))
        if tau >= 0.0:
            actuator = replace(actuator, time_constant=tau, natural_frequency=0.0)
        controls.append(replace(control, actuator=actuator))
    return replace(aircraft, controls=tuple(controls))


def _by_control(aircraft: Aircraft, name: str, values: Sequence[float]) -> Sequence[float]:
    count = len(aircraft.controls)
    if len(values) not in (1, count):
        raise ConfigError(f'parameter {name}: must be one number, or one for each of the {count} '
                          f'controls {", ".join(aircraft.control_names)}; got {len(values)}')
    return values if len(values) == count else tuple(values) * count


def failed(aircraft: Aircraft, settings: SimulatorSettings) -> dict[str, Failure]:
    """Return the failures that the parameters ask for; refuse what the aircraft has not."""
    try:
        found = failure_reader.failures([word for word in settings.failures if word.strip()])
        failures.of_parts(aircraft, found)
    except ConfigError as error:
        raise ConfigError(f'parameter failures: {error}') from None
    return found

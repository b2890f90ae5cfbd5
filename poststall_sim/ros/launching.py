# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments of the launch files, which are text, as parameters and as what to start."""

from collections.abc import Mapping
from typing import Any

from poststall_sim.aircraft import ConfigError

_TRUTH = {'true': True, '1': True, 'false': False, '0': False}


def truth(arguments: Mapping[str, str], name: str) -> bool:
    """
    Return whether an argument is true.

    Raises
    ------
    ConfigError
        When it is neither true nor false.

    """
    value = _TRUTH.get(arguments[name].lower())
    if value is None:
        raise ConfigError(f'{name}: must be true or false, got {arguments[name]!r}')
    return value


def simulator_parameters(arguments: Mapping[str, str]) -> dict[str, Any]:
    """
    Return the parameters of the simulator that the arguments say.

    An argument that is empty says none, so that the parameter file goes before the default. In a
    namespace the body frame is prefixed with it: the frames of all aircraft share ``/tf``.

    Raises
    ------
    ConfigError
        When an argument is not what it should be.

    """
    result: dict[str, Any] = {}
    if arguments['aircraft']:
        result['aircraft'] = arguments['aircraft']
    for name, parameter in (('real_time_factor', 'real_time_factor'),
                            ('altitude', 'initial.altitude')):
        if arguments[name]:
            result[parameter] = _number(name, arguments[name])
    namespace = arguments['namespace'].strip('/')
    if namespace:
        result['frames.prefix'] = namespace + '/'
    if truth(arguments, 'joystick'):
        result['joy.enabled'] = True
    if truth(arguments, 'follow_clock'):
        result |= {'publish_clock': False, 'use_sim_time': True}
    return result


def scenario_flies(arguments: Mapping[str, str]) -> bool:
    """Return whether the pilot and his scenario fly: nobody else was asked to."""
    return not (truth(arguments, 'autopilot') or truth(arguments, 'joystick'))


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ConfigError(f'{name}: must be a number, got {text!r}') from None

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The parameter that names the engines that do not work."""

from poststall_sim.aircraft import Aircraft, ConfigError

NAME = 'engine_failures'


def failed(aircraft: Aircraft, text: str) -> frozenset[str]:
    """Return the engines that a value of the parameter names; refuse what is none."""
    names = frozenset(word for word in (each.strip() for each in text.split(',')) if word)
    try:
        aircraft.require_engines(names)
    except ConfigError as error:
        raise ConfigError(f'parameter {NAME}: {error}') from None
    return names


def text(names: frozenset[str]) -> str:
    """Return the value of the parameter that names these."""
    return ', '.join(sorted(names))

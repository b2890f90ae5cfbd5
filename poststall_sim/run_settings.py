# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""How a flight is computed and in which air, as the diagnostics tell it: a bag is read later."""

from typing import Any

from poststall_sim import __version__
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.model import Settings
from poststall_sim.frames import swap_ned_enu
from poststall_sim.simulation import Flight
from poststall_sim.topics import Condition, Level
from poststall_sim.weather import Weather

ENDING = ': settings'
"""Of the diagnostic's name, behind that of the node."""


def closure(settings: Settings) -> str:
    """Return how the section angle is found."""
    return settings.closure.value if settings.decambering else 'off: attached flow'


def condition(node: str, flight: Flight, scenario: str = '') -> Condition:
    """Return the diagnostic; scenario : the name of the one that is flown, if there is one."""
    settings = flight.model.settings
    values: dict[str, Any] = {
        'poststall_sim': __version__, **({'scenario': scenario} if scenario else {}),
        'dt_s': flight.dt_ns * 1e-9, 'panels': settings.chordwise,
        'closure': closure(settings)}
    if settings.decambering:
        if settings.closure is Closure.NONLOCAL:
            values['ell_chords'] = _listed(settings.ell)
        else:
            values['scheme'] = settings.scheme.value
        values |= {'tolerance': settings.tolerance, 'iterations_limit': settings.limit}
    values |= {'separation': settings.separation.value, 'wake': settings.wake.value,
               'ground': settings.ground}
    return Condition(Level.OK, node + ENDING, 'as flown now', values | _air(flight.weather))


def _air(weather: Weather) -> dict[str, Any]:
    found = {'wind_enu_m_s': _listed((swap_ned_enu(weather.wind_N) + 0.0).tolist()),
             'gusts': len(weather.gusts), 'turbulence': 'none'}
    if (turbulence := weather.turbulence) is not None:
        found |= {'turbulence': turbulence.spectrum.value,
                  'turbulence_horizontal_m_s': turbulence.horizontal,
                  'turbulence_vertical_m_s': turbulence.vertical,
                  'turbulence_seed': turbulence.seed}
    return found


def _listed(values: float | tuple[float, ...] | list[float]) -> str:
    """Return numbers with commas between them."""
    several = values if isinstance(values, (tuple, list)) else (values,)
    return ', '.join(f'{each:g}' for each in several)

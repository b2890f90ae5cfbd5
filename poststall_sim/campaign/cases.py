# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Cases made of a campaign, and the checks that come before the first of them is computed.

Each case is read as a definition of its own, so that a value no aircraft can have is refused with
its key; and a key that could be given any of its values without a case becoming another is refused
too.
"""

import dataclasses
import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from poststall_sim import air_reader, definition, flight_file, jobs
from poststall_sim.aero.model import DEFAULTS, Settings
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.atmosphere import STANDARD, Atmosphere
from poststall_sim.autopilot_law import Law
from poststall_sim.campaign import effect, paths, pilots, sampling
from poststall_sim.campaign.case import Case, Flying, Initial, Recovered, Steady, Stop
from poststall_sim.campaign.definition import EXAMPLE, FLIGHT, NOBODY, Campaign
from poststall_sim.campaign.sampling import Distribution, Value
from poststall_sim.reader import Place, Reader, listed, shown, suggestion
from poststall_sim.scenario import Scenario
from poststall_sim.weather import CALM

CPU_LIMIT = 600.0
"""Of a flight, where nothing else is asked for [s of processor time]."""
PROBED = 12
"""In so many cases, over all of the design, so many values of a key are tried for an effect."""
_SECONDS = {'duration_s': (1e-3, 86400.0), 'dt_s': (1e-5, 1.0), 'cpu_limit_s': (1e-3, 1e6)}
_ATMOSPHERE = ('temperature_offset_K', 'sea_level_pressure_Pa', 'density_kg_m3')
_ANGLE, _RATE = (-180.0, 180.0), (-3600.0, 3600.0)


class Builder:
    """Makes cases of a campaign; aircraft that several cases share are read once."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self.design = campaign.design
        self._aircraft: dict[Any, tuple[Aircraft, str]] = {}

    def cases(self, without: Collection[int] = ()) -> Iterator[Case]:
        """Yield all cases but those of some numbers."""
        left = np.ones(len(self.design), dtype=bool)
        left[list(without)] = False
        for index in np.flatnonzero(left).tolist():
            yield self.case(index)

    def case(self, index: int, values: tuple[Value, ...] | None = None) -> Case:
        """
        Return a case, of the design's values or of others in their place.

        Whatever it cannot be is a `ConfigError` with the key.
        """
        campaign = self.campaign
        values = self.design[index] if values is None else values
        inputs = dict(zip((each.key for each in campaign.variables), values))
        tree = paths.changed(campaign.tree, inputs, campaign.where)
        aircraft, key = self._read_aircraft(tree, inputs)
        settings = _settings(Reader(tree['settings'], campaign.where.key('settings')))
        seed = sampling.case_seed(campaign.seed, index)
        if campaign.kind == FLIGHT:
            task, atmosphere = self._flying(tree, aircraft, seed)
        else:
            task = _steady(campaign.kind, aircraft,
                           Reader(tree['condition'], campaign.where.key('condition')))
            atmosphere = _still_air(Reader(tree['air'], campaign.where.key('air')), task.altitude)
        return Case(
            index=index, seed=seed, inputs=inputs, atmosphere=atmosphere,
            aircraft=aircraft, settings=settings, task=task, quantities=campaign.quantities,
            model_key=f'{key} {settings!r} {atmosphere!r}')

    def _read_aircraft(self, tree: Mapping[str, Any],
                       inputs: Mapping[str, Value]) -> tuple[Aircraft, str]:
        own = tuple(sorted((k, v) for k, v in inputs.items() if k.startswith('aircraft.')))
        if own not in self._aircraft:
            path = self.campaign.aircraft_file
            read = definition.aircraft(path) if definition.is_avl(path) else \
                definition.aircraft_in(Reader(tree['aircraft'], Place(path.name)), path.parent)
            # Its name makes no difference to how it flies.
            print_of = flight_file.fingerprint(dataclasses.replace(read, name='aircraft'))
            while len(self._aircraft) > 100:
                self._aircraft.pop(next(iter(self._aircraft)))
            self._aircraft[own] = read, print_of
        return self._aircraft[own]

    def _flying(self, tree: dict[str, Any], aircraft: Aircraft,
                seed: int) -> tuple[Flying, Atmosphere]:
        where = self.campaign.where
        scenario: Scenario | None = None
        law, autopilot = None, None
        if self.campaign.scenario_file is not None:
            scenario = definition.scenario_in(
                Reader(tree['scenario'], Place(self.campaign.scenario_file.name)))
            scenario = jobs.fitted(aircraft, scenario)
            jobs.require_controls(aircraft, scenario)
        elif tree['autopilot'] == EXAMPLE:
            law = _law(Reader(tree['law'], where.key('law')))
        elif tree['autopilot'] != NOBODY:
            autopilot = str(tree['autopilot'])
            try:
                pilots.imported(autopilot)
            except ConfigError as error:
                raise where.error(f'{error}; expected {NOBODY}, {EXAMPLE} or MODULE:FUNCTION') \
                    from None
        numbers = {key: where.key(key).number(tree[key], within=limits)
                   for key, limits in _SECONDS.items() if key in tree}
        if scenario is None and 'duration_s' not in numbers:
            raise where.error('key duration_s must be there: without a scenario nothing says '
                              'how long to fly')
        spin = where.key('spin_alpha_deg').number(tree.get('spin_alpha_deg', 16.0),
                                                  within=(0.0, 90.0))
        initial = _initial(Reader(tree['initial'], where.key('initial')), scenario)
        if scenario is not None and not tree['air']:
            atmosphere, weather = scenario.atmosphere, scenario.weather
        else:
            atmosphere, weather = air_reader.air(
                Reader(tree['air'], where.key('air')), initial.altitude)
        if weather.turbulence is not None:   # another one in each case
            weather = dataclasses.replace(weather, turbulence=dataclasses.replace(
                weather.turbulence, seed=seed % 2 ** 53))
        return Flying(
            initial=initial, weather=weather,
            duration=numbers.get('duration_s') or scenario.duration,
            dt=numbers.get('dt_s'),
            scenario=None if scenario is None else dataclasses.replace(
                scenario, name='scenario', duration=1.0, airspeed=1.0, altitude=1.0,
                atmosphere=STANDARD, weather=CALM),
            law=law, autopilot=autopilot,
            recovered=_recovered(Reader(tree['recovered'], where.key('recovered'))),
            spin_alpha=math.radians(spin), stop=_stop(Reader(tree['stop'], where.key('stop'))),
            history_every=self.campaign.history_every,
            cpu_limit=numbers.get('cpu_limit_s', CPU_LIMIT)), atmosphere


def functions(campaign: Campaign) -> list[str]:
    """Return the functions of the user's, MODULE:FUNCTION, that fly in a campaign."""
    named = [campaign.tree.get('autopilot', NOBODY)]
    for each in campaign.variables:
        if each.key == 'autopilot' and not isinstance(each.over, Distribution):
            named = list(each.over)
    return [str(name) for name in named if name not in (NOBODY, EXAMPLE)]


def check(campaign: Campaign) -> int:
    """Refuse a campaign of which any case cannot be, or any key changes nothing; count cases."""
    builder, law_flies = Builder(campaign), False
    kept, watched = frozenset(campaign.quantities), {'recovered': False, 'spin_alpha_deg': False}
    for index, values in enumerate(builder.design):
        try:
            case = builder.case(index, values)
        except ConfigError as error:
            given = ', '.join(f'{each.key} = {shown(value)}'
                              for each, value in zip(campaign.variables, values))
            raise ConfigError(f'{campaign.where.file}: case {index} ({given}) cannot be: '
                              f'{error}') from None
        if isinstance(case.task, Flying):
            law_flies = law_flies or case.task.law is not None
            watched['recovered'] |= effect.watches_recovery(case.task, kept)
            watched['spin_alpha_deg'] |= effect.watches_spin(case.task, kept)
        elif index == 0:
            _require_condition(campaign, case.task)
    if campaign.tree.get('law') and not law_flies:
        raise campaign.where.error(f'law: changes nothing, the autopilot is never {EXAMPLE}')
    for key, needed in watched.items():
        if campaign.tree.get(key) and not needed:
            raise campaign.where.error(f'{key}: changes nothing, no quantity that is kept and no '
                                       'stop goes by it')
    for place, variable in enumerate(campaign.variables):
        _require_effect(builder, place, variable)
    return len(builder.design)


def files_read(campaign: Campaign) -> dict[str, str]:
    """
    Return fingerprints of the aircraft with the curves of its files, by what names the files.

    Of the first case, and of it with each text that varies: files are named by texts.
    """
    builder = Builder(campaign)
    first = builder.design[0]
    prints = {'': builder.case(0).aircraft}
    for place, each in enumerate(campaign.variables):
        if each.key.startswith('aircraft.') and not isinstance(each.over, Distribution):
            for value in each.over:
                if isinstance(value, str):
                    other = (*first[:place], value, *first[place + 1:])
                    prints[f'{each.key} {value}'] = builder.case(0, other).aircraft
    return {name: flight_file.fingerprint(aircraft) for name, aircraft in prints.items()}


def longest(builder: Builder) -> float:
    """Return how long the longest flight of a campaign may be [s]."""
    keys = {each.key for each in builder.campaign.variables}
    numbers = range(len(builder.design)) if keys & {'duration_s', 'scenario.duration_s'} else [0]
    return max(builder.case(index).task.duration for index in numbers)


def _require_effect(builder: Builder, place: int, variable: sampling.Variable) -> None:
    """Refuse a key that none of a few cases changes with, whatever it is given."""
    design = builder.design
    others: list[Value] = [*variable.over[:PROBED], variable.over[-1]] \
        if not isinstance(variable.over, Distribution) else \
        [*variable.over.quantile([0.25, 0.75]).tolist(), *design.ends(place)]
    for index in range(0, len(design), max(1, len(design) // PROBED)):
        prints = set()
        for other in others:
            values = list(design[index])
            values[place] = other
            prints.add(effect.fingerprint(builder.case(0, tuple(values))))
            if len(prints) > 1:
                return
    raise builder.campaign.where.error(
        f'vary[{place}].key: {variable.key} changes nothing here, from {shown(others[0])} to '
        f'{shown(others[1])}')


def _require_condition(campaign: Campaign, task: Steady) -> None:
    where = campaign.where.key('condition')
    for name, key in (('alpha', 'alpha_deg'), ('airspeed', 'airspeed_m_s')):
        needed = {'polar': ('alpha', 'airspeed'), 'modes': ('alpha',)}.get(task.kind, ())
        if name in needed and getattr(task, name) is None:
            raise where.error(f'key {key} must be there for {task.kind}')
    if task.kind == 'trim' and (task.alpha is None) == (task.airspeed is None):
        raise where.error('a trim has either airspeed_m_s or alpha_deg')


def _initial(read: Reader, scenario: Scenario | None) -> Initial:
    airspeed = read.number_if_any('airspeed_m_s', within=(0.1, 400.0))
    altitude = read.number_if_any('altitude_m', within=(0.1, 20_000.0))
    if scenario is not None:
        airspeed = scenario.airspeed if airspeed is None else airspeed
        altitude = scenario.altitude if altitude is None else altitude
    for key, value in (('airspeed_m_s', airspeed), ('altitude_m', altitude)):
        if value is None:
            read.number(key)   # says that it must be there

    def angle(key: str, limits: tuple[float, float] = _ANGLE) -> float | None:
        value = read.number_if_any(key, within=limits)
        return None if value is None else math.radians(value)

    trim_airspeed = read.number_if_any('trim_airspeed_m_s', within=(0.1, 400.0))
    return read.build(
        Initial, trim_airspeed=trim_airspeed or airspeed, altitude=altitude, airspeed=airspeed,
        alpha=angle('alpha_deg'), beta=angle('beta_deg', (-90.0, 90.0)) or 0.0,
        roll=angle('roll_deg') or 0.0, pitch=angle('pitch_deg', (-90.0, 90.0)),
        heading=angle('heading_deg', (-360.0, 360.0)) or 0.0,
        rates_B=tuple(angle(f'{name}_rate_deg_s', _RATE) or 0.0
                      for name in ('roll', 'pitch', 'yaw')))


def _law(read: Reader) -> Law:
    return read.build(Law, **{field.name: read.number(field.name, default=field.default)
                              for field in dataclasses.fields(Law)})


def _recovered(read: Reader) -> Recovered:
    return read.build(
        Recovered,
        alpha=math.radians(read.number('alpha_deg', default=12.0, within=(0.0, 180.0))),
        roll=math.radians(read.number('roll_deg', default=30.0, within=(0.0, 180.0))),
        rate=math.radians(read.number('rate_deg_s', default=30.0, above=0.0)),
        hold=read.number('hold_s', default=0.5, at_least=0.0))


def _stop(read: Reader) -> Stop:
    return read.build(
        Stop, **{name: read.boolean(name) for name in ('recovered', 'spun') if name in read.tree},
        height_lost=read.number_if_any('height_lost_m', above=0.0) or math.inf)


def _settings(read: Reader) -> Settings:
    given: dict[str, Any] = {}
    if 'panels' in read.tree:
        given['chordwise'] = read.count('panels', at_most=32)
    for name, key in (('ell', 'ell_chords'), ('lag', 'lag_chords'), ('delay', 'delay_chords'),
                      ('relaxation', 'relaxation_chords')):
        if key in read.tree:
            given[name] = read.number(key)
    for name in ('decambering', 'ground'):
        if name in read.tree:
            given[name] = read.boolean(name)
    for name, kind in (('separation', Separation), ('wake', Shape)):
        if name in read.tree:
            given[name] = read.choice(name, {each.value: each for each in kind})
    read.done()
    return read.where.build(lambda **fields: dataclasses.replace(DEFAULTS, **fields), **given)


def _still_air(read: Reader, altitude: float) -> Atmosphere:
    """Read the air of steady flight, which has a density and does not move."""
    for key in read.tree:
        if key not in _ATMOSPHERE:
            raise read.where.error(f'steady flight is in still air: unknown key {key}, there are '
                                   + listed(_ATMOSPHERE) + suggestion(key, _ATMOSPHERE))
    return air_reader.air(read, altitude)[0]


def _steady(kind: str, aircraft: Aircraft, read: Reader) -> Steady:
    def angle(key: str, limits: tuple[float, float] = _ANGLE) -> float | None:
        value = read.number_if_any(key, within=limits)
        return None if value is None else math.radians(value)

    common = {'kind': kind, 'altitude': read.number('altitude_m', default=0.0,
                                                    within=(-500.0, 20_000.0)),
              'alpha': angle('alpha_deg', (-180.0, 180.0) if kind == 'polar' else (-40.0, 60.0))}
    if kind != 'modes':
        common['airspeed'] = read.number_if_any('airspeed_m_s', within=(0.1, 400.0))
    if kind != 'polar':
        return read.build(Steady, climb_angle=angle('climb_deg', (-90.0, 90.0)), **common)
    controls = read.mapping('controls_deg', default={})
    deflections = tuple((name, math.radians(controls.number(name, within=(-90.0, 90.0))))
                        for name in controls.names())
    controls.where.build(jobs.deflections, aircraft=aircraft, by_name=dict(deflections))
    return read.build(
        Steady, beta=angle('beta_deg', (-90.0, 90.0)) or 0.0, deflections=deflections,
        rates=tuple(read.number(f'{name}_rate', default=0.0, within=(-1.0, 1.0))
                    for name in ('roll', 'pitch', 'yaw')), **common)

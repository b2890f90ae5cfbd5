# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What commands on an aircraft share: which one, how it is computed, how results begin."""

import argparse
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from poststall_sim import __version__, terminal
from poststall_sim import option_values as values
from poststall_sim.aero import model as models
from poststall_sim.atmosphere import STANDARD, Atmosphere

Command = Callable[..., argparse.ArgumentParser]
"""
Adds a command: its name, what it does, an example of its options, its default aircraft.

of_aircraft=False : a command that is not of one aircraft.
"""


def add_options(command: argparse.ArgumentParser, *,
                closure: str = '(default nonlocal)') -> argparse._ArgumentGroup:
    """Add the options of air and solver; return the latter's group, for those of one command."""
    air = command.add_argument_group('air')
    air.add_argument('--temperature-offset', type=values.within(values.TEMPERATURE_OFFSET),
                     metavar='K', help='warmer than the standard atmosphere (default 0)')
    air.add_argument('--qnh', type=values.within(values.QNH), metavar='HPA',
                     help='pressure at sea level (default 1013.25)')
    group = command.add_argument_group('solver')
    group.add_argument('--panels', type=values.count, metavar='N',
                       help='panels along every chord (default 4)')
    group.add_argument('--strips', type=values.by_surface(values.count), action='append',
                       default=[], metavar='N or NAME=N',
                       help='strips of every surface, or of one: instead of those of the '
                       'definition; may be given again')
    group.add_argument('--closure', choices=('nonlocal', 'local'),
                       help=f'how the section angle is found {closure}')
    group.add_argument('--ell', type=values.by_surface(values.number), action='append',
                       default=[], metavar='CHORDS or NAME=CHORDS',
                       help='averaging length of the non-local closure, of all surfaces or '
                       'of one (default 1)')
    group.add_argument('--no-decambering', action='store_true',
                       help='attached flow at any angle')
    return group


def add_as_avl(group) -> None:
    """Add the option of commands on steady flow that asks for what AVL computes."""
    group.add_argument('--as-avl', action='store_true',
                       help='as AVL has it: attached flow at any angle, wakes along x, no cores '
                       'between surfaces, forces of the vortices along the span alone')


def aircraft(arguments: argparse.Namespace):
    """Return the aircraft that the options name."""
    from poststall_sim import definition
    path = definition.find(definition.Kind.AIRCRAFT, arguments.aircraft)
    defined = definition.aircraft(path)
    for assumption in defined.assumptions:
        terminal.complain(f'{defined.name}: {assumption}')
    if definition.is_avl(path) and not vars(arguments).get('as_avl', True):
        terminal.complain(f'{defined.name}: by the rules of this package, which count forces and '
                          'cores that AVL does not: --as-avl gives what AVL computes')
    return defined


def model(arguments: argparse.Namespace, atmosphere: Atmosphere = STANDARD):
    """Return the model that the options ask for; what they do not say of the air is given."""
    defined = aircraft(arguments)
    names = [surface.name for surface in defined.surfaces]
    strips = _of_surfaces('strips', arguments.strips, names,
                          [surface.strips for surface in defined.surfaces])
    cut = replace(defined, surfaces=tuple(
        surface.cut(int(n)) for surface, n in zip(defined.surfaces, strips)))
    ell = _of_surfaces('ell', arguments.ell, names, [models.DEFAULTS.ell] * len(names))
    settings = _settings(arguments, ell[0] if len(set(ell)) == 1 else tuple(ell))
    given = {'temperature_offset': arguments.temperature_offset,
             'sea_level_pressure': None if arguments.qnh is None else 100.0 * arguments.qnh}
    atmosphere = replace(
        atmosphere, **{name: value for name, value in given.items() if value is not None})
    return models.build(cut, settings, atmosphere)


def _of_surfaces(option: str, given: list[dict[str, float]], names: list[str],
                 defaults: list) -> list:
    """Return a number for each surface: its own, that of all, or its default."""
    from poststall_sim.aircraft import ConfigError
    chosen = {name: value for each in given for name, value in each.items()}
    for name in chosen:
        if name not in ('', *names):
            raise ConfigError(f'--{option}: there is no surface {name!r}, there are '
                              f'{", ".join(names)}')
    return [chosen.get(name, chosen.get('', value)) for name, value in zip(names, defaults)]


def _settings(arguments: argparse.Namespace, ell: float | tuple[float, ...]):
    """Return the settings that the options ask for; refuse what would have no effect."""
    from poststall_sim.aero.decambering import AngleForm, Closure
    from poststall_sim.aero.schemes import Scheme, Start
    from poststall_sim.aero.separation import Separation
    from poststall_sim.aero.wake import Shape
    from poststall_sim.aircraft import ConfigError
    asked = vars(arguments)
    scheme, damping = asked.get('scheme'), asked.get('damping')
    closure = Closure(arguments.closure or ('local' if scheme else 'nonlocal'))
    by_scheme = closure is Closure.LOCAL and scheme in ('A', 'B', 'C', 'D')
    start = asked.get('start', ('previous', None))[0]
    if closure is Closure.NONLOCAL and scheme in ('A', 'B', 'C', 'D'):
        raise ConfigError(f'scheme {scheme} solves the local closure: give --closure local')
    if closure is Closure.LOCAL and arguments.ell:
        raise ConfigError('--ell is for the non-local closure: the local one averages nothing')
    if not by_scheme and damping not in (None, 1.0):
        raise ConfigError('--damping is for schemes A to D: give --scheme')
    if not by_scheme and start == 'schemeA1':
        raise ConfigError('--start schemeA1 is for schemes A to D: give --scheme')
    for name, law in (('lag', 'lag'), ('relaxation', 'goman_khrabrov'),
                      ('delay', 'goman_khrabrov')):
        if asked.get(name) is not None and asked.get('separation', law) != law:
            raise ConfigError(f'--{name} is for --separation {law}')
    as_avl = asked.get('as_avl', False)
    decambering = not (arguments.no_decambering or as_avl)
    if not decambering:
        idle = [name for name in ('closure', 'ell', 'scheme', 'damping', 'symmetric', 'tolerance',
                                  'limit', 'starts') if asked.get(name)]
        if idle or start != 'previous':
            raise ConfigError(f'--{(idle or ["start"])[0]} has no effect with '
                              f'--{"as-avl" if as_avl else "no-decambering"}')
    given = {'chordwise': arguments.panels, 'damping': damping,
             'tolerance': asked.get('tolerance'), 'limit': asked.get('limit'),
             'scheme': Scheme(scheme) if scheme else None,
             'separation': Separation(asked['separation']) if asked.get('separation') else None,
             'wake': Shape.FROZEN if asked.get('frozen_wake') else
             Shape(asked['wake']) if isinstance(asked.get('wake'), str) else None,
             **{name: asked.get(name) for name in ('lag', 'relaxation', 'delay', 'ground')}}
    return models.Settings(
        closure=closure, ell=ell, decambering=decambering,
        angle_form=AngleForm(asked.get('angle_form', 'exact')),
        start=Start(start) if start in ('zero', 'schemeA1') else Start.GIVEN,
        symmetric=asked.get('symmetric', False), as_avl=as_avl,
        axial_wake=asked.get('axial_wake', False),
        unsteady='angle_form' not in asked and not as_avl,
        **{key: value for key, value in given.items() if value is not None})


def head(arguments: argparse.Namespace, model) -> dict[str, Any]:
    """Return what every result begins with: who made it, of what, how."""
    from poststall_sim.aero.decambering import Closure
    reference, settings = model.aircraft.reference, model.settings
    local = settings.closure is Closure.LOCAL
    return {
        'poststall_sim': __version__, 'aircraft': model.aircraft.name,
        'closure': settings.closure.value, 'scheme': settings.scheme.value if local else 'newton',
        'reference': {'area_m2': reference.area, 'chord_m': reference.chord,
                      'span_m': reference.span, 'cg_m': list(model.aircraft.mass.cg_G)},
        'atmosphere': {'temperature_offset_K': model.atmosphere.temperature_offset,
                       'sea_level_pressure_Pa': model.atmosphere.sea_level_pressure,
                       'density_kg_m3': model.atmosphere.density},
        'settings': {
            'panels': settings.chordwise, 'closure': settings.closure.value,
            'strips': {grid.name: grid.strips.stop - grid.strips.start
                       for grid in model.lattice.grids},
            'ell_chords': settings.ell, 'decambering': settings.decambering,
            'angle_form': settings.angle_form.value, 'axial_wake': settings.axial_wake,
            'as_avl': settings.as_avl, 'damping': settings.damping,
            'symmetric': settings.symmetric, 'tolerance': settings.tolerance,
            'limit': settings.limit}}

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A new aircraft file, from a few numbers or from an AVL file."""

import argparse
from pathlib import Path

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands.solver import Command

_WING, _TAIL = 'naca4415_re4e5', 'naca0012_re3e5'


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    new = command('new', 'a new aircraft file, from a few numbers or from an AVL file',
                  'mine --span 4 --chord 0.3 --mass 5', None, of_aircraft=False)
    new.add_argument('name', help='of the aircraft: letters, digits and _')
    for option, unit in (('span', 'M'), ('chord', 'M'), ('mass', 'KG')):
        new.add_argument(f'--{option}', type=values.positive, metavar=unit)
    new.add_argument('--tail-volume', type=values.positive, metavar='V',
                     help='area times arm over area and chord of the wing (default 0.55)')
    new.add_argument('--from', dest='avl', type=Path, metavar='FILE.avl',
                     help='from an AVL file instead, masses from the .mass file beside it')
    new.add_argument('--output', type=values.output, metavar='FILE',
                     help='(default NAME.yaml); curves of an AVL file go beside it')
    return new


def run(arguments: argparse.Namespace) -> int:
    """Write the file; return the exit code."""
    from dataclasses import replace

    from poststall_sim import aircraft_writer, avl_reader, definition, sizing
    from poststall_sim.reader import Place
    name = Place('NAME').name(arguments.name)
    path = arguments.output or Path(f'{name}.yaml')
    given = {key: getattr(arguments, key) for key in ('span', 'chord', 'mass', 'tail_volume')
             if getattr(arguments, key) is not None}
    if path.exists():
        raise definition.ConfigError(f'{path} is there: give another --output')
    if arguments.avl:
        if given:
            raise definition.ConfigError(f'--{next(iter(given)).replace("_", "-")} has no effect '
                                         'with --from')
        aircraft, turned = _our_way_round(avl_reader.aircraft(arguments.avl))
        cg, area = aircraft.mass.cg_G, aircraft.reference.area
        aircraft = replace(aircraft, name=name, engines=(sizing.engine(
            aircraft.mass.mass, area, (cg[0] - aircraft.reference.chord, *cg[1:])),))
        remarks = (f'{name}, from {arguments.avl.name}. What that file did not say:', '',
                   f'an engine, through the centre of gravity: {sizing.THRUST:g} of the weight at '
                   'rest', *turned)
    else:
        missing = [key for key in ('span', 'chord', 'mass') if key not in given]
        if missing:
            raise definition.ConfigError(f'new needs --{missing[0]} or --from')
        wing, tail = (definition.airfoil(definition.find(definition.Kind.AIRFOIL, each))
                      for each in (_WING, _TAIL))
        numbers = sizing.Numbers(**given)
        aircraft = sizing.conventional(name, numbers, wing, tail)
        remarks = (
            f'{name}: span {numbers.span:g} m, chord {numbers.chord:g} m, {numbers.mass:g} kg.',
            '',
            f'Tail volume {numbers.tail_volume:g} on an arm of {sizing.TAIL_ARM:g} chords between '
            f'quarter chords, fin volume {sizing.VERTICAL_VOLUME:g}; lengths are rounded.',
            f'The centre of gravity stands {100 * sizing.STATIC_MARGIN:g} % of the chord ahead of '
            'the neutral point.',
            'Radii of gyration of ordinary aircraft; full thrust is '
            f'{sizing.THRUST:g} of the weight at rest.',
            'Sections at model size: give your own curves for others.')
    files = aircraft_writer.csv_names(aircraft) if arguments.avl \
        else [f'{airfoil.name}.csv' for airfoil in aircraft.airfoils]
    path.write_text(aircraft_writer.text(aircraft, files, remarks=remarks))
    terminal.say(f'aircraft {path}')
    if arguments.avl:
        for remark in turned:
            terminal.say(remark)
        for airfoil, file in zip(aircraft.airfoils, files):
            beside = path.parent / file
            beside.write_text(aircraft_writer.curves(airfoil))
            terminal.say(f'curves {beside}')
    terminal.write_json(arguments.json, {'aircraft': name, 'file': str(path)})
    return 0


def _our_way_round(aircraft):
    """Return an aircraft with controls that sticks and autopilots mind, and what was turned."""
    from dataclasses import replace

    from poststall_sim import survey
    from poststall_sim.aero import model as models
    found = survey.backwards(survey.survey(models.build(aircraft)))
    controls = tuple(each.reversed() if each.name in found else each
                     for each in aircraft.controls)
    return replace(aircraft, controls=controls), tuple(
        f'{name}: its sign is not that of the file, in which a positive one '
        f'{survey.POSITIVE[name][2]}' for name in found)

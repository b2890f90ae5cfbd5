# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""An aircraft in three views and an isometric, with its figures and what is odd about it."""

import argparse

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    show = command('show', 'an aircraft in three views, its figures and what is odd about it',
                   'trainer --plot trainer.png', 'trainer')
    show.add_argument('aircraft', nargs='?', default=argparse.SUPPRESS, metavar='AIRCRAFT',
                      help='the same as --aircraft')
    show.add_argument('--plot', type=values.figure, nargs='?', metavar='FILE',
                      const='show.png',
                      help='draw it: PNG, SVG or PDF (default show.png)')
    show.add_argument('--avl', type=values.output, metavar='FILE',
                      help='write it as an AVL file, and its masses as .mass beside that')
    solver.add_options(show)
    return show


def run(arguments: argparse.Namespace) -> int:
    """Print the figures; draw and write as asked; return the exit code."""
    from poststall_sim import avl_mass, avl_writer, survey, surveying
    model = solver.model(arguments)
    aircraft = model.aircraft
    figures, stall = survey.survey(model), survey.stall(model)
    found = survey.findings(model, figures, stall)
    terminal.say(f'{aircraft.name}: {aircraft.mass.mass:.4g} kg, centre of gravity at x = '
                 f'{aircraft.mass.cg_G[0]:.4g} m, {model.lattice.strips} strips')
    terminal.print_table(*surveying.surfaces(figures))
    terminal.say(f'\n{surveying.stall_line(stall, model)}')
    terminal.print_rows(f'in {survey.FLOW}, controls neutral:', surveying.lines(figures))
    if found:
        terminal.say('\n'.join(['', *surveying.findings(found)]))
    terminal.write_json(arguments.json, {
        **solver.head(arguments, model), **surveying.result(figures, stall, found)})
    if arguments.avl:
        arguments.avl.write_text(avl_writer.text(aircraft, model.settings.chordwise))
        masses = arguments.avl.with_suffix('.mass')
        masses.write_text(avl_mass.text(aircraft.mass, aircraft.name))
        terminal.say(f'AVL {arguments.avl} {masses}')
        for remark in avl_writer.left_out(aircraft):
            terminal.say(remark)
    if arguments.plot:
        from poststall_sim import plots
        terminal.drawn(plots.aircraft_figure(model, figures, arguments.plot))
    return 0

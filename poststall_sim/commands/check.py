# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What is odd about an aircraft, each with what to do."""

import argparse

from poststall_sim import terminal
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    check = command('check', 'what is odd about an aircraft, and what to do', 'trainer', 'trainer')
    check.add_argument('aircraft', nargs='?', default=argparse.SUPPRESS, metavar='AIRCRAFT',
                       help='the same as --aircraft')
    check.add_argument('--strict', action='store_true',
                       help='exit code 1 if there is anything odd')
    solver.add_options(check)
    return check


def run(arguments: argparse.Namespace) -> int:
    """Print the findings; return the exit code."""
    from poststall_sim import survey, surveying
    model = solver.model(arguments)
    figures, stall = survey.survey(model), survey.stall(model)
    found = survey.findings(model, figures, stall)
    terminal.say('\n'.join(surveying.findings(found)) or f'{model.aircraft.name}: nothing odd')
    terminal.write_json(arguments.json, {
        **solver.head(arguments, model), **surveying.result(figures, stall, found)})
    return 1 if found and arguments.strict else 0

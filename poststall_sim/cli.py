# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The command `poststall`: polars, trims, modes, flights and figures without a ROS graph.

Angles are in degrees here and in `commands`, on the way in and out. Exit codes: 0 a result, 1 none
(no trim, not converged, diverged), 2 bad input, said in one line on stderr.
"""

import argparse
import os
import re
import sys
from typing import Any

from poststall_sim import __version__, completion, interrupts, terminal
from poststall_sim import option_values as values
from poststall_sim.commands import (
    airfoil,
    campaign,
    check,
    database,
    derivatives,
    export,
    fly,
    modes,
    new,
    plot,
    polar,
    report,
    show,
    trim,
    watch,
)

COMMANDS = (new, show, check, polar, trim, modes, derivatives, database, fly, plot, report,
            watch, export, airfoil, campaign)
"""In the order of the help."""

_NEGATIVE = re.compile(r'-[\d.]')
_EXIT_CODES = ('exit codes: 0 a result; 1 none (no trim, not converged, diverged); 2 bad input; '
               '130 interrupted')


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    try:
        return _run(sys.argv[1:] if argv is None else argv)
    except KeyboardInterrupt:
        terminal.complain('interrupted')
        return 130


def _run(argv: list[str]) -> int:
    try:
        arguments = parse(argv)
    except OSError as error:   # a name that no file can have
        terminal.complain(error)
        return 2
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.jobs import NoResultError
    try:
        with interrupts.not_in_the_compiler(), terminal.telling_of_compiling(), \
                terminal.leaving_output_to(arguments.json):
            code = arguments.run(arguments)
        sys.stdout.flush()   # here, where it is known what a broken pipe means
        return code
    except NoResultError as error:
        terminal.complain(error)
        return 1
    except BrokenPipeError:   # the reader, `head` perhaps, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ConfigError, ImportError, OSError) as error:
        terminal.complain(error)
        return 2


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the options; ``command`` is the name of what to do and ``run`` does it."""
    return _parser().parse_args(_joined(argv))


def _joined(argv: list[str]) -> list[str]:
    """Return the arguments with negative values joined to their option: ``--alpha -4:20:1``."""
    result: list[str] = []
    for word in argv:
        previous = result[-1] if result else ''
        if _NEGATIVE.match(word) and previous.startswith('--') and '=' not in previous:
            result[-1] = f'{previous}={word}'
        else:
            result.append(word)
    return result


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> Any:
        self.exit(2, f'{self.prog}: {message} (see {self.prog} --help)\n')


class _PrintCompletion(argparse.Action):
    """Print the completion script, as --version prints the version."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace,
                 shell: Any, option: str | None = None) -> None:
        try:
            terminal.say(completion.script(parser, shell))
        except ImportError as error:
            parser.error(str(error))
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog='poststall',
        description='Flight past the stall: polars, trims, modes, flights, figures.',
        epilog=f'example: poststall polar --aircraft trainer --alpha -4:30:1\n\n{_EXIT_CODES}',
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--version', action='version', version=f'poststall_sim {__version__}')
    parser.add_argument('--print-completion', action=_PrintCompletion, choices=completion.SHELLS,
                        metavar='SHELL', help='print what lets a shell complete these commands '
                        '(bash or zsh) and exit')
    commands = parser.add_subparsers(title='commands', required=True, metavar='COMMAND',
                                     parser_class=_Parser)

    def command(name: str, what: str, example: str, aircraft: str | None,
                of_aircraft: bool = True):
        sub = commands.add_parser(
            name, help=what, description=f'{what[0].upper()}{what[1:]}.',
            epilog=f'example: poststall {name} {example}\n\n{_EXIT_CODES}',
            formatter_class=argparse.RawDescriptionHelpFormatter)
        sub.set_defaults(command=name)
        if of_aircraft:
            sub.add_argument('--aircraft', default=aircraft, metavar='NAME_OR_FILE',
                             help='aircraft: a file of ours or of AVL (.avl), or a name in '
                             'config/aircraft'
                             + (f' (default {aircraft})' if aircraft else
                                ' (default: the one the bag names)'))
        sub.add_argument('--json', type=values.result, nargs='?', const='-', metavar='FILE',
                         help='write the result as JSON, without a file or with - to the '
                         'standard output: all else is then said on the other one')
        return sub

    for module in COMMANDS:
        module.add(command).set_defaults(run=module.run)
    return parser


if __name__ == '__main__':
    sys.exit(main())

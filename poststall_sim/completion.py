# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a shell needs to complete the command line: options, choices, names and files."""

import argparse
from collections.abc import Iterator

from poststall_sim import definition
from poststall_sim import option_values as values

SHELLS = ('bash', 'zsh')

_FILES = {'bash': '_shtab_compgen_files', 'zsh': '_files'}
_FOLDERS = {'bash': '_shtab_compgen_dirs', 'zsh': '_files -/'}
_READ_FROM_FILES = ('bag', 'source', 'resume', 'record', 'measured', 'avl')
"""Destinations of options that name what is there already, without a reader of their own."""
_WRITTEN_TO = (values.output, values.result, values.figure, values.page, values.state_space)
_NAMED = {'aircraft': definition.Kind.AIRCRAFT, 'scenario': definition.Kind.SCENARIO,
          'what': definition.Kind.CAMPAIGN, 'file': definition.Kind.AIRFOIL}
"""Destinations of what is a file or the name of a shipped one."""


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """
    Return a shell's completion script of a parser and all of its commands.

    Raises ImportError, with what to install, where shtab is missing.
    """
    try:
        import shtab
    except ImportError as error:
        raise ImportError('--print-completion needs shtab: '
                          "pip install '.[completion]' in the checkout") from error
    for each in _parsers(parser):
        for action in each._actions:   # argparse has no public list of them
            if action.dest in _NAMED and not action.choices:
                action.complete = dict.fromkeys(SHELLS, f'_poststall_{action.dest}')
            elif action.type is values.folder:
                action.complete = _FOLDERS
            elif action.type in _WRITTEN_TO or action.dest in _READ_FROM_FILES:
                action.complete = _FILES
    return shtab.complete(parser, shell, preamble={'bash': _bash(), 'zsh': _zsh()})


def _parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Yield a parser and those of its commands."""
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for each in action.choices.values():
                yield from _parsers(each)


def _bash() -> str:
    return '\n'.join(
        f"_poststall_{what}() {{ compgen -W '{' '.join(definition.names(kind))}' -- $1; "
        'compgen -f -- $1; }' for what, kind in _NAMED.items())


def _zsh() -> str:
    return '\n'.join(
        f"_poststall_{what}() {{ compadd {' '.join(definition.names(kind))}; _files; }}"
        for what, kind in _NAMED.items())

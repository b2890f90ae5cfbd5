# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The words on a node's command line that are not ROS's: help, version, and nothing else."""

import argparse
import dataclasses

from rclpy.utilities import remove_ros_args

from poststall_sim import __version__


def heed(name: str, what: str, parameters: tuple[type, ...], args: list[str] | None) -> None:
    """
    Answer --help and --version; refuse other words than ROS's in one line, exit code 2.

    what : what the node does, in a line
    parameters : records of its parameters
    args : as `rclpy.init` takes them; None = the command line
    """
    try:
        words = remove_ros_args(args)
    except RuntimeError:   # ROS's words are wrong: `process.run` says so, in one line
        return
    parser = _Parser(
        prog=name, description=what, epilog=_listed(name, parameters),
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--version', action='version', version=f'poststall_sim {__version__}')
    parser.parse_args(words[1:] if args is None else words)


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line that says how parameters are given."""

    def error(self, message: str) -> None:
        self.exit(2, f'{self.prog}: {message}: parameters are given as --ros-args -p '
                     f'NAME:=VALUE (see {self.prog} --help)\n')


def _listed(name: str, parameters: tuple[type, ...]) -> str:
    """Return how parameters are given, and each with its default and what it means."""
    lines = [f'example: ros2 run poststall_sim {name} --ros-args -p NAME:=VALUE',
             '         (remap topics there with -r, a namespace with -r __ns:=/left)',
             '', 'exit codes: 0 told to stop, 2 bad input', '', 'parameters:']
    for kind in parameters:
        for field in dataclasses.fields(kind):
            entry, value = field.metadata, field.default
            default = list(value) if isinstance(value, tuple) else value
            shown = str(default).lower() if isinstance(value, bool) else default
            lines += [f"  {entry['name']} := {shown!r}" if isinstance(value, str) else
                      f"  {entry['name']} := {shown}", f"      {entry['description']}"]
    return '\n'.join(lines)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Text of the command line turned into values.

Each reader raises `ArgumentTypeError` with what it expected. Angles stay in degrees.
"""

import argparse
import math
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

STDOUT = Path('/dev/stdout')

_MOST_POINTS = 10_000
_FIGURES = ('.png', '.svg', '.pdf')
_PAGES = ('.html', '.htm')
_STATE_SPACES = ('.npz', '.mat')

AIRSPEED = (0.1, 400.0)
"""Of a flight, a trim or a polar [m/s]; as the node's initial.airspeed."""
HEIGHT = (0.1, 20_000.0)
"""Where a flight can start [m]; as the node's initial.altitude."""
ALTITUDE = (-500.0, 20_000.0)
"""Of steady flow [m]."""
CLIMB = (-90.0, 90.0)
"""[deg]."""
TEMPERATURE_OFFSET = (-80.0, 80.0)
"""[K]."""
QNH = (500.0, 1500.0)
"""[hPa]."""
_WIND = (-100.0, 100.0)
_SEVERITIES = ('light', 'moderate', 'severe')
_INTENSITY = (0.0, 100.0)


def given(value: object) -> bool:
    """Tell whether an option was given: 0 is a value, but None, False and what is empty is not."""
    return not (value is None or value is False or isinstance(value, (list, dict)) and not value)


def number(text: str) -> float:
    """Return a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'expected a number, got {text!r}')
    return value


def positive(text: str) -> float:
    """Return a number above 0."""
    value = number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f'must be above 0, got {text!r}')
    return value


def refused(value: float, limits: tuple[float, float]) -> str | None:
    """Return what is wrong with a value that is not within limits."""
    low, high = limits
    return None if low <= value <= high else f'must be {low:g} to {high:g}, got {value:g}'


def within(limits: tuple[float, float]) -> Callable[[str], float]:
    """Return a reader of a number within limits."""
    def read(text: str) -> float:
        value = number(text)
        if complaint := refused(value, limits):
            raise argparse.ArgumentTypeError(complaint)
        return value
    return read


def count(text: str) -> int:
    """Return a whole number, not below 0."""
    if not re.fullmatch(r'\d{1,15}', text):
        raise argparse.ArgumentTypeError(f'expected a whole number from 0 on, got {text!r}')
    return int(text)


def whole_within(limits: tuple[int, int]) -> Callable[[str], int]:
    """Return a reader of a whole number within limits."""
    def read(text: str) -> int:
        value = count(text)
        if complaint := refused(value, limits):
            raise argparse.ArgumentTypeError(complaint)
        return value
    return read


def span(text: str) -> list[float]:
    """Return the values of A, A:B (in steps of 1) or A:B:STEP, both ends included."""
    parts = [number(part) for part in text.split(':')]
    if len(parts) == 1:
        return parts
    if len(parts) > 3:
        raise argparse.ArgumentTypeError(f'expected A:B:STEP, got {text!r}')
    begin, end = parts[:2]
    step = parts[2] if len(parts) == 3 else math.copysign(1.0, end - begin)
    if step == 0.0 or (end - begin) / step < 0.0:
        raise argparse.ArgumentTypeError(f'the step must lead from A to B, got {text!r}')
    steps = (end - begin) / step   # of numbers as great as there are: infinite
    if steps + 1e-9 >= _MOST_POINTS:
        raise argparse.ArgumentTypeError(
            f'expected at most {_MOST_POINTS} points, got {text!r}')
    return [round(begin + i * step, 12) for i in range(math.floor(steps + 1e-9) + 1)]


def span_within(limits: tuple[float, float]) -> Callable[[str], list[float]]:
    """Return a reader of a `span` within limits."""
    def read(text: str) -> list[float]:
        values = span(text)
        for value in values:
            if complaint := refused(value, limits):
                raise argparse.ArgumentTypeError(complaint)
        return values
    return read


class Deflections(argparse.Action):
    """Gather deflections [deg], or lists of them, by name; a name stands once."""

    def __call__(self, parser, namespace, values, option_string=None) -> None:
        """Add one to those of before."""
        name, value = values
        gathered = getattr(namespace, self.dest)
        if name in gathered:
            raise argparse.ArgumentError(self, f'{name} is given twice')
        setattr(namespace, self.dest, {**gathered, name: value})


def deflection(text: str) -> tuple[str, float]:
    """Return the name and the angle [deg] of NAME=DEG."""
    name, separator, value = text.partition('=')
    if not (separator and name):
        raise argparse.ArgumentTypeError(f'expected NAME=DEG, got {text!r}')
    return name, number(value)


def deflections(text: str) -> tuple[str, list[float]]:
    """Return the name and the angles [deg] of NAME=A:B:STEP."""
    name, separator, angles = text.partition('=')
    if not (separator and name):
        raise argparse.ArgumentTypeError(f'expected NAME=A:B:STEP, got {text!r}')
    return name, span(angles)


def some_of(names: Sequence[str]) -> Callable[[str], list[str]]:
    """Return a reader of some of these names, with commas between."""
    def read(text: str) -> list[str]:
        chosen = text.split(',')
        for each in chosen:
            if each not in names:
                raise argparse.ArgumentTypeError(
                    f'expected one or some of {",".join(names)}, got {text!r}')
        return chosen
    return read


def failure(text: str):
    """Return the name and the failures.Failure of NAME:KIND[=DEG]."""
    from poststall_sim import failure_reader
    from poststall_sim.aircraft import ConfigError
    try:
        if '@' in text:
            raise ConfigError(f'a trim has no time, got {text!r}')
        return failure_reader.failure(text)
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def fault(text: str):
    """Return the scenario.Fault of NAME:KIND[=DEG][@TIME], at 0 s without a time."""
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.failure_reader import failure
    from poststall_sim.scenario import Fault
    what, separator, time = text.partition('@')
    try:
        begins = number(time) if separator else 0.0
        if begins < 0.0:
            raise ConfigError(f'the time must be at least 0 s, got {time}')
        return Fault(begins, *failure(what))
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def by_surface(reader: Callable[[str], float]) -> Callable[[str], dict[str, float]]:
    """Return a reader of N or NAME=N[,NAME=N...]: values by surface, '' for all of them."""
    def read(text: str) -> dict[str, float]:
        values = {}
        for part in text.split(','):
            name, separator, value = part.rpartition('=')
            if separator and not name:
                raise argparse.ArgumentTypeError(f'expected N or NAME=N, got {text!r}')
            values[name] = reader(value)
        return values
    return read


def start(text: str) -> tuple[str, Path | None]:
    """Return where the points of a polar start, and the file if it is one."""
    if text in ('zero', 'schemeA1', 'previous'):
        return text, None
    name, _, path = text.partition('=')
    if name != 'given' or not path:
        raise argparse.ArgumentTypeError(
            f'expected zero, schemeA1, previous or given=FILE, got {text!r}')
    if not Path(path).is_file():
        raise argparse.ArgumentTypeError(f'there is no file {path}')
    return name, Path(path)


def output(text: str) -> Path:
    """Return a file that can be written, seen to before anything is computed."""
    path = _writable(text)
    if text == '-':
        raise argparse.ArgumentTypeError('expected a file: - is for --json')
    if path.exists() and not path.is_file():
        # Some files are written beside their place and moved there: a device would be replaced.
        raise argparse.ArgumentTypeError(f'expected a file, {text!r} is none')
    return path


def result(text: str) -> Path:
    """Return where a result goes: a file, or anything else that can be written; - is `STDOUT`."""
    return STDOUT if text == '-' else _writable(text)


def _writable(text: str) -> Path:
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f'expected a file, {text!r} is a folder')
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f'there is no folder {path.parent}')
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f'{path} cannot be written')
    return path


def figure(text: str) -> Path:
    """Return a file that a figure can be written to."""
    path = output(text)
    if path.suffix.lower() not in _FIGURES:
        raise argparse.ArgumentTypeError(
            f'expected a name that ends in {", ".join(_FIGURES)}, got {text!r}')
    return path


def page(text: str) -> Path:
    """Return a file that a page can be written to."""
    path = output(text)
    if path.suffix.lower() not in _PAGES:
        raise argparse.ArgumentTypeError(
            f'expected a name that ends in {" or ".join(_PAGES)}, got {text!r}')
    return path


def state_space(text: str) -> Path:
    """Return a file that a linear system can be written to."""
    path = output(text)
    if path.suffix not in _STATE_SPACES:
        raise argparse.ArgumentTypeError(
            f'expected a name that ends in {" or ".join(_STATE_SPACES)}, got {text!r}')
    return path


def folder(text: str) -> Path:
    """Return a folder that is there or can be made."""
    path = Path(text)
    above = [each for each in (path, *path.parents) if each.exists()]
    if above and not above[0].is_dir():
        raise argparse.ArgumentTypeError(f'expected a folder, {above[0]} is a file')
    return path


def reference(text: str) -> tuple[float, float, float] | None:
    """Return a point of the drawing [m], None for the centre of gravity."""
    if text == 'cg':
        return None
    parts = text.split(',')
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f'expected cg or X,Y,Z, got {text!r}')
    x, y, z = map(number, parts)
    return x, y, z


def wind(text: str) -> np.ndarray:
    """Return the velocity of the air (3,), east, north and up [m/s]."""
    parts = [number(part) for part in text.split(',')]
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f'expected E,N,U, got {text!r}')
    for part in parts:
        if complaint := refused(part, _WIND):
            raise argparse.ArgumentTypeError(f'each {complaint}')
    return np.array(parts)


def turbulence(text: str) -> str | float:
    """Return a level of turbulence by its name, or its vertical root mean square [m/s]."""
    if text in _SEVERITIES:
        return text
    try:
        return within(_INTENSITY)(text)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f'expected {", ".join(_SEVERITIES)} or 0 to 100 m/s, got {text!r}') from None


def gust(text: str) -> tuple[np.ndarray, float, float]:
    """Return velocity (3,) east, north, up [m/s], length [m] and begin [m] of a gust."""
    parts = text.split(':')
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f'expected E,N,U:LENGTH:BEGIN, got {text!r}')
    return wind(parts[0]), positive(parts[1]), number(parts[2])

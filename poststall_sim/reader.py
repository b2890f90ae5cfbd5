# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A file's text and its YAML, and a reader of mappings that knows where it is.

Whatever is wrong is a `ConfigError` of one line that names the file, the key (or the line), the
value given and what was expected. Nothing here knows an aircraft: see definition.py.
"""

import difflib
import math
import os
import re
import reprlib
import stat
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import yaml

from poststall_sim.aircraft import ConfigError

Record = TypeVar('Record')
Choice = TypeVar('Choice')

SIZE_LIMIT = 1_000_000
"""Bytes; a longer file is not a definition."""

_INTEGER = re.compile(r'[-+]?[0-9]{1,15}')
_NUMBER = re.compile(r'[-+]?(\.[0-9]+|[0-9]+\.?[0-9]*)([eE][-+]?[0-9]+)?')
_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*')
_CONSTANTS = {
    **dict.fromkeys(('', '~', 'null', 'Null', 'NULL')),
    **dict.fromkeys(('true', 'True', 'TRUE'), True),
    **dict.fromkeys(('false', 'False', 'FALSE'), False),
    **dict.fromkeys(('.inf', '.Inf', '.INF', '+.inf'), math.inf), '-.inf': -math.inf,
    **dict.fromkeys(('.nan', '.NaN', '.NAN'), math.nan)}
_REQUIRED: Any = object()

_shortened = reprlib.Repr()
_shortened.maxstring = _shortened.maxother = 60
_shortened.maxlevel = 3


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a file, for errors: the file, and a path to a key or a line."""

    file: str
    path: str = ''

    def key(self, key: str) -> 'Place':
        """Return the place of a key below this one."""
        return Place(self.file, f'{self.path}.{plain(key)}' if self.path else plain(key))

    def item(self, index: int) -> 'Place':
        """Return the place of an item of the list at this place."""
        return Place(self.file, f'{self.path}[{index}]')

    def line(self, number: int) -> 'Place':
        """Return the place of a line of the file, counted from 1."""
        return Place(self.file, f'line {number}')

    def error(self, text: str) -> ConfigError:
        """Return an error of one line for this place."""
        return ConfigError(' '.join(f'{self.file}: {self.path}{": " if self.path else ""}{text}'
                                    .split()))

    def build(self, record: Callable[..., Record], **fields: Any) -> Record:
        """Make a record; what its constructor refuses is an error at this place."""
        try:
            return record(**fields)
        except ConfigError as error:
            raise self.error(str(error)) from None

    def number(self, value: Any, *, above: float | None = None, at_least: float | None = None,
               at_most: float | None = None,
               within: tuple[float, float] | None = None) -> float:
        """Return a value that stands here, if it is a finite number within the limits."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(f'must be a number, got {shown(value)}')
        if not math.isfinite(value):
            raise self.error(f'must be a finite number, got {shown(value)}')
        low, high = within or (-math.inf, math.inf)
        for fits, wanted in (
                (above is None or value > above, f'above {above}'),
                (at_least is None or value >= at_least, f'at least {at_least}'),
                (at_most is None or value <= at_most, f'at most {at_most}'),
                (low <= value <= high, f'within {low} to {high}')):
            if not fits:
                raise self.error(f'must be {wanted}, got {shown(value)}')
        return float(value)

    def vector(self, value: Any, length: int, **limits: Any) -> tuple[float, ...]:
        """Return a value that stands here, if it is a list of so many numbers in the limits."""
        if not isinstance(value, list) or len(value) != length:
            raise self.error(f'must be a list of {length} numbers, got {shown(value)}')
        return tuple(self.item(i).number(item, **limits) for i, item in enumerate(value))

    def text(self, value: Any, *, free: bool = False) -> str:
        """Return a value that stands here, if it is a text of one line; free: or of any lines."""
        if not isinstance(value, str) or not (free or (value.strip() and value.isprintable())):
            raise self.error(f'must be a text{"" if free else " of one line"}, got {shown(value)}')
        return value

    def name(self, value: Any) -> str:
        """Return a value that stands here, if it can be part of a topic or a parameter."""
        if not isinstance(value, str) or not _NAME.fullmatch(value):
            raise self.error('must be a name of letters, digits and _ that starts with a letter, '
                             f'got {shown(value)}')
        return value


class Reader:
    """
    Takes values out of a mapping, each checked, and remembers which keys were asked for.

    A key without a ``default`` must be there. After the last one `build` or `done` refuses the
    keys that nobody asked for.
    """

    def __init__(self, mapping: Any, where: Place) -> None:
        """Read from a mapping that stands at a place."""
        if not isinstance(mapping, Mapping):
            raise where.error(f'must be a mapping of keys to values, got {shown(mapping)}')
        self.where = where
        self._mapping = mapping
        self._asked: list[str] = []

    @property
    def tree(self) -> Mapping[str, Any]:
        """The mapping itself, for who puts other values in its place."""
        return self._mapping

    def done(self) -> None:
        """Refuse the keys that nobody asked for."""
        for key in self._mapping:
            if key not in self._asked:
                raise self._unknown(key, self._asked)

    def build(self, record: Callable[..., Record], **fields: Any) -> Record:
        """Refuse unknown keys and make the record, its own errors at this place."""
        self.done()
        return self.where.build(record, **fields)

    def names(self) -> list[str]:
        """Return the keys of a mapping whose keys are names of the user's choice."""
        return [self.where.name(key) for key in self._mapping]

    def has(self, key: str) -> bool:
        """Tell whether a key that may be left out is there."""
        self._get(key, None)
        return key in self._mapping

    def value(self, key: str, *, default: Any = _REQUIRED) -> Any:
        """Return whatever stands there, for who checks it."""
        return self._get(key, default)

    def number(self, key: str, *, default: float = _REQUIRED, **limits: Any) -> float:
        """Return a finite number; limits: ``above``, ``at_least``, ``at_most``, ``within``."""
        return self.where.key(key).number(self._get(key, default), **limits)

    def number_if_any(self, key: str, **limits: Any) -> float | None:
        """Return a finite number within limits, or None where the key is missing."""
        return None if self._get(key, None) is None else self.number(key, **limits)

    def count(self, key: str, *, at_most: int) -> int:
        """Return a whole number from 1 on."""
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= at_most:
            raise self.where.key(key).error(
                f'must be a whole number from 1 to {at_most}, got {shown(value)}')
        return value

    def boolean(self, key: str, *, default: bool = _REQUIRED) -> bool:
        """Return true or false."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise self.where.key(key).error(f'must be true or false, got {shown(value)}')
        return value

    def text(self, key: str, *, default: str = _REQUIRED, free: bool = False) -> str:
        """Return a text of one line; free text may have more lines or none."""
        return self.where.key(key).text(self._get(key, default), free=free)

    def name(self, key: str) -> str:
        """Return a name that can be part of a topic or a parameter."""
        return self.where.key(key).name(self._get(key))

    def choice(self, key: str, choices: Mapping[str, Choice], *,
               default: str = _REQUIRED) -> Choice:
        """Return what one of a few words stands for."""
        value = self._get(key, default)
        if not isinstance(value, str) or value not in choices:
            raise self.where.key(key).error(f'must be one of {listed(choices)}, got '
                                            f'{shown(value)}{suggestion(value, choices)}')
        return choices[value]

    def vector(self, key: str, length: int, *, default: list[float] = _REQUIRED,
               **limits: Any) -> tuple[float, ...]:
        """Return a list of so many numbers, each within the limits."""
        return self.where.key(key).vector(self._get(key, default), length, **limits)

    def numbers(self, key: str, *, default: list[float] = _REQUIRED) -> tuple[float, ...]:
        """Return a list of numbers, as many as there are."""
        return tuple(self.where.key(key).item(i).number(item)
                     for i, item in enumerate(self._list(key, default)))

    def rows(self, key: str, length: int) -> list[tuple[float, ...]]:
        """Return a list of lists of so many finite numbers each."""
        return [self.where.key(key).item(index).vector(row, length)
                for index, row in enumerate(self._list(key))]

    def points(self, key: str, *, within: tuple[float, float]) -> list[tuple[float, float]]:
        """Return a list of [time, value], times from 0 on and values within the limits."""
        rows = []
        for index, row in enumerate(self._list(key)):
            where = self.where.key(key).item(index)
            time, value = where.vector(row, 2)
            rows.append((where.item(0).number(time, at_least=0),
                         where.item(1).number(value, within=within)))
        return rows

    def mapping(self, key: str, *, default: dict[str, Any] = _REQUIRED) -> 'Reader':
        """Return a reader of the mapping below a key."""
        return Reader(self._get(key, default), self.where.key(key))

    def mappings(self, key: str, *, default: list[Any] = _REQUIRED) -> list['Reader']:
        """Return a reader for each mapping in a list."""
        return [Reader(item, self.where.key(key).item(index))
                for index, item in enumerate(self._list(key, default))]

    def files(self, key: str) -> list[tuple[str, Place, 'Reader']]:
        """
        Return the files at a key, one or a list: name, its place, a reader of what else is said.

        Each is a name as it is or key ``file`` of a mapping.
        """
        value, here = self._get(key), self.where.key(key)
        if value == []:
            raise here.error('must be a file or a list of files, got an empty list')
        found = []
        for index, item in enumerate(value if isinstance(value, list) else [value]):
            at = here.item(index) if isinstance(value, list) else here
            if isinstance(item, str):
                found.append((at.text(item), at, Reader({}, at)))
            else:
                read = Reader(item, at)
                found.append((read.text('file'), at.key('file'), read))
        return found

    def _list(self, key: str, default: Any = _REQUIRED) -> list[Any]:
        value = self._get(key, default)
        if not isinstance(value, list):
            raise self.where.key(key).error(f'must be a list, got {shown(value)}')
        return value

    def _get(self, key: str, default: Any = _REQUIRED) -> Any:
        if key not in self._asked:
            self._asked.append(key)
        if key in self._mapping:
            return self._mapping[key]
        if default is not _REQUIRED:
            return default
        others = [other for other in self._mapping if other not in self._asked]
        for other in difflib.get_close_matches(key, others, n=1, cutoff=0.7):
            raise self._unknown(other, [key])   # rather chord_mm there than chord_m missing
        raise self.where.error(f'key {key} must be there, got '
                               + (f'only {listed(self._mapping)}' if self._mapping else 'no keys'))

    def _unknown(self, key: str, known: Collection[str]) -> ConfigError:
        return self.where.error(
            f'unknown key {plain(key)} with value {shown(self._mapping[key])}'
            + (suggestion(key, known)
               or (f'; expected {listed(known)}' if known else '; expected no keys')))


def shown(value: Any) -> str:
    """Return a value as errors show it, shortened."""
    return _shortened.repr(value)


def plain(key: str) -> str:
    """Return a key as errors show it: without quotes, unless it is a strange one."""
    return key if key.isprintable() and len(key) <= 60 else shown(key)


def listed(keys: Iterable[str]) -> str:
    """Return keys as errors show them, at most twenty."""
    words = [plain(key) for key in keys]
    rest = f' and {len(words) - 20} more' if len(words) > 20 else ''
    return (', '.join(words[:20]) or 'nothing') + rest


def suggestion(word: Any, known: Iterable[str]) -> str:
    """Return a question for the nearest known word, or nothing."""
    if not isinstance(word, str) or len(word) > 80:
        return ''
    close = [match for match in difflib.get_close_matches(word, known, n=1) if match != word]
    return f'; did you mean {plain(close[0])}?' if close else ''


def place_of(path: str | os.PathLike[str]) -> Place:
    """Return the place of a file, named from the working directory where it is below that."""
    try:
        here = os.path.abspath(path)
        base = os.path.join(os.getcwd(), '')
    except OSError:   # the working directory was deleted
        return Place(os.fspath(path))
    below = here.startswith(base) and len(base) > 1
    return Place(here[len(base):] if below else here)


def file_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a file, if it is one."""
    where = place_of(path)
    try:
        status = os.stat(path)
        if not stat.S_ISREG(status.st_mode):
            kind = 'a folder' if stat.S_ISDIR(status.st_mode) else 'not a regular file'
            raise where.error(f'is {kind}, expected a definition file')
        if status.st_size > SIZE_LIMIT:
            raise where.error(f'is too large for a definition: expected at most {SIZE_LIMIT} '
                              f'bytes, got {status.st_size}')
        return Path(path).read_bytes().decode('utf-8-sig')
    except FileNotFoundError:
        raise where.error('does not exist, expected a definition file') from None
    except UnicodeDecodeError as error:
        raise where.error(f'must be UTF-8 text, got byte {error.object[error.start]:#04x} at '
                          f'position {error.start}') from None
    except OSError as error:
        raise where.error(f'must be readable, got {error.strerror}') from None


def open_yaml(path: str | os.PathLike[str]) -> Reader:
    """
    Return a reader of the mapping in a YAML file.

    Nodes are composed and never constructed, so that no tag can make an object; scalars follow
    YAML 1.2, in which 1e-3 is a number, and 010, 1:30 and no are not traps.
    """
    where = place_of(path)
    text = file_text(path)
    try:
        tree = _tree(yaml.compose(text, Loader=yaml.BaseLoader), where, {})
    except yaml.MarkedYAMLError as error:
        at = where.line(error.problem_mark.line + 1) if error.problem_mark else where
        tab = '; indent with blanks, not tabs' if "'\\t'" in str(error.problem) else ''
        raise at.error(f'is not YAML: {error.context or ""} {error.problem}{tab}') from None
    except yaml.YAMLError as error:
        raise where.error(f'is not YAML: {error}') from None
    except RecursionError:
        raise where.error('must not be nested so deeply') from None
    if tree is None:
        raise where.error('is empty, expected a mapping of keys to values')
    return Reader(tree, where)


def _tree(node: Any, where: Place, made: dict[int, Any]) -> Any:
    """Return a YAML node as dict, list, text, number, boolean or None; aliases are shared."""
    if node is None:
        return None
    at = where.line(node.start_mark.line + 1)
    if id(node) in made:
        if made[id(node)] is _REQUIRED:
            raise at.error('an alias must not stand for the very list or mapping it is in')
        return made[id(node)]
    if node.tag not in ('tag:yaml.org,2002:str', 'tag:yaml.org,2002:seq', 'tag:yaml.org,2002:map'):
        raise at.error(f'must have no tag, got {shown(node.tag)}')
    if isinstance(node, yaml.ScalarNode):
        return scalar(node.value) if node.style is None else node.value
    made[id(node)] = _REQUIRED
    result: Any
    if isinstance(node, yaml.SequenceNode):
        result = [_tree(item, where, made) for item in node.value]
    else:
        result = {}
        for key, value in node.value:
            at = where.line(key.start_mark.line + 1)
            if not isinstance(key, yaml.ScalarNode):
                raise at.error('a key must be a word, got a list or a mapping')
            if key.value in result:
                raise at.error(f'key {plain(key.value)} must be there once, got it twice')
            result[key.value] = _tree(value, where, made)
    made[id(node)] = result
    return result


def scalar(text: str) -> Any:
    """Return what a word without quotes stands for, by the core schema of YAML 1.2."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    return float(text) if _NUMBER.fullmatch(text) else text

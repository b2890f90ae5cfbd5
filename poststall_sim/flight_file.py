# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A flight in a file, wake and all: written at one instant, gone on with later, bit for bit.

The file is numpy's own (``.npz``, nothing pickled): one array for each field of a
`simulation.SavedFlight`, named by its path (``state.flow.wake.drift_N``), and beside them the
format's number and what the flight was made with, so that it goes on with nothing else.
"""

import dataclasses
import enum
import hashlib
import types
import typing
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import atomic_file
from poststall_sim.aero.history import History
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import ConfigError
from poststall_sim.simulation import Flight, SavedFlight

FORMAT = 7
"""Goes up with every change of what a flight remembers: an old file is refused, not guessed."""
GREATEST = 256 * 1024 * 1024
"""No flight is larger, packed or not [bytes]: what is, is not read."""
_FORMAT, _AIRCRAFT, _SETTINGS = 'format', 'aircraft', 'settings'
_NAN_HAS_A_MEANING = {'failed_parts', 'state.flow.share'}
"""No angle of a failure, and no separation but by the static curve; all else is finite."""


def save_state(flight: Flight, path: Path) -> None:
    """
    Write a flight as it is now; an older file of that name is replaced at once or not at all.

    Raises `ConfigError` where the file cannot be written, or something else is there.
    """
    _require_plausible(path)
    arrays = dict(_arrays('', flight.saved()))
    arrays |= {_FORMAT: np.array(FORMAT), _AIRCRAFT: np.array(fingerprint(flight.model.aircraft)),
               _SETTINGS: np.array(repr(flight.model.settings))}
    with atomic_file.writing(path) as file:
        np.savez_compressed(file, **arrays)


def load_state(model: Model, path: Path) -> Flight:
    """
    Return the flight in a file, ready to go on as if it had never stopped.

    Raises `ConfigError` where the file is not one of a flight, of another format, or was
    written with another aircraft or other settings than the model's.
    """
    _require_plausible(path)
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(part.file_size for part in packed.infolist())
        arrays = {}
        if size <= GREATEST:
            with np.load(path, allow_pickle=False) as file:
                arrays = {key: np.asarray(file[key]) for key in file.files}
    except FileNotFoundError:
        raise ConfigError(f'there is no file {path}') from None
    except (OSError, ValueError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error):
        raise ConfigError(f'{path}: not the state of a flight') from None
    if size > GREATEST:
        raise ConfigError(f'{path}: {size} bytes unpacked, more than any flight ({GREATEST})')
    if any(arrays.get(key, np.zeros(0)).ndim for key in (_FORMAT, _AIRCRAFT, _SETTINGS)):
        raise ConfigError(f'{path}: not the state of a flight')
    if arrays[_FORMAT] != FORMAT:
        raise ConfigError(f'{path}: format {arrays[_FORMAT]}, expected {FORMAT}: it was written '
                          'by another version')
    if arrays[_AIRCRAFT] != fingerprint(model.aircraft):
        raise ConfigError(f'{path}: written with another aircraft than {model.aircraft.name} is '
                          'now')
    if arrays[_SETTINGS] != repr(model.settings):
        raise ConfigError(f'{path}: written with {arrays[_SETTINGS]}, not {model.settings!r}')
    for name, array in arrays.items():
        if array.dtype.kind == 'f' and not (np.isfinite(array) | (
                np.isnan(array) & (name in _NAN_HAS_A_MEANING))).all():
            raise ConfigError(f'{path}: {name} is not finite')
    try:
        return Flight.resumed(model, _value(SavedFlight, '', arrays))
    except KeyError as error:
        raise ConfigError(f'{path}: {error.args[0]} is missing') from None
    except (TypeError, ValueError):
        raise ConfigError(f'{path}: a field is not of its type or shape') from None


def _require_plausible(path: Path) -> None:
    """Raise `ConfigError` for what is there and no regular file, or larger than any flight."""
    found = atomic_file.require_regular(path)
    if found is not None and found.st_size > GREATEST:
        raise ConfigError(f'{path}: {found.st_size} bytes, more than any flight ({GREATEST})')


def fingerprint(record: Any) -> str:
    """Return a hash of everything in a record, an aircraft or any other."""
    digest = hashlib.sha256()
    for name, array in _arrays('', record):
        digest.update(f'{name} {array.dtype} {array.shape} '.encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _arrays(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Yield every field in a record, named by its path; None is left out."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _arrays(f'{name}.{field.name}'.lstrip('.'), getattr(value, field.name))
    elif isinstance(value, tuple):
        for i, each in enumerate(value):
            yield from _arrays(f'{name}.{i}', each)
    elif isinstance(value, History):
        yield from _arrays(name, (value.nodes[value.first:], value.rings[value.first:]))
    elif isinstance(value, enum.Enum):
        yield name, np.array(value.name)
    elif value is not None:
        yield name, np.asarray(value)


def _value(kind: Any, name: str, arrays: dict[str, np.ndarray]) -> Any:
    """Return the value of a kind at a path; the inverse of `_arrays` for what flights have."""
    if isinstance(kind, types.UnionType):     # X | None
        kind = next(each for each in typing.get_args(kind) if each is not type(None))
        if not any(key == name or key.startswith(name + '.') for key in arrays):
            return None
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        return kind(**{
            field.name: _value(hints[field.name], f'{name}.{field.name}'.lstrip('.'), arrays)
            for field in dataclasses.fields(kind)})
    if typing.get_origin(kind) is tuple:     # tuple[X, ...]
        each, count = typing.get_args(kind)[0], 0
        items = []
        while any(key.startswith(f'{name}.{count}.') for key in arrays):
            items.append(_value(each, f'{name}.{count}', arrays))
            count += 1
        return tuple(items)
    if kind is History:
        return History(*(_value(np.ndarray, f'{name}.{i}', arrays) for i in range(2)))
    if name not in arrays:
        raise KeyError(name)
    array = arrays[name]
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return kind[str(array)]
    if kind in (int, float, str, bool):
        return kind(array)
    return array

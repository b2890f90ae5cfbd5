# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flights as rosbag2 folders (MCAP, message definitions inside), written without ROS and read back.

`Recorder` writes what it is given: plain fields of `topics`, or CDR bytes that came over DDS.
`FlightRecorder` does what the simulator node does, for a flight without a ROS graph.
`read` gives any bag's topics as arrays over simulated time, whoever recorded it.
"""

import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import cdr, inlets, run_settings, topics
from poststall_sim.frames import FloatArray
from poststall_sim.state import Snapshot
from poststall_sim.views import Views

try:
    from rosbags.highlevel import AnyReader, AnyReaderError
    from rosbags.interfaces import (
        Nodetype,
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.rosbag2.errors import WriterError
    from rosbags.typesys import Stores, get_typestore
except ImportError as error:
    raise ImportError('bags need the rosbags library: pip install rosbags') from error

_ENDLESS = QosTime(9223372036, 854775807)


class BagError(ValueError):
    """A bag that cannot be written or read."""


def free_path(path: Path) -> Path:
    """Return the path, or the first of path_2, path_3 ... if it is taken."""
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_name(f'{path.name}_{number}')
    return free


class Recorder:
    """
    Write a bag: a new folder, never over an old one. A context manager; `close` ends the bag.

    The MCAP's chunks are compressed by zstd, as by ``ros2 bag record`` with the storage preset
    ``zstd_fast``: markers shrink tenfold, and readers of MCAP unpack them as they go.

    Raises
    ------
    BagError
        When the folder is there already or cannot be made.

    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.messages = 0
        self._typestore = get_typestore(Stores.ROS2_JAZZY)
        self._connections: dict[str, Any] = {}
        try:
            self._writer = Writer(self.path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except (WriterError, OSError) as error:
            raise BagError(f'cannot record to {self.path}: {error}') from None

    def __enter__(self) -> 'Recorder':
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def knows(self, type_name: str) -> bool:
        """Tell whether the definition of a message type is known, so that it can be written."""
        return type_name in self._typestore.fielddefs

    def add_topic(self, name: str, type_name: str, qos: topics.Qos) -> None:
        """Announce a topic: what is not announced cannot be written raw."""
        if name not in self._connections:
            self._connections[name] = self._writer.add_connection(
                name, type_name, typestore=self._typestore, offered_qos_profiles=[_qos(qos)])

    def write(self, topic: topics.Topic, fields: topics.Fields, time_ns: int,
              namespace: str = '/') -> None:
        """Write plain fields as one message of a topic, stamped with simulated time [ns]."""
        name = topic.name if topic.name.startswith('/') else namespace + topic.name
        self.add_topic(name, topic.type, topic.qos)
        data = cdr.serialize(topic.type, fields) if topic.bulk else bytes(
            self._typestore.serialize_cdr(self._message(topic.type, fields), topic.type))
        self.write_raw(name, data, time_ns)

    def write_raw(self, name: str, data: bytes, time_ns: int) -> None:
        """Write the CDR bytes of one message of an announced topic."""
        try:
            self._writer.write(self._connections[name], time_ns, data)
        except OSError as error:
            raise self._broken(error) from None
        self.messages += 1

    def close(self) -> None:
        """End the bag: index and metadata are written now."""
        if self._writer.storage is not None:
            if not self.messages:   # the library's idea of the first stamp of nothing overflows
                self._writer.min_timestamp = 0
            try:
                self._writer.close()
            except OSError as error:
                raise self._broken(error) from None

    def _broken(self, error: OSError) -> BagError:
        """Give the bag up, so that `close` does nothing, and return what to say of it."""
        with contextlib.suppress(OSError):   # what is still buffered does not fit either
            self._writer.abort()
        return BagError(f'cannot go on recording to {self.path}: {error.strerror}; the bag is '
                        'not complete')

    def _message(self, type_name: str, fields: topics.Fields) -> Any:
        """Return a message filled with plain fields; what they do not name is zero."""
        _, definition = self._typestore.fielddefs[type_name]
        return self._typestore.types[type_name](**{
            name: self._value(description, fields.get(name))
            for name, description in definition})

    def _value(self, description: Any, value: Any) -> Any:
        node, detail = description
        if node is Nodetype.NAME:
            return self._message(detail, value or {})
        if node is Nodetype.BASE:
            zero = {'string': '', 'bool': False}.get(detail[0], 0)
            return zero if value is None else value
        (element, inner), length = detail
        if element is Nodetype.NAME:
            return [self._message(inner, item) for item in value or ()]
        if inner[0] == 'string':
            return list(value or ())
        dtype = np.dtype(inner[0])
        if value is None:
            return np.zeros(length if node is Nodetype.ARRAY else 0, dtype)
        return np.ascontiguousarray(value, dtype)


def _qos(qos: topics.Qos) -> Qos:
    return Qos(
        QosHistory.KEEP_LAST, qos.depth,
        QosReliability.RELIABLE if qos.reliable else QosReliability.BEST_EFFORT,
        QosDurability.TRANSIENT_LOCAL if qos.latched else QosDurability.VOLATILE,
        _ENDLESS, _ENDLESS, QosLiveliness.AUTOMATIC, _ENDLESS, False)


class FlightRecorder:
    """Write a `simulation.Flight` into a bag as the node would publish it, at its rates."""

    def __init__(self, path: str | os.PathLike[str], flight, scenario: str = '') -> None:
        """Begin a bag; scenario : the name of what is flown, for the diagnostics."""
        self._recorder = Recorder(path)
        self._flight = flight
        self._scenario = scenario
        self._layout = topics.layout(flight)
        self._views = Views(flight.model, self._layout, topics.Rate.VIEWS.default)
        self._schedule = topics.Schedule({})
        self._tally = topics.SolverTally()
        self._reported_ns: int | None = None
        for topic in topics.PUBLISHED:
            if topic.rate is topics.Rate.ONCE:
                self._write(topic, flight.snapshot)
        self._record(flight.snapshot)

    def __enter__(self) -> 'FlightRecorder':
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def add(self, snapshot: Snapshot, commands: Mapping[str, float] | None = None) -> None:
        """Count a step; write what is due after it, and the pilot's commands if there are any."""
        self._tally.add(snapshot)
        self._record(snapshot, commands)

    def close(self) -> None:
        """Write a last report and end the bag."""
        self._report(self._flight.snapshot)
        self._recorder.close()

    def _record(self, snapshot: Snapshot, commands: Mapping[str, float] | None = None) -> None:
        self._views.follow(self._flight)
        due = self._schedule.due(snapshot.time_ns)
        for topic in due:
            if topic.switched_on and topic.shown_by(self._layout):
                self._write(topic, snapshot)
        if commands and any(topic.rate is topics.Rate.STATE for topic in due):
            self._recorder.write(inlets.PILOT, topics.joint_fields(
                snapshot.time_ns, commands), snapshot.time_ns)
        if self._reported_ns is None or snapshot.time_ns - self._reported_ns >= 1_000_000_000:
            self._report(snapshot)

    def _write(self, topic: topics.Topic, snapshot: Snapshot) -> None:
        values = (topic.fields(snapshot, self._layout) if topic.fields
                  else self._views.fields(topic, self._flight))
        self._recorder.write(topic, values, snapshot.time_ns)

    def _report(self, snapshot: Snapshot) -> None:
        self._reported_ns = snapshot.time_ns
        reason = self._flight.paused_reason
        self._recorder.write(topics.DIAGNOSTICS, topics.diagnostics_fields(
            snapshot.time_ns, self._flight.model.aircraft.name, [
                topics.Condition(
                    topics.Level.ERROR if reason else topics.Level.OK, 'simulator: flight',
                    reason or 'flying', {'paused_reason': reason or '',
                                         'density_kg_m3': f'{snapshot.density:.9g}'}),
                self._tally.condition('simulator: solver', snapshot, run_settings.closure(
                    self._flight.model.settings)),
                run_settings.condition('simulator', self._flight, self._scenario)],
        ), snapshot.time_ns)


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """
    One topic of a bag: time (n,) in simulated seconds, and each field by its dotted path.

    Numbers are (n,) arrays and number arrays (n, k) ones where their length never changes;
    all else are object arrays. skipped : messages that could not be decoded.
    """

    type: str
    time: FloatArray
    fields: dict[str, np.ndarray]
    skipped: int = 0

    def __getitem__(self, key: str) -> np.ndarray:
        """Return a field, such as ``pose.position.x``."""
        return self.fields[key]

    def __len__(self) -> int:
        return len(self.time)

    def by_name(self, key: str = 'position') -> dict[str, FloatArray]:
        """Return a JointState's values by name, (n,) each, NaN where a message lacks it."""
        result: dict[str, FloatArray] = {}
        for i, (names, values) in enumerate(zip(self['name'], self[key])):
            for name, value in zip(names, values):
                result.setdefault(name, np.full(len(self), np.nan))[i] = value
        return result

    def diagnostics(self) -> dict[str, dict[str, str]]:
        """Return the last value of each key of each status of a DiagnosticArray, as text."""
        result: dict[str, dict[str, str]] = {}
        for statuses in self['status']:
            for status in statuses:
                result.setdefault(status.name, {}).update(
                    {item.key: item.value for item in status.values},
                    level=str(status.level), message=status.message)
        return result


def read(path: str | os.PathLike[str]) -> dict[str, Series]:
    """
    Return the topics of a bag by name, decoded with the definitions that it holds.

    Times are simulated: header stamps where messages have them, else the time of recording,
    which the bag's /clock (or its best stamped topic) turns into simulated time.

    Raises
    ------
    BagError
        When there is no bag or it cannot be read: one that was not closed has no metadata.

    """
    path = Path(path)
    if path.is_file() and (path.parent / 'metadata.yaml').exists():
        path = path.parent
    raw: dict[str, tuple[str, list[int], list[Any], int]] = {}
    try:
        with AnyReader([path]) as reader:
            for connection, logged_ns, data in reader.messages():
                kind, logged, decoded, skipped = raw.setdefault(
                    connection.topic, (connection.msgtype, [], [], 0))
                try:
                    message = reader.deserialize(data, connection.msgtype)
                except AnyReaderError:   # padding after an empty array, see `topics`
                    raw[connection.topic] = (kind, logged, decoded, skipped + 1)
                    continue
                logged.append(logged_ns)
                decoded.append(message)
    except (AnyReaderError, OSError, AssertionError) as error:
        if path.is_dir() and any(path.glob('*.mcap')) and not (path / 'metadata.yaml').exists():
            raise BagError(f'cannot read the bag {path}: it was not closed, its recorder was '
                           'killed or had no room') from None
        raise BagError(f'cannot read the bag {path}: {error or "it is damaged"}') from None

    stamps = {name: _stamps(messages) for name, (_, _, messages, _) in raw.items()}
    stamped = [name for name, found in stamps.items() if found is not None]
    best = topics.CLOCK.name if topics.CLOCK.name in stamped else max(
        stamped, key=lambda name: len(stamps[name]), default=None)
    result = {}
    for name, (kind, logged, messages, skipped) in raw.items():
        time = stamps[name]
        if time is None and best is not None:
            time = np.interp(logged, raw[best][1], stamps[best])
        elif time is None:
            time = (np.array(logged, dtype=float) - min(logged, default=0)) * 1e-9
        result[name] = Series(kind, time, _columns(messages), skipped)
    return result


def _stamps(messages: list[Any]) -> FloatArray | None:
    """Return the stamps that messages carry [s], None if they carry none."""
    if not messages:
        return None
    first = messages[0]
    if hasattr(first, 'clock') and hasattr(first.clock, 'nanosec'):
        found = [message.clock for message in messages]
    elif hasattr(first, 'header'):
        found = [message.header.stamp for message in messages]
    else:
        return None
    times = np.array([stamp.sec + stamp.nanosec * 1e-9 for stamp in found])
    return times if times.any() or len(times) == 1 else None


def _columns(messages: list[Any]) -> dict[str, np.ndarray]:
    """Return the fields of messages of one type as arrays, by dotted path."""
    columns: dict[str, list[Any]] = {}

    def walk(message: Any, prefix: str) -> None:
        for name in message.__dataclass_fields__:
            value = getattr(message, name)
            if name == '__msgtype__':
                continue
            if hasattr(value, '__dataclass_fields__'):
                walk(value, f'{prefix}{name}.')
            else:
                columns.setdefault(prefix + name, []).append(value)

    for message in messages:
        walk(message, '')
    return {key: _array(values) for key, values in columns.items()}


def _array(values: list[Any]) -> np.ndarray:
    first = values[0]
    if isinstance(first, (bool, int, float)):
        return np.array(values)
    if isinstance(first, np.ndarray) and len({value.shape for value in values}) == 1:
        return np.stack(values)
    result = np.empty(len(values), dtype=object)
    result[:] = values
    return result

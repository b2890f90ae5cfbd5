# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A small recorder for machines without ``ros2 bag``: topics into a rosbag2 (MCAP).

    python -m poststall_sim.ros.recorder --output DIR [--topics NAME ...]
                                         [--exclude-topics NAME ...]

It subscribes like any recorder, to whatever topics there are and come, and writes the bytes as
they arrive. The time of recording is simulated time, as with ``ros2 bag record --use-sim-time``:
the stamp of a message that has a header, else the latest time that the simulator has shown.
"""

import argparse
import struct
import sys
from collections.abc import Sequence
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.utilities import remove_ros_args

from poststall_sim import topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.recording import BagError, Recorder
from poststall_sim.ros import messages, process

LOOK_PERIOD = 0.1
"""New topics are looked for this often [s]."""

JUMP_NS = 500_000_000
"""Simulated time that falls by more was set back; by less, messages came out of order [ns]."""

STAMP = slice(4, 12)
"""Where a message that begins with a time has it, as CDR."""

SKIPPED = ('/parameter_events',)
"""Topics not recorded: their empty arrays trip readers, and they say nothing of the flight."""


class RecorderNode(Node):
    """
    Record topics until stopped; say ``ready`` once the simulator's have all been heard.

    The simulator's are those of the table in `topics`, in this node's namespace. It shows new
    subscribers its present state even while it is paused, so that each arrives without delay.

    chosen : names of what is recorded, empty for all; excluded : what is not, chosen or not.
    Names without a slash in front are in this node's namespace.
    """

    def __init__(self, output: str, chosen: Sequence[str] = (), excluded: Sequence[str] = (),
                 **node_options: Any) -> None:
        super().__init__('recorder', **node_options)
        self._chosen = {self.resolve_topic_name(name) for name in chosen}
        self._excluded = {*SKIPPED, *(self.resolve_topic_name(name) for name in excluded)}
        self._heard: set[str] = set()
        self._given_up: set[str] = set()
        self._types: dict[str, str] = {}
        self.exit_code: int | None = None
        self._now_ns = 0
        self._ready = False
        self._expected = set(filter(self._wanted, (
            self.resolve_topic_name(topic.name) for topic in topics.PUBLISHED
            if topic.fields is not None and topic.by_default
            and topic.everywhere and messages.available(topic.type))))
        try:
            self._recorder = Recorder(output)
        except BagError as error:
            raise ConfigError(str(error)) from None
        self.create_timer(LOOK_PERIOD, self._look,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.get_logger().info(f'recording to {self._recorder.path}')

    def _records(self, name: str) -> bool:
        return name not in self._excluded and (not self._chosen or name in self._chosen)

    def _wanted(self, name: str) -> bool:
        """Tell whether a topic is listened to: /clock always is, it tells when all else came."""
        return name == topics.CLOCK.name or self._records(name)

    def _look(self) -> None:
        """Subscribe to topics that are new, and see whether all that are expected came."""
        for name, kinds in self.get_topic_names_and_types():
            if (name not in self._types and name not in self._given_up and self._wanted(name)
                    and (offers := self.get_publishers_info_by_topic(name))):
                self._subscribe(name, kinds, _met_by([each.qos_profile for each in offers]))
        if not self._ready and self._expected <= self._heard:
            self._ready = True
            self.get_logger().info(f'ready: {len(self._types)} topics')

    def _subscribe(self, name: str, kinds: list[str], qos: topics.Qos) -> None:
        try:
            if len(kinds) > 1:
                raise ValueError(f'it has several types, {", ".join(kinds)}')
            if not self._recorder.knows(kinds[0]):
                raise ValueError(f'the definition of {kinds[0]} is not known')
            kind = messages.message_class(kinds[0])
        except (ImportError, AttributeError, ValueError) as error:
            self._given_up.add(name)
            self.get_logger().warning(f'{name} is not recorded: {error}')
            return
        self._types[name] = kinds[0]
        if self._records(name):
            self._recorder.add_topic(name, kinds[0], qos)
        fields = kind.get_fields_and_field_types()
        stamped = next(iter(fields.values()), '') == 'std_msgs/Header'
        self.create_subscription(
            kind, name, lambda data: self._on_message(name, stamped, data),
            messages.qos_profile(qos), raw=True)

    def _on_message(self, name: str, stamped: bool, data: bytes) -> None:
        time_ns = self._now_ns
        # Time comes first after the CDR header; bytes that nobody has read may be none of either.
        if (name == topics.CLOCK.name or stamped) and len(data) >= STAMP.stop:
            order = '<' if data[1] & 1 else '>'
            seconds, nanoseconds = struct.unpack(order + 'iI', data[STAMP])
            if name == topics.CLOCK.name or (seconds, nanoseconds) != (0, 0):
                time_ns = seconds * 1_000_000_000 + nanoseconds
            if name in self._expected and (
                    time_ns > self._now_ns or time_ns < self._now_ns - JUMP_NS):
                self._now_ns = time_ns
        self._heard.add(name)
        if self.exit_code is not None or not self._records(name):
            return   # the bag was given up, or this is only here to tell the time
        try:
            self._recorder.write_raw(name, data, max(time_ns, 0))
        except BagError as error:
            self._give_up(error)

    def _give_up(self, error: BagError) -> None:
        """Say why there is no going on, a full disk perhaps, and end the node."""
        self.get_logger().fatal(str(error))
        self.exit_code = 1

    def destroy_node(self) -> None:
        """Close the bag, then the node."""
        try:
            self._recorder.close()
        except BagError as error:
            self._give_up(error)
        if self.exit_code is None:
            self.get_logger().info(
                f'{self._recorder.messages} messages of '
                f'{sum(map(self._records, self._types))} topics in '
                f'{self._recorder.path}')
        super().destroy_node()


def _met_by(offers: Sequence[QoSProfile]) -> topics.Qos:
    """Return a quality of service that all publishers of a topic can meet."""
    return topics.Qos(
        depth=1000,
        reliable=all(each.reliability == ReliabilityPolicy.RELIABLE for each in offers),
        latched=all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offers))


def main(args: list[str] | None = None) -> int:
    """Record until told to stop; return the exit code."""
    args = sys.argv if args is None else ['recorder', *args]
    parser = argparse.ArgumentParser(
        prog='recorder', description='Record topics to a rosbag2 folder (MCAP, zstd).')
    parser.add_argument('--output', required=True, metavar='DIR',
                        help='the folder to make; it must not exist')
    parser.add_argument('--topics', nargs='+', default=[], metavar='NAME',
                        help='what to record (default: every topic)')
    parser.add_argument('--exclude-topics', nargs='+', default=[], metavar='NAME',
                        help='what not to record, as markers and path; goes before --topics')
    options = parser.parse_args(remove_ros_args(args)[1:])
    return process.run('recorder', lambda: RecorderNode(
        options.output, options.topics, options.exclude_topics), args)


if __name__ == '__main__':
    sys.exit(main())

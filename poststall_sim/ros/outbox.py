# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the simulator says: its publishers, what is due after a step, who has begun to listen."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.publisher import Publisher

from poststall_sim import cdr, topics
from poststall_sim.fields import Fields
from poststall_sim.ros import messages
from poststall_sim.ros.sensor_settings import SensorSettings
from poststall_sim.topics import Rate, Topic
from poststall_sim.views import Views

if TYPE_CHECKING:
    from poststall_sim.ros.simulator import SimulatorNode

AGAIN_PERIOD = 1.0
"""While time stands, what is best effort is shown again this often [s of wall time]."""


class Outbox:
    """
    The publishers of a simulator, each with the message that it keeps and refills.

    Nothing is made that nobody listens to, but for the clock and what is said once.
    """

    def __init__(self, node: SimulatorNode, sensors: SensorSettings) -> None:
        """Open what is not switched off; whoever comes late is shown it by `tend`."""
        self._node = node
        rates = node.settings.rates | sensors.rates
        self._instruments = sensors.instruments(node.layout)
        self._views = Views(node.flight.model, node.layout, rates[Rate.VIEWS])
        self._views.follow(node.flight)
        self._schedule = topics.Schedule(rates)
        self._outlets = self._opened({rate for rate, hz in rates.items() if hz == 0.0})
        self._listeners = dict.fromkeys(self._outlets, 0)
        self._shown_ns: dict[Topic, int] = {}
        self._again_at = 0.0

    def _opened(self, off: set[Rate]) -> dict[Topic, tuple[Publisher, Any]]:
        """Create the publishers, each with its message."""
        node, outlets, missing = self._node, {}, {}
        if not node.settings.publish_clock:
            off = off | {Rate.CLOCK}
        for topic in topics.PUBLISHED:
            if topic.rate in off or topic.switch in node.settings.switched_off \
                    or not topic.shown_by(node.layout):
                continue
            if not messages.available(topic.type):
                missing.setdefault(topic.type.partition('/')[0], []).append(topic.name)
                continue
            kind = messages.message_class(topic.type)
            # rclpy goes through all event handlers at each wake, which costs half as much as the
            # flight does; who asks for another quality of service is told so on his own side.
            outlets[topic] = (node.create_publisher(
                kind, topic.name, messages.qos_profile(topic.qos),
                event_callbacks=PublisherEventCallbacks(use_default_callbacks=False)), kind())
        for package, names in missing.items():
            node.get_logger().info(
                f'{package} is not installed, so there is no {" and no ".join(names)}')
        return outlets

    def stepped(self) -> None:
        """Publish what is due after a step."""
        snapshot = self._node.flight.snapshot
        self._views.follow(self._node.flight)
        for topic, values in self._instruments.step(snapshot):
            if self._heard(topic):
                self.emit(topic, values)
        for topic in self._schedule.due(snapshot.time_ns):
            self._publish(topic)

    def show(self) -> None:
        """Publish what has not been published of the present snapshot."""
        for topic in self._outlets:
            if topic.rate is not Rate.ONCE and (
                    self._shown_ns.get(topic) != self._node.flight.snapshot.time_ns):
                self._publish(topic)

    def show_all(self) -> None:
        """Publish every topic of the present snapshot, what is said once only at first."""
        self._schedule.due(self._node.flight.snapshot.time_ns)
        for topic in self._outlets:
            if topic.rate is not Rate.ONCE or topic not in self._shown_ns:
                self._publish(topic)

    def tend(self, *, stands: bool) -> None:
        """
        While time stands, repeat /clock and show new subscribers the present state.

        What is best effort may get lost on the way, or come before a subscriber has found this
        publisher, and no other comes while time stands: so it is shown again now and then.
        """
        now, time_ns = time.monotonic(), self._node.flight.snapshot.time_ns
        again = stands and now >= self._again_at
        if again:
            self._again_at = now + AGAIN_PERIOD
        for topic, (publisher, _) in self._outlets.items():
            before = self._listeners[topic]
            self._listeners[topic] = publisher.get_subscription_count()
            new = self._listeners[topic] > before
            if (stands and topic.rate is not Rate.ONCE and (
                    topic.rate is Rate.CLOCK or new)) or (topic is topics.PATH and new) or (
                    again and not topic.qos.reliable and self._shown_ns.get(topic) == time_ns):
                self._publish(topic)

    def emit(self, topic: Topic, values: Fields) -> None:
        """Publish plain fields on a topic."""
        publisher, message = self._outlets[topic]
        publisher.publish(cdr.serialize(topic.type, values) if topic.bulk
                          else messages.fill(message, values))

    def _publish(self, topic: Topic) -> None:
        """Publish a topic of the present snapshot, unless nobody would hear it."""
        if topic not in self._outlets or not topic.rate.shows_state:
            return
        node = self._node
        snapshot = node.flight.snapshot
        self._shown_ns[topic] = snapshot.time_ns
        if topic.rate in (Rate.CLOCK, Rate.ONCE) or self._heard(topic):
            self.emit(topic, topic.fields(snapshot, node.layout) if topic.fields
                      else self._views.fields(topic, node.flight))

    def _heard(self, topic: Topic) -> int:
        return self._outlets[topic][0].get_subscription_count()

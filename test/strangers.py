# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Participants whose DDS is not ROS's Fast DDS, behind one face: read a topic, publish on one.

Cyclone DDS is what other robots may well run; here it has the types as ROS mangles them and is
kept to the loopback. rosless has types of its own, and keeps to nothing: it announces itself on
every interface.
"""

import time
from dataclasses import dataclass, field

import pytest
from processes import LIMIT

LOOPBACK = """
<CycloneDDS><Domain>
  <General><Interfaces><NetworkInterface name="lo"/></Interfaces></General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers>
  </Discovery>
</Domain></CycloneDDS>
"""


class Rosless:
    """A participant by rosless, an RTPS in Rust."""

    def __init__(self, domain):
        rosless = pytest.importorskip(
            'rosless', reason='rosless is not asked for: it announces itself on every interface')
        self._node = rosless.Node(domain)

    def reader(self, topic, kind, latched=False):
        """Return a function that returns the next message of a topic, or None in vain."""
        subscription = self._node.subscribe(
            topic, kind, reliability='reliable' if latched else 'best_effort',
            durability='transient_local' if latched else 'volatile')
        return lambda: subscription.read(timeout=LIMIT)

    def writer(self, topic, kind):
        """Return a function that publishes a message of the fields that it is given."""
        publisher = self._node.advertise(topic, kind)
        return lambda **fields: publisher.send(fields)


class Cyclone:
    """A participant by Eclipse Cyclone DDS."""

    def __init__(self, domain):
        pytest.importorskip('cyclonedds', reason='cyclonedds, a second DDS, is not installed')
        from cyclonedds.core import Policy, Qos
        from cyclonedds.domain import Domain, DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic
        from cyclonedds.util import duration

        self._domain = Domain(domain, LOOPBACK)
        self._participant = DomainParticipant(domain)
        self._types = cyclone_types()
        self._make = DataReader, DataWriter, Topic
        keep, reliable = Policy.History.KeepLast(100), Policy.Reliability.Reliable
        self._any = Qos(Policy.Reliability.BestEffort, keep)
        self._latched = Qos(reliable(duration(seconds=1)), Policy.Durability.TransientLocal)
        self._reliable = Qos(reliable(duration(seconds=1)), keep)

    def _topic(self, topic, kind):
        return self._make[2](self._participant, f'rt/{topic}', self._types[kind])

    def reader(self, topic, kind, latched=False):
        """Return a function that returns the next message of a topic, or None in vain."""
        source = self._make[0](self._participant, self._topic(topic, kind),
                               qos=self._latched if latched else self._any)

        def read():
            end = time.monotonic() + LIMIT
            while time.monotonic() < end:
                if found := source.take(1):
                    return found[0]
                time.sleep(0.002)
            return None

        return read

    def writer(self, topic, kind):
        """Return a function that publishes a message of the fields that it is given."""
        target = self._make[1](self._participant, self._topic(topic, kind), qos=self._reliable)
        return lambda **fields: target.write(self._types[kind](**fields))


def cyclone_types():
    """Return the messages that the tests use, field by field as ROS 2 Jazzy defines them."""
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32

    @dataclass
    class Time(IdlStruct, typename='builtin_interfaces::msg::dds_::Time_'):
        sec: int32 = 0
        nanosec: uint32 = 0

    @dataclass
    class Header(IdlStruct, typename='std_msgs::msg::dds_::Header_'):
        stamp: Time = field(default_factory=Time)
        frame_id: str = ''

    @dataclass
    class Point(IdlStruct, typename='geometry_msgs::msg::dds_::Point_'):
        x: float64
        y: float64
        z: float64

    @dataclass
    class Quaternion(IdlStruct, typename='geometry_msgs::msg::dds_::Quaternion_'):
        x: float64
        y: float64
        z: float64
        w: float64

    @dataclass
    class Pose(IdlStruct, typename='geometry_msgs::msg::dds_::Pose_'):
        position: Point
        orientation: Quaternion

    @dataclass
    class PoseStamped(IdlStruct, typename='geometry_msgs::msg::dds_::PoseStamped_'):
        header: Header
        pose: Pose

    @dataclass
    class JointState(IdlStruct, typename='sensor_msgs::msg::dds_::JointState_'):
        header: Header = field(default_factory=Header)
        name: sequence[str] = field(default_factory=list)
        position: sequence[float64] = field(default_factory=list)
        velocity: sequence[float64] = field(default_factory=list)
        effort: sequence[float64] = field(default_factory=list)

    @dataclass
    class Dimension(IdlStruct, typename='std_msgs::msg::dds_::MultiArrayDimension_'):
        label: str
        size: uint32
        stride: uint32

    @dataclass
    class Layout(IdlStruct, typename='std_msgs::msg::dds_::MultiArrayLayout_'):
        dim: sequence[Dimension] = field(default_factory=list)
        data_offset: uint32 = 0

    @dataclass
    class Float64MultiArray(IdlStruct, typename='std_msgs::msg::dds_::Float64MultiArray_'):
        layout: Layout = field(default_factory=Layout)
        data: sequence[float64] = field(default_factory=list)

    @dataclass
    class PointField(IdlStruct, typename='sensor_msgs::msg::dds_::PointField_'):
        name: str
        offset: uint32
        datatype: uint8
        count: uint32

    @dataclass
    class PointCloud2(IdlStruct, typename='sensor_msgs::msg::dds_::PointCloud2_'):
        header: Header
        height: uint32
        width: uint32
        fields: sequence[PointField]
        is_bigendian: bool
        point_step: uint32
        row_step: uint32
        data: sequence[uint8]
        is_dense: bool

    return {f'{package}/msg/{kind.__name__}': kind for package, kind in (
        ('geometry_msgs', PoseStamped), ('sensor_msgs', JointState),
        ('sensor_msgs', PointCloud2), ('std_msgs', Float64MultiArray))}

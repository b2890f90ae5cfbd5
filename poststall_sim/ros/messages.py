# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Plain fields to rclpy messages, and messages to commands: no node, no state."""

import array
import importlib
import importlib.util
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from poststall_sim.frames import (
    FloatArray,
    quaternion_from_enu_flu,
    swap_body_flu,
    swap_ned_enu,
)
from poststall_sim.reader import listed, plain, shown
from poststall_sim.ros.commands import Refusal, RefusedCommand
from poststall_sim.state import BodyState
from poststall_sim.topics import Fields, Qos


def message_class(name: str) -> type:
    """Return the class of a message type, such as ``std_msgs/msg/Float64``."""
    package, *_, kind = name.split('/')
    return getattr(importlib.import_module(f'{package}.msg'), kind)


def available(name: str) -> bool:
    """Tell whether a message type is installed; tf2_msgs, say, does not come with pip."""
    return importlib.util.find_spec(name.partition('/')[0]) is not None


def qos_profile(qos: Qos) -> QoSProfile:
    """Return the rclpy form of a topic's quality of service."""
    return QoSProfile(
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if qos.latched
                    else DurabilityPolicy.VOLATILE))


SERVICES = qos_profile(Qos(depth=1000))
"""
Of every service: so many calls may wait for one long step, as with parameters.

The history of a service is one for all its callers, so at the middleware's 10 the eleventh call
that waits, whoever made it, pushes out the first, which is then never answered.
"""


def fill(message: Any, fields: Fields) -> Any:
    """
    Write plain fields into a message and return it; what the fields do not name stays.

    An array goes into the message's own buffer when that has its length already: rclpy copies on
    publish, so that one message can be kept and refilled.
    """
    for key, value in fields.items():
        if isinstance(value, dict):
            fill(getattr(message, key), value)
        elif isinstance(value, np.ndarray):
            kept = getattr(message, key)
            if isinstance(kept, np.ndarray):   # of a length that the definition fixes
                kept[:] = value
            elif len(kept) == value.size:
                np.frombuffer(kept, value.dtype)[:] = value
            else:
                setattr(message, key, array.array(value.dtype.char, value.tobytes()))
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            element = _element_class(message, key)
            setattr(message, key, [fill(element(), item) for item in value])
        elif isinstance(getattr(message, key), bytes):
            setattr(message, key, bytes([value]))
        else:
            setattr(message, key, value)
    return message


def message(type_name: str, fields: Fields) -> Any:
    """Return a new message of a type, filled with plain fields."""
    return fill(message_class(type_name)(), fields)


def _element_class(message: Any, key: str) -> type:
    """Return the class of the elements of a message's sequence of messages."""
    declared = message.get_fields_and_field_types()[key]
    return message_class(declared.removeprefix('sequence<').partition('>')[0].partition(',')[0])


@dataclass(frozen=True, slots=True)
class Commands:
    """Commanded values by name [rad; throttle 0..1], and the names that nobody knows."""

    values: dict[str, float]
    unknown: tuple[str, ...] = ()


def commands_from_joint_state(message: Any, known_names: Sequence[str]) -> Commands:
    """
    Return the commands of a sensor_msgs/JointState: position by name, the rest is ignored.

    Raises
    ------
    RefusedCommand
        When name and position differ in length or hold nothing, a name comes twice, or a
        position is not a finite number; nothing of the message is to be used then.

    """
    names, positions = message.name, message.position
    if len(names) != len(positions):
        raise RefusedCommand(
            Refusal.LENGTH, f'name has {len(names)} entries and position {len(positions)}: they '
            'must have one length')
    if not names:
        raise RefusedCommand(Refusal.LENGTH, 'name and position are empty: nothing is commanded')
    if len(set(names)) < len(names):
        twice = sorted(name for name, count in Counter(names).items() if count > 1)
        raise RefusedCommand(Refusal.DUPLICATE, f'{listed(twice)} named more than once')
    for name, position in zip(names, positions):
        _require_finite(name, position)
    known = set(known_names)
    return Commands(
        {name: float(position) for name, position in zip(names, positions) if name in known},
        tuple(name for name in names if name not in known))


def commands_from_array(message: Any, names: Sequence[str]) -> Commands:
    """
    Return the commands of a std_msgs/Float64MultiArray: one value for each name, in order.

    Raises
    ------
    RefusedCommand
        When the number of values is not that of the names or a value is not a finite number.

    """
    if len(message.data) != len(names):
        raise RefusedCommand(
            Refusal.LENGTH, f'got {len(message.data)} values, expected {len(names)} in the order '
            f'of the parameter surfaces: {", ".join(names)}')
    for name, value in zip(names, message.data):
        _require_finite(name, value)
    return Commands({name: float(value) for name, value in zip(names, message.data)})


def _require_finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise RefusedCommand(Refusal.NOT_FINITE, f'{plain(name)} is {value}, not a finite number')


GREATEST = {'position': 1e6, 'altitude': 20000.0, 'speed': 400.0, 'rate': 100.0, 'wind': 100.0}
"""What is taken for a mistake when it is more [m, m, m/s, rad/s, m/s]."""


class RefusedState(ValueError):
    """A state or a wind that the simulator does not go to."""


def nanoseconds(stamp: Any) -> int:
    """Return a builtin_interfaces/Time in ns."""
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def clock_time(message: Any) -> int | None:
    """Return the time [ns] of a /clock, None for one before 0 or beyond what a stamp can hold."""
    time_ns = nanoseconds(message.clock)
    return time_ns if 0 <= time_ns < 2**31 * 1_000_000_000 else None


def vector(message: Any, what: str, greatest: float) -> FloatArray:
    """
    Return a geometry_msgs/Vector3 or Point as (3,).

    Raises
    ------
    RefusedState
        When a component is not a finite number or beyond the greatest.

    """
    found = np.array([message.x, message.y, message.z])
    if not np.isfinite(found).all():
        raise RefusedState(f'{what} {found.tolist()}: not finite')
    if np.abs(found).max() > greatest:
        raise RefusedState(f'{what} {found.tolist()}: a component is beyond {greatest:g}')
    return found


def require_frame(found: str, expected: str, what: str) -> None:
    """Raise `RefusedState` for another frame than the expected one; empty is that one."""
    if found not in ('', expected):
        raise RefusedState(f'{what} is {shown(found)}, it must be {expected!r} or empty')


def place_from_pose(pose: Any) -> tuple[FloatArray, FloatArray]:
    """
    Return position_N (3,) [m] and q_NB (4,) of a geometry_msgs/Pose of FLU in ENU.

    Raises
    ------
    RefusedState
        When it is not finite, below the ground or beyond the air, or no attitude.

    """
    position_N = swap_ned_enu(vector(pose.position, 'position', GREATEST['position']))
    if not 0.0 <= -position_N[2] <= GREATEST['altitude']:
        raise RefusedState(f'altitude {-position_N[2]:g} m: it must be from 0, the ground, to '
                           f'{GREATEST["altitude"]:g}')
    q = pose.orientation
    xyzw = np.array([q.x, q.y, q.z, q.w])
    size = float(np.linalg.norm(xyzw))
    if not abs(size - 1.0) <= 0.01:
        raise RefusedState(f'orientation {xyzw.tolist()}: its length is {size:g}, it must be 1')
    return position_N, quaternion_from_enu_flu(xyzw / size)


def body_from_odometry(message: Any, *, map_frame: str, base_frame: str) -> BodyState:
    """
    Return the body of a nav_msgs/Odometry: pose in map, twist in base_link, over the ground.

    Raises
    ------
    RefusedState
        When the aircraft cannot be there or so, or a frame is another.

    """
    require_frame(message.header.frame_id, map_frame, 'frame_id')
    require_frame(message.child_frame_id, base_frame, 'child_frame_id')
    position_N, q_NB = place_from_pose(message.pose.pose)
    twist = message.twist.twist
    return BodyState(
        position_N, swap_body_flu(vector(twist.linear, 'velocity', GREATEST['speed'])),
        swap_body_flu(vector(twist.angular, 'angular velocity', GREATEST['rate'])), q_NB)


def wind_from_vector(message: Any, *, map_frame: str) -> FloatArray:
    """
    Return wind_N (3,) [m/s] of a geometry_msgs/Vector3Stamped in map.

    Raises
    ------
    RefusedState
        When it is no wind, or in another frame.

    """
    require_frame(message.header.frame_id, map_frame, 'frame_id')
    return swap_ned_enu(vector(message.vector, 'wind', GREATEST['wind']))

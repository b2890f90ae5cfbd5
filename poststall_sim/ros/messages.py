# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Plain fields to rclpy messages, and messages to commands: no node, no state."""

import array
import enum
import importlib
import importlib.util
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

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


class Refusal(enum.Enum):
    """Why a command was not obeyed, as diagnostics count it."""

    NOT_FINITE = 'refused_not_finite'
    LENGTH = 'refused_wrong_length'
    DUPLICATE = 'refused_duplicate_name'


class RefusedCommand(ValueError):
    """A command message that is refused as a whole."""

    def __init__(self, refusal: Refusal, text: str) -> None:
        super().__init__(text)
        self.refusal = refusal


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
        twice = sorted(name for name in set(names) if list(names).count(name) > 1)
        raise RefusedCommand(Refusal.DUPLICATE, f'{", ".join(twice)} named more than once')
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
        raise RefusedCommand(Refusal.NOT_FINITE, f'{name} is {value}, not a finite number')

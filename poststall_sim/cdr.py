# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Plain fields as CDR bytes, for messages of thousands of points.

A wake of two thousand points costs several milliseconds as message objects, longer than a step
of the flight, and a tenth of one as bytes: a sequence of points or colours is an array (n, k)
here, which goes out as it stands. Little endian, XCDR version 1 (OMG DDS-XTypes 1.3, 7.4.1),
which is what ROS 2 publishes.
"""

import struct
from typing import Any

import numpy as np

from poststall_sim.fields import Fields

_HEAD = b'\x00\x01\x00\x00'
_NUMBERS = {'bool': '?', 'uint8': 'B', 'int32': 'i', 'uint32': 'I', 'float32': 'f',
            'float64': 'd'}

_TIME = (('sec', 'int32'), ('nanosec', 'uint32'))
_XYZ = tuple((axis, 'float64') for axis in 'xyz')

DEFINITIONS = {
    'builtin_interfaces/msg/Time': _TIME,
    'builtin_interfaces/msg/Duration': _TIME,
    'std_msgs/msg/Header': (('stamp', 'builtin_interfaces/msg/Time'), ('frame_id', 'string')),
    'std_msgs/msg/ColorRGBA': tuple((channel, 'float32') for channel in 'rgba'),
    'geometry_msgs/msg/Point': _XYZ,
    'geometry_msgs/msg/Vector3': _XYZ,
    'geometry_msgs/msg/Quaternion': (*_XYZ, ('w', 'float64')),
    'geometry_msgs/msg/Pose': (('position', 'geometry_msgs/msg/Point'),
                               ('orientation', 'geometry_msgs/msg/Quaternion')),
    'geometry_msgs/msg/PoseStamped': (('header', 'std_msgs/msg/Header'),
                                      ('pose', 'geometry_msgs/msg/Pose')),
    'nav_msgs/msg/Path': (('header', 'std_msgs/msg/Header'),
                          ('poses', 'geometry_msgs/msg/PoseStamped[]')),
    'sensor_msgs/msg/CompressedImage': (('header', 'std_msgs/msg/Header'), ('format', 'string'),
                                        ('data', 'uint8[]')),
    'visualization_msgs/msg/UVCoordinate': (('u', 'float32'), ('v', 'float32')),
    'visualization_msgs/msg/MeshFile': (('filename', 'string'), ('data', 'uint8[]')),
    'visualization_msgs/msg/Marker': (
        ('header', 'std_msgs/msg/Header'), ('ns', 'string'), ('id', 'int32'), ('type', 'int32'),
        ('action', 'int32'), ('pose', 'geometry_msgs/msg/Pose'),
        ('scale', 'geometry_msgs/msg/Vector3'), ('color', 'std_msgs/msg/ColorRGBA'),
        ('lifetime', 'builtin_interfaces/msg/Duration'), ('frame_locked', 'bool'),
        ('points', 'geometry_msgs/msg/Point[]'), ('colors', 'std_msgs/msg/ColorRGBA[]'),
        ('texture_resource', 'string'), ('texture', 'sensor_msgs/msg/CompressedImage'),
        ('uv_coordinates', 'visualization_msgs/msg/UVCoordinate[]'), ('text', 'string'),
        ('mesh_resource', 'string'), ('mesh_file', 'visualization_msgs/msg/MeshFile'),
        ('mesh_use_embedded_materials', 'bool')),
    'visualization_msgs/msg/MarkerArray': (('markers', 'visualization_msgs/msg/Marker[]'),),
}
"""What is in the messages that can be written, as in their .msg files, in order."""


def serialize(type_name: str, fields: Fields) -> bytes:
    """Return the bytes of a message of one of `DEFINITIONS`; what is not named is zero."""
    out = bytearray(_HEAD)
    _write(out, type_name, fields)
    return bytes(out)


def _write(out: bytearray, kind: str, value: Any) -> None:
    if kind.endswith('[]'):
        _write_sequence(out, kind[:-2], value)
    elif kind in DEFINITIONS:
        for name, inner in DEFINITIONS[kind]:
            _write(out, inner, (value or {}).get(name))
    elif kind == 'string':
        text = (value or '').encode() + b'\x00'
        _write(out, 'uint32', len(text))
        out += text
    else:
        code = _NUMBERS[kind]
        _align(out, struct.calcsize(code))
        out += struct.pack('<' + code, value or 0)


def _write_sequence(out: bytearray, kind: str, value: Any) -> None:
    count = 0 if value is None else len(value)
    _write(out, 'uint32', count)
    if not count:
        return
    if isinstance(value, np.ndarray):   # elements of numbers of one type, without gaps
        code = _NUMBERS[DEFINITIONS[kind][0][1]]
        _align(out, struct.calcsize(code))
        out += np.ascontiguousarray(value, '<' + np.dtype(code).str[1:]).tobytes()
    else:
        for item in value:
            _write(out, kind, item)


def _align(out: bytearray, size: int) -> None:
    """Fill up to a multiple of a number's size, counted from behind the head."""
    out += bytes(-(len(out) - len(_HEAD)) % size)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
r"""
Axes, signs and rotations: the one file where they are written.

Axes (a suffix on every vector's name):

* ``N`` north-east-down, fixed to a flat, non-rotating earth.
* ``B`` body, origin at the centre of gravity, x forward, y right, z down.
* ``G`` geometry, origin of the drawing, x aft, y right, z up.
* ``ENU`` and ``FLU`` are N and B as ROS wants them (REP-103).

::

          G: z up                    x forward  y right
             |  y right                       \  /
             | /                    B at CG    \/
             |/____ x aft                       |
                                                | z down

Signs:

* alpha = atan2(w, u), beta = asin(v / V), of the velocity of the body through the air in B;
  beta > 0 is wind from the right. Rates p, q, r are about B: right wing down, nose up,
  nose right.
* A control's deflection is positive trailing edge DOWN; on a vertical surface positive
  trailing edge LEFT. An ``aileron`` is positive right side up: it rolls to the right.
* Circulation is positive where it lifts towards the strip's normal (up on a wing; to port on a
  fin that is drawn from its root up). Decambering is positive nose-up: stall makes it negative.
* Quaternions ``q_NB = [w, x, y, z]`` turn B components into N components.
"""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2], 3rd CGPM (1901)."""

_FLIP_XZ = np.array([-1.0, 1.0, -1.0])
_FLIP_YZ = np.array([1.0, -1.0, -1.0])


def geometry_to_body(vector_G: FloatArray) -> FloatArray:
    """
    Turn components (..., 3) in geometry axes into body axes.

    The rotation is its own inverse (half a turn about y), so that it serves both ways; polar
    and axial vectors (rates, moments) turn alike.
    """
    return vector_G * _FLIP_XZ


body_to_geometry = geometry_to_body


def swap_body_flu(vector: FloatArray) -> FloatArray:
    """Turn (..., 3) components from B (forward-right-down) into FLU, or back."""
    return vector * _FLIP_YZ


def swap_ned_enu(vector: FloatArray) -> FloatArray:
    """Turn (..., 3) components from N (north-east-down) into ENU, or back."""
    return np.stack([vector[..., 1], vector[..., 0], -vector[..., 2]], axis=-1)


def quaternion_enu_flu(q_NB: FloatArray) -> FloatArray:
    """
    Return the attitude of FLU in ENU as ROS writes it, [x, y, z, w], for ``q_NB`` [w, x, y, z].

    FLU is B turned by half a turn about x, ENU is N turned by half a turn about (1, 1, 0)/sqrt 2:
    q_ENU_FLU = q_ENU_N q_NB q_B_FLU.
    """
    half = np.sqrt(0.5)
    q = multiply(multiply(np.array([0.0, half, half, 0.0]), q_NB), np.array([0.0, 1.0, 0.0, 0.0]))
    return np.array([q[1], q[2], q[3], q[0]])


def quaternion_from_enu_flu(xyzw: FloatArray) -> FloatArray:
    """Return ``q_NB`` [w, x, y, z] for an attitude of FLU in ENU given as ROS writes it."""
    half = np.sqrt(0.5)
    q = np.array([xyzw[3], xyzw[0], xyzw[1], xyzw[2]])
    turned = multiply(
        multiply(np.array([0.0, -half, -half, 0.0]), q), np.array([0.0, -1.0, 0.0, 0.0]))
    return turned


def multiply(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the quaternion product a b, both [w, x, y, z]."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return np.array([
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw])


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return a x b of two vectors (3,); for one pair numpy's own takes ten times as long."""
    ax, ay, az = map(float, a)
    bx, by, bz = map(float, b)
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def norm(vector: FloatArray) -> float:
    """Return the length of one vector (3,); as of `cross`, numpy's own takes ten times as long."""
    return math.sqrt(vector.dot(vector))


def rotation(q: FloatArray) -> FloatArray:
    """
    Return the matrix of a unit quaternion: ``rotation(q_NB) @ v_B`` gives N components.

    Kuipers, Quaternions and Rotation Sequences, 1999, sec. 7.7.
    """
    w, x, y, z = q.tolist() if q.ndim == 1 else q     # one by one Python's floats are faster
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)]])


def quaternion_about(axis: FloatArray, angle: float) -> FloatArray:
    """Return the quaternion [w, x, y, z] of a turn by an angle [rad] about a unit axis (3,)."""
    return np.concatenate([[np.cos(0.5 * angle)], np.sin(0.5 * angle) * axis])


def quaternion_from_euler(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return ``q_NB`` [w, x, y, z] for the sequence yaw, pitch, roll [rad]."""
    cr, sr = np.cos(0.5 * roll), np.sin(0.5 * roll)
    cp, sp = np.cos(0.5 * pitch), np.sin(0.5 * pitch)
    cy, sy = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
    return np.array([
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy])


def euler_from_quaternion(q_NB: FloatArray) -> FloatArray:
    """
    Return roll, pitch, yaw [rad] of ``q_NB``, for display only.

    At pitch = +-90 deg roll and yaw are one angle; it is given as yaw and roll is 0.
    """
    r_NB = rotation(q_NB)
    pitch = np.arcsin(np.clip(-r_NB[2, 0], -1.0, 1.0))
    if abs(r_NB[2, 0]) > 1.0 - 1e-12:
        return np.array([0.0, pitch, np.arctan2(-r_NB[0, 1], r_NB[1, 1])])
    return np.array([
        np.arctan2(r_NB[2, 1], r_NB[2, 2]), pitch, np.arctan2(r_NB[1, 0], r_NB[0, 0])])


def euler_rates(roll: float, pitch: float) -> FloatArray:
    """Return the matrix that turns body rates (3,) into d(roll, pitch, yaw)/dt [rad/s]."""
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    return np.array([[1.0, sr * sp / cp, cr * sp / cp], [0.0, cr, -sr],
                     [0.0, sr / cp, cr / cp]])


def quaternion_rate(q_NB: FloatArray, rates_B: FloatArray) -> FloatArray:
    """Return dq_NB/dt = q_NB (0, rates_B) / 2 for body rates [rad/s]."""
    return 0.5 * multiply(q_NB, np.array([0.0, rates_B[0], rates_B[1], rates_B[2]]))


def flow_angles(airspeed_B: FloatArray) -> tuple[float, float, float]:
    """
    Return airspeed [m/s], alpha and beta [rad] of the velocity through the air, (3,) in B.

    At rest both angles are 0.
    """
    u, v, w = map(float, airspeed_B)
    speed = math.sqrt(u * u + v * v + w * w)
    if speed == 0.0:
        return 0.0, 0.0, 0.0
    return speed, math.atan2(w, u), math.asin(min(max(v / speed, -1.0), 1.0))


def velocity_from_flow_angles(speed: float, alpha: float, beta: float) -> FloatArray:
    """Return the velocity through the air, (3,) in B [m/s], of airspeed, alpha and beta [rad]."""
    return speed * np.array([
        np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)])


def body_to_stability(vector_B: FloatArray, alpha: float) -> FloatArray:
    """
    Turn (..., 3) components in B into stability axes: B turned about y by -alpha.

    x points along the projection of the velocity on the plane of symmetry, so that lift is
    -z and drag (at beta = 0) is -x.
    """
    ca, sa = np.cos(alpha), np.sin(alpha)
    x, y, z = vector_B[..., 0], vector_B[..., 1], vector_B[..., 2]
    out = np.empty_like(vector_B)
    out[..., 0], out[..., 1], out[..., 2] = ca * x + sa * z, y, ca * z - sa * x
    return out


def control_sign(normal_G: FloatArray) -> float:
    """
    Return +1 or -1: how a positive deflection turns the normals of a strip with this normal.

    A turn is positive nose-up (trailing edge away from the normal). Positive deflection is
    trailing edge down, so a strip whose normal points up counts +1; on a vertical surface it is
    trailing edge left, so a normal to port counts -1. At 45 deg the surface counts as level.
    """
    if abs(normal_G[2]) >= abs(normal_G[1]) * (1.0 - 1e-9):
        return 1.0 if normal_G[2] > 0.0 else -1.0
    return 1.0 if normal_G[1] > 0.0 else -1.0

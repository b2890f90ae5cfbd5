# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Axes, signs and rotations against round trips and attitudes that can be drawn by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from poststall_sim import frames

# A handful of products of numbers of order one.
ROUND_OFF = 1e-14

ANGLES = st.floats(-math.pi, math.pi)
PITCHES = st.floats(-math.radians(89.9), math.radians(89.9))
COMPONENTS = st.floats(-100.0, 100.0)
VECTORS = st.tuples(COMPONENTS, COMPONENTS, COMPONENTS).map(np.array)
ATTITUDES = st.builds(
    frames.quaternion_from_euler, ANGLES, st.floats(-math.pi / 2, math.pi / 2), ANGLES)

NORTH, EAST, DOWN = np.eye(3)
FORWARD, RIGHT, BELOW = np.eye(3)


def same_angle(a, b, tolerance):
    return abs(math.remainder(a - b, 2.0 * math.pi)) <= tolerance


def elementary(axis, angle):
    """Return the matrix of a turn about axis 0, 1 or 2, written out."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[j, i], matrix[i, j] = s, -s
    return matrix


@given(ATTITUDES)
def test_rotation_is_orthogonal_and_right_handed(q_NB):
    r_NB = frames.rotation(q_NB)
    assert np.abs(r_NB @ r_NB.T - np.eye(3)).max() < ROUND_OFF
    assert np.linalg.det(r_NB) == pytest.approx(1.0, abs=ROUND_OFF)


@given(ANGLES, PITCHES, ANGLES)
def test_euler_angles_are_yaw_then_pitch_then_roll(roll, pitch, yaw):
    r_NB = frames.rotation(frames.quaternion_from_euler(roll, pitch, yaw))
    by_hand = elementary(2, yaw) @ elementary(1, pitch) @ elementary(0, roll)
    assert np.abs(r_NB - by_hand).max() < ROUND_OFF


@given(ANGLES, PITCHES, ANGLES)
def test_euler_angles_make_the_round_trip(roll, pitch, yaw):
    back = frames.euler_from_quaternion(frames.quaternion_from_euler(roll, pitch, yaw))
    # At 89.9 deg the angles stand on cos(pitch) = 1/573: round-off times that.
    for there, again in zip((roll, pitch, yaw), back):
        assert same_angle(there, again, 1e-11)


@given(ANGLES, ANGLES, st.sampled_from([-1.0, 1.0]))
def test_straight_up_and_down_roll_and_yaw_are_one_angle(roll, yaw, up):
    q_NB = frames.quaternion_from_euler(roll, up * math.pi / 2, yaw)
    angles = frames.euler_from_quaternion(q_NB)
    assert angles[0] == 0.0
    # arcsin and the gimbal's threshold of 1e-12 in the sine both are worth sqrt(2e-12).
    assert angles[1] == pytest.approx(up * math.pi / 2, abs=2e-6)
    assert same_angle(angles[2], yaw - up * roll, 1e-11)
    again = frames.quaternion_from_euler(*angles)
    assert np.abs(frames.rotation(again) - frames.rotation(q_NB)).max() < 3e-6


@pytest.mark.parametrize('euler_deg, body_axis, points_to', [
    ((0, 0, 0), FORWARD, NORTH),
    ((0, 0, 90), FORWARD, EAST),      # heading east
    ((0, 0, 90), RIGHT, -NORTH),
    ((0, 90, 0), FORWARD, -DOWN),     # nose up
    ((0, 90, 0), BELOW, NORTH),
    ((90, 0, 0), RIGHT, DOWN),        # right wing down
    ((90, 0, 0), BELOW, -EAST),
    ((180, 0, 0), BELOW, -DOWN),      # on its back
    ((90, 0, 90), RIGHT, DOWN),
    ((90, 90, 0), RIGHT, DOWN * 0 + NORTH * 1),
])
def test_known_attitudes(euler_deg, body_axis, points_to):
    r_NB = frames.rotation(frames.quaternion_from_euler(*np.radians(euler_deg)))
    assert np.abs(r_NB @ body_axis - points_to).max() < ROUND_OFF


@given(ATTITUDES, ATTITUDES)
def test_product_of_quaternions_is_the_product_of_rotations(a, b):
    product = frames.rotation(frames.multiply(a, b))
    assert np.abs(product - frames.rotation(a) @ frames.rotation(b)).max() < ROUND_OFF


@given(ATTITUDES, VECTORS.filter(lambda v: np.linalg.norm(v) > 1e-3))
def test_rate_of_the_quaternion_is_that_of_a_steady_turn(q_NB, rates_B):
    """With constant body rates w, q(t) = q(0) (cos(w t/2), sin(w t/2) n)."""
    speed = np.linalg.norm(rates_B)

    def turned(angle):
        turn = np.append(math.cos(0.5 * angle), math.sin(0.5 * angle) * rates_B / speed)
        return frames.multiply(q_NB, turn)

    h = 1e-5   # of angle: truncation h^2/24 = 4e-12, cancellation 1e-16/h = 1e-11
    difference = (turned(h) - turned(-h)) / (2.0 * h) * speed
    assert np.abs(frames.quaternion_rate(q_NB, rates_B) - difference).max() < 1e-10 * speed


@given(VECTORS)
def test_geometry_axes_are_body_axes_turned_about_the_wing(vector):
    assert np.array_equal(frames.geometry_to_body(frames.body_to_geometry(vector)), vector)
    assert np.array_equal(frames.geometry_to_body(vector), elementary_half_turn(1) @ vector)


def elementary_half_turn(axis):
    return np.diag(np.where(np.arange(3) == axis, 1.0, -1.0))


def test_vectors_turn_along_their_last_axis():
    vectors = np.arange(12.0).reshape(2, 2, 3)
    for turn in (frames.geometry_to_body, frames.swap_body_flu, frames.swap_ned_enu,
                 lambda v: frames.body_to_stability(v, 0.3)):
        one_by_one = np.array([[turn(v) for v in row] for row in vectors])
        assert np.array_equal(turn(vectors), one_by_one)


@given(VECTORS)
def test_ros_axes_are_their_own_way_back(vector):
    assert np.array_equal(frames.swap_ned_enu(frames.swap_ned_enu(vector)), vector)
    assert np.array_equal(frames.swap_body_flu(frames.swap_body_flu(vector)), vector)


def test_ros_axes_of_the_compass():
    assert frames.swap_ned_enu(np.array([1.0, 2.0, 3.0])).tolist() == [2.0, 1.0, -3.0]
    assert frames.swap_body_flu(np.array([1.0, 2.0, 3.0])).tolist() == [1.0, -2.0, -3.0]


@given(ATTITUDES, VECTORS)
def test_ros_attitude_turns_flu_into_enu_as_ours_turns_body_into_ned(q_NB, vector_B):
    x, y, z, w = frames.quaternion_enu_flu(q_NB)
    by_ros = frames.rotation(np.array([w, x, y, z])) @ frames.swap_body_flu(vector_B)
    ours = frames.swap_ned_enu(frames.rotation(q_NB) @ vector_B)
    assert np.abs(by_ros - ours).max() < 1e-12   # components up to 100


@given(ATTITUDES)
def test_ros_attitude_makes_the_round_trip(q_NB):
    back = frames.quaternion_from_enu_flu(frames.quaternion_enu_flu(q_NB))
    assert np.abs(back - q_NB).max() < ROUND_OFF


@pytest.mark.parametrize('yaw_deg, xyzw', [
    (90, (0, 0, 0, 1)),                                 # heading east is REP-103's zero
    (0, (0, 0, math.sqrt(0.5), math.sqrt(0.5))),        # north: 90 deg to the left of east
    (180, (0, 0, -math.sqrt(0.5), math.sqrt(0.5))),
])
def test_ros_headings(yaw_deg, xyzw):
    q = frames.quaternion_enu_flu(frames.quaternion_from_euler(0, 0, math.radians(yaw_deg)))
    assert abs(abs(q @ np.array(xyzw)) - 1.0) < ROUND_OFF


@pytest.mark.parametrize('velocity_B, alpha_deg, beta_deg', [
    ((2, 0, 0), 0, 0),
    ((1, 0, 1), 45, 0),        # falling through the air: from below
    ((0, 0, 3), 90, 0),
    ((-1, 0, 0), 180, 0),      # tail first
    ((-1, 0, -1), -135, 0),
    ((1, 1, 0), 0, 45),        # towards the right: wind from the right
    ((0, -2, 0), 0, -90),
])
def test_flow_angles_by_hand(velocity_B, alpha_deg, beta_deg):
    speed, alpha, beta = frames.flow_angles(np.array(velocity_B, dtype=float))
    assert speed == pytest.approx(math.hypot(*velocity_B), rel=1e-15)
    assert math.degrees(alpha) == pytest.approx(alpha_deg, abs=1e-12)
    assert math.degrees(beta) == pytest.approx(beta_deg, abs=1e-12)


def test_at_rest_the_flow_angles_are_zero():
    assert frames.flow_angles(np.zeros(3)) == (0.0, 0.0, 0.0)


@given(st.floats(1e-3, 300.0), ANGLES, PITCHES)
def test_flow_angles_make_the_round_trip(speed, alpha, beta):
    again = frames.flow_angles(frames.velocity_from_flow_angles(speed, alpha, beta))
    assert again[0] == pytest.approx(speed, rel=1e-14)
    assert same_angle(again[1], alpha, 1e-14)
    assert again[2] == pytest.approx(beta, abs=1e-12)   # arcsin at 89.9 deg


@given(st.floats(0.1, 300.0), ANGLES, PITCHES)
def test_stability_axes_see_no_vertical_velocity(speed, alpha, beta):
    velocity = frames.velocity_from_flow_angles(speed, alpha, beta)
    seen = frames.body_to_stability(velocity, alpha)
    expected = speed * np.array([math.cos(beta), math.sin(beta), 0.0])
    assert np.abs(seen - expected).max() < 1e-14 * speed


def test_lift_is_up_in_stability_axes():
    """Nose up at 30 deg in level flight, an upward force is lift and no drag."""
    alpha = math.radians(30.0)
    up_B = frames.rotation(frames.quaternion_from_euler(0.0, alpha, 0.0)).T @ -DOWN
    assert np.abs(frames.body_to_stability(up_B, alpha) - [0.0, 0.0, -1.0]).max() < ROUND_OFF


@given(st.floats(-math.pi, math.pi))
def test_positive_deflection_is_trailing_edge_down_or_left(tilt):
    """A nose-up turn takes the trailing edge away from the normal."""
    normal_G = np.array([0.0, math.sin(tilt), math.cos(tilt)])
    trailing_edge_G = -frames.control_sign(normal_G) * normal_G
    if abs(normal_G[2]) > abs(normal_G[1]):
        assert trailing_edge_G[2] < 0.0
    elif abs(normal_G[2]) < abs(normal_G[1]) * (1.0 - 1e-8):
        assert trailing_edge_G[1] < 0.0


@pytest.mark.parametrize('normal_G, sign', [
    ((0, 0, 1), 1), ((0, 0, -1), -1),
    ((0, -1, 0), -1), ((0, 1, 0), 1),          # fins with normals to port and to starboard
    ((0, -1, 1), 1), ((0, 1, 1), 1),           # both halves of a V-tail count as level
    ((0, 1, -1), -1),
])
def test_control_sign_by_hand(normal_G, sign):
    normal = np.array(normal_G) / math.hypot(*normal_G)
    assert frames.control_sign(normal) == sign

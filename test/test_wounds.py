# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What users of other flight simulators complain of in their issue trackers, and what holds it here.

Eleven wounds, each with one of the threads that tell of it and with the tests that would fail if
it opened here, one of them at least in every `make test`. Whoever renames one of those tests
renames it here too.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

WOUNDS = {
    'the wind blows the wrong way, or airspeed does not feel it (PX4-Autopilot 27376)': (
        'test_wind_shows_as_sideslip_at_once_and_as_drift_when_trimmed_in_it',
        'test_wind_is_where_it_blows_to',
        'test_a_wind_is_where_it_blows_to_in_map_or_no_frame'),
    'a control acts with the other sign, or as another (PX4-Autopilot 24034)': (
        'test_each_control_makes_the_moment_that_its_sign_says',
        'test_a_joint_state_commands_by_name',
        'test_positive_deflection_is_trailing_edge_down_or_left'),
    'north-east-down and east-north-up are taken for each other (mavros 216)': (
        'test_position_is_east_north_up',
        'test_attitude_is_that_of_flu_in_enu',
        'test_body_vectors_are_forward_left_up',
        'test_ros_attitude_turns_flu_into_enu_as_ours_turns_body_into_ned',
        'test_the_axes_of_aviation_say_the_same_through_the_static_transforms'),
    'it cannot be paused, stepped, hurried or reset, or a reset leaves something (ros_gz 919)': (
        'test_paused_stepped_flown_and_stopped',
        'test_after_a_reset_all_is_as_at_the_start_and_30_commands_at_once_are_heard_in_order',
        'test_a_reset_takes_back_what_its_scope_names_and_nothing_else',
        'test_it_is_heard_by_a_flight_that_goes_as_fast_as_it_can'),
    'forces cannot be seen, or are drawn elsewhere (PX4-SITL_gazebo-classic 1072)': (
        'test_lift_points_up_at_quarter_chords_and_adds_up_to_the_weight',
        'test_views_are_there_for_who_looks_and_stand_where_the_aircraft_is',
        'test_another_value_makes_another_flight'),
    'at no airspeed the last force stays (PX4-SITL_gazebo-classic 901)': (
        'test_an_accelerometer_feels_the_lift_there_is_and_at_no_airspeed_none',),
    'publishing all at full rate costs real time (PX4-SITL_gazebo-classic 561)': (
        'test_every_topic_has_its_type_quality_frame_and_rate',
        'test_nothing_is_made_that_nobody_listens_to',
        'test_at_full_rates_a_step_is_flown_once_and_makes_one_message_of_each_topic',
        'test_everything_at_every_step_is_flown_in_real_time'),
    'airspeed, alpha and beta are on no topic (PX4-Autopilot 24302)': (
        'test_all_topics_of_an_instant_say_the_same_and_rates_are_slopes',
        'test_flow_angles_by_hand'),
    'nobody says how it is flown (rotors_simulator 310)': (
        'test_every_command_topic_stands_in_the_readme',
        'test_the_axes_and_buttons_of_a_stick_stand_in_the_readme'),
    'a bag begins at time 0, for there was no /clock yet (rosbag2 1276)': (
        'test_paused_stepped_flown_and_stopped',
        'test_a_bag_by_another_recorder_is_put_on_simulated_time',
        'test_pilot_and_recorder_make_a_bag_of_a_scenario'),
    'filling an array element by element is slow (rclpy 763)': (
        'test_an_array_is_refilled_in_place',
        'test_what_goes_over_the_wire_is_what_the_fields_say'),
}


def found(folder, *without):
    """
    Return the names of the tests of a folder that have none of some marks.

    Of a test whose parameters alone are marked, some run.
    """
    marks, names = tuple(f'pytest.mark.{mark}' for mark in without), set()
    for path in ROOT.glob(f'{folder}/test_*.py'):
        body = ast.parse(path.read_text(encoding='utf-8')).body
        of_all = [mark for node in body if isinstance(node, ast.Assign)
                  and ast.unparse(node.targets[0]) == 'pytestmark'
                  for mark in getattr(node.value, 'elts', [node.value])]
        names.update(node.name for node in body if isinstance(node, ast.FunctionDef) and not any(
            ast.unparse(mark).startswith(marks) for mark in [*of_all, *node.decorator_list]))
    return names


@pytest.fixture(scope='module')
def tests():
    """Return the names of all tests and benchmarks that run somewhere."""
    return found('test', 'skip') | found('benchmark', 'skip')


@pytest.fixture(scope='module')
def quick():
    """Return the names of the tests that run in every `make test`."""
    return found('test', 'skip', 'soak')


@pytest.mark.parametrize('wound', WOUNDS)
def test_each_wound_is_held_by_tests_that_there_are(wound, tests, quick):
    assert WOUNDS[wound] and tests.issuperset(WOUNDS[wound]), set(WOUNDS[wound]) - tests
    assert quick.intersection(WOUNDS[wound])


def test_what_runs_in_soak_or_in_the_benchmarks_alone_is_not_quick(tests, quick):
    assert quick < tests
    slow = {'test_ten_minutes_end_as_fast_and_as_small_as_they_began',
            'test_everything_at_every_step_is_flown_in_real_time'}
    assert slow <= tests and not slow & quick


def test_there_are_eleven():
    assert len(WOUNDS) == 11

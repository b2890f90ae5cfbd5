# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The interface that others build on: names, types, qualities, rates, parameters, row by row.

Written out here once more, on purpose: a row that is changed breaks somebody's launch file.
"""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from nav_msgs.msg import Odometry
from processes import Reports, free_domain, send_sparingly
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
)
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

from poststall_sim import inlets, topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import euler_from_quaternion
from poststall_sim.ros import declaration, flight_setup
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.messages import available
from poststall_sim.ros.parameters import SimulatorSettings
from poststall_sim.topics import Qos

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

STATE, STRIPS = ('rates.state', 50.0), ('rates.strips', 20.0)
RELIABLE, LATCHED, SENSOR = Qos(10), Qos(1, latched=True), Qos(5, reliable=False)
ARRAY = 'std_msgs/msg/Float64MultiArray'
WRENCH, TWIST = 'geometry_msgs/msg/WrenchStamped', 'geometry_msgs/msg/TwistStamped'

PUBLISHED = {
    '/clock': ('rosgraph_msgs/msg/Clock', ('rates.clock', 100.0), Qos(1, reliable=False)),
    'pose': ('geometry_msgs/msg/PoseStamped', STATE, RELIABLE),
    'odom': ('nav_msgs/msg/Odometry', STATE, RELIABLE),
    'twist': (TWIST, STATE, RELIABLE),
    'twist/air': (TWIST, STATE, RELIABLE),
    'accel': ('geometry_msgs/msg/AccelStamped', STATE, RELIABLE),
    'imu': ('sensor_msgs/msg/Imu', STATE, RELIABLE),
    'wrench': (WRENCH, STATE, RELIABLE),
    'wrench/propulsion': (WRENCH, STATE, RELIABLE),
    **{f'air_data/{name}': ('std_msgs/msg/Float64', STATE, RELIABLE)
       for name in ('airspeed', 'alpha', 'beta', 'load_factor')},
    'joint_states': ('sensor_msgs/msg/JointState', STATE, RELIABLE),
    **dict.fromkeys(('joint_targets', 'surface_states'),
                    ('sensor_msgs/msg/JointState', STATE, RELIABLE)),
    'battery': ('sensor_msgs/msg/BatteryState', ('rates.battery', 5.0), RELIABLE),
    'wind/applied': ('geometry_msgs/msg/Vector3Stamped', ('rates.wind', 5.0), RELIABLE),
    **{f'strip_{name}': (ARRAY, STRIPS, RELIABLE)
       for name in ('cl', 'cd', 'cm', 'alpha', 'decambering', 'gamma', 'stalled')},
    **{f'strip_{name}': (ARRAY, ('', 0.0), LATCHED) for name in ('y', 'chord', 'cl_max')},
    'strips': ('sensor_msgs/msg/PointCloud2', ('rates.views', 5.0), Qos(5, reliable=False)),
    'markers': ('visualization_msgs/msg/MarkerArray', ('rates.views', 5.0), Qos(1)),
    'path': ('nav_msgs/msg/Path', ('rates.path', 1.0), LATCHED),
    '/diagnostics': ('diagnostic_msgs/msg/DiagnosticArray', ('rates.diagnostics', 1.0), RELIABLE),
    '/tf': ('tf2_msgs/msg/TFMessage', ('rates.tf', 50.0), Qos(100)),
    '/tf_static': ('tf2_msgs/msg/TFMessage', ('', 0.0), LATCHED),
    'odom_ned': ('nav_msgs/msg/Odometry', ('rates.ned', 50.0), RELIABLE),
    'wrench_frd': (WRENCH, ('rates.ned', 50.0), RELIABLE),
    'sensors/imu': ('sensor_msgs/msg/Imu', ('sensors.imu.rate', 0.0), SENSOR),
    'sensors/gps': ('sensor_msgs/msg/NavSatFix', ('sensors.gps.rate', 0.0), SENSOR),
    'sensors/pitot': ('sensor_msgs/msg/FluidPressure', ('sensors.pitot.rate', 0.0), SENSOR),
    'sensors/barometer': (
        'sensor_msgs/msg/FluidPressure', ('sensors.barometer.rate', 0.0), SENSOR),
}
OF_SOME_AIRCRAFT = {'battery'}
"""Shown over DDS by `test_ros_engines`: the trainer has no battery."""
COMMAND, LATEST = Qos(32, reliable=False), Qos(1, reliable=False)
SUBSCRIBED = {
    'autopilot/surface_cmd': ('sensor_msgs/msg/JointState', COMMAND),
    'pilot/surface_cmd': ('sensor_msgs/msg/JointState', COMMAND),
    'surface_commands': (ARRAY, LATEST),
    'joy': ('sensor_msgs/msg/Joy', LATEST),
    'wind': ('geometry_msgs/msg/Vector3Stamped', Qos(1)),
    'initialpose': ('geometry_msgs/msg/PoseWithCovarianceStamped', Qos(1)),
    'set_state': ('nav_msgs/msg/Odometry', Qos(1)),
}
SERVICES = {
    **dict.fromkeys(('reset', 'step', 'trim', 'gust', 'save_state', 'load_state'),
                    'std_srvs/srv/Trigger'),
    **dict.fromkeys(('pause', 'engage'), 'std_srvs/srv/SetBool'),
}
WRITABLE = {
    'real_time_factor': 1.0, 'wind.velocity': [0.0, 0.0, 0.0], 'command.source': 'auto',
    'command.timeout': 0.5, 'command.on_timeout': 'hold', 'command.deadband': 0.01,
    'decambering.enabled': True, 'step_count': 1, 'reset.time': False, 'flight_file': '',
    'joy.deadband': 0.05, 'joy.scale.aileron': -0.35, 'joy.scale.elevator': 0.35,
    'joy.scale.rudder': 0.35, 'joy.scale.throttle': 1.0,
    'engine_failures': '', 'failures': [''],
    'wind.shear.law': 'none', 'wind.shear.exponent': 0.143, 'wind.shear.roughness': 0.6096,
    'wind.shear.reference_height': 6.096, 'wind.gust.velocity': [0.0, 0.0, 2.0],
    'wind.gust.length': 10.0, 'wind.gust.distance': 5.0, 'wind.gust.shape': 'one_minus_cosine',
    'wind.turbulence.intensity': 'none', 'wind.turbulence.sigma': 0.0,
    'wind.turbulence.model': 'dryden', 'wind.turbulence.seed': 0,
}
FIXED = {
    'aircraft': 'trainer', 'dt': 0.0, 'max_steps_per_wake': 10, 'start_paused': False,
    'publish_clock': True, 'frames.map': 'map', 'frames.base': 'base_link', 'frames.prefix': '',
    'publish_tf': True, 'publish_markers': True, 'publish_ned': False, 'uvlm.core': 0.05,
    'surface_limits_deg': [-1.0], 'surface_rate_limits_deg': [-1.0], 'servo_tau': [-1.0],
    'decambering.start': 'previous', 'decambering.angle_form': 'exact',
    'initial.airspeed': 12.0, 'initial.altitude': 150.0, 'initial.position': [0.0, 0.0, 0.0],
    'initial.euler_deg': [0.0, 0.0, 0.0], 'initial.trim': True, 'decambering.scheme': 'robust',
    'decambering.relaxation': 1.0, 'lockstep': 'off', 'joy.enabled': False,
    'joy.axes.aileron': 3, 'joy.axes.elevator': 4, 'joy.axes.rudder': 0, 'joy.axes.throttle': 1,
    'joy.buttons.pause': 7, 'joy.buttons.reset': 6, 'joy.buttons.trim': 0, 'uvlm.chordwise': 4,
    'uvlm.spanwise': 0, 'uvlm.wake_length': 0.0, 'decambering.closure': 'nonlocal',
    'decambering.ell': 1.0, 'decambering.tolerance': 1e-5, 'decambering.max_iterations': 200,
    'uvlm.wake': 'prescribed', 'uvlm.free_rows': 16, 'uvlm.free_every': 2,
    'uvlm.precision': 'float32', 'uvlm.coarsen': True, 'uvlm.interpolate': True,
    'ground.effect': False, 'separation.law': 'quasi_steady', 'separation.lag': 3.0,
    'separation.relaxation': 0.5, 'separation.delay': 4.5,
    'atmosphere.temperature_offset': 0.0, 'atmosphere.sea_level_pressure': 101325.0,
    'atmosphere.density': 0.0, 'origin.latitude': 0.0, 'origin.longitude': 0.0,
    'origin.altitude': 0.0, 'sensors.seed': 1,
    'sensors.imu.delay': 0.0, 'sensors.imu.accel_noise': 0.05, 'sensors.imu.gyro_noise': 0.005,
    'sensors.imu.accel_bias': [0.0, 0.0, 0.0], 'sensors.imu.gyro_bias': [0.0, 0.0, 0.0],
    'sensors.gps.delay': 0.1, 'sensors.gps.noise': [1.0, 1.0, 2.0],
    'sensors.gps.bias': [0.0, 0.0, 0.0],
    'sensors.pitot.delay': 0.0, 'sensors.pitot.noise': 2.0, 'sensors.pitot.bias': 0.0,
    'sensors.barometer.delay': 0.0, 'sensors.barometer.noise': 5.0,
    'sensors.barometer.bias': 0.0,
    'use_sim_time': False,
    'surfaces': ['aileron', 'elevator', 'rudder', 'throttle'],
    **{parameter: rate for _, (parameter, rate), _ in PUBLISHED.values() if parameter},
}
FROM_ROS = {'use_sim_time', 'start_type_description_service'}
OF_THE_AIRCRAFT = {'strip_names'}
"""As many as its strips: held to what is published by `test_ros_topics`."""
OFF = {name: 20.0 for _, (name, rate), _ in PUBLISHED.values() if name and rate == 0.0}
"""Rates of what is off unless it is asked for, as asked for here."""
DIAGNOSED = {
    'flight': {'paused', 'paused_reason', 'optional_parts_missing'},
    'pace': {'real_time_factor_asked', 'real_time_factor', 'step_time_mean_us', 'lag_max_ms',
             'lost_time_s', 'late_ticks'},
    'solver': {'closure', 'iterations_mean', 'iterations_max', 'residual_now', 'residual_max',
               'not_converged'},
    'settings': {'closure', 'separation', 'parameters_without_effect'},
    'commands': {'source', 'age_s', 'engaged', 'refused_not_finite', 'refused_wrong_length',
                 'unknown_names', 'beyond_limits'},
}


def test_the_tables_of_topics_hold_every_row():
    """Also the depths of histories, which a graph does not tell."""
    published = {topic.name: topic for topic in topics.PUBLISHED}
    for name, (kind, (parameter, rate), qos) in PUBLISHED.items():
        found = published[name]
        assert (found.type, found.rate.parameter, found.qos) == (kind, parameter, qos), name
        assert found.rate.default == rate, name
    assert published.keys() == PUBLISHED.keys()
    assert {topic.name: (topic.type, topic.qos) for topic in inlets.SUBSCRIBED} == SUBSCRIBED


def test_the_graph_has_every_row_and_each_parameter_is_described_checked_and_guarded(start, probe):
    """
    One simulator as it comes, but paused; a stick is listened to, nothing is off.

    There is no name in the graph and no parameter that is not written out here.
    """
    changed = {'start_paused': True, 'joy.enabled': True, 'rates.diagnostics': 20.0,
               'publish_ned': True, **OFF}
    start('simulator', ros=[part for name, value in changed.items()
                            for part in ('-p', f'{name}:={str(value).lower()}')])
    reports = Reports(probe)
    for name, keys in DIAGNOSED.items():
        assert keys <= reports.keys(name), name

    def meets(info, kind, qos):
        quality = info.qos_profile
        return info.topic_type == kind and (
            quality.reliability == ReliabilityPolicy.RELIABLE) == qos.reliable and (
            quality.durability == DurabilityPolicy.TRANSIENT_LOCAL) == qos.latched

    def publishers(name):
        return [info for info in probe.node.get_publishers_info_by_topic(name)
                if info.node_name == 'simulator']

    node = probe.node

    def named(asked):
        """Return the names that the simulator has of something, and nobody else's."""
        return {name for name, _ in asked('simulator', '/')}

    def absolute(names):
        return {name if name.startswith('/') else f'/{name}' for name in names}

    on = {name for name, (kind, _, _) in PUBLISHED.items()
          if available(kind)} - OF_SOME_AIRCRAFT
    # Who has what is told apart from what there is, and may come later.
    probe.spin_until(lambda: all(map(publishers, on)) and all(
        map(node.count_subscribers, SUBSCRIBED)) and all(
            absolute(names) <= named(asked) for names, asked in (
                (on, node.get_publisher_names_and_types_by_node),
                (SUBSCRIBED, node.get_subscriber_names_and_types_by_node),
                (SERVICES, node.get_service_names_and_types_by_node))), 'the graph')
    for name, (kind, _, qos) in PUBLISHED.items():
        infos = publishers(name)
        assert len(infos) == (name in on) and all(meets(info, kind, qos) for info in infos), name
    for name, (kind, qos) in SUBSCRIBED.items():
        info, = probe.node.get_subscriptions_info_by_topic(name)
        assert meets(info, kind, qos), name
    offered = dict(probe.node.get_service_names_and_types())
    assert {name: offered[f'/{name}'] for name in SERVICES} == {
        name: [kind] for name, kind in SERVICES.items()}

    assert named(node.get_publisher_names_and_types_by_node) == absolute(on) | {
        '/rosout', '/parameter_events'}
    assert named(node.get_subscriber_names_and_types_by_node) - {
        '/parameter_events'} == absolute(SUBSCRIBED)
    assert {name for name in named(node.get_service_names_and_types_by_node)
            if not name.startswith('/simulator/')} == absolute(SERVICES)

    names = probe.call(ListParameters, '/simulator/list_parameters').result.names
    described = dict(zip(names, probe.call(
        DescribeParameters, '/simulator/describe_parameters', names=names).descriptors))
    values = dict(zip(names, map(parameter_value_to_python, probe.call(
        GetParameters, '/simulator/get_parameters', names=names).values)))
    expected = {**WRITABLE, **FIXED, **changed}
    assert set(names) | FROM_ROS == {*expected, *FROM_ROS, *OF_THE_AIRCRAFT}
    assert {name: values[name] for name in expected} == expected
    ours = {name: each for name, each in described.items() if name not in FROM_ROS}
    assert not any(ours[name].read_only for name in WRITABLE)
    assert all(each.read_only for name, each in ours.items() if name in FIXED)
    for name, each in ours.items():
        value = values[name]
        assert each.description, name
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            assert re.search(r'\[.+\]', each.description), name   # its unit
            span, = [*each.floating_point_range, *each.integer_range]
            assert span.from_value <= value <= span.to_value, name
        elif name in ('failures', 'engine_failures', 'flight_file'):
            assert each.additional_constraints, name
        elif not isinstance(value, (str, bool)) and name not in ('surfaces', 'strip_names'):
            assert re.search(r'\[.+\]', each.description) and each.additional_constraints, name

    def refused(name):
        """Return a value that nobody should take for a parameter."""
        value, each = values[name], ours[name]
        if each.read_only:
            return list(value) if not isinstance(value, (str, bool, int, float)) else value
        if isinstance(value, (bool, str)):
            return 0.5 if 'one of' not in each.additional_constraints else 'nobody'
        spans = [*each.floating_point_range, *each.integer_range]
        return spans[0].to_value + 1 if spans else [1e9] * len(value)

    def answers(wanted):
        return zip(wanted, probe.call(SetParameters, '/simulator/set_parameters', parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in wanted.items()
        ]).results)

    for name, result in answers({name: refused(name) for name in ours}):
        assert not result.successful and (
            name in result.reason or 'Wrong parameter type' in result.reason), result.reason
    for name, result in answers(WRITABLE):
        assert result.successful, (name, result.reason)

    # Which law of lift is flown shows in the lift: at alpha 25 deg of two pi alpha there is much.
    cl = probe.collect(Float64MultiArray, 'strip_cl')
    odoms = probe.collect(Odometry, 'odom')
    state, steep = probe.publisher(Odometry, 'set_state'), Odometry()
    steep.pose.pose.position.z, steep.pose.pose.orientation.w = 300.0, 1.0
    steep.twist.twist.linear.x = 12.0 * math.cos(math.radians(25.0))
    steep.twist.twist.linear.z = -12.0 * math.sin(math.radians(25.0))
    send_sparingly(reports, state, steep, lambda: odoms and
                   odoms[-1].pose.pose.position.z == pytest.approx(300.0), 'the state')
    for enabled, closure, expected in (
            (True, 'nonlocal', lambda lift: lift < 1.7),
            (False, 'off: attached flow', lambda lift: lift > 2.0)):
        assert probe.set_parameter('decambering.enabled', enabled).successful
        reports.wait_for('solver', 'closure', closure)
        cl.clear()
        assert probe.call(Trigger, 'step').success
        # Of the wing; what was shown before the step may still be on its way.
        probe.spin_until(lambda expected=expected: cl and expected(max(cl[-1].data[:20])),
                         f'the lift, decambering {closure}')


def test_a_flight_starts_where_and_as_it_is_told():
    def first(**given):
        flight = flight_setup.flight_from_settings(
            replace(SimulatorSettings(), uvlm_chordwise=1, **given), AirSettings(), [].append)
        return flight.reset(time_ns=0)

    trimmed = first(initial_position=(10.0, 20.0, 300.0), initial_euler=(0.0, 0.0, 90.0))
    assert trimmed.body.position_N.tolist() == [20.0, 10.0, -300.0]
    roll, pitch, yaw = euler_from_quaternion(trimmed.body.q_NB)
    assert (roll, yaw) == pytest.approx((0.0, math.pi / 2)) and pitch == pytest.approx(
        trimmed.alpha, abs=1e-9)
    put = first(initial_euler=(60.0, -20.0, 270.0), initial_trim=False)
    assert put.body.altitude == 150.0 and put.airspeed == pytest.approx(12.0)
    assert euler_from_quaternion(put.body.q_NB) == pytest.approx(
        np.radians([60.0, -20.0, -90.0]), abs=1e-9)
    assert put.alpha == pytest.approx(trimmed.alpha, abs=5e-3)   # in the air of another height
    with pytest.raises(ConfigError, match='set initial.trim to false for others'):
        first(initial_euler=(5.0, 0.0, 0.0))


def test_what_does_not_go_together_is_refused_with_its_reason():
    few = replace(SimulatorSettings(), decambering_max_iterations=3)
    assert flight_setup.aero_settings(few).limit == 3
    with pytest.raises(ConfigError, match='separation lag is for'):
        flight_setup.aero_settings(replace(
            SimulatorSettings(), separation='lag', decambering_enabled=False))
    context, changes = rclpy.Context(), []
    context.init(args=[], domain_id=free_domain())
    node = rclpy.create_node('simulator', context=context, cli_args=[
        '--ros-args', '-p', 'separation.law:=lag'])
    try:
        declaration.follow(node, declaration.Followed(
            declaration.declare(node, SimulatorSettings), lambda *said: changes.append(said),
            flight_setup.aero_settings))
        result, = node.set_parameters([Parameter('decambering.enabled', value=False)])
        assert not result.successful and 'separation lag is for' in result.reason
        assert node.get_parameter('decambering.enabled').value and not changes
    finally:
        node.destroy_node()
        context.try_shutdown()

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Every row of the table as a subscriber meets it: type, QoS, frame, sign and rate, over DDS."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from geometry_msgs.msg import (
    AccelStamped,
    PoseStamped,
    TwistStamped,
    Vector3Stamped,
    WrenchStamped,
)
from nav_msgs.msg import Odometry, Path
from processes import Reports, arrives, nanoseconds, owed, send_sparingly
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState, PointCloud2
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from poststall_sim import cdr, definition, topics
from poststall_sim.ros import messages
from poststall_sim.ros.messages import available, message_class, qos_profile
from poststall_sim.topics import Rate

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
AVAILABLE = [topic for topic in topics.PUBLISHED if topic.common and available(topic.type)]


def test_every_topic_has_its_type_quality_frame_and_rate(start, probe):
    """All at once, in real time, what is off by default switched on."""
    simulator = start('simulator', ros=[
        '-p', 'publish_ned:=true', '-p', 'rates.ned:=10.0', '-p', 'rates.clock:=50.0',
        '-p', 'frames.map:=world',
        '-p', 'frames.prefix:=left/', '-p', 'rates.path:=2.0', '-p', 'rates.views:=4.0',
        '-p', 'rates.state:=20.0', '-p', 'sensors.imu.rate:=40.0', '-p', 'sensors.gps.rate:=4.0',
        '-p', 'sensors.pitot.rate:=20.0', '-p', 'sensors.barometer.rate:=10.0'])
    rates = {Rate.SENSED_IMU: 40.0, Rate.GPS: 4.0, Rate.PITOT: 20.0, Rate.BAROMETER: 10.0,
             Rate.NED: 10.0, Rate.CLOCK: 50.0, Rate.PATH: 2.0, Rate.VIEWS: 4.0,
             Rate.STATE: 20.0}
    heard, infos = {}, {}
    for topic in AVAILABLE:
        heard[topic], infos[topic] = probe.collect_with_infos(
            message_class(topic.type), topic.name, qos_profile(replace(topic.qos, depth=1000)))
    probe.spin_until(lambda: all(heard.values()), 'every topic')
    for topic in AVAILABLE:
        info, = probe.node.get_publishers_info_by_topic(topic.name)
        assert info.topic_type == topic.type
        assert info.qos_profile.reliability == qos_profile(topic.qos).reliability, topic.name
        assert info.qos_profile.durability == qos_profile(topic.qos).durability, topic.name
    if not available('tf2_msgs/msg/TFMessage'):
        assert simulator.says().count('tf2_msgs is not installed, so there is no /tf and no ') == 1
        assert not probe.node.count_publishers('/tf')

    clock, = (found for topic, found in heard.items() if topic is topics.CLOCK)
    for found in (*heard.values(), *infos.values()):
        found.clear()
    probe.spin_until(lambda: len(clock) > 5, 'the clock')
    begin = nanoseconds(clock[-1].clock)
    probe.spin_until(lambda: nanoseconds(clock[-1].clock) > begin + 4_000_000_000, 'four seconds')
    passed = 1e-9 * (nanoseconds(clock[-1].clock) - begin)
    for topic, found in heard.items():
        if topic.rate is Rate.ONCE:
            assert not found, topic.name
            continue
        assert not topic.qos.reliable or not owed(infos[topic], topic.qos.depth), topic.name
        if topic is topics.DIAGNOSTICS:   # of wall time, which a busy machine has more of
            continue
        rate = rates.get(topic.rate, topic.rate.default)
        # By their numbers, as what is best effort need not come.
        published = np.diff([info['publication_sequence_number'] for info in infos[topic]])
        if hasattr(found[0], 'header'):
            gaps = np.diff([nanoseconds(message.header.stamp) for message in found])
            assert np.abs(gaps - 1e9 / rate * published).max() <= 8_000_000, topic.name   # a step
        # A period at each end, and one that is still on its way.
        assert sum(published) == pytest.approx(rate * passed, rel=0.1, abs=3.0), topic.name

    ours = {topic.name: found[-1] for topic, found in heard.items()
            if found and hasattr(found[-1], 'header')}
    in_map = {'pose', 'odom', 'path', 'wind/applied'}
    aviation = {'odom_ned': 'world_ned', 'wrench_frd': 'left/base_link_frd'}
    for name, message in ours.items():
        if name not in ('joint_states', 'joint_targets', 'surface_states', '/diagnostics'):
            expected = 'world' if name in in_map else aviation.get(name, 'left/base_link')
            assert message.header.frame_id == expected, name
    assert ours['odom'].child_frame_id == 'left/base_link'
    assert ours['odom_ned'].child_frame_id == 'left/base_link_frd'
    assert ours['path'].poses[0].header.frame_id == 'world'


def test_nothing_is_made_that_nobody_listens_to(probe, monkeypatch):
    """Counted in the node itself, which runs here: what is filled into which message."""
    from poststall_sim.ros import simulator

    made = []
    latched = {topic.type.rpartition('/')[2] for topic in AVAILABLE if topic.rate is Rate.ONCE}
    made_of_state = {topic.type.rpartition('/')[2] for topic in AVAILABLE if topic.rate not in (
        Rate.CLOCK, Rate.DIAGNOSTICS)} - latched
    fill, serialize = messages.fill, cdr.serialize
    monkeypatch.setattr(messages, 'fill', lambda message, fields: (
        made.append(type(message).__name__), fill(message, fields))[1])
    monkeypatch.setattr(cdr, 'serialize', lambda kind, fields: (
        made.append(kind.rpartition('/')[2]), serialize(kind, fields))[1])
    node = simulator.SimulatorNode(context=probe.context, cli_args=[
        '--ros-args', '-p', 'start_paused:=true', '-p', 'rates.views:=1000.0', '-p',
        'rates.path:=1000.0', '-p', 'publish_ned:=true', '-p', 'rates.ned:=1000.0',
        '-p', 'rates.diagnostics:=0.1', '-p', 'sensors.imu.rate:=1000.0',
        '-p', 'sensors.gps.rate:=1000.0'])
    probe.executor.add_node(node)
    try:
        made.clear()
        assert probe.call(Trigger, 'step').success
        assert 'Clock' in made and not made_of_state & set(made)
        for topic in (topics.MARKERS, topics.PATH, topics.GPS):
            heard = probe.collect(message_class(topic.type), topic.name, qos_profile(topic.qos))
            kind = topic.type.rpartition('/')[2]
            probe.spin_until(
                lambda kind=kind, heard=heard: probe.call(Trigger, 'step').success
                and kind in made and heard, topic.name)
        assert made_of_state & set(made) == {'MarkerArray', 'Path', 'NavSatFix'}
    finally:
        probe.executor.remove_node(node)
        node.destroy_node()


def test_at_full_rates_a_step_is_flown_once_and_makes_one_message_of_each_topic(
        probe, monkeypatch):
    """Everything on, at 1/dt, with a listener each: what is not counted twice costs only once."""
    from poststall_sim import simulation
    from poststall_sim.ros import simulator

    made, flown, count = Counter(), [], 20
    fill, serialize, fly = messages.fill, cdr.serialize, simulation.step
    monkeypatch.setattr(messages, 'fill', lambda message, fields: (
        made.update([type(message).__name__]), fill(message, fields))[1])
    monkeypatch.setattr(cdr, 'serialize', lambda kind, fields: (
        made.update([kind.rpartition('/')[2]]), serialize(kind, fields))[1])
    monkeypatch.setattr(simulation, 'step', lambda *given, **named: (
        flown.append(1), fly(*given, **named))[1])
    shown = [topic for topic in AVAILABLE
             if topic.rate not in (Rate.ONCE, Rate.DIAGNOSTICS)]
    node = simulator.SimulatorNode(context=probe.context, cli_args=[
        '--ros-args', '-p', 'start_paused:=true', '-p', 'dt:=0.008', '-p', 'publish_ned:=true',
        '-p', 'sensors.gps.delay:=0.0', *(part for rate in {topic.rate for topic in shown}
                                          for part in ('-p', f'{rate.parameter}:=125.0'))])
    try:
        for topic in shown:
            probe.node.create_subscription(
                message_class(topic.type), topic.name, made.get, qos_profile(topic.qos), raw=True)
        probe.spin_until(lambda: all(map(node._outbox._heard, shown)), 'a listener of every topic')
        made.clear()
        flown.clear()
        node.advance(count)
        kinds = Counter(topic.type.rpartition('/')[2] for topic in shown)
        assert {kind: made[kind] for kind in kinds} == {
            kind: count * topics for kind, topics in kinds.items()}
        assert len(flown) == count
    finally:
        node.destroy_node()


def test_sensors_without_errors_measure_what_there_is_and_come_late_as_told(start, probe):
    """Over the equator, flying north at 15 m/s; the barometer's message 20 ms after its sample."""
    start('simulator', ros=[
        '-p', 'start_paused:=true', '-p', 'initial.altitude:=500.0', '-p', 'dt:=0.005',
        '-p', 'initial.airspeed:=15.0', '-p', 'rates.diagnostics:=10.0', '-p', 'step_count:=40',
        '-p', 'origin.longitude:=11.0', '-p', 'origin.altitude:=100.0',
        '-p', 'sensors.imu.rate:=200.0', '-p', 'sensors.imu.accel_noise:=0.0',
        '-p', 'sensors.imu.gyro_noise:=0.0', '-p', 'sensors.imu.gyro_bias:=[0.0, 0.0, 0.25]',
        '-p', 'sensors.gps.rate:=200.0', '-p', 'sensors.gps.noise:=[0.0, 0.0, 0.0]',
        '-p', 'sensors.gps.delay:=0.0',
        '-p', 'sensors.pitot.rate:=200.0', '-p', 'sensors.pitot.noise:=0.0',
        '-p', 'sensors.barometer.rate:=200.0', '-p', 'sensors.barometer.noise:=0.0',
        '-p', 'sensors.barometer.delay:=0.02'])
    heard = {topic: probe.collect(message_class(topic.type), topic.name, QoSProfile(
        depth=100, reliability=ReliabilityPolicy.BEST_EFFORT))
        for topic in (topics.SENSED_IMU, topics.GPS, topics.PITOT, topics.BAROMETER)}
    odom = probe.collect(Odometry, 'odom')
    ideal = probe.collect(Imu, 'imu')
    probe.spin_until(lambda: odom and ideal and all(
        probe.node.count_publishers(topic.name) for topic in heard), 'the simulator')

    def latest():
        """Return the sensors' latest messages, once they are of the instant that is shown."""
        now = nanoseconds(odom[-1].header.stamp)
        if not all(heard.values()):
            return None
        found = {topic: each[-1] for topic, each in heard.items()}
        there = all(nanoseconds(message.header.stamp) == now - (
            20_000_000 if topic is topics.BAROMETER else 0) for topic, message in found.items())
        return found if there and nanoseconds(ideal[-1].header.stamp) == now else None

    def stepped():
        """Step, and return the readings of the last step if none of them got lost."""
        assert probe.call(Trigger, 'step').success
        end = probe.node.get_clock().now().nanoseconds + 500_000_000
        probe.spin_until(lambda: latest() or probe.node.get_clock().now().nanoseconds > end,
                         'sensors')
        return latest()
    found = probe.spin_until(stepped, 'the readings of all sensors')
    here, speed = odom[-1].pose.pose.position, odom[-1].twist.twist.linear

    imu = found[topics.SENSED_IMU]
    assert imu.linear_acceleration == ideal[-1].linear_acceleration
    assert imu.angular_velocity.z == ideal[-1].angular_velocity.z + 0.25
    gps = found[topics.GPS]
    assert gps.latitude * 110_574.3 == pytest.approx(here.y, rel=1e-4) and here.y > 1.0
    assert gps.longitude == pytest.approx(11.0, abs=1e-6)
    assert gps.altitude == pytest.approx(here.z + 100.0)
    # 500 m in the U.S. Standard Atmosphere, 1976: 95 461 Pa and 1.1673 kg/m^3.
    assert found[topics.BAROMETER].fluid_pressure == pytest.approx(95_461.0, abs=5.0)
    assert found[topics.PITOT].fluid_pressure == pytest.approx(
        0.5 * 1.1673 * speed.x ** 2, rel=1e-3)


def xyz(vector):
    return np.array([vector.x, vector.y, vector.z])


def turned(q, vector):
    """Return a vector of the child frame in the parent frame, by Rodrigues' formula."""
    axis = np.array([q.x, q.y, q.z])
    return vector + 2.0 * np.cross(axis, np.cross(axis, vector) + q.w * vector)


def with_flaps(folder):
    """Write a trainer that has two flaps inboard of its ailerons; return its path."""
    trainer = definition.find(definition.Kind.AIRCRAFT, 'trainer')
    before, elevator, after = trainer.read_text(encoding='utf-8').partition('  elevator:')
    for side in ('left', 'right'):
        before += f"""  flap_{side}:
    limits_deg: [-20.0, 20.0]
    effectors:
      - {{surface: wing, side: {side}, span: [0.1, 0.5], hinge: 0.75, gain: 1.0}}
"""
    (folder / 'flaps.yaml').write_text(before + elevator + after, encoding='utf-8')
    return folder / 'flaps.yaml'


@pytest.fixture
def lockstep(request, start, probe, tmp_path):
    """Start a paused simulator; return what steps it and shows the latest messages."""
    aircraft = request.param(tmp_path) if hasattr(request, 'param') else 'trainer'
    start('simulator', ros=[
        '-p', f'aircraft:={aircraft}', '-p', 'start_paused:=true', '-p', 'publish_ned:=true',
        '-p', 'command.timeout:=1000.0', '-p', 'initial.altitude:=500.0',
        '-p', 'rates.diagnostics:=10.0', '-p', 'initial.airspeed:=15.0'])

    class Lockstep:
        def __init__(self):
            self.heard = {}
            self.reports = Reports(probe)
            self.command = probe.publisher(JointState, 'autopilot/surface_cmd')
            self.joints = self.follow(JointState, 'joint_states')
            self.trim = self.controls()
            self.dt_ns = round(1e9 * self.reports.number('pace', 'dt_s'))

        def follow(self, kind, name, qos=10):
            heard = probe.collect(kind, name, qos)
            probe.spin_until(lambda: heard, name)
            if hasattr(heard[0], 'header'):
                self.heard[name] = heard
            return heard

        def controls(self):
            return dict(zip(self.joints[-1].name, self.joints[-1].position))

        def step(self, count):
            """Step, and wait until all that is followed shows the instant at the end."""
            assert probe.set_parameter('step_count', count).successful
            time_ns = nanoseconds(self.joints[-1].header.stamp) + count * self.dt_ns
            assert probe.call(Trigger, 'step').success
            probe.spin_until(lambda: all(
                nanoseconds(heard[-1].header.stamp) == time_ns for heard in self.heard.values()),
                'the step')

        def move(self, **changes):
            """Command controls away from trim, and wait until that has arrived."""
            # None of them twice: the count of the second would be taken for that of the next.
            arrives(self.reports, self.command, JointState(name=list(changes), position=[
                self.trim[name] + change for name, change in changes.items()]))

        def reset(self):
            """Reset, which shows everything anew, and wait until all that is followed is there."""
            stamp = nanoseconds(self.joints[-1].header.stamp)
            for heard in self.heard.values():
                heard.clear()
            assert probe.call(Trigger, 'reset').success
            probe.spin_until(lambda: all(
                heard and nanoseconds(heard[-1].header.stamp) == stamp
                for heard in self.heard.values())
                and self.controls() == pytest.approx(self.trim), 'the reset')

    return Lockstep()


@pytest.mark.parametrize('lockstep', [with_flaps], indirect=True)
def test_each_control_makes_the_moment_that_its_sign_says(lockstep, probe):
    """
    In FLU: roll to the right about +x, nose down about +y, nose to the left about +z.

    A trailing edge that goes down lifts: a flap lifts its side.
    """
    wrenches = lockstep.follow(WrenchStamped, 'wrench')
    pushes = lockstep.follow(WrenchStamped, 'wrench/propulsion')
    frd = lockstep.follow(WrenchStamped, 'wrench_frd')

    def moments(**changes):
        lockstep.reset()
        lockstep.move(**changes)
        lockstep.step(4)
        torque = wrenches[-1].wrench.torque
        return np.array([torque.x, torque.y, torque.z])

    still = moments(elevator=0.0)
    for control, axis in (('aileron', 0), ('elevator', 1), ('rudder', 2)):
        for sign in (1.0, -1.0):
            change = moments(**{control: sign * 0.1}) - still
            assert sign * change[axis] > 0.2, control                   # N m
            assert np.argmax(np.abs(change)) == axis, control
    torque, ned = wrenches[-1].wrench.torque, frd[-1].wrench.torque
    assert (torque.x, torque.y, torque.z) == (ned.x, -ned.y, -ned.z)    # nose right is + in FRD
    assert ned.z > 0.0

    left, right = moments(flap_left=0.1) - still, moments(flap_right=0.1) - still
    assert left[0] > 1.0 and right == pytest.approx(left * [-1.0, 1.0, -1.0], rel=1e-3)
    lifted = wrenches[-1].wrench.force.z
    assert moments(flap_right=-0.1)[0] - still[0] > 1.0
    assert lifted - wrenches[-1].wrench.force.z > 2.0                   # N

    before = pushes[-1].wrench.force.x
    moments(throttle=0.3)
    assert pushes[-1].wrench.force.x > before + 1.0
    assert pushes[-1].header.frame_id == 'base_link'


def test_joint_states_say_how_fast_a_control_moves(lockstep, probe):
    lockstep.move(elevator=0.02, throttle=0.1)
    lockstep.step(1)
    joints = lockstep.joints[-1]
    velocity = dict(zip(joints.name, joints.velocity))
    dt = 1e-9 * lockstep.dt_ns
    assert velocity['elevator'] == pytest.approx(0.02 / dt)
    assert velocity['throttle'] == pytest.approx(0.1 / dt)
    assert velocity['rudder'] == 0.0 and list(joints.effort) == [0.0] * 4
    lockstep.step(1)
    assert list(lockstep.joints[-1].velocity) == [0.0] * 4


def test_an_accelerometer_feels_the_lift_there_is_and_at_no_airspeed_none(lockstep, probe):
    imu = lockstep.follow(Imu, 'imu')
    odom = lockstep.follow(Odometry, 'odom')
    wrench, push = (lockstep.follow(WrenchStamped, name) for name in (
        'wrench', 'wrench/propulsion'))
    assert imu[-1].linear_acceleration.z == pytest.approx(9.8, abs=0.1)
    lockstep.move(elevator=-0.1, aileron=0.1)
    lockstep.step(30)
    felt, twist = imu[-1], odom[-1].twist.twist
    force = [a + b for a, b in zip(*(
        (w.force.x, w.force.y, w.force.z) for w in (wrench[-1].wrench, push[-1].wrench)))]
    found = felt.linear_acceleration
    # Newton: mass times specific force is all force but the weight; the trainer has 9 kg.
    assert [9.0 * found.x, 9.0 * found.y, 9.0 * found.z] == pytest.approx(force, abs=1e-6)
    assert found.z > 12.0                                 # pulling up
    assert felt.angular_velocity == twist.angular
    assert twist.angular.y < -0.1 and twist.angular.x > 0.1   # nose up, to the right
    assert felt.orientation == odom[-1].pose.pose.orientation
    assert np.linalg.norm([felt.orientation.x, felt.orientation.y, felt.orientation.z,
                           felt.orientation.w]) == pytest.approx(1.0)

    # At rest in the air it is the force of that which counts, not the last one that there was.
    still = Odometry()
    still.pose.pose.orientation.w, still.pose.pose.position.z = 1.0, 300.0
    speeds = lockstep.follow(Float64, 'air_data/airspeed')
    wrench.clear()
    send_sparingly(lockstep.reports, probe.publisher(Odometry, 'set_state'), still,
                   lambda: odom[-1].pose.pose.position.z == pytest.approx(300.0), 'the state')
    probe.spin_until(lambda: wrench and speeds[-1].data == 0.0, 'no airspeed')
    # But for the air that it takes along as it begins to fall: a part of its weight of 88 N.
    assert np.abs(xyz(wrench[-1].wrench.force)).max() < 10.0
    assert np.abs(xyz(wrench[-1].wrench.torque)).max() < 2.0
    lockstep.step(2)
    assert np.isfinite(xyz(wrench[-1].wrench.force)).all()
    assert odom[-1].twist.twist.linear.z < 0.0


def test_wind_shows_as_sideslip_at_once_and_as_drift_when_trimmed_in_it(lockstep, probe):
    """Flying north, an air that goes west comes from the right: beta is positive."""
    odom = lockstep.follow(Odometry, 'odom')
    betas = lockstep.follow(Float64, 'air_data/beta')
    speeds = lockstep.follow(Float64, 'air_data/airspeed')
    assert probe.set_parameter('wind.velocity', [-3.0, 0.0, 0.0]).successful
    betas.clear()
    lockstep.step(1)
    probe.spin_until(lambda: betas, 'beta')
    assert betas[-1].data == pytest.approx(np.arcsin(3.0 / np.hypot(15.0, 3.0)), abs=0.02)
    assert odom[-1].pose.pose.position.x == pytest.approx(0.0, abs=1e-2)
    lockstep.reset()
    betas.clear()
    begin = odom[-1].pose.pose.position.x, nanoseconds(odom[-1].header.stamp)
    lockstep.step(100)
    probe.spin_until(lambda: betas, 'beta')
    passed = 1e-9 * (nanoseconds(odom[-1].header.stamp) - begin[1])
    assert (odom[-1].pose.pose.position.x - begin[0]) / passed == pytest.approx(-3.0, abs=0.05)
    assert abs(betas[-1].data) < 0.02
    assert speeds[-1].data == pytest.approx(15.0, abs=0.2)


def test_all_topics_of_an_instant_say_the_same_and_rates_are_slopes(lockstep, probe):
    """In a turning pull-up through a wind; map is ENU, base_link FLU, everywhere in SI."""
    assert probe.set_parameter('wind.velocity', [2.0, -1.0, 0.5]).successful
    lockstep.move(elevator=-0.1, aileron=0.05, rudder=0.05)
    lockstep.step(25)
    odoms, poses = lockstep.follow(Odometry, 'odom'), lockstep.follow(PoseStamped, 'pose')
    twists, air, accels, winds = (lockstep.follow(kind, name) for kind, name in (
        (TwistStamped, 'twist'), (TwistStamped, 'twist/air'), (AccelStamped, 'accel'),
        (Vector3Stamped, 'wind/applied')))
    clouds = lockstep.follow(PointCloud2, 'strips', BEST_EFFORT)
    numbers = {name: lockstep.follow(Float64, f'air_data/{name}')
               for name in ('airspeed', 'alpha', 'beta', 'load_factor')}
    strips = {name: lockstep.follow(Float64MultiArray, f'strip_{name}') for name in (
        'cl', 'cd', 'cm', 'alpha', 'decambering', 'stalled', 'gamma')}
    strip_y, chord = (lockstep.follow(Float64MultiArray, name, LATCHED)
                      for name in ('strip_y', 'strip_chord'))
    before, here, accel = odoms[-1], None, None
    for count in range(2):
        for heard in (*numbers.values(), *strips.values()):
            heard.clear()
        lockstep.step(1)
        probe.spin_until(lambda: all((*numbers.values(), *strips.values())), 'all of the step')
        if count == 0:
            here, accel = odoms[-1], accels[-1].accel
            pose, twist, through, wind = (
                poses[-1].pose, twists[-1].twist, air[-1].twist, xyz(winds[-1].vector))
            found = {name: heard[-1].data for name, heard in numbers.items()}
            rows = {name: np.array(heard[-1].data) for name, heard in strips.items()}
            cloud = clouds[-1]
    after, dt = odoms[-1], 1e-9 * lockstep.dt_ns

    assert pose == here.pose.pose and twist == here.twist.twist
    q, velocity = pose.orientation, xyz(twist.linear)
    assert wind.tolist() == [2.0, -1.0, 0.5]
    assert turned(q, xyz(through.linear)) == pytest.approx(turned(q, velocity) - wind)
    assert through.angular == twist.angular
    u, v, w = xyz(through.linear) * [1.0, -1.0, -1.0]
    assert found['airspeed'] == pytest.approx(np.sqrt(u * u + v * v + w * w))
    assert found['alpha'] == pytest.approx(np.arctan2(w, u)) and found['alpha'] > 0.05
    assert found['beta'] == pytest.approx(np.arcsin(v / found['airspeed']))
    assert abs(found['beta']) > 0.02 and found['load_factor'] > 1.2

    # Central differences over 12 ms: of motions that take a tenth of a second, to a thousandth.
    def slope(of):
        return (of(after) - of(before)) / (2.0 * dt)
    assert slope(lambda odom: xyz(odom.pose.pose.position)) == pytest.approx(
        turned(q, velocity), abs=1e-3)
    assert turned(q, xyz(accel.linear)) == pytest.approx(slope(
        lambda odom: turned(odom.pose.pose.orientation, xyz(odom.twist.twist.linear))), abs=0.02)
    assert xyz(accel.angular) == pytest.approx(
        slope(lambda odom: xyz(odom.twist.twist.angular)), abs=0.02)

    names = [field.name for field in cloud.fields]
    points = np.frombuffer(bytes(cloud.data), '<f4').reshape(cloud.width, -1)
    for name in ('cl', 'cd', 'cm', 'alpha', 'decambering', 'stalled'):
        assert points[:, names.index(name)] == pytest.approx(rows[name], rel=1e-6, abs=1e-7), name
    assert points[:, names.index('y')] == pytest.approx(np.array(strip_y[-1].data), rel=1e-6)
    # Of the wing, whose strips feel about the airspeed: cl = 2 gamma / (V c).
    assert (2.0 * rows['gamma'] / (found['airspeed'] * np.array(chord[-1].data)))[:20] \
        == pytest.approx(rows['cl'][:20], rel=0.1)


def test_views_are_there_for_who_looks_and_stand_where_the_aircraft_is(lockstep, probe):
    lockstep.step(150)
    odom = lockstep.follow(Odometry, 'odom')
    clouds = lockstep.follow(PointCloud2, 'strips', BEST_EFFORT)
    paths = lockstep.follow(Path, 'path', LATCHED)
    markers = lockstep.follow(MarkerArray, 'markers')
    here = odom[-1].pose.pose.position
    assert clouds[-1].width == 33
    names = [field.name for field in clouds[-1].fields]
    points = np.frombuffer(bytes(clouds[-1].data), '<f4').reshape(33, -1)
    assert points[0, names.index('y')] > 1.5 > -1.5 > points[19, names.index('y')]
    assert 0.2 < points[:20, names.index('cl')].mean() < 1.0
    assert not points[:, names.index('stalled')].any()
    last = paths[-1].poses[-1].pose.position
    assert (last.x, last.y, last.z) == (here.x, here.y, here.z)
    assert paths[-1].poses[0].pose.position.y == 0.0 and len(paths[-1].poses) >= 5
    assert {marker.ns: marker.header.frame_id for marker in markers[-1].markers} == {
        'body': 'base_link', 'strips': 'base_link', 'lift': 'base_link', 'controls': 'base_link',
        'wake': 'map'}
    wake = next(marker for marker in markers[-1].markers if marker.ns == 'wake')
    assert max(point.y for point in wake.points) == pytest.approx(here.y, abs=0.5)
    # Best effort, it may get lost: who waits for it while time stands is shown it again.
    clouds.clear()
    probe.spin_until(lambda: clouds, 'the strips again')
    before = len(paths[-1].poses)
    lockstep.reset()
    probe.spin_until(lambda: len(paths[-1].poses) < before, 'a new path')
    assert paths[-1].poses[0].pose.position.y == 0.0

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The markers of a flying node as a viewer would draw them, looked at by counting pixels.

The picture is made from messages alone: triangles and lines by their namespace, those in
base_link placed by the pose. ``--basetemp`` keeps it, as views.png.
"""

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')
pytest.importorskip('matplotlib', reason='figures need matplotlib')

from geometry_msgs.msg import PoseStamped
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.image import imread
from processes import Reports, nanoseconds, send_until
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]


def rotation(q):
    """Return the matrix of a geometry_msgs/Quaternion, by its definition."""
    axis = np.array([q.x, q.y, q.z])
    return np.array([v + 2.0 * np.cross(axis, np.cross(axis, v) + q.w * v)
                     for v in np.eye(3)]).T


class Scene:
    """Points (n, 3) in map and colours (n, 4) of each namespace, and whether it is lines."""

    def __init__(self, message, pose):
        self.position = np.array([pose.position.x, pose.position.y, pose.position.z])
        self.attitude = rotation(pose.orientation)
        self.parts = {}
        for marker in message.markers:
            points = np.array([[p.x, p.y, p.z] for p in marker.points])
            if marker.header.frame_id == 'base_link':
                points = self.position + points @ self.attitude.T
            colours = np.array([[c.r, c.g, c.b, c.a] for c in marker.colors or
                                [marker.color] * len(points)])
            self.parts[marker.ns] = (points, colours, marker.type == Marker.LINE_LIST)

    def arrows(self):
        """Return where lift begins and where it points to (n, 3), in base_link."""
        points = (self.parts['lift'][0] - self.position) @ self.attitude
        return points[0::2], points[1::2] - points[0::2]

    def draw(self, path, axes, names, box):
        """Draw parts on two axes of map into a PNG, and return its pixels."""
        figure = Figure(figsize=(6, 6), dpi=100)
        ax = figure.add_axes([0, 0, 1, 1])
        ax.set_axis_off()
        ax.set_xlim(*box[0])
        ax.set_ylim(*box[1])
        for name in names:
            points, colours, lines = self.parts[name]
            corners = 2 if lines else 3
            shapes = points[:, axes].reshape(-1, corners, 2)
            kind = LineCollection if lines else PolyCollection
            key = {'colors' if lines else 'facecolors': colours[::corners]}
            ax.add_collection(kind(shapes, **key, linewidths=0.8))
        figure.savefig(path)
        return imread(path)[..., :3]


def dark(image):
    return (image < 0.97).any(axis=-1)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('views')


def test_the_picture_shows_an_aircraft_its_lift_its_wake_and_where_it_stalls(
        start, probe, folder):
    start('simulator', ros=[
        '-p', 'start_paused:=true', '-p', 'command.timeout:=1000.0',
        '-p', 'initial.altitude:=500.0', '-p', 'rates.diagnostics:=10.0',
        '-p', 'initial.airspeed:=12.0'])
    messages = probe.collect(MarkerArray, 'markers')
    poses = probe.collect(PoseStamped, 'pose')
    reports = Reports(probe)
    probe.spin_until(lambda: messages and poses and reports.heard, 'markers')

    def step(count):
        assert probe.set_parameter('step_count', count).successful
        time_ns = nanoseconds(poses[-1].header.stamp) + count * round(
            1e9 * reports.number('pace', 'dt_s'))
        assert probe.call(Trigger, 'step').success
        probe.spin_until(lambda: nanoseconds(poses[-1].header.stamp) == time_ns and nanoseconds(
            messages[-1].markers[0].header.stamp) == time_ns, 'the step')
        return Scene(messages[-1], poses[-1].pose)

    scene = step(100)
    here = scene.position
    names = ['wake', 'body', 'strips', 'controls', 'lift']

    # From above: the wing is the widest, the wake lies behind (south of a flight to the north).
    box = ((here[0] - 3, here[0] + 3), (here[1] - 5, here[1] + 1))
    above = dark(scene.draw(folder / 'above.png', [0, 1], ['body', 'strips'], box))
    assert 0.01 < above.mean() < 0.2                      # an aircraft, not a blank, not a blot
    across = above.any(axis=0)
    assert np.ptp(np.flatnonzero(across)) == pytest.approx(3.2 * 100, abs=5)    # span, 100 px/m
    assert (above ^ above[:, ::-1]).mean() < 0.01         # the left as the right
    trail = dark(scene.draw(folder / 'trail.png', [0, 1], ['wake'], box))
    rows = np.flatnonzero(trail.any(axis=1))              # rows count from the north
    assert rows.min() > 100 - 25 and trail[-1].any() and trail.mean() > 0.01

    # From the left: lift points up from the wing.
    box = ((here[1] - 3, here[1] + 3), (here[2] - 2, here[2] + 4))
    side = dark(scene.draw(folder / 'side.png', [1, 2], ['lift'], box))
    assert side.any() and np.flatnonzero(side.any(axis=1)).min() < 380
    begins, arrows = scene.arrows()
    wing = np.abs(begins[:, 2]) < 0.15
    wing &= begins[:, 0] > -0.3
    assert wing.sum() == 20 and (arrows[wing, 2] > 0.05).all()
    assert 0.2 < arrows[wing, 2].max() < 1.0
    _, colours, _ = scene.parts['strips']
    assert not (colours[:, 0] > 0.8).any()                # nothing red in level flight

    # Pulled into the stall: red strips, and the wake bends down behind the nose.
    command = probe.publisher(JointState, 'autopilot/surface_cmd')
    send_until(probe, command, JointState(name=['elevator', 'throttle'], position=[-0.5, 0.0]),
               lambda: reports.number('commands', 'accepted') > 0, 'the command')
    scene = step(120)
    here = scene.position
    box = ((here[0] - 3, here[0] + 3), (here[2] - 4, here[2] + 2))
    image = scene.draw(folder / 'behind.png', [0, 2], names, box)
    red = (image[..., 0] > 0.7) & (image[..., 1] < 0.3) & (image[..., 2] < 0.3)
    assert red.sum() > 50, 'stalled strips should be red'
    box = ((here[1] - 6, here[1] + 2), (here[2] - 4, here[2] + 4))
    assert dark(scene.draw(folder / 'views.png', [1, 2], names, box)).mean() > 0.01

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What views of a flight show beyond its snapshot: markers for RViz and Foxglove, and the path.

The aircraft's markers are in base_link and locked to it, so that they move as its transform does
and not in jumps; the wake is in map. Points and colours are arrays (see `cdr`).
"""


import numpy as np

from poststall_sim import fields, silhouette, topics
from poststall_sim.aero.model import Model
from poststall_sim.aero.wake import Shape
from poststall_sim.coupling import placement
from poststall_sim.fields import Fields, Layout
from poststall_sim.frames import (
    GRAVITY,
    FloatArray,
    body_to_geometry,
    geometry_to_body,
    swap_body_flu,
    swap_ned_enu,
)
from poststall_sim.simulation import Flight
from poststall_sim.state import Snapshot

LINE_LIST, TRIANGLE_LIST = 5, 11
"""Types of visualization_msgs/Marker."""

WAKE_ROWS = 20
"""Rows of the wake that are drawn, at most."""
PATH_POSES = 500
"""Poses of the path, at most: then every other one goes, and half as many come."""
PATH_PERIOD_NS = 100_000_000
"""The path has a pose this often at first [ns of simulated time]."""
LIFT_LENGTH = 0.15
"""A lift of the weight over the wing's span is drawn this long, in spans."""
PERIODS_SHOWN = 5
"""What is measured goes out of sight when it has not been renewed for so many periods."""

BODY, CONTROL = (0.55, 0.58, 0.62, 1.0), (0.95, 0.75, 0.2, 1.0)
IDLE, LOADED, STALLED = (0.62, 0.75, 0.90, 1.0), (0.10, 0.35, 0.75, 1.0), (0.85, 0.10, 0.10, 1.0)
DOWNWARDS = (0.45, 0.10, 0.65, 1.0)
"""Of a strip of much negative lift: unlike green, not to be taken for red by anybody."""
WAKE = (0.35, 0.65, 0.75, 0.5)


class Views:
    """
    Markers and path of the flights of a model, made when they are asked for.

    rate : of the markers [Hz of simulated time], for how long they stay in sight.
    """

    def __init__(self, model: Model, layout: Layout, rate: float) -> None:
        self._model, self._layout = model, layout
        self._makers = {topics.MARKERS: self.markers, topics.PATH: self.path}
        lifetime_ns = round(PERIODS_SHOWN * 1e9 / rate) if rate > 0.0 else 0
        self._lifetime = fields.stamp(lifetime_ns)
        aircraft, lattice = model.aircraft, model.lattice
        reference = aircraft.reference
        self._widths = {'lift': 0.004 * reference.span, 'wake': 0.0015 * reference.span}
        self._body = silhouette.triangles(silhouette.fuselage(aircraft))
        self._strips = silhouette.triangles(strip_quads(model))
        self._arm_G = lattice.quarter_chord - np.array(aircraft.mass.cg_G)
        weight = aircraft.mass.mass * GRAVITY
        self._lift_scale = LIFT_LENGTH * reference.span / (weight / reference.span)
        self._poses: list[Fields] = []
        self._period_ns = PATH_PERIOD_NS
        self._seen = (0, 0)
        self._next_ns = 0

    def fields(self, topic: topics.Topic, flight: Flight) -> Fields:
        """Return what one of the topics `MARKERS` and `PATH` says of a flight now."""
        return self._makers[topic](flight)

    def follow(self, flight: Flight) -> None:
        """Remember the present place for the path; a flight that begins again begins another."""
        time_ns, steps = seen = flight.snapshot.time_ns, flight.state.flow.steps
        if time_ns < self._seen[0] or steps < self._seen[1]:
            self._poses, self._period_ns = [], PATH_PERIOD_NS
        self._seen = seen
        if self._poses and time_ns < self._next_ns:
            return
        self._next_ns = time_ns + self._period_ns
        self._poses.append(fields.pose(flight.snapshot, self._layout))
        if len(self._poses) >= PATH_POSES:
            self._poses = self._poses[::2]
            self._period_ns *= 2

    def path(self, flight: Flight) -> Fields:
        """Return a nav_msgs/Path that ends where the aircraft is."""
        self.follow(flight)
        return {'header': fields.header(flight.snapshot.time_ns, self._layout.map_frame),
                'poses': [*self._poses, fields.pose(flight.snapshot, self._layout)]}

    def markers(self, flight: Flight) -> Fields:
        """Return a visualization_msgs/MarkerArray of the present state."""
        snapshot = flight.snapshot
        strips = strip_colours(snapshot, self._layout)
        controls = silhouette.triangles(
            silhouette.movables(self._model.aircraft, snapshot.angles))
        drawn = [
            ('body', TRIANGLE_LIST, self._body, BODY),
            ('strips', TRIANGLE_LIST, self._strips, np.repeat(strips, 6, axis=0)),
            ('lift', LINE_LIST, self._lift(snapshot), np.repeat(strips, 2, axis=0)),
            ('wake', LINE_LIST, wake_lines(flight), WAKE)]
        if len(controls):
            drawn.append(('controls', TRIANGLE_LIST, controls, CONTROL))
        return {'markers': [self._marker(snapshot.time_ns, *each) for each in drawn]}

    def _marker(self, time_ns: int, name: str, kind: int, points: FloatArray,
                colours: FloatArray | tuple[float, ...]) -> Fields:
        """Return a marker, the only one of its namespace; colours : one, or one a point."""
        in_map = name == 'wake'
        marker = {
            'header': fields.header(
                time_ns, self._layout.map_frame if in_map else self._layout.base_frame),
            'ns': name, 'type': kind, 'pose': {'orientation': {'w': 1.0}},
            'frame_locked': not in_map, 'points': points}
        if kind == LINE_LIST:   # the aircraft stays in sight, what was measured does not
            marker |= {'scale': {'x': self._widths[name]}, 'lifetime': self._lifetime}
        else:
            marker['scale'] = {'x': 1.0, 'y': 1.0, 'z': 1.0}
        if isinstance(colours, tuple):
            marker['color'] = dict(zip('rgba', colours))
        else:
            marker |= {'color': dict(zip('rgba', BODY)), 'colors': colours}
        return marker

    def _lift(self, snapshot: Snapshot) -> FloatArray:
        """
        Return (2 n, 3) lines in base_link, from each quarter chord the way its lift points.

        Across the air that the strip meets and across its span; as long as lift over width.
        """
        lattice = self._model.lattice
        air_B = snapshot.velocity_air_B + np.cross(
            snapshot.body.rates_B, geometry_to_body(self._arm_G))
        lift_G = np.cross(-body_to_geometry(air_B), lattice.span_axis)
        lift_G *= self._lift_scale * snapshot.density * snapshot.strips.circulation[:, None]
        lines_G = np.stack([self._arm_G, self._arm_G + lift_G], axis=1)
        return swap_body_flu(geometry_to_body(lines_G)).reshape(-1, 3)


def strip_colours(snapshot: Snapshot, layout: Layout) -> FloatArray:
    """
    Return a colour (n, 4) for each strip.

    Deeper as its lift nears its greatest, another where lift is negative, red past the stall.
    """
    share = np.clip(snapshot.strips.cl / layout.strip_cl_max, -1.0, 1.0)[:, None]
    full = np.where(share < 0.0, np.array(DOWNWARDS), np.array(LOADED))
    colours = (1.0 - np.abs(share)) * np.array(IDLE) + np.abs(share) * full
    colours[snapshot.strips.stalled.astype(bool)] = STALLED
    return colours


def wake_lines(flight: Flight) -> FloatArray:
    """Return lines (2 k, 3) in map along and across the wake, of `WAKE_ROWS` rows at most."""
    lattice, wake = flight.model.lattice, flight.state.flow.wake
    nodes = wake.nodes_N
    place = placement(flight.model.aircraft, flight.snapshot.body)
    if flight.model.settings.wake is Shape.FROZEN:   # its rows stand still behind the body
        nodes = place.to_inertial(nodes - nodes[0, 0] + lattice.wake_nodes[0])
    rows = np.unique(np.linspace(0, len(nodes) - 1, WAKE_ROWS).round().astype(int))
    shown = swap_ned_enu(nodes[rows])
    along = np.stack([shown[:-1], shown[1:]], axis=2)
    across = np.stack([shown[:, lattice.te_node], shown[:, lattice.te_node + 1]], axis=2)
    return np.concatenate([along.reshape(-1, 3), across.reshape(-1, 3)])


def strip_quads(model: Model) -> list[FloatArray]:
    """Return the four corners (4, 3) of each strip in base_link [m], from the lattice's rings."""
    lattice, cg = model.lattice, np.array(model.aircraft.mass.cg_G)
    quads: list[FloatArray] = []
    for grid in lattice.grids:
        rings = lattice.ring_corners[grid.panels].reshape(grid.rows, -1, 4, 3)
        front, rear = rings[0, :, :2], rings[-1, :, [3, 2]].swapaxes(0, 1)
        # Rings stand a quarter panel behind their panels.
        back = 0.25 * (rear - front) / grid.rows
        corners = np.concatenate([front - back, (rear - back)[:, ::-1]], axis=1)
        quads.extend(swap_body_flu(geometry_to_body(corners - cg)))
    return quads

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Markers and path: where they are, which way they point, what they cost."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from poststall_sim import cdr, definition, silhouette, simulation, topics, views
from poststall_sim.aero.model import Settings
from poststall_sim.aero.wake import Shape
from poststall_sim.frames import GRAVITY
from poststall_sim.state import Controls
from poststall_sim.views import LINE_LIST, Views


@pytest.fixture(scope='module')
def trainer():
    return definition.aircraft(definition.find('aircraft', 'trainer'))


def fly(aircraft, seconds=0.3, **settings):
    flight = simulation.start(
        aircraft, Settings(chordwise=2, **settings), airspeed=15.0, altitude=100.0)
    while flight.snapshot.time < seconds:
        flight.step(flight.trim)
    return flight


@pytest.fixture(scope='module')
def flight(trainer):
    return fly(trainer)


def seen(flight, **layout):
    found = Views(flight.model, topics.layout(flight, **layout), 5.0).markers(flight)['markers']
    assert len({marker['ns'] for marker in found}) == len(found)
    return {marker['ns']: marker for marker in found}


def test_the_aircraft_has_its_size_and_stands_about_its_centre_of_gravity(trainer, flight):
    """Wing from tip to tip, leading edge ahead of base_link by the centre of gravity's x."""
    strips = seen(flight)['strips']['points']
    n = sum(surface.strips for surface in trainer.surfaces)
    assert strips.shape == (6 * n, 3)
    wing = strips[:6 * trainer.surfaces[0].strips]
    assert (wing[:, 1].min(), wing[:, 1].max()) == pytest.approx((-1.6, 1.6))
    assert wing[:, 0].max() == pytest.approx(0.19)
    assert wing[:, 0].min() == pytest.approx(0.19 - 0.4)
    assert wing[:, 2].max() == pytest.approx(0.05 + 0.07)
    fin = strips[-6 * trainer.surfaces[2].strips:]
    assert fin[:, 2].max() == pytest.approx(0.40 + 0.05)
    assert np.ptp(fin[:, 1]) == 0.0
    triangles = strips.reshape(-1, 3, 3)
    area = 0.5 * np.linalg.norm(np.cross(
        triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    assert area.sum() == pytest.approx(flight.model.lattice.area.sum(), rel=1e-9)


def test_lift_points_up_at_quarter_chords_and_adds_up_to_the_weight(trainer, flight):
    lift = seen(flight)['lift']['points'].reshape(-1, 2, 3)
    layout = topics.layout(flight)
    assert lift[:, 0] == pytest.approx(layout.strip_place)
    wing = lift[:trainer.surfaces[0].strips]
    arrows = wing[:, 1] - wing[:, 0]
    assert (arrows[:, 2] > 0.0).all()
    # Across the airspeed: at alpha its tip stands forward by tan alpha.
    assert arrows[:, 0] / arrows[:, 2] == pytest.approx(math.tan(flight.snapshot.alpha), rel=1e-2)
    # A lift of the weight over the span is LIFT_LENGTH spans long; a tail carries a little.
    widths = flight.model.lattice.strip_width[:, None]
    sum_z = float(np.sum((lift[:, 1] - lift[:, 0]) * widths, axis=0)[2])
    span = trainer.reference.span
    assert sum_z / (views.LIFT_LENGTH * span * span) == pytest.approx(
        flight.snapshot.load_factor, rel=0.02)
    assert -flight.snapshot.force_B[2] == pytest.approx(
        trainer.mass.mass * GRAVITY, rel=0.02)


def test_the_wake_lies_behind_in_map_and_begins_at_the_trailing_edges(flight):
    """Flying north at 100 m: y is forward. Nodes stay where they were shed."""
    marker = seen(flight)['wake']
    assert marker['header']['frame_id'] == 'map' and not marker['frame_locked']
    points, position = marker['points'], flight.snapshot.body.position_N
    assert points[:, 1].max() < position[0]
    assert points[:, 1].max() > position[0] - 1.5    # the wing's trailing edge
    # It is as long as asked for behind the tail, whose trailing edge is 1.3 m behind.
    assert points[:, 1].min() == pytest.approx(
        position[0] - 1.3 - flight.model.wake_length, abs=0.5)
    assert points[:, 2] == pytest.approx(np.full(len(points), 100.0), abs=1.5)
    nodes = flight.state.flow.wake.moving_A.shape[1]
    strips = flight.model.lattice.strips
    rows = views.WAKE_ROWS
    assert len(points) == 2 * ((rows - 1) * nodes + rows * strips)


def test_a_frozen_wake_is_drawn_behind_the_body_too(trainer, flight):
    frozen = fly(trainer, wake=Shape.FROZEN)
    apart = (seen(frozen)['wake']['points'].mean(axis=0)
             - seen(flight)['wake']['points'].mean(axis=0))
    assert apart == pytest.approx(np.zeros(3), abs=0.2)


def test_stalled_strips_are_red_and_loaded_ones_are_darker(flight):
    layout, snapshot = topics.layout(flight), flight.snapshot
    stalled = np.zeros(len(layout.strip_names))
    stalled[3] = 1.0
    snapshot = replace(snapshot, strips=replace(
        snapshot.strips, stalled=stalled, cl=np.linspace(-0.5, 1.0, len(stalled))))
    colours = views.strip_colours(snapshot, layout)
    assert colours[3] == pytest.approx(views.STALLED)
    rest = np.delete(colours, 3, axis=0)
    assert (rest[:, 0] < views.STALLED[0]).all() and rest[-1, 2] < views.IDLE[2]


def test_negative_lift_has_a_colour_of_its_own_and_its_lines_point_down(flight):
    """Of as much lift upwards and downwards: as deep, and told apart in every channel of two."""
    layout, snapshot = topics.layout(flight), flight.snapshot
    least = layout.strip_cl_max
    up, down, none = (views.strip_colours(replace(snapshot, strips=replace(
        snapshot.strips, cl=share * least, stalled=np.zeros(len(least)))), layout)
        for share in (0.8, -0.8, 0.0))
    assert none == pytest.approx(np.tile(views.IDLE, (len(least), 1)))
    assert (np.abs(up - down)[:, :2] > 0.1).all()
    assert (np.abs(down - np.array(views.STALLED))[:, 2] > 0.4).all()
    flight = SimpleNamespace(model=flight.model, state=flight.state, snapshot=replace(
        snapshot, strips=replace(snapshot.strips, circulation=-snapshot.strips.circulation)))
    lines = seen(flight)['lift']['points'].reshape(-1, 2, 3)[:20]
    assert (lines[:, 1, 2] < lines[:, 0, 2]).all()


@pytest.mark.parametrize(('control', 'place', 'axis', 'sign'), [
    ('elevator', np.array([-1, 0, 0]), 2, -1),   # trailing edge down
    ('rudder', np.array([-1, 0, 0]), 1, 1),      # trailing edge left
    ('aileron', np.array([0, 1, 0]), 2, -1),     # on the left: down
    ('aileron', np.array([0, -1, 0]), 2, 1),     # on the right: up
])
def test_a_positive_control_moves_its_trailing_edge_as_the_signs_say(
        trainer, control, place, axis, sign):
    index = trainer.control_names.index(control)
    deflections = np.zeros(len(trainer.control_names))
    neutral = silhouette.movables(trainer, trainer.mixing @ deflections)
    deflections[index] = 0.2
    moved = silhouette.movables(trainer, trainer.mixing @ deflections)
    shifts = [(a, b - a) for a, b in zip(neutral, moved)
              if np.any(a != b) and (a.mean(axis=0) @ place) > 0.0]
    assert shifts
    for quad, shift in shifts:
        assert np.abs(shift[:2]).max() < 0.01 * np.abs(shift).max() + 2e-3   # the hinge stays
        # The other corners go down the chord behind the hinge times sin of the deflection.
        chord = np.linalg.norm(quad[3] - quad[0])
        assert shift[3][axis] * sign == pytest.approx(chord * math.sin(0.2), rel=0.1)
        assert abs(shift[3][axis]) > 3.0 * abs(np.delete(shift[3], axis)).max()


def test_frames_lifetimes_and_sizes_are_as_viewers_need_them(flight):
    found = seen(flight, map_frame='world', base_frame='left/base_link')
    assert found['wake']['header']['frame_id'] == 'world'
    for name in ('body', 'strips', 'lift', 'controls'):
        assert found[name]['header']['frame_id'] == 'left/base_link'
        assert found[name]['frame_locked']
    for name, marker in found.items():
        lines = marker['type'] == LINE_LIST
        assert len(marker['points']) % (2 if lines else 3) == 0
        assert ('colors' not in marker) or len(marker['colors']) == len(marker['points'])
        assert marker['color'] and marker['scale']['x'] > 0.0
        assert marker['pose']['orientation'] == {'w': 1.0}
        # What was measured vanishes after five periods, the aircraft stays.
        assert marker.get('lifetime') == ({'sec': 1, 'nanosec': 0} if lines else None), name
        assert np.isfinite(marker['points']).all()
    assert {marker['header']['stamp']['nanosec'] for marker in found.values()} == {
        flight.snapshot.time_ns}
    # As bytes a message is small enough for five a second.
    markers = Views(flight.model, topics.layout(flight), 5.0).markers(flight)
    assert len(cdr.serialize(topics.MARKERS.type, markers)) < 120_000


def test_the_path_is_thinned_evenly_ends_here_and_begins_again_with_the_flight(
        trainer, monkeypatch):
    monkeypatch.setattr(views, 'PATH_POSES', 8)
    flight = fly(trainer, seconds=0.0)
    seen = Views(flight.model, topics.layout(flight), 5.0)
    seen.follow(flight)
    times = []
    for _ in range(400):
        snapshot = flight.step(flight.trim)
        seen.follow(flight)
        path = seen.path(flight)
        times = [p['header']['stamp']['sec'] + 1e-9 * p['header']['stamp']['nanosec']
                 for p in path['poses']]
        assert len(times) <= 8 + 1
        assert times[0] == 0.0 and times[-1] == pytest.approx(snapshot.time)
        assert np.ptp(np.diff(times)[:-1]) < 0.1 if len(times) > 3 else True
    assert path['header']['frame_id'] == 'map'
    places = np.array([p['pose']['position']['y'] for p in path['poses']])
    assert places == pytest.approx(15.0 * np.array(times), abs=0.2)
    flight.reset()
    flight.step(Controls(flight.trim.deflections, flight.trim.throttle))
    seen.follow(flight)
    again = seen.path(flight)['poses']
    assert len(again) == 2 and again[0]['pose']['position']['y'] < 1.0

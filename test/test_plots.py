# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Figures are drawn from bags, ours or anyone's, and say what the flight did."""

import json
import math
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
import wings

matplotlib = pytest.importorskip('matplotlib', reason='figures need matplotlib')
rosbags = pytest.importorskip('rosbags', reason='bags need rosbags')

from matplotlib.colors import to_rgb  # noqa: E402
from matplotlib.image import imread  # noqa: E402
from matplotlib.text import Text  # noqa: E402
from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

from poststall_sim import cli, definition, plots, silhouette, survey  # noqa: E402
from poststall_sim.aero import model as models  # noqa: E402
from poststall_sim.plots import derivatives, modes, style, trajectory  # noqa: E402
from poststall_sim.plots import flight as flights  # noqa: E402
from poststall_sim.plots.bag import extremes, flight_data  # noqa: E402
from poststall_sim.plots.lookup import Lookup  # noqa: E402
from poststall_sim.recording import BagError  # noqa: E402

FIGURES = ['summary', 'trajectory', 'elevator_alpha', 'rudder_beta', 'strip_cl', 'history']


@pytest.fixture(scope='module')
def flown(tmp_path_factory):
    """Fly into the stall and out of it, return the bag and what the flight said of itself."""
    folder = tmp_path_factory.mktemp('flown')
    assert cli.main(['fly', '--record', str(folder / 'bag'), '--duration', '10.5',
                     '--json', str(folder / 'fly.json')]) == 0
    return folder / 'bag', json.loads((folder / 'fly.json').read_text())


@pytest.fixture(scope='module')
def data(flown):
    return flight_data(flown[0])


@pytest.fixture(scope='module')
def figures(flown):
    paths = plots.flight_figures(flown[0], flown[0].parent / 'new' / 'folder')
    return {path.stem: path for path in paths}


def has_colour(path, colour, pixels):
    """Tell whether so many pixels have a colour, to within anti-aliasing."""
    image = imread(path)[..., :3]
    return np.count_nonzero(np.abs(image - to_rgb(colour)).max(axis=-1) < 0.03) >= pixels


def test_every_figure_is_drawn_and_shows_something(figures):
    assert list(figures) == FIGURES
    for path in figures.values():
        image = imread(path)[..., :3]
        assert image.shape[0] > 600 and image.shape[1] > 1000
        inked = np.count_nonzero(image.min(axis=-1) < 0.95) / image[..., 0].size
        assert 0.01 < inked < 0.5, path.name
        colours = (image * 255).astype(np.int64) @ [1, 256, 256 ** 2]
        assert len(np.unique(colours)) > 50


def test_stall_is_visible_in_the_figures(figures):
    for name in ('summary', 'trajectory', 'strip_cl'):
        assert has_colour(figures[name], style.STALLED, 150), name
        assert has_colour(figures[name], style.ATTACHED, 150), name


def test_what_is_drawn_is_what_was_flown(flown, data):
    series = {key: np.array(values) for key, values in flown[1]['series'].items()}
    for drawn, key in ((np.degrees(data.alpha), 'alpha_deg'), (data.airspeed, 'airspeed_m_s'),
                       (np.degrees(data.pitch), 'pitch_deg'), (data.sink_rate, 'sink_rate_m_s'),
                       (data.position[:, 2], 'altitude_m'), (data.position[:, 1], 'north_m'),
                       (np.degrees(data.deflections['elevator']), 'elevator_deg'),
                       (data.lift, 'CL')):
        np.testing.assert_allclose(
            np.interp(series['time_s'], data.time, drawn), series[key],
            atol=1e-6 * max(np.abs(series[key]).max(), 1.0), err_msg=key)


def test_a_bag_without_stalls_has_those_of_its_aircraft(flown, data, monkeypatch):
    """From the angles at which the sections work, shifted by the deflected ailerons."""
    column = Lookup.column
    monkeypatch.setattr(Lookup, 'column', lambda bag, topic, *keys: None if topic in (
        'strip_stalled', 'strip_cl_max') else column(bag, topic, *keys))
    found = flight_data(flown[0]).strips
    np.testing.assert_array_equal(found.stalled, data.strips.stalled)
    np.testing.assert_allclose(found.cl_max, data.strips.cl_max)
    assert found.stalled.any()


def test_stalled_strips_are_found_as_the_solver_found_them(flown, data):
    series = flown[1]['series']
    told = dict(zip(np.round(series['time_s'], 6), series['stalled_wing_strips']))
    strips = data.strips
    compared = [(told[t], int(row.sum())) for t, row in
                zip(np.round(strips.time, 6), strips.stalled[:, strips.wing]) if t in told]
    assert len(compared) > 100
    assert max(count for count, _ in compared) >= 10
    assert all(one == other for one, other in compared)
    deepest = strips.deepest()
    most = strips.stalled[:, strips.wing].sum(axis=1).max()     # some between what is told
    assert strips.stalled[deepest, strips.wing].sum() == most
    assert 0 <= most - max(count for count, _ in compared) <= 1
    assert strips.recovered()


def test_attached_flow_at_any_angle_is_not_called_stalled(tmp_path):
    assert cli.main(['fly', '--record', str(tmp_path / 'bag'), '--duration', '6.5',
                     '--no-decambering']) == 0
    flight = flight_data(tmp_path / 'bag')
    assert np.degrees(flight.strips.alpha).max() > 20.0
    assert not flight.strips.stalled.any() and flight.strips.deepest() is None
    assert flight.notes == ('flown without decambering: attached flow at any angle',)


def test_the_lift_coefficient_is_that_of_the_air_that_was_flown_in(tmp_path, monkeypatch):
    """25 K warmer than standard, where the standard density is 9 % too much."""
    assert cli.main(['fly', '--record', str(tmp_path / 'bag'), '--duration', '1.5', '--json',
                     str(tmp_path / 'fly.json'), '--temperature-offset', '25']) == 0
    flight = flight_data(tmp_path / 'bag')
    flown = json.loads((tmp_path / 'fly.json').read_text())['series']
    expected = np.interp(flight.time, flown['time_s'], flown['CL'])
    # The points of the series lie between those of the bag.
    np.testing.assert_allclose(flight.lift, expected, rtol=2e-3)
    assert not any('standard atmosphere' in note for note in flight.notes)
    monkeypatch.setattr(Lookup, 'diagnostics', lambda bag: [])   # of another simulator
    foreign = flight_data(tmp_path / 'bag', flight.aircraft)
    assert foreign.lift / expected == pytest.approx(np.full(len(expected), 0.918), abs=5e-3)
    assert any(note.startswith('CL in the standard atmosphere') for note in foreign.notes)


def test_surfaces_are_told_apart_without_knowing_the_aircraft(flown, data, monkeypatch):
    def unknown(*_):
        raise definition.ConfigError('not here')
    monkeypatch.setattr(definition, 'find', unknown)
    blind = flight_data(flown[0])
    assert [group.strips for group in blind.strips.groups] \
        == [group.strips for group in data.strips.groups]
    assert [group.name for group in data.strips.groups] == ['wing', 'tail', 'fin']
    assert blind.strips.groups[0].name == 'wing'
    assert blind.strips.span == pytest.approx(3.2)
    assert blind.strips.wing_area == pytest.approx(1.28, rel=0.01)
    np.testing.assert_array_equal(blind.strips.stalled, data.strips.stalled)
    assert any('trainer is not known here' in note for note in blind.notes)
    # The lift coefficient then is made with the area of the strips.
    np.testing.assert_allclose(blind.lift, data.lift, rtol=0.01)


def test_extremes_are_those_of_the_flight(flown, data):
    found, series = extremes(data), flown[1]['series']
    assert found['alpha_max_deg'] == pytest.approx(max(series['alpha_deg']))
    assert found['altitude_min_m'] == pytest.approx(min(series['altitude_m']))
    assert found['stalled_wing_share_max'] == data.strips.stalled_share.max()
    # Between the instants of the one and the other a strip may come or go.
    assert found['stalled_wing_share_max'] == pytest.approx(
        max(series['stalled_wing_strips']) / 20, abs=1.0 / 20)


def foreign_bag(path, topics, storage=StoragePlugin.SQLITE3, start_ns=1_700_000_000_000_000_000):
    """Write a bag as anyone may: topics by name with type and (time [s], fields) pairs."""
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=storage) as writer:
        for name, (kind, rows) in topics.items():
            connection = writer.add_connection(name, kind, typestore=store)
            for seconds, fields in rows:
                message = store.types[kind](**fields(store, seconds))
                writer.write(connection, start_ns + round(2e9 * seconds),
                             store.serialize_cdr(message, kind))


def header(store, seconds):
    stamp = store.types['builtin_interfaces/msg/Time'](
        sec=int(seconds), nanosec=round(seconds % 1.0 * 1e9))
    return store.types['std_msgs/msg/Header'](stamp=stamp, frame_id='map')


def circling(store, seconds):
    """Fly a circle to the left of 50 m radius, one turn in 10 s, wings level."""
    kinds, angle = store.types, 2.0 * math.pi * seconds / 10.0
    heading = angle + 0.5 * math.pi
    return {'header': header(store, seconds), 'pose': kinds['geometry_msgs/msg/Pose'](
        position=kinds['geometry_msgs/msg/Point'](
            x=50.0 * math.cos(angle), y=50.0 * math.sin(angle), z=100.0 - seconds),
        orientation=kinds['geometry_msgs/msg/Quaternion'](
            x=0.0, y=0.0, z=math.sin(0.5 * heading), w=math.cos(0.5 * heading)))}


def strips(values):
    def fields(store, seconds):
        layout = store.types['std_msgs/msg/MultiArrayLayout'](dim=[], data_offset=0)
        return {'layout': layout, 'data': np.array(values(seconds), dtype=float)}
    return fields


TIMES = np.arange(0.0, 10.01, 0.1)


@pytest.mark.parametrize('storage', list(StoragePlugin))
def test_someone_elses_bag_with_poses_only(tmp_path, storage):
    foreign_bag(tmp_path / 'bag', {'/glider/pose': (
        'geometry_msgs/msg/PoseStamped', [(t, circling) for t in TIMES])}, storage)
    flight = flight_data(tmp_path / 'bag')
    assert flight.time[-1] == pytest.approx(10.0)
    np.testing.assert_allclose(flight.sink_rate, 1.0, atol=1e-6)
    # The nose points along the path: base_link is x forward in a map of x east, y north.
    velocity = np.gradient(flight.position, flight.time, axis=0)[1:-1, :2]
    along = np.einsum('ij,ij->i', flight.attitude[1:-1, :2, 0], velocity)
    np.testing.assert_allclose(along, np.linalg.norm(velocity, axis=1), rtol=1e-6)
    assert [path.stem for path in plots.flight_figures(tmp_path / 'bag', tmp_path)] \
        == ['trajectory', 'history']
    assert any('strip_cl' in note and 'joint_states' in note for note in flight.notes)


def test_someone_elses_bag_with_strips_only(tmp_path):
    def lift(seconds):
        return np.cos(np.linspace(-1.5, 1.5, 8)) * (0.5 + 0.1 * seconds)
    kind = 'std_msgs/msg/Float64MultiArray'
    foreign_bag(tmp_path / 'bag', {
        '/strip_cl': (kind, [(t, strips(lift)) for t in TIMES]),
        '/strip_y': (kind, [(0.0, strips(lambda _: np.linspace(3.5, -3.5, 8)))])})
    flight = flight_data(tmp_path / 'bag')
    assert flight.strips.span == pytest.approx(8.0)
    assert [path.stem for path in plots.flight_figures(tmp_path / 'bag', tmp_path)] \
        == ['strip_cl', 'history']
    assert any('not known' in note for note in flight.notes)


def test_a_bag_that_tells_its_stall_needs_no_aircraft(tmp_path):
    kind = 'std_msgs/msg/Float64MultiArray'
    foreign_bag(tmp_path / 'bag', {
        '/strip_cl': (kind, [(t, strips(lambda _: np.ones(8))) for t in TIMES]),
        '/strip_y': (kind, [(0.0, strips(lambda _: np.linspace(3.5, -3.5, 8)))]),
        '/strip_cl_max': (kind, [(0.0, strips(lambda _: np.full(8, 1.4)))]),
        '/strip_stalled': (kind, [
            (t, strips(lambda s: np.arange(8) < (6 if 4.0 < s < 6.0 else 0)))
            for t in TIMES])})
    found = flight_data(tmp_path / 'bag').strips
    assert 4.0 < found.time[found.deepest()] / 2.0 < 6.0   # no clock: time of recording
    assert found.stalled_share.max() == pytest.approx(0.75)
    np.testing.assert_allclose(found.cl_max, 1.4)


def test_a_lift_without_an_angle_of_attack_is_not_known(tmp_path):
    def force(store, seconds):
        kinds = store.types
        vector = kinds['geometry_msgs/msg/Vector3'](x=0.0, y=0.0, z=88.0)
        return {'header': header(store, seconds),
                'wrench': kinds['geometry_msgs/msg/Wrench'](force=vector, torque=vector)}
    foreign_bag(tmp_path / 'bag', {
        '/pose': ('geometry_msgs/msg/PoseStamped', [(t, circling) for t in TIMES]),
        '/wrench': ('geometry_msgs/msg/WrenchStamped', [(t, force) for t in TIMES]),
        '/air_data/airspeed': ('std_msgs/msg/Float64', [
            (t, lambda store, _: {'data': 15.0}) for t in TIMES])})
    flight = flight_data(tmp_path / 'bag', definition.aircraft(
        definition.find('aircraft', 'trainer')))
    assert flight.airspeed is not None and flight.alpha is None and flight.lift is None


def test_one_aircraft_of_several_is_not_told_by_what_another_reports(tmp_path):
    def reports(name, hardware):
        def fields(store, seconds):
            kinds = store.types
            return {'header': header(store, seconds), 'status': [
                kinds['diagnostic_msgs/msg/DiagnosticStatus'](
                    level=0, name=name, message='', hardware_id=hardware, values=[])]}
        return fields
    foreign_bag(tmp_path / 'bag', {
        '/pose': ('geometry_msgs/msg/PoseStamped', [(t, circling) for t in TIMES]),
        '/left/pose': ('geometry_msgs/msg/PoseStamped', [(t, circling) for t in TIMES]),
        '/diagnostics': ('diagnostic_msgs/msg/DiagnosticArray', [
            (0.0, reports('left/simulator: flight', 'glider')),
            (0.1, reports('simulator: flight', 'trainer'))])})
    flight = flight_data(tmp_path / 'bag')
    assert flight.name == 'trainer' and list(flight.reported) == ['simulator: flight']
    assert any(note.startswith('several aircraft in the bag') for note in flight.notes)


def test_a_reset_begins_a_new_flight(tmp_path):
    foreign_bag(tmp_path / 'bag', {'/pose': (
        'geometry_msgs/msg/PoseStamped',
        [(t, circling) for t in TIMES]
        + [(10.0 + t, lambda store, s: circling(store, s - 10.0)) for t in TIMES[1:31]])})
    flight = flight_data(tmp_path / 'bag')
    assert (flight.time[0], flight.time[-1]) == pytest.approx((0.1, 3.0))
    assert any('jumps back' in note for note in flight.notes)


def test_a_bag_without_a_flight_is_refused(tmp_path):
    foreign_bag(tmp_path / 'bag', {'/camera': ('std_msgs/msg/Float64', [
        (0.0, lambda store, _: {'data': 1.0})])})
    with pytest.raises(BagError, match=r'no flight in the bag: expected one of odom, .*/camera'):
        plots.flight_figures(tmp_path / 'bag', tmp_path)


@pytest.fixture
def drawn(monkeypatch):
    """Return the figures that are drawn from here on, still to be looked into."""
    kept, canvas = [], style.canvas

    @contextmanager
    def keeping(*size_and_path):
        with canvas(*size_and_path) as figure:
            kept.append(figure)
            yield figure

    monkeypatch.setattr(style, 'canvas', keeping)
    return kept


def test_an_aircraft_is_drawn_in_the_axes_of_its_file(tmp_path, drawn):
    """What has a place in the file is drawn there; the nose up, and to the left from the left."""
    model = models.build(wings.shipped_aircraft('canard'))
    plots.aircraft_figure(model, survey.survey(model), tmp_path / 'canard.png')
    figure, = drawn
    above, _, ahead, left = figure.axes
    engine, cg = model.aircraft.engines[0].position_G, model.aircraft.mass.cg_G
    for axes, (across, up), inverted, words in (
            (above, (1, 0), (False, True), ('y, to the right [m]', 'x, aft [m]')),
            (ahead, (1, 2), (True, False), ('y, to the right [m]', 'z, up [m]')),
            (left, (0, 2), (False, False), ('x, aft [m]', 'z, up [m]'))):
        there = {line.get_label(): line.get_xydata()[0] for line in axes.lines
                 if len(line.get_xydata())}
        for name, place in (('engine', engine), ('centre of gravity', cg)):
            assert there[name] == pytest.approx([place[across], place[up]], abs=1e-12)
        assert (axes.xaxis_inverted(), axes.yaxis_inverted()) == inverted
        assert (axes.get_xlabel(), axes.get_ylabel()) == words
    # The foreplane's leading edge and the fin's top are the ends of what is drawn of surfaces.
    points = np.concatenate([path.vertices for each in left.collections[1:]
                             for path in each.get_paths()])
    sections = [section.leading_edge_G for surface in model.aircraft.surfaces
                for section in surface.sections]
    assert points[:, 0].min() == pytest.approx(min(x for x, _, _ in sections), abs=1e-9)
    assert points[:, 1].max() == pytest.approx(max(z for _, _, z in sections), abs=1e-9)


def test_why_a_strip_may_exceed_its_section_is_said_where_it_may(data, tmp_path, drawn):
    """Of the closure that averages along the span, and where the line is drawn."""
    instant = replace(data, time=data.time[:1], alpha=None, position=None, beta=None)
    local = replace(instant, strips=replace(data.strips, averaged=False))
    for flight, said in ((instant, True), (local, False)):
        assert [path.stem for path in flights.draw_flight(flight, tmp_path)] == ['strip_cl']
        words = ' '.join(text.get_text() for text in drawn.pop().findobj(Text))
        assert ('One strip may lie above' in words) == said


def test_silhouette_has_the_aircrafts_size_and_looks_forward():
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    points = np.concatenate(silhouette.of_aircraft(trainer))
    assert np.ptp(points[:, 1]) == pytest.approx(3.2)
    # The centre of gravity is the origin; nose ahead, fin behind and above.
    assert points[:, 0].max() > 0.2 and points[:, 0].min() == pytest.approx(0.19 - 1.49)
    assert points[np.argmax(points[:, 2]), 0] < -1.0
    assert np.ptp(np.concatenate(silhouette.generic(5.0, 0.5))[:, 1]) == pytest.approx(5.0)


def test_flight_goes_from_left_to_right_whatever_its_course():
    for course in np.radians([0.0, 75.0, 160.0, 250.0, 340.0]):
        path = np.outer(np.linspace(0.0, 100.0, 20),
                        [math.sin(course), math.cos(course), -0.1])
        camera = trajectory.camera(path)
        right = np.cross(-camera, [0.0, 0.0, 1.0])
        assert path[-1] @ right > 50.0


def polar_result(tmp_path, *options):
    path = tmp_path / 'polar.json'
    assert cli.main(['polar', '--alpha', '0:24:4', '--json', str(path), *options]) == 0
    return json.loads(path.read_text())


def test_polar_is_drawn_with_its_stall(tmp_path):
    path = plots.polar_figure(polar_result(tmp_path), tmp_path / 'polar.png')
    assert has_colour(path, style.STALLED, 100) and has_colour(path, style.ATTACHED, 100)


def test_trims_are_drawn_with_those_that_fail(tmp_path):
    path = tmp_path / 'trim.json'
    assert cli.main(['trim', '--airspeed', '6:18:4', '--alpha', '0:40:10',
                     '--json', str(path)]) == 0
    figure = plots.trim_figure(json.loads(path.read_text()), tmp_path / 'trim.png')
    assert has_colour(figure, style.ATTACHED, 100) and has_colour(figure, style.STALLED, 50)


def test_of_each_control_its_own_moment_is_drawn_where_the_first_point_has_none():
    def point(**known):
        names = ('CL_alpha', 'CL_aileron', 'Cl_aileron', 'Cm_aileron', 'Cn_aileron',
                 'CL_elevator', 'Cl_elevator', 'Cm_elevator', 'Cn_elevator')
        return {'derivatives': {name: known.get(name) for name in names}}
    assert derivatives.by_controls([point(), point(
        Cl_aileron=-0.3, Cn_aileron=0.02, Cl_elevator=0.0, Cm_elevator=-1.2)]) == (
        'Cl_aileron', 'Cm_elevator')


def test_modes_are_drawn_with_what_is_unstable_and_what_is_wake(tmp_path):
    path = tmp_path / 'modes.json'
    assert cli.main(['modes', '--alpha', '2:20:9', '--decambering', 'all', '--panels', '2',
                     '--strips', 'wing=8', '--strips', 'tail=4', '--strips', 'fin=3',
                     '--json', str(path)]) == 0
    result = json.loads(path.read_text())
    figure = plots.modes_figure(result, tmp_path / 'modes.png')
    assert has_colour(figure, modes.SHADE, 1000)
    for colour in (style.ATTACHED, style.STALLED, style.SECOND):
        assert has_colour(figure, colour, 100)
    drawn = modes.branches(result['points'])
    assert {each.model for each in drawn} == {'fixed', 'variable', 'lagged'}
    assert not any(each.name.startswith('wake') for each in drawn)


def test_modes_of_a_sweep_with_holes_are_drawn(tmp_path):
    """A trim that failed, a branch of one point, a split pair."""
    def mode(name, real, imag=0.0, share=1.0):
        return {'name': name, 'real': real, 'imag': imag, 'share': share}

    sets = [[mode('phugoid', -0.1, 0.5), mode('spiral', 0.1)], [],
            [mode('phugoid, fast', -0.3), mode('phugoid, slow', 0.1),
             mode('roll', -5.0, share=0.2)]]
    points = [{'alpha_deg': 2.0 * i, 'decambering': 'variable', 'modes': each}
              for i, each in enumerate(sets)]
    for chosen in (points, points[:1], points[1:2]):
        path = plots.modes_figure({'aircraft': 'glider', 'points': chosen}, tmp_path / 'm.png')
        assert path.stat().st_size > 10_000
    assert [each.classical for each in modes.branches(points)] == [
        'phugoid', 'spiral', 'phugoid', 'phugoid', 'roll']

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A report holds the flight or the polar that it is of, and asks for nothing but itself."""

import html.parser
import json
import re
import sys
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest
from browsers import SCREENS, Tab, chromium

pytest.importorskip('plotly', reason='reports need plotly')
pytest.importorskip('rosbags', reason='bags need rosbags')

from poststall_sim import __version__, cli, definition, recording
from poststall_sim.plots.bag import flight_data
from poststall_sim.report import flight as flights
from poststall_sim.report import page as pages
from poststall_sim.report import polar as polars

VOID = {'meta', 'link', 'input', 'br', 'hr', 'img'}


class Page(html.parser.HTMLParser):
    """What stands in a page: elements, whether they close, the text of each script."""

    def __init__(self, text):
        super().__init__()
        self.declared, self.elements, self.scripts, self.open = [], [], [], []
        self.said = ''
        self.feed(text)
        self.close()

    def handle_decl(self, decl):
        self.declared.append(decl)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == 'script':
            self.scripts.append('')

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1:] == ['script']:
            self.scripts[-1] += data
        else:
            self.said += data

    @property
    def data(self):
        return json.loads(self.scripts[0])


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Fly into the stall and out of it, sweep a polar; make a report of each."""
    folder = tmp_path_factory.mktemp('report')
    assert cli.main(['fly', '--record', str(folder / 'bag'), '--duration', '10',
                     '--json', str(folder / 'fly.json')]) == 0
    assert cli.main(['polar', '--alpha', '0:24:4', '--deflect', 'aileron=5', '--deflect',
                     'elevator=-5', '--json', str(folder / 'polar.json')]) == 0
    for name in ('bag', 'fly.json', 'polar.json'):
        output = (folder / name).with_suffix('.html')
        assert cli.main(['report', str(folder / name), '--output', str(output),
                         '--json', str(folder / f'said_{output.stem}.json')]) == 0
    return folder


@pytest.fixture(scope='module')
def series(folder):
    series = json.loads((folder / 'fly.json').read_text())['series']
    return {key: np.array(values) for key, values in series.items()}


@pytest.fixture(scope='module')
def of_bag(folder):
    return Page((folder / 'bag.html').read_text(encoding='utf-8'))


@pytest.fixture(scope='module')
def of_json(folder):
    return Page((folder / 'fly.html').read_text(encoding='utf-8'))


@pytest.fixture(scope='module')
def of_polar(folder):
    return Page((folder / 'polar.html').read_text(encoding='utf-8'))


def line_of(data, name):
    return np.array(next(line['values'] for panel in data['panels'] for line in panel['lines']
                         if line['name'] == name), dtype=float)


def test_the_page_is_whole_and_names_no_place_but_itself(folder, of_bag, of_json, of_polar):
    for page in (of_bag, of_json, of_polar):
        assert page.declared == ['DOCTYPE html'] and not page.open
        ids = [attributes['id'] for _, attributes in page.elements if 'id' in attributes]
        assert len(ids) == len(set(ids))
        for tag, attributes in page.elements:
            for key in ('src', 'href', 'action', 'srcset', 'poster'):
                assert attributes.get(key, 'data:,').startswith('data:'), (tag, key)
        # The browser itself is told to fetch nothing.
        policy = next(attributes['content'] for tag, attributes in page.elements
                      if attributes.get('http-equiv') == 'Content-Security-Policy')
        assert "default-src 'none'" in policy and 'http' not in policy
    assert (folder / 'bag.html').stat().st_size < 8e6


def test_histories_are_those_of_the_flight(of_bag, of_json, series):
    for page in (of_bag, of_json):
        data = page.data
        for name, key in (('alpha', 'alpha_deg'), ('beta', 'beta_deg'), ('pitch', 'pitch_deg'),
                          ('bank', 'roll_deg'), ('airspeed', 'airspeed_m_s'),
                          ('altitude', 'altitude_m'), ('CL', 'CL'), ('n', 'load_factor'),
                          ('elevator', 'elevator_deg'), ('throttle', 'throttle')):
            shown = np.interp(series['time_s'], data['x'], line_of(data, name))
            # five figures of the greatest value
            np.testing.assert_allclose(shown, series[key], err_msg=name,
                                       atol=1.1e-4 * max(np.abs(series[key]).max(), 1e-3))


def test_the_aircraft_stands_where_it_was_and_as_it_was(of_bag, of_json, series):
    for page in (of_bag, of_json):
        data = page.data
        view, frames = data['view'], data['frames']
        place, attitude = np.array(view['position']), np.array(view['attitude'])
        matrices = attitude.reshape(-1, 3, 3)
        np.testing.assert_allclose(matrices @ matrices.transpose(0, 2, 1),
                                   np.broadcast_to(np.eye(3), matrices.shape), atol=1e-3)

        def at(key, frames=frames):
            return np.interp(frames, series['time_s'], series[key])

        np.testing.assert_allclose(place, np.column_stack(
            [at('east_m'), at('north_m'), at('altitude_m')]), atol=2e-2)
        # map is east, north, up; base_link x forward, y left, z up
        nose, left = matrices[:, :, 0], matrices[:, :, 1]
        np.testing.assert_allclose(np.degrees(np.arcsin(nose[:, 2])), at('pitch_deg'), atol=0.5)
        np.testing.assert_allclose(np.degrees(np.arctan2(nose[:, 0], nose[:, 1])),
                                   at('yaw_deg'), atol=1.0)
        assert left[np.argmax(at('roll_deg')), 2] == left[:, 2].max()   # right wing down


def test_loading_is_that_of_the_strips(folder, of_bag):
    data = of_bag.data
    bag = recording.read(folder / 'bag')
    lift, stalled = bag['/strip_cl'], bag['/strip_stalled']
    np.testing.assert_allclose(data['frames'], lift.time, atol=1e-6)
    np.testing.assert_allclose(data['strips']['cl'], lift['data'], atol=1e-4)
    assert [[each == '1' for each in row] for row in data['strips']['stalled']] \
        == (stalled['data'] > 0.5).tolist()
    assert [(group['name'], group['begin'], group['end'], group['upright'])
            for group in data['strips']['groups']] \
        == [('wing', 0, 20, False), ('tail', 20, 28, False), ('fin', 28, 33, True)]


def off_the_curves(data, frame):
    """Return how far the operating points of wing and tail lie from their curves."""
    strips, found = data['strips'], []
    for curve, group in zip(data['curves'], strips['groups']):
        own = slice(group['begin'], group['end'])
        found += list(np.array(strips['cl'][frame][own]) - np.interp(
            strips['angle'][frame][own], curve['alpha'], curve['cl']))
    return np.abs(found)


def test_operating_points_of_attached_strips_lie_on_their_curves(of_bag, of_polar):
    # The averaging closure lets a strip lie beside its curve where that bends; at small angles
    # by some thousandths. A deflection that was forgotten would be 0.1 and more.
    flown, swept = of_bag.data, of_polar.data
    assert [curve['name'] for curve in flown['curves']] == ['wing', 'tail']
    for frame in (0, 20, 40):
        assert off_the_curves(flown, frame).max() < 5e-3
    assert off_the_curves(swept, 0).max() < 5e-3


def test_under_the_local_closure_every_strip_is_on_its_curve_past_the_stall_too(tmp_path):
    """Its condition, strip by strip; a flap that faded there would be degrees beside it."""
    path = tmp_path / 'local.json'
    assert cli.main(['polar', '--alpha', '18:22:2', '--closure', 'local', '--deflect',
                     'aileron=15', '--deflect', 'elevator=-15', '--json', str(path)]) == 0
    result = json.loads(path.read_text())
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    data = polars.of_json(result, trainer)
    assert data['curves'] and result['points'][-1]['stalled_strips'] > 5
    for frame in range(3):
        # The curves are drawn every quarter of a degree.
        assert off_the_curves(data, frame).max() < 3e-3


def test_curves_of_an_aircraft_with_its_strips_elsewhere_are_not_drawn(short):
    """It has as many: only where they stand says that it is another one."""
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    wing, *others = trainer.surfaces
    longer = replace(wing, sections=tuple(
        replace(each, leading_edge_G=tuple(np.multiply(each.leading_edge_G, (1.0, 1.1, 1.0))))
        for each in wing.sections))
    data = flights.of_bag(short, flight_data(
        short, replace(trainer, surfaces=(longer, *others))))
    assert data['curves'] == []
    assert any('the strips are not those of trainer' in note for note in data['notes'])


def first(events, kind):
    return next(float(event['at'].split()[0]) for event in events if event['kind'] == kind)


def test_events_are_when_they_happened(folder, of_bag, of_json, series):
    times, count = series['time_s'], series['stalled_wing_strips']
    begin, end = times[count > 0][0], times[count > 0][-1]
    for page in (of_bag, of_json):
        events = page.data['events']
        assert [event['kind'] for event in events].count('recovery') == 1
        # The strips of a bag come 20 times a second.
        assert first(events, 'stall') == pytest.approx(begin, abs=0.06)
        assert first(events, 'recovery') == pytest.approx(end, abs=0.07)
        assert begin < first(events, 'deepest') < end
        if page is of_json:
            summary = json.loads((folder / 'fly.json').read_text())['summary']
            # The summary looks at every step, the series at those of 50 Hz.
            assert first(events, 'deepest') == pytest.approx(
                summary['deepest_stall']['time_s'], abs=0.02)
        assert first(events, 'extreme') == pytest.approx(times[np.argmax(series['alpha_deg'])],
                                                         abs=0.021)
        assert f'{np.max(series["alpha_deg"]):.1f} deg' in page.said
        frames = page.data['frames']
        for event in events:
            assert frames[event['frame']] == pytest.approx(
                float(event['at'].split()[0]), abs=0.03)
            assert event['text'] in page.said
    assert json.loads((folder / 'said_bag.json').read_text())['events'] == of_bag.data['events']


def rows_of(data, title):
    return dict(next(rows for name, rows in data['tables'] if name == title))


@pytest.fixture(scope='module')
def short(tmp_path_factory):
    """Return the bag of a moment in the wind; its name has a dot in it."""
    bag = tmp_path_factory.mktemp('short') / 'run_1.5'
    assert cli.main(['fly', '--record', str(bag), '--duration', '0.2', '--wind', '1,-2,0.5',
                     '--turbulence', '0.3', '--seed', '7', '--ell', '1.5',
                     '--separation', 'lag']) == 0
    return bag


def test_a_page_has_the_whole_name_of_its_bag(short):
    assert cli.main(['report', str(short)]) == 0
    assert short.with_name('run_1.5.html').is_file()


def test_a_bag_tells_how_it_was_flown(folder, short):
    run = rows_of(flights.of_bag(short, flight_data(short)), 'Run')
    expected = {
        'poststall sim': __version__, 'aircraft': 'trainer', 'scenario': 'stall_and_recovery',
        'dt [s]': '0.008', 'closure': 'nonlocal', 'ell [chords]': '1.5', 'tolerance': '1e-05',
        'separation': 'lag', 'wind enu [m/s]': '1, -2, 0.5', 'turbulence': 'dryden',
        'turbulence vertical [m/s]': '0.3', 'turbulence seed': '7'}
    assert {key: run.get(key) for key in expected} == expected
    calm = rows_of(flights.of_bag(folder / 'bag', flight_data(folder / 'bag')), 'Run')
    assert (calm['turbulence'], calm['wind enu [m/s]']) == ('none', '0, 0, 0')


def test_figures_are_rounded_and_what_is_none_is_left_out(of_bag, of_json):
    for page in (of_bag, of_json):
        figures = rows_of(page.data, 'In figures')
        assert len(figures) > 10   # never the last digits of what is zero, as -5e-07
        assert all(re.fullmatch(r'-?\d+(\.\d{1,2})?', text) for text in figures.values()), figures
    told = of_json.data['tables']
    assert 'none' not in {text for _, rows in told for _, text in rows}
    assert 'temperature offset [K]' in rows_of(of_json.data, 'Atmosphere')   # no fixed density
    assert 'density [kg/m^3]' not in rows_of(of_json.data, 'Atmosphere')


def test_settings_have_their_units_and_as_many_figures_as_they_need():
    assert pages.table('air', {
        'alpha_rad': 0.1, 'engine_1_thrust_N': 3.0, 'lag_max_ms': 2.5,
        'sea_level_pressure_Pa': 101325.0})[1] == [
            ('alpha [rad]', '0.1'), ('engine 1 thrust [N]', '3'), ('lag max [ms]', '2.5'),
            ('sea level pressure [Pa]', '101325')]


def test_settings_are_in_the_page(of_bag, of_json, of_polar):
    for page in (of_bag, of_json, of_polar):
        assert 'trainer' in page.said and 'nonlocal' in page.said
        assert 'span [m]3.2' in page.said and 'Made by poststall_sim' in page.said
    assert 'iterations mean' in of_bag.said and 'converged1250' in of_bag.said
    assert 'scenariostall_and_recovery' in of_json.said
    assert 'aileron5' in of_polar.said


def test_a_polar_is_shown_point_by_point(folder, of_polar):
    points = json.loads((folder / 'polar.json').read_text())['points']
    data = of_polar.data
    assert data['frames'] == [0, 4, 8, 12, 16, 20, 24] and data['view'] is None
    for key in ('CL', 'CD', 'Cm', 'Cl'):
        np.testing.assert_allclose(line_of(data, key), [point[key] for point in points],
                                   rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(data['strips']['cl'], [point['strips']['cl'] for point in points],
                               atol=1e-4)
    stall = next(event for event in data['events'] if event['kind'] == 'stall')
    wing = [sum(point['strips']['stalled'][:20]) for point in points]
    assert stall['frame'] == next(k for k, stalled in enumerate(wing) if stalled)


def test_steps_that_did_not_converge_are_events(folder):
    result = json.loads((folder / 'fly.json').read_text())
    assert result['series']['not_converged_steps'][-1] == 0
    counted = np.zeros(len(result['series']['time_s']), dtype=int)
    counted[100:] += 3
    counted[200:] += 1
    result['series']['not_converged_steps'] = counted.tolist()
    times = result['series']['time_s']
    failures = [(event['at'], event['text']) for event in flights.of_json(result, None)['events']
                if event['kind'] == 'failure']
    assert failures == [(f'{times[100]:.2f} s', '3 steps not converged'),
                        (f'{times[200]:.2f} s', '1 step not converged')]


def test_a_long_flight_is_thinned_and_says_so(folder):
    result = json.loads((folder / 'fly.json').read_text())
    series = result['series']
    before = len(series['time_s'])
    again = 5 * before
    for key in series:
        series[key] *= 5
    series['time_s'] = np.linspace(0.0, 50.0, again).tolist()
    data = flights.of_json(result, None)
    assert len(data['frames']) == len(data['x']) == pages.MOST_INSTANTS < again
    assert (data['x'][0], data['x'][-1]) == (0.0, 50.0)
    assert f'thinned: 2000 of {again} samples of the histories are in this page' in data['notes']


def test_a_name_cannot_leave_its_place(folder):
    result = json.loads((folder / 'fly.json').read_text())
    result['aircraft'] = name = '</script><script>alert("$data")</script>'
    page = Page(pages.text(flights.of_json(result, None)))
    assert page.data['title'] == f'Flight of {name}'
    assert len(page.scripts) == 3 and not page.open
    assert page.said.count(name) == 4   # title, heading, settings, note


@pytest.mark.parametrize('content, complaint', [
    ('{"trims": []}', 'a report is of a bag, or of what fly or polar wrote as JSON'),
    ('{"aircraft": "trainer"', 'a report is of a bag'),
    ('[1, 2]', 'a report is of a bag'),
    ('{"aircraft": "trainer", "series": {"time_s": [0]}, "summary": {}}', 'is not whole'),
    ('{"aircraft": "trainer", "points": [], "sweep": "up", "deflections_deg": {}}',
     'is not whole')])
def test_what_is_no_report_is_refused_in_one_line(tmp_path, capsys, content, complaint):
    path = tmp_path / 'some.json'
    path.write_text(content)
    assert cli.main(['report', str(path)]) == 2
    said = capsys.readouterr().err
    assert complaint in said and said.count('\n') == 1
    assert not path.with_suffix('.html').exists()


def test_a_folder_that_is_no_bag_and_a_page_of_another_kind_are_refused(tmp_path, capsys):
    assert cli.main(['report', str(tmp_path / 'none')]) == 2
    assert 'there is no bag or JSON' in capsys.readouterr().err
    assert cli.main(['report', str(tmp_path)]) == 2
    assert 'it has no metadata.yaml' in capsys.readouterr().err
    other = tmp_path / 'mine.yaml'
    other.write_text('name: mine')
    assert cli.main(['report', str(other)]) == 2
    assert capsys.readouterr().err == (
        f'poststall: {other}: a report is of a bag, or of what fly or polar wrote as JSON\n')
    with pytest.raises(SystemExit, match='2'):
        cli.main(['report', str(tmp_path), '--output', str(tmp_path / 'page.pdf')])
    assert 'expected a name that ends in .html' in capsys.readouterr().err


def test_without_the_library_the_command_says_what_to_install(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'plotly.offline', None)
    assert cli.main(['report', str(folder / 'fly.json'),
                     '--output', str(folder / 'never.html')]) == 2
    assert 'pip install plotly' in capsys.readouterr().err


@pytest.fixture(scope='module')
def browser():
    yield from chromium()


@pytest.fixture
def opened(browser, folder):
    """Open reports in windows; at the end nothing was asked for and nothing was wrong."""
    with ExitStack() as tabs:
        def open_page(name, *size):
            tab = tabs.enter_context(Tab(browser, (folder / name).as_uri(), size))
            tab.until('document.getElementById("readouts").textContent !== ""')
            return tab

        yield open_page


LOADING = 'Array.from(document.getElementById("loading").data[0].y)'


@pytest.mark.browser
@pytest.mark.parametrize('size', SCREENS, ids=['desk', 'phone'])
def test_the_slider_moves_loading_points_aircraft_and_the_line_in_time(opened, of_bag, size):
    tab, data = opened('bag.html', *size), of_bag.data
    page = tab.page

    def shown():
        return page.evaluate(f"""[{LOADING},
            Array.from(document.getElementById("points").data[2].x),
            Array.from(document.getElementById("view").data[3].x),
            parseFloat(document.getElementById("instant").style.left),
            document.getElementById("readouts").textContent]""")

    def wait_for(frame):
        tab.until(f'{LOADING}[0] === {data["strips"]["cl"][frame][0]}')

    deepest = next(event['frame'] for event in data['events'] if event['kind'] == 'deepest')
    wait_for(deepest)
    before = shown()
    page.focus('#slider')
    page.keyboard.press('Shift+ArrowRight')
    wait_for(deepest + 10)
    page.keyboard.press('ArrowRight')
    wait_for(deepest + 11)
    after = shown()
    wing = slice(0, 20)
    assert after[0] == data['strips']['cl'][deepest + 11][wing]
    assert after[1] == data['strips']['angle'][deepest + 11][wing]
    assert all(one != other for one, other in zip(before, after))
    # The middle of what is drawn is some metre beside the centre of gravity at most.
    assert np.mean(after[2]) == pytest.approx(data['view']['position'][deepest + 11][0],
                                              abs=1.5 * data['view']['scale'])
    page.locator('#events button.recovery').click()
    wait_for(next(event['frame'] for event in data['events'] if event['kind'] == 'recovery'))
    assert page.evaluate('document.documentElement.scrollWidth') == size[0]
    assert 'One strip may lie above the line' in page.text_content('#loading-hint')


@pytest.mark.browser
def test_histories_zoom_together_and_playing_goes_on(opened):
    tab = opened('bag.html', 1280, 800)
    page = tab.page
    page.evaluate('Plotly.relayout("histories", {"xaxis3.range": [4, 6]})')
    axes = page.evaluate("""Object.entries(document.getElementById("histories")._fullLayout)
        .filter(([key]) => key.startsWith("xaxis")).map(([, axis]) => Array.from(axis.range))""")
    assert len(axes) == 9 and all(axis == [4, 6] for axis in axes)
    slider = 'Number(document.getElementById("slider").value)'
    begin = page.evaluate(slider)
    page.click('#play')
    tab.until(f'{slider} > {begin + 4}')
    page.keyboard.press('ArrowLeft')   # whoever moves the slider takes over
    assert page.get_attribute('#play', 'aria-label') == 'play'


@pytest.mark.browser
@pytest.mark.parametrize('name, size, figures', [
    ('bag.html', SCREENS[0], ('view', 'loading', 'points', 'histories')),
    ('bag.html', SCREENS[1], ('view', 'loading', 'points', 'histories')),
    ('fly.html', SCREENS[1], ('view', 'histories')),
    ('polar.html', SCREENS[0], ('loading', 'points', 'histories'))])
def test_every_figure_draws_something(opened, name, size, figures):
    tab = opened(name, *size)
    tab.page.wait_for_timeout(500)   # the first picture of WebGL comes after the script's end
    for figure in figures:
        assert tab.inked(f'#{figure}') > 1000, figure
    assert tab.page.locator('section:visible').count() == len(figures) + 2

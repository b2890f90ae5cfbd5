# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""State space of a linear flight: the same motion as its system, whole, continuous and reduced."""

import dataclasses
import functools
import math
import sys
from pathlib import Path

import curves
import numpy as np
import pytest
from scipy import io, signal

from poststall_sim import __version__, definition, state_space_file, trim
from poststall_sim.aero.model import Settings, build
from poststall_sim.aircraft import ConfigError
from poststall_sim.stability import flight, motion, reduction
from poststall_sim.stability.motion import Decambering
from poststall_sim.stability.state_space import StateSpace

ALTITUDE = 0.0
KIND = Decambering.VARIABLE
ALPHAS = {'attached': 4.0, 'stalled': 20.0}


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """A trimmed trainer of a few strips, its system and the whole of it as state space."""

    model: object
    at: flight.Linearised
    full: StateSpace

    @property
    def system(self):
        return self.at.systems[KIND]


@functools.cache
def reduced_air(case, **asked):
    """Return a case with the air reduced to an order, or to an error."""
    return reduction.reduce(case.system, reference=case.model.aircraft.reference,
                            airspeed=case.at.trim.airspeed, **asked)


@pytest.fixture(scope='module')
def cases():
    machine = curves.with_strips(
        definition.aircraft(curves.CONFIG / 'aircraft' / 'trainer.yaml'), wing=8, tail=4, fin=3)
    model = build(machine, Settings(chordwise=2))
    found = {}
    for name, alpha in ALPHAS.items():
        at = flight.linearise(
            model, trim.glide(model, alpha=math.radians(alpha), altitude=ALTITUDE),
            altitude=ALTITUDE, decamberings=(KIND, Decambering.LAGGED))
        found[name] = Case(model, at, reduction.full(at.systems[KIND]))
    return found


@pytest.fixture(params=ALPHAS)
def case(cases, request):
    return cases[request.param]


def own_eigenvalues(system):
    """Return the eigenvalues of the body, without the heading and what dies as the wake does."""
    found = motion.spectrum(system)
    size = np.abs(found.eigenvalues)
    return found.eigenvalues[(found.participation > 0.8) & (size > 1e-4) & (size < 8.0)]


def simulated(space, inputs):
    """Return the outputs (k, p) of inputs (k, m), from rest."""
    return signal.dlsim(space.to_scipy(), inputs)[1]


def step_of(space, name, size, seconds):
    """Return inputs (k, m) of which one jumps to a size in the second step."""
    inputs = np.zeros((round(seconds / space.dt), len(space.inputs)))
    inputs[1:, space.inputs.index(name)] = size
    return inputs


def close(one, other, share):
    """Tell whether columns are as close as a share of the largest value in each of the other."""
    return (np.abs(one - other).max(axis=0) <= share * np.abs(other).max(axis=0)).all()


def test_whole_system_marches_from_a_disturbance(case):
    disturbed = np.array([0.3, 0.1, -0.2, 0.1, 0.2, -0.1, 0.02, 0.01, 0.05])
    x = np.concatenate([np.zeros(len(case.full.states) - 9), disturbed])
    marched = case.system.march(disturbed, 100)
    found = np.empty_like(marched)
    for k in range(101):
        found[k] = (case.full.c @ x)[:9]
        x = case.full.a @ x
    # Round-off of a hundred steps.
    assert close(found, marched, 1e-11)


def test_whole_system_answers_every_input_as_the_descriptor_does(case):
    """Inputs of the end of a step, at random, 0 at first; loads too, by SciPy's own march."""
    system = case.system
    inputs = np.random.default_rng(3).normal(size=(80, len(system.inputs)))
    inputs[0] = 0.0
    factors = motion.factorised(system.e)
    x, expected = np.zeros(system.size), []
    for u in inputs:
        x = factors.solve(system.a @ x + system.b @ u)
        expected.append(np.concatenate([x[system.own], x[system.split[-2]:system.split[-1]]]))
    assert close(simulated(case.full, inputs), np.array(expected), 1e-11)


def test_eigenvalues_are_those_of_the_spectrum(case):
    found = case.full.eigenvalues
    for each in own_eigenvalues(case.system):
        # Dense eigenvalues, next to the defective ones of the wake.
        assert np.abs(found - each).min() < 1e-7 * abs(each)


def test_continuous_form_is_what_the_trapezoidal_rule_makes_the_steps_of(case):
    space = case.full
    continuous, half = space.continuous(), 0.5 * space.dt
    assert continuous.dt is None
    s = np.array([0.2 + 1.0j, 10.0j, -3.0 + 5.0j])
    assert np.allclose(continuous.response(s), space.response((1.0 + s * half) / (1.0 - s * half)),
                       rtol=1e-7, atol=1e-9)
    found = continuous.eigenvalues
    for each in own_eigenvalues(case.system):
        expected = np.tanh(each * half) / half
        assert np.abs(found - expected).min() < 1e-7 * abs(each)
        # The leading term of the tanh, and as much again for the next.
        assert abs(expected - each) < 1.1 * abs(each) * abs(each * space.dt) ** 2 / 12.0


def test_continuous_body_obeys_its_equations_of_motion(case):
    """M s y = P L + R y whatever the flow does; throttle, half a step early, beside them."""
    body, space = case.system.body, case.full
    s = 1.0 + 4.0j
    (answer,) = space.continuous().response(np.array([s]))
    y, load = answer[:9], answer[9:]
    left = s * body.mass @ y - body.push @ load - body.rest @ y
    left[:, -1] -= body.throttle * (1.0 + 0.5 * s * space.dt)
    assert np.abs(left).max() < 1e-9 * np.abs(load).max()


def test_a_continuous_system_is_not_made_continuous_again():
    space = StateSpace(np.eye(1), np.eye(1), np.eye(1), np.eye(1), None, ('x',), ('u',), ('y',))
    with pytest.raises(ValueError, match='continuous already'):
        space.continuous()


def test_matrices_and_names_agree():
    with pytest.raises(ValueError, match='b is'):
        StateSpace(np.eye(1), np.eye(2), np.eye(1), np.eye(1), 0.1, ('x',), ('u',), ('y',))


@pytest.mark.parametrize('kind', [KIND, Decambering.LAGGED])
def test_error_falls_with_the_order(case, kind):
    """By more than a decade for twelve states; the flow stays stable, the aircraft as it is."""
    case = dataclasses.replace(case, at=dataclasses.replace(
        case.at, systems={KIND: case.at.systems[kind]}))
    own = own_eigenvalues(case.system)
    found = [reduced_air(case, order=order) for order in (12, 24, 36, 60)]
    errors = np.array([each.error for each in found])
    slow = np.array([each.eigenvalue_errors(own).max() for each in found])
    # As measured, with half as much again.
    assert (errors < [0.2, 1e-2, 1.1e-3, 5.5e-5]).all()
    assert (slow < [7e-2, 8e-3, 2.5e-3, 8e-5]).all()
    assert all(each.radius < 1.0 for each in found)


def test_error_holds_between_the_frequencies_it_was_found_at(case):
    """Of a motion of the whole aircraft that is forced through the band."""
    reduced = reduced_air(case, error=1e-4)
    z = np.exp(1j * np.linspace(0.03, 0.97, 15) * reduced.frequency * case.full.dt)
    one, other = reduced.space.response(z), case.full.response(z)
    # Each output by each input, over the largest in the band; the body amplifies near its modes.
    share = np.abs(one - other).max(axis=0) / np.abs(other).max(axis=(0, 2))[:, None]
    assert share.max() < 10.0 * 1e-4


def test_the_least_order_is_found_for_an_error(case):
    reduced = reduced_air(case, error=1e-3)
    assert reduced.error <= 1e-3
    assert reduced_air(case, order=reduced.order - 1).error > 1e-3
    assert reduced.order + 18 + 9 == len(reduced.space.states)


def test_an_unstable_aircraft_is_reduced(cases):
    """Past the stall it departs; the same departure is in the reduced one, within a thousandth."""
    case = cases['stalled']
    own = own_eigenvalues(case.system)
    departing = own[own.real > 0.1]
    assert len(departing)
    reduced = reduced_air(case, order=24)
    assert reduced.radius < 1.0
    assert reduced.eigenvalue_errors(departing).max() < 1e-3


# The jump itself has all frequencies: that of a gust is felt by the load at once, and by the
# quick part of the pitch rate, which soon is gone.
@pytest.mark.parametrize(('name', 'flown', 'felt'), [
    ('elevator', 3e-4, 5e-3), ('aileron', 2e-4, 8e-3), ('gust_w', 1e-2, 1e-1)])
def test_step_of_an_input(case, name, flown, felt):
    """Two seconds of motion and load after it; the order is that of an error of 1e-4."""
    inputs = step_of(case.full, name, 0.02, 2.0)
    reduced = reduced_air(case, error=1e-4)
    one, other = (simulated(space, inputs) for space in (reduced.space, case.full))
    moved = np.abs(other).max(axis=0) > 1e-6 * np.abs(other).max()
    for part, share in ((slice(0, 9), flown), (slice(9, 15), felt)):
        assert close(one[:, part][:, moved[part]], other[:, part][:, moved[part]], share)


def test_static_gains_are_kept_at_any_order(case):
    """At a frequency of a millionth of V/c, where the heading still is finite."""
    least = len(case.system.body.motion) + len(case.model.aircraft.controls)
    reduced = reduced_air(case, order=least)
    z = np.exp(1e-6j * np.array([reduced.frequency * case.full.dt]))
    one, other = reduced.space.response(z)[0], case.full.response(z)[0]
    assert np.abs(one - other).max() < 1e-4 * np.abs(other).max()
    assert reduced.error > 1e-2


def test_response_by_controls_is_that_of_the_rows(case):
    """The frequency response against which all is measured, from the rows that are marched."""
    system = case.system
    rows = motion.flow_rows(system.flow, system.share, system.kept)
    z = 0.97 + 0.1j
    expected = reduction._load_response(rows, z)
    assert np.abs(motion.load_response(system, z) - expected).max() < 1e-9 * np.abs(expected).max()


def test_what_cannot_be_reduced_is_refused(cases, monkeypatch):
    case = cases['attached']
    monkeypatch.setattr(reduction, 'MOST', 16)
    with pytest.raises(ConfigError, match='order 8: the air needs 9 states'):
        reduced_air(case, order=8)
    with pytest.raises(ConfigError, match='out of reach, the least was'):
        reduced_air(case, error=1e-15)
    growing = dataclasses.replace(
        case.at.systems[Decambering.LAGGED], kept=np.full_like(case.system.kept, 1.02))
    with pytest.raises(ConfigError, match='does not die out'):
        reduction.reduce(growing, reference=case.model.aircraft.reference,
                         airspeed=case.at.trim.airspeed)


@pytest.mark.parametrize('suffix', ['.npz', '.mat'])
@pytest.mark.parametrize('order', [None, 12])
def test_files_need_nothing_of_this_package(cases, tmp_path, suffix, order):
    case = cases['stalled']
    path = tmp_path / f'trainer{suffix}'
    space = state_space_file.export(path, case.model, case.at, decambering=KIND,
                                    altitude=ALTITUDE, order=order).space
    if suffix == '.npz':
        with np.load(path, allow_pickle=False) as file:
            read = {key: file[key] for key in file.files}
    else:
        read = {key: np.array([each.item() for each in value.ravel()])
                if value.dtype == object else value.squeeze()
                for key, value in io.loadmat(path).items() if not key.startswith('__')}
    for key in ('a', 'b', 'c', 'd', 'dt'):
        assert np.array_equal(read[key], getattr(space, key))
    for key in ('states', 'inputs', 'outputs'):
        assert tuple(read[key]) == getattr(space, key)
        assert len(read[key[:-1] + '_units']) == len(read[key])
    assert dict(zip(read['inputs'], read['input_units'])) == {
        'aileron': 'rad', 'elevator': 'rad', 'rudder': 'rad', 'gust_u': 'm/s', 'gust_v': 'm/s',
        'gust_w': 'm/s', 'throttle': '1'}
    assert dict(zip(read['outputs'], read['output_units']))['moment_y'] == 'N m'
    units = dict(zip(read['states'], read['state_units']))
    assert units['theta'] == 'rad' and units['q'] == 'rad/s'
    if order is None:
        assert (units['shift_x[0]'], units['turn_y[3]'], units['wake[2,1]']) == (
            'm', 'rad', 'm^2/s')
    assert 'x forward' in str(read['axes']) and str(read['version']) == __version__
    assert read['order'] == (-1 if order is None else order)
    at = case.at.trim
    assert read['trim_alpha'] == at.alpha and read['trim_airspeed'] == at.airspeed
    assert np.array_equal(read['trim_deflections'], at.controls.deflections)


def test_files_that_cannot_be_written_are_refused(cases, tmp_path):
    case = cases['attached']

    def export(path, at=case.at):
        return state_space_file.export(path, case.model, at, decambering=KIND, order=12,
                                       altitude=ALTITUDE)

    with pytest.raises(ConfigError, match=r'ends in \.npz or \.mat'):
        export(tmp_path / 'trainer.csv')
    with pytest.raises(ConfigError, match='cannot be written'):
        export(tmp_path / 'nowhere' / 'trainer.npz')
    at = dataclasses.replace(case.at, systems={}, message='at a fold')
    with pytest.raises(ConfigError, match='at a fold'):
        export(tmp_path / 'trainer.npz', at)
    assert not list(Path(tmp_path).iterdir())


def test_python_control_takes_it_with_its_names(case):
    control = pytest.importorskip('control')
    space = reduced_air(case, order=12).space
    found = space.to_control()
    assert found.dt == space.dt and tuple(found.output_labels) == space.outputs
    z = np.exp(0.2j)
    assert np.allclose(found(z), space.response(np.array([z]))[0], rtol=1e-9)
    assert control.isctime(space.continuous().to_control())


def test_without_python_control_it_says_what_to_install(monkeypatch):
    space = StateSpace(np.eye(1), np.eye(1), np.eye(1), np.eye(1), 0.1, ('x',), ('u',), ('y',))
    monkeypatch.setitem(sys.modules, 'control', None)
    with pytest.raises(ImportError, match=r"pip install '\.\[control\]'"):
        space.to_control()

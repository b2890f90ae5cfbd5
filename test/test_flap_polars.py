# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Tables of a section with its flap deflected: read at the strip's own angle, mixed between."""

import dataclasses
import math

import numpy as np
import pytest
import wings

from poststall_sim import definition, simulation, trim
from poststall_sim.aero import model as models
from poststall_sim.aero.plate import flap_effectiveness, flap_moment
from poststall_sim.aero.polars import moved, section_polar
from poststall_sim.aircraft import Airfoil, ConfigError
from poststall_sim.controls import Control, Effector
from poststall_sim.state import Controls, Status

HINGE, ROWS = 0.7, 4
DOWN = math.radians(15.0)
TAU, MOMENT = flap_effectiveness(ROWS, HINGE), flap_moment(ROWS, HINGE)
VISCOSITY = 1.5e-5
PLAIN = wings.stalling(0.0, 14.0)


def shifted(foil, by, cm=0.0):
    """Return the curves of a section at alpha + by, as a table at its own angles."""
    values = section_polar(foil).at(foil.alpha + by)[:, :3] + [0.0, 0.0, cm]
    values[-1] = values[0]
    return Airfoil(foil.name, foil.alpha, *values.T)


def flapped(deflection=DOWN, drag=0.04):
    """Return a table with the flap down: more lift, an earlier stall, more drag and moment."""
    made = wings.stalling(-math.degrees(TAU * deflection), 11.0)
    return dataclasses.replace(made, cd=made.cd + drag, cm=made.cm - 0.1 * np.cos(made.alpha) ** 2,
                               deflection=deflection)


def wing(*tables):
    """Return a wing whose outer halves have ailerons on the last 30 % of their chord."""
    ailerons = Control('aileron', (-0.5, 0.5), (
        Effector('wing', (0.5, 1.0), hinge=HINGE, side=1, gain=-1.0),
        Effector('wing', (0.5, 1.0), hinge=HINGE, side=-1, gain=1.0)))
    surface = wings.panel_wing(PLAIN, [(0, 0, 0), (0, 4, 0)], [1, 1], 16, symmetric=True)
    machine = wings.aircraft([surface], PLAIN, area=8.0, chord=1.0, span=8.0,
                             controls=(ailerons,))
    return models.build(dataclasses.replace(machine, airfoils=(PLAIN, *tables)),
                        models.Settings(chordwise=ROWS))


def flown(model, deflection, alpha=0.09):
    """Return steady loads with the aileron at a deflection."""
    deflections = np.array([deflection])
    return wings.steady(model.at(10.0, VISCOSITY, deflections), 10.0, alpha,
                        deflections=deflections)


def test_table_that_only_shifts_is_what_is_flown_without_one():
    """
    The law without flap tables, as a table: the same loads, but for interpolation.

    Where flow is attached; past the stall that law lets a flap fade, and a table is believed.
    """
    plain, same = wing(), wing(dataclasses.replace(
        shifted(PLAIN, TAU * DOWN, MOMENT * DOWN), deflection=DOWN))
    for alpha in np.radians([-2.0, 3.0]):
        for deflection in (0.0, 0.4 * DOWN, DOWN, 1.5 * DOWN):
            first, second = (flown(each, deflection, alpha) for each in (plain, same))
            assert first.status is second.status is Status.CONVERGED
            # Interpolated twice: PCHIP through points off the first one's own.
            assert second.force_G == pytest.approx(first.force_G, rel=2e-3, abs=0.05)
            assert second.moment_G == pytest.approx(first.moment_G, rel=2e-3, abs=0.1)


def test_at_its_own_deflection_a_table_is_read_at_the_strips_angle():
    table = flapped()
    result = flown(wing(table), DOWN)
    # Port aileron down, starboard up; there is no table of that, and the plain one is shifted.
    port, up = section_polar(table), section_polar(PLAIN)
    alpha = result.strips.alpha
    down, inner, raised = slice(0, 4), slice(4, 12), slice(12, 16)
    for found, c, own in ((result.strips.cd, 1, 0.0), (result.strips.cm, 2, MOMENT * DOWN)):
        # The moved curve is a cubic through other points: of fourth order in a quarter degree.
        # What the lattice has of the flap's moment is not in the strip's cm.
        assert found[down] == pytest.approx(port.at(alpha[down])[:, c] - own, abs=1e-5)
        assert found[inner] == pytest.approx(up.at(alpha[inner])[:, c], abs=1e-12)
        assert found[raised] == pytest.approx(up.at(alpha[raised] - TAU * DOWN)[:, c], abs=1e-9)
    plain = flown(wing(), DOWN)
    assert result.strips.cd[down].min() > plain.strips.cd[down].max() + 0.02


def test_between_deflections_the_curves_are_mixed_and_beyond_them_held():
    model = wing(flapped(), flapped(-DOWN, 0.02))
    low, mid, high = (moved(section_polar(each), TAU * each.deflection, -MOMENT * each.deflection)
                      for each in (flapped(-DOWN, 0.02), PLAIN, flapped()))
    for share, expected in ((0.25, 0.75 * mid.curve + 0.25 * high.curve), (1.0, high.curve),
                            (1.6, high.curve), (-0.5, 0.5 * (low.curve + mid.curve))):
        lattice = model.at(10.0, VISCOSITY, np.array([share * DOWN])).lattice
        curves = lattice.curves[lattice.polar_index]
        # The flap's effect is a key with nine digits.
        assert np.abs(curves[0] - expected).max() < 1e-9
        assert np.abs(curves[6] - mid.curve).max() < 1e-12


def test_flaps_and_reynolds_numbers_go_together():
    tables = [dataclasses.replace(each, reynolds=reynolds, cd=each.cd + drag)
              for each in (PLAIN, flapped()) for reynolds, drag in ((1e5, 0.03), (1e6, 0.0))]
    plain = wing()
    model = models.build(dataclasses.replace(plain.aircraft, airfoils=tuple(tables)),
                         plain.settings)
    airspeed = VISCOSITY * math.sqrt(1e5 * 1e6)     # half way in ln(Re), on a chord of 1 m
    lattice = model.at(airspeed, VISCOSITY, np.array([0.5 * DOWN])).lattice
    curve = lattice.curves[lattice.polar_index[0]]
    expected = np.mean([moved(section_polar(each), TAU * each.deflection,
                              -MOMENT * each.deflection).curve for each in tables], axis=0)
    assert np.abs(curve - expected).max() < 1e-9


@pytest.mark.parametrize('hinge', [0.5, 0.75])
def test_flap_moment_of_the_lattice_approaches_thin_airfoil_theory(hinge):
    """-sin th (1 - cos th)/2; a row of panels is off by its share of the flap, of first order."""
    th = math.acos(1.0 - 2.0 * hinge)
    exact = -0.5 * math.sin(th) * (1.0 - math.cos(th))
    off = [abs(flap_moment(rows, hinge) - exact) for rows in (4, 32, 256)]
    assert off[0] < 0.12 * abs(exact) and off[2] < 0.2 * off[1] < 0.1 * off[0] + 1e-6


def test_moment_of_a_flapped_wing_is_the_tables_once():
    """
    A long wing with the flap of all its span down: cm of the middle as its table says.

    Lift acts at the quarter chord, about which it is. The lattice's own 0.15 would be in it twice.
    """
    surface = wings.panel_wing(PLAIN, [(0, 0, 0), (0, 200, 0)], [1, 1], 40, symmetric=True)
    flap = Control('flap', (-0.5, 0.5), (Effector('wing', hinge=HINGE),))
    machine = wings.aircraft([surface], PLAIN, area=400.0, chord=1.0, span=400.0, controls=(flap,))
    model = models.build(dataclasses.replace(machine, airfoils=(PLAIN, flapped())),
                         models.Settings(chordwise=ROWS))
    result = flown(model, DOWN, 0.02)
    moment = result.moment_G[1] / (0.5 * wings.DENSITY * 100.0 * 400.0)
    table = section_polar(flapped()).at(float(np.median(result.strips.alpha)))
    assert moment == pytest.approx(table[2], abs=0.012)


def test_moved_curve_is_the_curve_moved():
    foil = section_polar(PLAIN)
    alpha = np.linspace(-math.pi, math.pi, 977)
    other = moved(foil, 0.1)
    # Of the slope, up to 6 per rad, what cubics through other points leave where it turns.
    assert np.abs(other.at(alpha + 0.1)[:, 3] - foil.at(alpha)[:, 3]).max() < 0.05
    assert np.abs(other.at(alpha + 0.1)[:, :3] - foil.at(alpha)[:, :3]).max() < 1e-4
    assert other.zero_lift == pytest.approx(foil.zero_lift + 0.1, abs=1e-5)
    assert moved(foil, 0.0) is foil


@pytest.fixture(scope='module')
def trainer(tmp_path_factory):
    """Return the trainer from a file, its tail with tables for elevator up and down."""
    folder = tmp_path_factory.mktemp('flaps')
    from poststall_sim import airfoil_writer
    tail = wings.shipped('naca0012_re3e5')
    for name, deflection in (('up', -20.0), ('down', 20.0)):
        made = shifted(tail, flap_effectiveness(ROWS, 0.6) * math.radians(deflection))
        airfoil_writer.write(folder / f'{name}.csv', dataclasses.replace(
            made, cd=made.cd + 0.03), ['by formula'])
    text = (wings.CONFIG / 'aircraft' / 'trainer.yaml').read_text()
    (folder / 'plane.yaml').write_text(text.replace(
        'tail: naca0012_re3e5.csv', 'tail: [naca0012_re3e5, {file: up, flap_deg: -20}, '
        '{file: down, flap_deg: 20}]'))
    return definition.aircraft(folder / 'plane.yaml')


def test_flap_tables_are_read_and_fly(trainer):
    """A trim with them balances, the flight begins in it, and a deflected elevator brakes."""
    assert sorted(round(math.degrees(each.deflection), 9) for each in trainer.airfoils) \
        == [-20.0, 0.0, 0.0, 20.0]
    plain = wings.shipped_aircraft('trainer')
    drags = []
    for machine in (plain, trainer):
        flight = simulation.start(machine, airspeed=13.0, altitude=200.0)
        assert np.abs(flight.snapshot.acceleration_B).max() < 2e-3
        deflections = flight.trim.deflections.copy()
        deflections[1] = math.radians(-20.0)
        flight.step(Controls(deflections, flight.trim.throttle))
        drags.append(flight.snapshot.strips.cd[20:28])
    assert drags[1] == pytest.approx(drags[0] + 0.03, abs=4e-3)
    found = trim.glide(models.build(trainer), alpha=math.radians(14.0), altitude=100.0)
    assert found.status is Status.CONVERGED


def test_tables_without_the_plain_section_are_refused():
    with pytest.raises(ConfigError, match='a table with the flap at 0 deg must be there'):
        dataclasses.replace(wing().aircraft, airfoils=(flapped(),
                            dataclasses.replace(flapped(), deflection=-DOWN)))
    with pytest.raises(ConfigError, match='at most 90 deg, got 859'):
        dataclasses.replace(PLAIN, deflection=15.0)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What the package computes beside closed forms and published numbers, for docs/validation.md.

The cases are those of the tests, by the tests' own functions: here they are asked for more points
and written into tables. What is asked of them is held there; tolerances here are said only.
"""

import math
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

import exact
import test_avl
import test_energy
import test_free_to_roll
import test_published_aircraft as navion
import test_rigid_body
import test_steady
import test_turbulence
import test_unsteady_theory as theory
import wings

from poststall_sim import definition, jobs, simulation
from poststall_sim.aero import model as models
from poststall_sim.aero import polars
from poststall_sim.aero.decambering import Closure, section_decambering
from poststall_sim.aero.model import Settings, build
from poststall_sim.stability import free_to_roll
from poststall_sim.stability.motion import Decambering
from poststall_sim.turbulence import Spectrum

RATIOS = {4.0: (3.676, -0.345), 6.0: (4.276, -0.450), 8.0: (4.644, -0.528)}
"""Aspect ratios, with lift slope and damping in roll of another lattice (8 x 40, cosine)."""
FREQUENCIES = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7)
"""Reduced frequencies of the oscillating plate."""
NAVION_MODES = {'short period': '5 %', 'phugoid': '15 %', 'roll': '9 to 21 % more',
                'Dutch roll': '0 to 20 % less'}
SPECTRA = {Spectrum.DRYDEN: 'Dryden', Spectrum.VON_KARMAN: 'von Kármán'}


@dataclass(frozen=True, slots=True)
class Row:
    """
    A number beside its reference.

    asked : of it, in words; unit : of a difference that is not divided by the reference.
    """

    quantity: str
    ours: float
    reference: float
    asked: str
    unit: str = ''

    @property
    def off(self) -> float:
        """Return the difference, as a share of the reference unless it has a unit."""
        gap = self.ours - self.reference
        return gap if self.unit else gap / abs(self.reference)

    def said(self) -> str:
        """Return the difference in words."""
        if not self.unit:
            return f'{100.0 * self.off:.2g} %'
        return f'{self.off:.2g} {self.unit}'.removesuffix(' -')


@dataclass(frozen=True, slots=True)
class Case:
    """A reference case: what it is compared with, the test that holds it, its numbers."""

    name: str
    against: str
    test: str
    rows: tuple[Row, ...]

    def worst(self) -> tuple[str, ...]:
        """Return the largest difference of each unit in words."""
        found: dict[str, Row] = {}
        for row in self.rows:
            if row.unit not in found or abs(row.off) > abs(found[row.unit].off):
                found[row.unit] = row
        return tuple(row.said().lstrip('-') for row in found.values())

    def asked(self) -> str:
        """Return what the test asks, each bound once."""
        return ', '.join(dict.fromkeys(row.asked for row in self.rows))


def bertin_and_smith() -> Iterable[Row]:
    """Yield the hand-worked swept wing of Aerodynamics for Engineers."""
    wing = wings.panel_wing(
        wings.potential(), [(0, 0, 0), (2.5, 2.5, 0)], [1, 1], 8, symmetric=True)
    machine = wings.aircraft([wing], wings.potential(), area=5.0, chord=1.0, span=5.0)
    yield Row('CL_alpha, swept by 45°, AR 5', test_steady.slope(
        machine, build(machine, Settings(chordwise=1))), 1.096 * math.pi, '0.2 %')


def warren() -> Iterable[Row]:
    """Yield the Warren-12 planform, about its apex."""
    half = math.sqrt(2.0)
    wing = wings.panel_wing(wings.potential(), [(0, 0, 0), (0.5 + half, half, 0)], [1.5, 0.5], 40,
                            symmetric=True)
    machine = wings.aircraft([wing], wings.potential(), area=2.0 * half, chord=1.0,
                             span=2.0 * half, cg_G=(0, 0, 0))
    model = build(machine, Settings(chordwise=8))
    yield Row('CL_alpha', test_steady.slope(machine, model), 2.743, '2 %')
    yield Row('Cm_alpha', test_steady.slope(machine, model, 'pitch'), -3.10, '3 %')


@cache
def rectangular(ratio: float) -> tuple[float, float]:
    """Return lift slope and damping in roll of a rectangular plate, 8 x 40 panels, cosine."""
    machine = wings.rectangular(ratio, 40, cosine=True)
    model = build(machine, Settings(chordwise=8))
    rolling = wings.steady(model, 1.0, rates_B=(2.0 * test_steady.SMALL / ratio, 0.0, 0.0))
    return test_steady.slope(machine, model), \
        wings.coefficients(machine, rolling, 1.0).roll / test_steady.SMALL


def rectangles() -> Iterable[Row]:
    """Yield rectangular plates."""
    for ratio, published in RATIOS.items():
        for name, ours, reference in zip(('CL_alpha', 'Cl_p'), rectangular(ratio), published):
            yield Row(f'{name}, AR {ratio:g}', ours, reference, '0.0006', unit='per rad')


def elliptic() -> Iterable[Row]:
    """Yield the efficiency of an elliptic wing, from 40 and 80 strips."""
    coarse, fine = (test_steady.span_efficiency(machine, build(machine))[0]
                    for machine in map(test_steady.elliptic, (40, 80)))
    yield Row('span efficiency e of an elliptic wing, extrapolated', 2.0 * fine - coarse, 1.0,
              '1 %')


@cache
def avl(name: str, as_avl: bool = False) -> tuple[Row, ...]:
    """Return everything that AVL was asked of one of the aircraft of the tests."""
    text, panels, alpha, expected = (test_avl.AS_AVL if as_avl else test_avl.AVL)[name]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / 'plane.avl'
        file.write_text(text)
        aircraft = definition.aircraft(file)
    rules = {'as_avl': True} if as_avl else {'axial_wake': True}
    ours = test_avl.figures(aircraft, panels, alpha, **rules)
    return tuple(Row(key, ours[key], value, asked_of_avl(key, aircraft.control_names, as_avl))
                 for key, value in expected.items())


def asked_of_avl(key: str, controls: tuple[str, ...], as_avl: bool) -> str:
    """Return the tolerance of `test_avl` in words."""
    if as_avl:
        return '0.002 %'
    by_control = key.partition('_')[2] in controls
    return f'{100.0 * test_avl.TOLERANCES.get(key, 0.02 if by_control else 0.01):g} %'


def wagner() -> Iterable[Row]:
    """Yield the lift after a sudden start."""
    s = np.array([0.5, 1.0, 2.0, 4.0, 6.0, 10.0])
    for at, ours, closed in zip(s, theory.wagner_march(32, s), exact.wagner(s)):
        yield Row(f'share of the lift, s = {at:g}', ours, float(closed), '0.5 %')


def kuessner() -> Iterable[Row]:
    """Yield the lift on entering a gust."""
    s = np.array([0.5, 1.0, 2.0, 4.0, 6.0, 10.0])
    for at, ours, closed in zip(s, theory.entering(32, s), exact.kuessner(s)):
        yield Row(f'share of the lift, s = {at:g}', ours, float(closed), '2 %')


@cache
def oscillating(rows: int, k: float, kind: str) -> complex:
    """Return the lift of an oscillating plate over the quasi-steady one."""
    return theory.oscillating(rows, k, kind)


def theodorsen() -> Iterable[Row]:
    """Yield the lift of an oscillating plate, eight panels."""
    for kind in ('plunge', 'pitch'):
        for k in (0.1, 0.3, 0.5):
            ours, closed = oscillating(8, k, kind), theory.theodorsen(k, kind)
            yield Row(f'amplitude, {kind}, k = {k:g}', abs(ours), abs(closed), '1 %')
            yield Row(f'phase, {kind}, k = {k:g}', math.degrees(np.angle(ours)),
                      math.degrees(np.angle(closed)), '0.5°', unit='°')


def decambering() -> Iterable[Row]:
    """Yield the dissertation's one number of decambering."""
    polar = polars.section_polar(wings.shipped('naca4415_re3e6'))
    alpha = math.radians(20.0)
    yield Row('decambering of the NACA 4415 at 20° [°]', math.degrees(section_decambering(
        polar.at(alpha)[0], alpha, polar.zero_lift)), -9.65, '0.005°', unit='°')


@cache
def infinite(closure: Closure) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angles [deg], coefficients (n, 3) of an infinite wing and of its section."""
    machine = wings.rectangular(1e4, 3, wings.shipped('naca4415_re3e6'))
    model = build(machine, Settings(closure=closure, limit=400))
    angles = np.arange(-10.0, 171.0, 4.0)
    found = []
    for alpha in np.radians(angles):
        each = wings.coefficients(machine, wings.steady(model, 10.0, alpha), 10.0, alpha)
        found.append((each.lift, each.drag, each.pitch))
    curve = polars.section_polar(wings.shipped('naca4415_re3e6'))
    return angles, np.array(found), curve.at(np.radians(angles))[:, :3]


def sections() -> Iterable[Row]:
    """Yield where an infinite wing is furthest from its section."""
    for closure in Closure:
        angles, ours, closed = infinite(closure)
        for k, name in enumerate(('cl', 'cd', 'cm')):
            at = int(np.argmax(np.abs(ours - closed)[:, k]))
            yield Row(f'{name} of an infinite wing, {closure.value} closure, worst from -10 to '
                      f'170°: at {angles[at]:g}°', ours[at, k], closed[at, k], '0.0005', unit='-')


def rolling() -> Iterable[Row]:
    """Yield the poles of a flat wing that is free to roll."""
    flat = wings.rectangular(6, 8)
    model = build(test_free_to_roll.heavy(flat, 1000.0),
                  Settings(chordwise=4, wake_length=20.0, decambering=False))
    (found,), _ = free_to_roll.damping(
        model, alpha=0.0, axis=free_to_roll.Axis.BODY, decamberings=(Decambering.FIXED,),
        airspeed=20.0, density=1.225, dt=0.25 / 20.0)
    yield Row('pole of a flat wing that is free to roll [1/s]', found.pole.real, -0.679, '1 %')
    yield Row('the same in quasi-steady flow [1/s]', found.Clp * 0.25 * 1.225 * 20.0 * 6.0
              * 36.0 / 1000.0, -0.690, '0.5 %')


@cache
def brick() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return time [s] and rates (n, 3) [deg/s] of the tumbling brick, flown and in closed form."""
    states = test_rigid_body.fly(
        test_rigid_body.body(rates=test_rigid_body.BRICK_RATES), test_rigid_body.unloaded, 0.01,
        3000, **test_rigid_body.of(test_rigid_body.BRICK_MASS,
                                   np.diag(test_rigid_body.BRICK_MOMENTS)))
    time = 0.01 * np.arange(3001)
    closed = exact.torque_free_rates(
        test_rigid_body.BRICK_MOMENTS, test_rigid_body.BRICK_RATES, time)
    return time, np.degrees([s.rates_B for s in states]), np.degrees(closed)


def tumbling() -> Iterable[Row]:
    """Yield where the brick is furthest from the closed form."""
    _, flown, closed = brick()
    worst = np.unravel_index(np.argmax(np.abs(flown - closed)), flown.shape)
    yield Row('rates of a brick in 30 s', flown[worst], closed[worst], '1e-6 °/s', unit='°/s')


def falling() -> Iterable[Row]:
    """Yield how far a falling sphere is from the closed form."""
    ball = build(test_energy.sphere(), Settings(chordwise=1))
    yield Row('speed of a falling sphere', test_energy.off(ball, 3_000_000, 0.0), 0.0,
              '1.5e-4 m/s', unit='m/s')


@cache
def energies() -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return time [s], energy gained and work done [J] in the demo's stall, and all that went."""
    aircraft = wings.shipped_aircraft('trainer')
    scenario = definition.scenario(definition.find('scenarios', 'stall_and_recovery'))
    flight = simulation.start(aircraft, Settings(chordwise=2), airspeed=scenario.airspeed,
                              altitude=scenario.altitude)
    snapshots = [flight.snapshot, *jobs.fly(flight, scenario, 13.0)]
    had = test_energy.energy(snapshots, aircraft.mass)
    means = test_energy.power(snapshots)
    means = 0.5e-9 * flight.dt_ns * (means[1:] + means[:-1])
    return (np.array([s.time for s in snapshots]), had - had[0],
            np.append(0.0, np.cumsum(means)), float(np.abs(means).sum()))


def balanced() -> Iterable[Row]:
    """Yield the energy that the work in a stall leaves over."""
    _, gained, work, gone = energies()
    yield Row('energy left over in a stall, of all the work', float(
        np.abs(gained - work).max() / gone), 0.0, '1e-3', unit='-')


@cache
def navion_numbers() -> tuple[dict[str, float], dict[str, complex]]:
    """Return our derivatives and modes of the Navion."""
    model = models.build(definition.aircraft(definition.find('aircraft', 'navion')))
    return navion.derived(model).coefficients, navion.poles(model)


def published_modes() -> Iterable[Row]:
    """Yield how quick the modes of the Navion are."""
    _, found = navion_numbers()
    for name, asked in NAVION_MODES.items():
        yield Row(f'size of the {name} [1/s]', abs(found[name]), abs(navion.MODES[name]), asked)


@cache
def spectra(spectrum: Spectrum) -> tuple[np.ndarray, np.ndarray]:
    """Return wave numbers and the mean periodograms (3, k) along paths in all directions."""
    k, found = test_turbulence.periodograms(
        lambda seed: test_turbulence.isotropic(spectrum, seed), test_turbulence.turn, 2.0)
    return k, found.mean(axis=0)


def gusty() -> Iterable[Row]:
    """Yield the spectra of turbulence over their formulas."""
    for spectrum in Spectrum:
        k, found = spectra(spectrum)
        inside = (k > 0.01) & (k < 0.08)
        for component, name, formula in ((0, 'along', test_turbulence.longitudinal),
                                         (2, 'across', test_turbulence.transverse)):
            closed = formula(spectrum, k[inside], test_turbulence.SIGMA, test_turbulence.SCALE)
            yield Row(f'{SPECTRA[spectrum]}, {name} the path', float(
                (found[component, inside] / closed).mean()), 1.0, '4 standard errors')


@cache
def cases() -> tuple[Case, ...]:
    """Return all cases with their numbers."""
    def case(name: str, against: str, test: str, rows: Iterable[Row]) -> Case:
        return Case(name, against, test, tuple(rows))
    return (
        case('swept wing', 'Bertin & Smith', 'test_steady.py::test_swept_wing_of_bertin_and_smith',
             bertin_and_smith()),
        case('Warren-12 wing', "OpenVSP's validation",
             'test_steady.py::test_warren_12_planform', warren()),
        case('rectangular wings', 'another lattice',
             'test_steady.py::test_rectangular_wings', rectangles()),
        case('elliptic wing', 'lifting-line theory',
             'test_steady.py::test_elliptic_wing_has_the_slope_and_the_efficiency_of_its_kind',
             elliptic()),
        *(case(f'{name} aircraft', 'AVL (OptVL 2.5.0)',
               'test_avl.py::test_the_lattice_says_what_avl_says', avl(name))
          for name in test_avl.AVL),
        *(case(f"{name}, AVL's rules of forces", 'AVL (OptVL 2.5.0)',
               'test_avl.py::test_by_avls_rules_of_forces_all_is_what_avl_says', avl(name, True))
          for name in test_avl.AS_AVL),
        case('sudden start', 'Wagner',
             'test_unsteady_theory.py::test_lift_after_a_sudden_start_is_that_of_wagner',
             wagner()),
        case('entering a gust', 'Küssner',
             'test_unsteady_theory.py::test_lift_on_entering_a_gust_is_that_of_kuessner',
             kuessner()),
        case('oscillating plate', 'Theodorsen',
             'test_unsteady_theory.py::test_oscillating_plate_has_the_lift_of_theodorsen',
             theodorsen()),
        case('decambering in two dimensions', 'Paul 2015, Figure 2.1',
             'test_decambering.py::test_two_dimensional_decambering_at_20_degrees',
             decambering()),
        case('infinite wing', "its section's own curve",
             'test_decambering.py::test_infinite_wing_returns_its_own_section_at_any_angle',
             sections()),
        case('wing free to roll', 'another computation',
             'test_free_to_roll.py::'
             'test_flat_wing_rolls_to_rest_at_the_rate_of_an_independent_computation', rolling()),
        case('tumbling brick', 'elliptic functions (NESC case 2)',
             'test_rigid_body.py::test_torque_free_brick_against_elliptic_functions', tumbling()),
        case('falling sphere', 'Newton',
             'test_energy.py::test_a_falling_sphere_has_the_closed_form', falling()),
        case('energy of a stall', 'the work of air and engine',
             'test_energy.py::test_energy_of_a_stall_and_its_recovery_balances', balanced()),
        case('Navion, modes', 'Teper 1969, Nelson 1998',
             'test_published_aircraft.py::test_its_modes_are_about_as_quick_as_published',
             published_modes()),
        case('turbulence', 'MIL-F-8785C',
             'test_turbulence.py::'
             'test_spectra_along_any_straight_path_are_the_specification_s', gusty()))


def table_summary() -> str:
    """Return the cases with the worst of each, as a table."""
    rows = ['| case | against | numbers | off by at most | asked |', '|---|---|---|---|---|']
    rows += [f'| {each.name} | {each.against} | {len(each.rows)} | {", ".join(each.worst())} | '
             f'{each.asked()} |' for each in cases()]
    return '\n'.join(rows)


def table_cases() -> str:
    """Return every number beside its reference, as a table."""
    rows = ['| case | quantity | ours | reference | off by | asked |', '|---|---|---|---|---|---|']
    rows += [f'| {case.name} | {row.quantity} | {row.ours:.4g} | {row.reference:.4g} | '
             f'{row.said()} | {row.asked} |' for case in cases() for row in case.rows]
    return '\n'.join(rows)


def table_tests() -> str:
    """Return the test that holds each case, as a table."""
    rows = ['| case | test |', '|---|---|']
    return '\n'.join(rows + [f'| {each.name} | `{each.test}` |' for each in cases()])

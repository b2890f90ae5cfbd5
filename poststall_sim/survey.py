# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What an aircraft is, in the figures of a drawing board, and what is odd about it.

Slopes are those of the attached lattice at `ALPHA`, controls neutral, moments about the centre of
gravity.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim import envelope, polar, surface_order
from poststall_sim.aero import polars
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import Aircraft, Surface, usual_radii
from poststall_sim.airfoil_report import stands_in, steepest_unique_fall
from poststall_sim.frames import control_sign
from poststall_sim.polar import Condition, Stall
from poststall_sim.state import Status

ALPHA = math.radians(2.0)
_STEP = 1e-3
FLOW = f'attached flow at alpha {math.degrees(ALPHA):g} deg'
"""In which the figures are taken: the design's, whatever the sections' curves say."""
STALLING = np.radians(np.arange(0.0, 31.0))
"""Angles of attack among which the stall is looked for [rad]."""
FIRST = 15.0
"""Airspeed at which a stall is looked for first [m/s]."""
STATIC_MARGIN = (0.05, 0.25)
HORIZONTAL_VOLUME, VERTICAL_VOLUME = (0.3, 1.2), (0.015, 0.10)
"""Model aeroplanes to transports: D. P. Raymer, Aircraft Design, 6th ed., table 6.4, widened."""
NO_TAIL = 1e-3
"""Less than this volume is none: the slight dihedral of a level tail."""
STRIP_WIDTH = (0.2, 1.0)
"""Of the chord. Wider ones blur the stall; much narrower ones cost time and say no more."""
ROLL_RATE, PITCH_CHANGE, LIFT_CHANGE = 0.05, 0.3, 1.5
"""Least p b/2V of full ailerons and change of Cm of full elevator; less of that is enough where
the static margin is so small that it changes the lift of trimmed flight by as much as this."""
GYRATION_FACTOR = 2.0
POSITIVE = {'elevator': (1, -1.0, 'lifts the nose'), 'aileron': (0, 1.0, 'rolls to the left'),
            'rudder': (2, -1.0, 'yaws to the right')}
"""Which of Cl, Cm, Cn a control changes, with which sign, and what it does with the other one."""
NO_AUTHORITY = 1e-4
"""Of Cl, Cm or Cn: a control that changes less does nothing there, and its sign is rounding."""
IN_WAKE = 0.1
"""Chords between a tail and the plane of the wing, below which the wake lies on it."""


@dataclass(frozen=True, slots=True)
class Planform:
    """
    A surface: area [m^2], span along itself [m], mean aerodynamic chord [m] and its quarter point.

    quarter_x, quarter_z [m] in G; sweep of the quarter chord and dihedral [rad]; volume : of a
    tail about the wing's quarter chord [-], None of the wing; upright : counts for yaw, not pitch.
    """

    name: str
    area: float
    span: float
    aspect_ratio: float
    mean_chord: float
    quarter_x: float
    quarter_z: float
    sweep: float
    dihedral: float
    upright: bool
    volume: float | None = None


@dataclass(frozen=True, slots=True)
class Survey:
    """
    Planforms, the largest first; neutral point x in G [m]; static margin in reference chords.

    chord : that one [m]; lift_slope [1/rad]; roll_damping, of p b/2V; authority : by control, the
    change of (Cl, Cm, Cn) from its least to its greatest deflection, halved [-].
    """

    planforms: tuple[Planform, ...]
    neutral_point: float
    static_margin: float
    chord: float
    lift_slope: float
    roll_damping: float
    authority: Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True, slots=True)
class Finding:
    """Something odd: where, what, and what to do about it."""

    subject: str
    what: str
    advice: str


def planform(surface: Surface) -> Planform:
    """Return the planform of a surface, both sides of a symmetric one."""
    places, sections = surface.section_places, surface.sections
    area = moment = square = high = 0.0
    for low, up, a, b in zip(places, places[1:], sections, sections[1:]):
        each = 0.5 * (up - low) * (a.chord + b.chord)
        # Means over a trapezoid: of the chord by area, and of quarter points by chord.
        share = (a.chord + 2.0 * b.chord) / (3.0 * (a.chord + b.chord))
        ends = [(s.leading_edge_G[0] + 0.25 * s.chord, s.leading_edge_G[2]) for s in (a, b)]
        area += each
        square += each * 2.0 / 3.0 * (a.chord ** 2 + a.chord * b.chord + b.chord ** 2) \
            / (a.chord + b.chord)
        moment += each * ((1.0 - share) * ends[0][0] + share * ends[1][0])
        high += each * ((1.0 - share) * ends[0][1] + share * ends[1][1])
    first, last = (np.add(s.leading_edge_G, [0.25 * s.chord, 0.0, 0.0])
                   for s in (sections[0], sections[-1]))
    across, up = float(last[1] - first[1]), float(last[2] - first[2])
    sides = 2.0 if surface.symmetric else 1.0
    normal = np.array([0.0, -up, across])
    upright = control_sign(normal) != control_sign(normal * [1.0, -1.0, 1.0])
    upright = upright or across == 0.0
    span = sides * places[-1]
    return Planform(
        surface.name, sides * area, span, span ** 2 / (sides * area), square / area,
        moment / area, high / area,
        math.atan2(float(last[0] - first[0]), places[-1]), math.atan2(up, abs(across)), upright)


def survey(model: Model) -> Survey:
    """Return the figures of an aircraft."""
    aircraft = model.aircraft
    attached = replace(model, settings=replace(model.settings, decambering=False))
    count = len(aircraft.controls)

    def at(alpha: float = ALPHA, rates=(0.0, 0.0, 0.0), deflections=None) -> np.ndarray:
        found = polar.point(attached, Condition(
            alpha, 0.0, np.array(rates), np.zeros(count) if deflections is None else deflections),
            airspeed=20.0, density=1.225).coefficients
        return np.array([found.CL, found.Cl, found.Cm, found.Cn])

    lift, _, pitch, _ = (at(ALPHA + _STEP) - at(ALPHA - _STEP)) / (2.0 * _STEP)
    rolling = (at(rates=(_STEP, 0.0, 0.0)) - at(rates=(-_STEP, 0.0, 0.0)))[1] / (2.0 * _STEP)
    authority = {}
    for control, row in zip(aircraft.controls, np.eye(count)):
        low, high = control.limits
        slope = (at(deflections=_STEP * row) - at(deflections=-_STEP * row)) / (2.0 * _STEP)
        authority[control.name] = tuple(
            float(value) for value in 0.5 * (high - low) * slope[1:])
    margin = float(-pitch / lift)
    return Survey(
        _planforms(model), aircraft.mass.cg_G[0] + margin * aircraft.reference.chord, margin,
        aircraft.reference.chord, float(lift), float(rolling), authority)


def backwards(figures: Survey) -> tuple[str, ...]:
    """Return the controls whose positive deflection does what sticks take for a negative one."""
    return tuple(name for name, (axis, sign, _) in POSITIVE.items()
                 if name in figures.authority
                 and sign * figures.authority[name][axis] < -NO_AUTHORITY)


def wing_of(model: Model) -> int:
    """Return which of a model's surfaces is the wing."""
    runs = [grid.strips for grid in model.lattice.grids]
    return surface_order.by_span(runs, model.lattice.quarter_chord[:, 1])[0]


def _planforms(model: Model) -> tuple[Planform, ...]:
    """
    Return the planforms, the wing's first, then the largest, with the volumes of the others.

    About the wing's quarter chord, Raymer's arm, which is the same wherever the centre of gravity
    stands.
    """
    others = [planform(surface) for surface in model.aircraft.surfaces]
    first = others.pop(wing_of(model))
    result = [first]
    for each in sorted(others, key=lambda p: -p.area):
        arm = each.quarter_x - first.quarter_x
        length = first.span if each.upright else first.mean_chord
        result.append(replace(each, volume=each.area * arm / (first.area * length)))
    return tuple(result)


def stall(model: Model) -> Stall | None:
    """Return the stall at sea level, controls neutral, None where lift still rises at the end."""
    aircraft, air = model.aircraft, model.atmosphere.at(0.0)
    neutral, speed = np.zeros(len(aircraft.controls)), FIRST
    stalling = replace(model, settings=replace(model.settings, decambering=True))
    # The speed that is found decides about the curves only where there are several by Reynolds
    # number, and there hardly: once more is enough.
    for _ in range(1 if model.lattice.tables is None else 2):
        flown = stalling.at(speed, air.kinematic_viscosity, neutral)
        points = [each for each in polar.sweep(
            flown, [Condition(alpha, deflections=neutral) for alpha in STALLING],
            airspeed=speed, density=air.density) if each.aero.status is Status.CONVERGED]
        found = polar.stall(
            aircraft, [each.condition.alpha for each in points],
            [each.coefficients.CL for each in points], air.density)
        if found is None:
            return None
        speed = found.airspeed
    return found


def findings(model: Model, figures: Survey, stalled: Stall | None) -> tuple[Finding, ...]:
    """Return what is odd about an aircraft and its `stall`, the gravest first."""
    aircraft = model.aircraft
    return (
        *_balance(figures), *_tails(figures), *_controls(aircraft, figures),
        *_masses(aircraft, figures), *_strips(model), *_sections(model),
        *_stand_ins(aircraft), *_reynolds(model, stalled),
        *(Finding('assumed', text, 'give it in an aircraft file, see poststall new')
          for text in aircraft.assumptions))


def _balance(figures: Survey) -> Iterator[Finding]:
    low, high = STATIC_MARGIN
    margin, neutral, chord = figures.static_margin, figures.neutral_point, figures.chord
    what = (f'{100.0 * margin:.1f} % of the reference chord of {chord:.4g} m in {FLOW}, the '
            f'neutral point is at x = {neutral:.4g} m')
    if margin < low:
        yield Finding('static margin', what + (': it diverges in pitch' if margin < 0.0 else ''),
                      f'move the centre of gravity forward, to x = {neutral - low * chord:.4g} m '
                      f'for {100.0 * low:g} %'
                      + (', or enlarge the tail' if _volumes(figures)[0] > NO_TAIL else ''))
    elif margin > high:
        yield Finding('static margin', what,
                      f'move the centre of gravity aft, to x = {neutral - high * chord:.4g} m for '
                      f'{100.0 * high:g} %: it takes much elevator to slow down')


def _volumes(figures: Survey) -> tuple[float, float]:
    """
    Return the horizontal and the vertical volume of all that stands behind the wing.

    A V-tail counts as both, by the squares of cosine and sine of its dihedral.
    """
    wing, *others = figures.planforms
    moments = [(each.area * max(each.quarter_x - wing.quarter_x, 0.0), each.dihedral)
               for each in others]
    level = sum(moment * math.cos(dihedral) ** 2 for moment, dihedral in moments)
    upright = sum(moment * math.sin(dihedral) ** 2 for moment, dihedral in moments)
    return level / (wing.area * wing.mean_chord), upright / (wing.area * wing.span)


def _tails(figures: Survey) -> Iterator[Finding]:
    wing, *others = figures.planforms
    # Without a tail, or with a foreplane, the static margin says all that there is to say.
    horizontal, vertical = _volumes(figures)
    for name, volume, (low, high) in (('horizontal', horizontal, HORIZONTAL_VOLUME),
                                      ('vertical', vertical, VERTICAL_VOLUME)):
        what = f'{volume:.3f} about the quarter chord of {wing.name}, ordinary are {low:g} to ' \
               f'{high:g}'
        if volume > high:
            yield Finding(f'{name} tail volume', what,
                          'check its area and arm: a larger tail is rare')
        elif NO_TAIL < volume < low:
            yield Finding(f'{name} tail volume', what, 'enlarge the tail or move it aft')
    if vertical <= NO_TAIL:
        yield Finding('vertical tail', f'there is none behind {wing.name}',
                      'add a fin, unless it is to fly without: it turns the nose into the wind')
    for each in others:
        apart = abs(each.quarter_z - wing.quarter_z)
        if not each.upright and each.quarter_x > wing.quarter_x \
                and apart < IN_WAKE * wing.mean_chord:
            yield Finding(each.name, f'stands {apart:.3g} m from the plane of {wing.name}',
                          f'move it up or down by {IN_WAKE:g} chords and more: the wake of '
                          f'{wing.name} lies on it, and what it feels depends on the strips')


def _controls(aircraft: Aircraft, figures: Survey) -> Iterator[Finding]:
    authority, backward = figures.authority, set(backwards(figures))
    if 'elevator' not in authority:
        yield Finding('elevator', f'there is none among {", ".join(authority) or "no controls"}',
                      'name the control that pitches elevator: trim moves that one')
    else:
        pitch = authority['elevator'][1]
        steep = [surface.name for surface in aircraft.surfaces
                 if surface.symmetric and planform(surface).upright]
        on_steep = [each.surface for control in aircraft.controls if control.name == 'elevator'
                    for each in control.effectors if each.surface in steep]
        enough = min(PITCH_CHANGE, LIFT_CHANGE * max(figures.static_margin, STATIC_MARGIN[0]))
        if on_steep and -enough < pitch:
            backward.discard('elevator')
            yield Finding(
                'elevator', f'changes Cm by {pitch:+.2f} only: {on_steep[0]} is steeper than 45 '
                'deg, where a positive angle is trailing edge left on both halves',
                'give the elevator gain -1 on the right half and 1 on the left, the rudder 1 on '
                'both')
        elif abs(pitch) < enough:
            yield Finding('elevator', f'changes Cm by {abs(pitch):.2f} only',
                          'give it more chord, span or deflection to reach the stall')
    for name in sorted(backward):
        yield Finding(name, f'a positive deflection {POSITIVE[name][2]}',
                      'change the sign of its gains, or sticks and autopilots work backwards')
    for name, does in (('aileron', 'roll'), ('rudder', 'yaw')):
        if name in authority and abs(authority[name][POSITIVE[name][0]]) < NO_AUTHORITY:
            together = _together(aircraft, name)
            yield Finding(
                name, ('right and left move together: it' if together else 'it')
                + f' does not {does}',
                'give the gains of right and left opposite signs' if together else
                f'look at its effectors: none of them makes it {does}')
    if 'aileron' in authority:
        rate = abs(authority['aileron'][0] / figures.roll_damping)
        if rate < ROLL_RATE and abs(authority['aileron'][0]) >= NO_AUTHORITY:
            yield Finding('aileron', f'rolls by p b/2V = {rate:.3f} at full deflection',
                          f'give it more span or chord: {ROLL_RATE:g} is little')


def _together(aircraft: Aircraft, name: str) -> bool:
    """Tell whether a control moves both halves of symmetric surfaces the same way."""
    halves = {surface.name for surface in aircraft.surfaces if surface.symmetric}
    parts = [each for control in aircraft.controls if control.name == name
             for each in control.effectors if each.surface in halves]
    right, left = (sum(each.gain for each in parts if each.side != other) for other in (-1, 1))
    return right * left > 0.0


def _masses(aircraft: Aircraft, figures: Survey) -> Iterator[Finding]:
    length = np.ptp([x for surface in aircraft.surfaces for s in surface.sections
                     for x in (s.leading_edge_G[0], s.leading_edge_G[0] + s.chord)])
    span = figures.planforms[0].span
    radii = np.sqrt(np.diag(aircraft.mass.inertia_B) / aircraft.mass.mass)
    usual = usual_radii(span, length)
    for axis, radius, other in zip(('roll', 'pitch', 'yaw'), radii, usual):
        if not 1.0 / GYRATION_FACTOR < radius / other < GYRATION_FACTOR:
            yield Finding(f'inertia in {axis}', f'has a radius of gyration of {radius:.3g} m',
                          f'check it: of aircraft like this it is about {other:.2g} m')


def _strips(model: Model) -> Iterator[Finding]:
    lattice = model.lattice
    for grid in lattice.grids:
        ratio = lattice.strip_width[grid.strips] / lattice.strip_chord[grid.strips]
        strips = grid.strips.stop - grid.strips.start
        low, high = STRIP_WIDTH
        if np.median(ratio) > high:
            yield Finding(grid.name, f'its strips are {np.median(ratio):.2f} chords wide',
                          f'cut it into more than {strips}')
        elif np.median(ratio) < low:
            yield Finding(grid.name, f'its strips are {np.median(ratio):.2f} chords wide',
                          f'cut it into fewer than {strips}: they cost time and say no more')


def _sections(model: Model) -> Iterator[Finding]:
    angles = np.radians(np.linspace(-60.0, 60.0, 481))
    reference, ell = model.aircraft.reference, model.settings.ell
    strips = max(grid.strips.stop - grid.strips.start for grid in model.lattice.grids)
    for airfoil in model.aircraft.airfoils:
        curve = polars.section_polar(airfoil)
        values = curve.at(angles)
        past = (angles > curve.stall_high) | (angles < curve.stall_low)
        fall = -float(values[past, 3].min())
        steepest = -steepest_unique_fall(
            airfoil, aspect_ratio=reference.span ** 2 / reference.area, strips=strips,
            ell=max(ell) if isinstance(ell, tuple) else ell)
        if fall > steepest:
            yield Finding(
                f'airfoil {airfoil.name}', f'its lift falls by {math.radians(fall):.3f} per deg '
                f'past the stall; up to {math.radians(steepest):.3f} the flow of such a wing has '
                'one solution only', 'soften its table, or average over more chords (--ell)')


def _stand_ins(aircraft: Aircraft) -> Iterator[Finding]:
    """Find sections that poststall new made for an AVL file; the file itself says so."""
    generic = [airfoil for airfoil in aircraft.airfoils if stands_in(airfoil)]
    if not generic or aircraft.assumptions:
        return
    said = ', '.join(
        f'{name} of ' + ' and '.join(surface.name for surface in aircraft.surfaces if any(
            section.airfoil == name for section in surface.sections))
        for name in dict.fromkeys(airfoil.name for airfoil in generic))
    dragless = all(airfoil.cd.min() == 0.0 for airfoil in generic)
    yield Finding(
        'sections', f'{said}: past the stall one generic plate'
        + ', before it without drag' * dragless,
        'give them tables of their own: poststall airfoil --extend makes one of a polar')


def _reynolds(model: Model, stalled: Stall | None) -> Iterator[Finding]:
    """Compare the section tables with the flow in level flight at the stall."""
    if stalled is None:
        return
    for excess in envelope.reynolds(stalled.airspeed, model.atmosphere.at(0.0), model.lattice):
        yield Finding('sections', f'at {stalled.airspeed:.3g} m/s, the stall in level flight: '
                      f'{excess.text}',
                      'give them tables of about that Reynolds number')

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Steady flight of any kind: climbs, turns, pull-ups and sideslips, with controls that are stuck.

All six balances at once, as the least of a sum of squares within the limits of the controls:
where they do not reach, the answer is the flight that comes nearest, and says so. `trim` has the
straight and symmetric flights, which take three balances; `branches` finds all of those that an
airspeed has.

Wakes are straight in all of them. In a flight with its wake in the air that of a turn curves with
it, and loads the wings otherwise; `turning` has the flights that are in balance with that.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.optimize import least_squares, minimize_scalar, root

from poststall_sim import failures, propulsion
from poststall_sim import trim as trims
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import ConfigError, level_airspeed
from poststall_sim.failures import Failure, Kind
from poststall_sim.frames import GRAVITY, FloatArray
from poststall_sim.state import Controls, Status
from poststall_sim.trim import ACCEPTED, ALL_WORK, Trim, balance

ROLL_CONTROL, YAW_CONTROL = trims.LATERAL_CONTROLS
"""The controls that balance roll and yaw."""
AXES = ('forward', 'sideways', 'vertical', 'rolling', 'pitching', 'yawing')
"""Of the balances, in the order of a residual."""
NEAR = 1e-3
"""A control this near to its limit, as a share of its way, is said to stand there."""
PROBE = 1e-6
"""Step of the difference quotients: the closure is solved a thousand times closer."""
SAME = 1e-4
"""Two trims are one whose angles of attack [rad], or shares of airspeed, differ by less."""

_LENGTHWAYS = ('airspeed', 'alpha', 'climb_angle', 'throttle', trims.PITCH_CONTROL)
_SIDEWAYS = ('beta', 'bank', 'turn_rate', ROLL_CONTROL, YAW_CONTROL)
_BOUNDS = {'airspeed': (0.5, 400.0), 'alpha': (-math.pi / 2, math.pi / 2),
           'climb_angle': (-1.55, 1.55), 'throttle': (0.0, 1.0), 'beta': (-0.7, 0.7),
           'bank': (-1.48, 1.48), 'turn_rate': (-20.0, 20.0)}
"""What a search stays within [m/s, rad, 0..1, rad/s]."""


@dataclass(frozen=True, slots=True)
class Task:
    """
    What a steady flight is asked to be; what is None is found.

    airspeed [m/s]; alpha, climb_angle, beta, bank [rad]; throttle 0..1; turn_rate : of the
    heading, right positive, pull_rate : of pitch beyond that, at the lowest point of a pull-up
    [rad/s]; coordinated : no side force is felt; held : deflections [rad] of controls that do not
    move, stuck or set, by name; failed : names of engines that do not work; failures : of parts,
    controls and engines, by name, what is stuck with its angle. A beta of None is 0 where the
    other unknowns are enough.
    """

    airspeed: float | None = None
    alpha: float | None = None
    climb_angle: float | None = 0.0
    throttle: float | None = None
    beta: float | None = None
    bank: float | None = None
    turn_rate: float | None = 0.0
    pull_rate: float = 0.0
    coordinated: bool = False
    held: Mapping[str, float] = field(default_factory=dict)
    failed: frozenset[str] = ALL_WORK
    failures: Mapping[str, Failure] = field(default_factory=dict)


def steady(model: Model, task: Task, *, altitude: float, start: Trim | None = None,
           more: FloatArray | None = None) -> Trim:
    """
    Return the steady flight that a task asks for, or the nearest to it that the controls allow.

    altitude [m]; start : a flight near it, where the search begins and on whose branch it stays;
    more (6,) : force [N] and moment [N m] in G that the air has beyond that of straight wakes.
    Raises `ConfigError` for a task with too many or too few unknowns.
    """
    aircraft = model.aircraft
    aircraft.require_engines(task.failed)
    parts = failures.of_parts(aircraft, task.failures)
    dead = failures.dead(aircraft, parts)
    task = _without(task, dead)
    known, unknown = _unknowns(model, task)
    bounds = _BOUNDS | {control.name: control.limits for control in aircraft.controls}
    low, high = (np.array([bounds[name][side] for name in unknown]) for side in (0, 1))
    tight, air = trims.tight(model), model.atmosphere.at(altitude)
    density = air.density
    delta = None if start is None else start.aero.strips.delta
    last: dict[str, Trim] = {}

    def flown(x: FloatArray) -> Trim:
        value = known | dict(zip(unknown, map(float, x)))
        deflections = np.array([value.get(name, 0.0) for name in aircraft.control_names])
        before = last.get('flown')
        found = Trim(
            airspeed=value['airspeed'], alpha=value['alpha'], climb_angle=value['climb_angle'],
            controls=Controls(deflections, value['throttle']), residual=np.empty(6),
            aero=None, status=Status.NOT_CONVERGED, message='', beta=value['beta'],
            bank=value['bank'], turn_rate=value['turn_rate'], pull_rate=task.pull_rate,
            angles=before and before.angles)
        found = replace(found, push=trims.pushed(model, found, density, task.failed))
        found = last['flown'] = trims.in_air(
            tight, found, air, before.aero.strips.delta if before else delta, parts)
        return found if more is None else replace(found, aero=replace(
            found.aero, force_G=found.aero.force_G + more[:3],
            moment_G=found.aero.moment_G + more[3:]))

    def imbalance(x: FloatArray) -> FloatArray:
        found = flown(x)
        residual, side = balance(model, found)
        return np.append(residual, side) if task.coordinated else residual

    x = np.array([_guess(model, task, name, known, start, density) for name in unknown])
    # The unknowns of the first three balances alone, then all: an aircraft flown straight stays
    # symmetric, to the bit, where past the stall a search sideways would fall off the branch.
    def search(x: FloatArray, low: FloatArray) -> FloatArray:
        for moved in (slice(0, 3), slice(0, len(unknown))):
            x = _searched(imbalance, x, moved, low, high)
            if missing(x) <= ACCEPTED:
                break
        return x

    def missing(x: FloatArray) -> float:
        return float(np.abs(imbalance(x)).max())

    first, x = x, search(x, low)
    if missing(x) > ACCEPTED and 'throttle' in unknown:
        # A propeller that the air turns answers to no throttle: a search that comes there stays.
        k = unknown.index('throttle')
        idle = propulsion.idle_throttle(aircraft, flown(x).airspeed, density, task.failed)
        if 0.0 < idle and x[k] <= idle + NEAR:
            answering = np.where(np.arange(len(x)) == k, idle, low)
            x = min(x, search(np.maximum(first, answering), answering), key=missing)
    found = replace(flown(x), residual=imbalance(x))
    found = replace(found, controls=_shown(model, found, dead))
    return replace(found, **_judged(found, unknown, x, low, high))


def _without(task: Task, dead: Sequence[str]) -> Task:
    """Return the task without the controls that are dead, and the engines that are off."""
    for name, failure in task.failures.items():
        if failure.kind is Kind.STUCK and failure.angle is None:
            raise ConfigError(f'{name}:stuck stays where it is, and a trim has no before: give '
                              'the angle')
    for name in dead:
        if name in task.held:
            raise ConfigError(f'{name} has failed and is held: give one of them')
    return replace(task, held={**task.held, **dict.fromkeys(dead, 0.0)},
                   failed=task.failed | failures.engines_off(task.failures))


def _shown(model: Model, found: Trim, dead: Sequence[str]) -> Controls:
    """Return the controls of a flight, dead ones at the deflection that their parts show."""
    deflections = found.controls.deflections.copy()
    which = [model.aircraft.control_names.index(name) for name in dead]
    deflections[which] = np.linalg.lstsq(
        model.aircraft.mixing[:, which], found.angles, rcond=None)[0]
    return replace(found.controls, deflections=deflections)


def _searched(imbalance: Callable[[FloatArray], FloatArray], x: FloatArray, moved: slice,
              low: FloatArray, high: FloatArray) -> FloatArray:
    """Return x (n,) with those of its elements moved that make the imbalance least."""
    def part(y: FloatArray) -> FloatArray:
        whole = x.copy()
        whole[moved] = y
        return whole

    low, high = low[moved], high[moved]
    inside = 1e-6 * (high - low)
    y = least_squares(
        lambda y: imbalance(part(y)), np.clip(x[moved], low + inside, high - inside),
        bounds=(low, high), x_scale=np.maximum(np.abs(x[moved]), 0.3), diff_step=PROBE,
        xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=60).x
    residual = imbalance(part(y))
    if len(residual) == len(y) and np.abs(residual).max() > ACCEPTED:
        # Near a solution, past the stall, the method that has no bounds gets further.
        nearer = root(lambda y: imbalance(part(y)), y, method='hybr', tol=1e-12).x
        if np.all((low <= nearer) & (nearer <= high)) and \
                np.abs(imbalance(part(nearer))).max() < np.abs(residual).max():
            y = nearer
    return part(y)


def _unknowns(model: Model, task: Task) -> tuple[dict[str, float], list[str]]:
    """Return what is known by name, and the names of what is to be found."""
    names = model.aircraft.control_names
    for name in task.held:
        if name not in names:
            raise ConfigError(f'{model.aircraft.name} has no control {name!r} to hold, it has '
                              f'{", ".join(names) or "none"}')
    if trims.PITCH_CONTROL not in names:
        raise ConfigError(f'trim moves the control named {trims.PITCH_CONTROL}, there are '
                          f'{list(names) or "none"}')
    working = set(model.aircraft.engine_names) - task.failed
    given = {'airspeed': task.airspeed, 'alpha': task.alpha, 'climb_angle': task.climb_angle,
             'throttle': task.throttle if working else 0.0, 'beta': task.beta,
             'bank': task.bank, 'turn_rate': task.turn_rate,
             **{name: None for name in (trims.PITCH_CONTROL, ROLL_CONTROL, YAW_CONTROL)
                if name in names}, **task.held}
    lengthways = [name for name in _LENGTHWAYS if given[name] is None]
    if len(lengthways) != 3:
        raise ConfigError(
            f'of {", ".join(_LENGTHWAYS)} three are to be found, here '
            f'{", ".join(lengthways) or "none"}: '
            + ('give another' if len(lengthways) > 3 else 'leave another open'))
    sideways = [name for name in _SIDEWAYS if name in given and given[name] is None]
    if 'beta' in sideways and len(sideways) > 3 + task.coordinated:
        given['beta'] = 0.0
        sideways.remove('beta')
    if len(sideways) > 3 + task.coordinated:
        raise ConfigError(f'of {", ".join(_SIDEWAYS)} {3 + task.coordinated} are to be found, '
                          f'here {", ".join(sideways)}: give another')
    known = {name: float(value) for name, value in given.items() if value is not None}
    return known, lengthways + sideways


def _guess(model: Model, task: Task, name: str, known: Mapping[str, float], start: Trim | None,
           density: float) -> float:
    """Return where the search for an unknown begins."""
    names = model.aircraft.control_names
    if start is not None:
        return float(start.controls.deflections[names.index(name)]) if name in names else \
            start.controls.throttle if name == 'throttle' else getattr(start, name)
    aircraft = model.aircraft
    speed = known.get('airspeed') or level_airspeed(
        aircraft.mass.mass, aircraft.reference.area, density, 0.5)
    rate = known.get('turn_rate', 0.0)
    if name == 'throttle':
        return trims.first_throttle(model, speed, density, task.failed)
    return {'airspeed': speed, 'alpha': math.radians(4.0), 'climb_angle': -0.1,
            'bank': math.atan(speed * rate / GRAVITY),
            'turn_rate': GRAVITY * math.tan(known.get('bank', 0.0)) / speed}.get(name, 0.0)


def _judged(found: Trim, unknown: list[str], x: FloatArray, low: FloatArray,
            high: FloatArray) -> dict:
    """Return the status and the message of a flight that was found."""
    worst = float(np.abs(found.residual).max())
    if found.aero.status is not Status.CONVERGED:
        message = f'the aerodynamics did not converge, residual {found.aero.max_residual:.1e}'
    elif worst > ACCEPTED:
        axis = (*AXES, 'felt sideways')[int(np.argmax(np.abs(found.residual)))]
        message = f'no balance found, residual {worst:.1e} of the weight ({axis})'
        at_limit = [_standing(name, value) for name, value, a, b in zip(unknown, x, low, high)
                    if min(value - a, b - value) < NEAR * (b - a)]
        if at_limit:
            message += f', with {" and ".join(at_limit)} at the limit'
    else:
        return {'status': Status.CONVERGED, 'message': 'trimmed'}
    return {'status': Status.NOT_CONVERGED, 'message': message}


def _standing(name: str, value: float) -> str:
    if name in ('throttle', 'airspeed'):
        return f'{name} {value:.2f}'
    unit = 'deg/s' if name == 'turn_rate' else 'deg'
    return f'{name.replace("_", " ")} {math.degrees(value):.3g} {unit}'


def branches(model: Model, *, airspeed: float, altitude: float, alphas: FloatArray,
             climb_angle: float | None = 0.0,
             told: Callable[[], None] = lambda: None) -> list[Trim]:
    """
    Return all straight trims at an airspeed, by continuation in the angle of attack.

    The flights at angles alphas (n,) [rad], each from the one before, up and then down, are
    followed; where their airspeed passes the one asked for there is a trim. climb_angle [rad],
    None to glide. Two ways find different flights where the section's stall has hysteresis. told :
    called after each of the 2 n angles. From the least angle of attack to the greatest.
    """
    def at(alpha: float, delta0: FloatArray | None) -> Trim:
        if climb_angle is None or not model.aircraft.engines:
            return trims.glide(model, alpha=alpha, altitude=altitude, delta0=delta0)
        return trims.powered(model, alpha=alpha, altitude=altitude, climb_angle=climb_angle,
                             delta0=delta0)

    def gap(alpha: float, delta0: FloatArray) -> float:
        return at(alpha, delta0).airspeed - airspeed

    def near(speed: float, other: float) -> bool:
        return abs(speed - other) < SAME * airspeed

    found: list[Trim] = []
    on_the_way_up: dict[float, float] = {}
    run: list[Trim] = []   # of neighbours, on one way, without a gap
    for k, alpha in enumerate([*alphas, *alphas[::-1]]):
        here = at(float(alpha), run[-1].aero.strips.delta if run else None)
        told()
        turns_back = run and here.alpha == run[-1].alpha
        run = [*([] if turns_back else run[-2:]), here] if _followed(here) else []
        if k < len(alphas):
            on_the_way_up |= {each.alpha: each.airspeed for each in run}
        elif all(near(on_the_way_up.get(each.alpha, math.inf), each.airspeed) for each in run):
            continue
        for low, high, delta0 in _brackets(gap, run, airspeed) if len(run) > 1 else ():
            trim = at(trims.crossing(partial(gap, delta0=delta0), low, high), delta0)
            # Where the branch ends in between the airspeed jumps over the one asked for.
            if trim.status is Status.CONVERGED and near(trim.airspeed, airspeed) and all(
                    abs(trim.alpha - other.alpha) > SAME for other in found):
                found.append(trim)
    return sorted(found, key=lambda trim: trim.alpha)


def _followed(found: Trim) -> bool:
    """
    Tell whether the forces of a flight balance, so that its airspeed means something.

    Between a flight within the limits and one beyond them there may be a trim: they are for the
    trim to keep, not for its neighbours.
    """
    forces = found.residual[:2 if len(found.residual) == 3 else 3]
    return found.aero.status is Status.CONVERGED and float(np.abs(forces).max()) <= ACCEPTED


def _brackets(gap: Callable[[float, FloatArray], float], run: Sequence[Trim],
              airspeed: float) -> Iterator[tuple[float, float, FloatArray]]:
    """
    Yield angles of attack between which the last neighbours pass an airspeed, and a decambering.

    gap (alpha, delta0) : of the airspeed to the one looked for. Where three neighbours bend
    towards it without reaching it, what is between them may.
    """
    gaps = [each.airspeed - airspeed for each in run]
    start = run[-2].aero.strips.delta
    if gaps[-2] * gaps[-1] <= 0.0:
        yield run[-2].alpha, run[-1].alpha, start
        return
    away = np.sign(gaps[-1]) * np.array(gaps)   # > 0 on the side of the neighbours
    if len(run) < 3 or not 0.0 < away[1] <= min(away[0], away[2]) \
            or away[1] > away[0] - 2.0 * away[1] + away[2]:
        return   # no curve, and no corner, goes further beyond its nearest point than it bends
    low, high = sorted((run[0].alpha, run[2].alpha))
    turning = minimize_scalar(lambda alpha: math.copysign(1.0, gaps[-1]) * gap(alpha, start),
                              bounds=(low, high), method='bounded', options={'xatol': 1e-4})
    for end in (low, high):
        if turning.fun <= 0.0 and gap(end, start) * gap(turning.x, start) <= 0.0:
            yield end, turning.x, start

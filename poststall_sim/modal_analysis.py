# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The job of the command `modes`: modes of trimmed flight as plain results.

As in `jobs`, what is returned is what ``--json`` writes: angles in degrees, no NaN and nothing
infinite, which is None. One point stands for one angle of attack and one kind of decambering.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import jobs, state_space_file, trim_jobs
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import Aircraft
from poststall_sim.engines import Propeller
from poststall_sim.stability import flight
from poststall_sim.stability.bodies import STATES
from poststall_sim.stability.flight import FlightModes
from poststall_sim.stability.modes import CLASSICAL, HEADING, Mode, plain
from poststall_sim.stability.motion import Decambering
from poststall_sim.state import Status

UNITS = ('real, imag [1/s], imag > 0: a pair; omega_n [rad/s]; zeta [-]; share of the body in the '
         'mode, the rest is wake [-]; participation of u, v, w, p, q, r, phi, theta in its motion')
LAGGED = Decambering.LAGGED
MARK = '~'
"""Stands in the table behind a mode of which the body has less than `HALF`."""
HALF = 0.5


def slipstream(aircraft: Aircraft) -> str:
    """Return what stands for the slipstreams of an aircraft in the linear systems, or nothing."""
    blown = [name for name, engine in zip(aircraft.engine_names, aircraft.engines)
             if isinstance(engine, Propeller) and engine.slipstream]
    return f'slipstream of {", ".join(blown)}: held as it is in the trim, what airspeed and ' \
        'throttle do to it is left out' if blown else ''


def decamberings(name: str) -> tuple[Decambering, ...]:
    """Return the kinds that a name stands for, `all` for each of them."""
    return tuple(Decambering) if name == 'all' else (Decambering(name),)


def modes(model: Model, alphas: Sequence[float], *, altitude: float, climb_angle: float | None,
          kinds: tuple[Decambering, ...], quasi_steady: bool = False, dt: float | None = None,
          rows: int | None = None) -> Iterator[list[jobs.Result]]:
    """
    Yield the points at each angle of attack [rad], one for each kind of decambering.

    altitude [m]; climb_angle [rad], None for a glide; quasi_steady : one point more, of the
    classical equations; dt [s] and rows : of wake, see `flight.linearise`.
    """
    flown = flight.trims_along(model, alphas, altitude=altitude, climb_angle=climb_angle)
    kind = 'glide' if climb_angle is None else 'powered'
    for found in flight.modes_along(model, flown, altitude=altitude, decamberings=kinds,
                                    quasi_steady=quasi_steady, dt=dt, rows=rows):
        trim = found[0].trim
        flying = trim_jobs.trim_result(model, trim, kind, altitude)
        yield [_point(each, flying) for each in found]


def _point(found: FlightModes, trim: jobs.Result) -> jobs.Result:
    return {
        'alpha_deg': round(math.degrees(found.trim.alpha), 10), 'trim': trim,
        'decambering': found.model, 'status': found.status.name.lower(),
        'message': found.message, 'departed': found.departed, 'dt_s': found.dt,
        'wake_rows': found.rows, 'residual': _finite(found.residual),
        'modes': [_mode(mode, share) for mode, share in zip(found.modes, found.shares)]}


def _mode(mode: Mode, share: float) -> jobs.Result:
    motion = np.delete(mode.participation, HEADING)
    return {
        'name': mode.name, 'real': mode.eigenvalue.real, 'imag': mode.eigenvalue.imag,
        'omega_n': mode.natural_frequency, 'zeta': _finite(mode.damping_ratio),
        'stable': mode.stable, 'time_to_half_or_double_s': _finite(mode.time_to_half_or_double),
        'period_s': _finite(mode.period), 'share': float(share),
        'participation': dict(zip(STATES, motion.tolist()))}


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def export(path: Path, model: Model, alphas: Sequence[float], *, altitude: float,
           climb_angle: float | None, kind: Decambering, order: int | None = None,
           dt: float | None = None, rows: int | None = None) -> str:
    """
    Write the linear system at the last angle of attack [rad], reached along the others.

    Return what was written, in words. path, order : see `state_space_file.export`.
    """
    *_, trim = flight.trims_along(model, alphas, altitude=altitude, climb_angle=climb_angle)
    at = flight.linearise(model, trim, altitude=altitude, decamberings=(kind,), dt=dt, rows=rows)
    if not at.systems:
        raise jobs.NoResultError(f'{path} is not written: {at.message}')
    written = state_space_file.export(
        path, model, at, decambering=kind, altitude=altitude, order=order)
    space, air = written.space, ''
    if written.order >= 0:
        air = (f', {written.order} for the air: its load errs by {written.error:.1e} of the '
               f'largest up to {written.frequency:.3g} rad/s')
    return (f'{path}: at {math.degrees(trim.alpha):g} deg, {len(space.inputs)} inputs, '
            f'{len(space.outputs)} outputs, {len(space.states)} states{air}')


def table(points: Sequence[jobs.Result]) -> tuple[tuple[str, ...], list[list[str]]]:
    """Return head and rows by angle of attack, a column for each mode that has a name."""
    branches = {plain(mode['name']) for point in points for mode in point['modes']}
    named = [name for name in CLASSICAL if name in branches]
    named += sorted(name for name in branches - set(named) if ' + ' in name)
    head = ('alpha [deg]', 'V [m/s]', 'decambering', *(f'{name} [1/s]' for name in named), '')
    return head, [_row(point, named) for point in points]


def _row(point: dict[str, Any], named: Sequence[str]) -> list[str]:
    cells = [', '.join(_cell(mode) for mode in point['modes'] if plain(mode['name']) == name)
             for name in named]
    good = point['status'] == Status.CONVERGED.name.lower() and not point['departed']
    message = '' if good else point['message']
    return [f'{point["alpha_deg"]:z.2f}', f'{point["trim"]["airspeed_m_s"]:.2f}',
            point['decambering'], *(cell or '-' for cell in cells), message]


def _cell(mode: dict[str, Any]) -> str:
    pair = f'+-{mode["imag"]:.3f}i' if mode['imag'] > 0.0 else ''
    return f'{mode["real"]:z.3f}{pair}' + (MARK if mode['share'] < HALF else ' ')

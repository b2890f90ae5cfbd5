# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A linear system in a file that needs nothing of this package: numpy's (.npz) or MATLAB's (.mat).

Both have the same fields under the same names:

* a, b, c, d, dt [s] : x(k+1) = a x(k) + b u(k), y(k) = c x(k) + d u(k), also in words: equation;
* states, inputs, outputs : names; state_units, input_units, output_units; axes : in words;
* trim_... : what the differences are from. airspeed, alpha, altitude, climb_angle (above the
  horizon, in still air), velocity_B (3,), throttle and deflections (controls,), the order of
  which is that of the first inputs;
* aircraft, decambering : what it is of; order, error, frequency [rad/s] : of the reduced air,
  see `reduction.Reduced`, order -1 of the whole; format, version : of the file, of the package.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import io

from poststall_sim import __version__, atomic_file
from poststall_sim.aero.model import Model
from poststall_sim.aircraft import ConfigError
from poststall_sim.stability import reduction
from poststall_sim.stability.flight import Linearised
from poststall_sim.stability.motion import Decambering
from poststall_sim.stability.state_space import StateSpace

FORMAT = 1
"""Goes up when a field is renamed or changes its meaning."""
SUFFIXES = ('.npz', '.mat')
EQUATION = 'x(k+1) = a x(k) + b u(k), y(k) = c x(k) + d u(k), all differences from the trim'
AXES = ('body axes B: x forward, y right, z down, at the centre of gravity; Euler angles yaw, '
        'pitch, roll from north, east, down; deflections positive trailing edge down, by the '
        'gains of the aircraft; gusts are velocities of the air along B')

_UNITS = {
    **dict.fromkeys(('u', 'v', 'w', 'gust_u', 'gust_v', 'gust_w'), 'm/s'),
    **dict.fromkeys(('p', 'q', 'r', 'shaft'), 'rad/s'),
    **dict.fromkeys(('phi', 'theta', 'psi', 'decambering'), 'rad'),
    **dict.fromkeys(reduction.LOADS[:3], 'N'), **dict.fromkeys(reduction.LOADS[3:], 'N m'),
    **dict.fromkeys((f'shift_{axis}' for axis in 'xyz'), 'm'),
    **dict.fromkeys((f'turn_{axis}' for axis in 'xyz'), 'rad'),
    **dict.fromkeys(('wake', 'circulation', 'circulation_before'), 'm^2/s'),
    **dict.fromkeys((f'{name}[{i}]' for name in ('impulse', 'impulse_before')
                     for i in range(3)), 'N s'),
    **dict.fromkeys(('impulse', 'impulse_before'), 'N m s'),
    'air': '1', 'throttle': '1'}


@dataclass(frozen=True, slots=True, eq=False)
class Written:
    """What is in a file: the space, and order, error and frequency [rad/s] of the air."""

    space: StateSpace
    order: int
    error: float
    frequency: float


def export(path: Path, model: Model, at: Linearised, *, decambering: Decambering, altitude: float,
           order: int | None = None, error: float | None = None) -> Written:
    """
    Write a linear system about a trim to a ``.npz`` or ``.mat`` file, whole or not at all.

    at : with this kind of decambering among its systems; altitude [m] of the trim; order : of the
    reduced air, or error, see `reduction.reduce`; with neither the system is whole. Raises
    `ConfigError` where the name ends otherwise, there is no system, it cannot be reduced so, or
    the file cannot be written.
    """
    if path.suffix not in SUFFIXES:
        raise ConfigError(f'{path}: expected a name that ends in {" or ".join(SUFFIXES)}')
    if decambering not in at.systems:
        raise ConfigError(f'no linear system to write: {at.message}')
    system, trim = at.systems[decambering], at.trim
    if order is None and error is None:
        space, of_air = reduction.full(system), (-1, 0.0, math.inf)
    else:
        asked = {} if error is None else {'error': error}
        reduced = reduction.reduce(system, reference=model.aircraft.reference,
                                   airspeed=trim.airspeed, order=order, **asked)
        space, of_air = reduced.space, (reduced.order, reduced.error, reduced.frequency)
    fields = {
        'a': space.a, 'b': space.b, 'c': space.c, 'd': space.d, 'dt': space.dt,
        'equation': EQUATION, 'axes': AXES,
        'states': space.states, 'state_units': _units(space.states),
        'inputs': space.inputs, 'input_units': _units(space.inputs, model.aircraft.control_names),
        'outputs': space.outputs, 'output_units': _units(space.outputs),
        'trim_airspeed': trim.airspeed, 'trim_alpha': trim.alpha, 'trim_altitude': altitude,
        'trim_climb_angle': trim.climb_angle, 'trim_bank': trim.bank,
        'trim_velocity_B': trim.velocity_B,
        'trim_throttle': trim.controls.throttle, 'trim_deflections': trim.controls.deflections,
        'aircraft': model.aircraft.name, 'decambering': decambering.value,
        **dict(zip(('order', 'error', 'frequency'), of_air)),
        'format': FORMAT, 'version': __version__}
    with atomic_file.writing(path) as file:
        if path.suffix == '.npz':
            np.savez_compressed(file, **{key: np.asarray(fields[key]) for key in fields})
        else:
            io.savemat(file, {key: _for_matlab(fields[key]) for key in fields},
                       do_compression=True, oned_as='column')
    return Written(space, *of_air)


def _units(names: tuple[str, ...], controls: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return the units of states, inputs or outputs; controls : names of deflections [rad]."""
    units = {**_UNITS, **dict.fromkeys(controls, 'rad')}
    return tuple(units[name] if name in units else units[name.partition('[')[0]]
                 for name in names)


def _for_matlab(value: object) -> object:
    """Return names as a column of cells; as text they would be padded to one length."""
    return np.array(value, dtype=object) if isinstance(value, tuple) else value

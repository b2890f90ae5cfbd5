# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The job of the command `airfoil`: a section read, extended, looked at and drawn.

As in `jobs`, what is returned is what ``--json`` writes: angles in degrees, slopes per degree,
and None for what is infinite.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from poststall_sim import (
    __version__,
    airfoil_reader,
    airfoil_report,
    definition,
    extension,
    polar_import,
)
from poststall_sim.aero.polars import section_polar
from poststall_sim.aircraft import Airfoil, ConfigError
from poststall_sim.jobs import Result
from poststall_sim.polar_import import Format, Imported

_WHOLE = math.radians(179.9)
"""Points that reach so far on both sides are a table over a full turn."""
_USED = math.radians(30.0)
"""Of a full turn that is extended anew, points beyond are left out."""


@dataclass(frozen=True, slots=True)
class Extension:
    """What is asked of an extension; angles [rad], lift of the negative stall below 0."""

    softness: float
    clmax: float | None = None
    alpha_clmax: float | None = None
    clmin: float | None = None
    alpha_clmin: float | None = None
    symmetric: bool = False
    separated: extension.Separated = extension.SECTION


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """A section over a full turn, the points it was made of, and the lines that say how."""

    airfoil: Airfoil
    points: Imported | None
    notes: tuple[str, ...]
    extended: bool


def read(file_or_name: str, form: Format | None, asked: Extension | None) -> Study:
    """Return a section from a file or a name in config/airfoils, extended if that is asked for."""
    path = definition.find(definition.Kind.AIRFOIL, file_or_name)
    points = polar_import.points(path, form)
    whole = points.alpha[0] < -_WHOLE and points.alpha[-1] > _WHOLE
    if asked is None:
        if not whole:
            raise ConfigError(
                f'{path}: covers {math.degrees(points.alpha[0]):g} to '
                f'{math.degrees(points.alpha[-1]):g} deg only: give --extend')
        notes = (f'written by poststall airfoil ({__version__}) from {path.name}',)
        return Study(airfoil_reader.airfoil(path), None, notes, False)
    airfoil, notes = _extended(path, points, asked)
    return Study(airfoil, points, notes, True)


def _extended(path: Path, found: Imported, asked: Extension) -> tuple[Airfoil, tuple[str, ...]]:
    used = np.abs(found.alpha) <= _USED
    alpha = found.alpha[used]
    if not alpha.size:
        raise ConfigError(f'{path}: has no points within 30 deg of zero incidence')
    points = extension.Points(alpha, found.cl[used], found.cd[used], found.cm[used],
                              (float(alpha[0]), float(alpha[-1])))
    if asked.symmetric:
        points = points.symmetric
    elif alpha[0] > -math.radians(1.0):
        raise ConfigError(f'{path}: begins at {math.degrees(alpha[0]):g} deg: points below zero '
                          'incidence are needed, or --symmetric')
    spread = {'softness': asked.softness, 'separated': asked.separated}
    positive = extension.stall_of(
        points, clmax=asked.clmax, alpha_clmax=asked.alpha_clmax, **spread)
    negative = None if asked.symmetric else extension.stall_of(
        points.upside_down, **spread,
        clmax=None if asked.clmin is None else -asked.clmin,
        alpha_clmax=None if asked.alpha_clmin is None else -asked.alpha_clmin)
    made = extension.extend(points, positive, negative, separated=asked.separated,
                            name=path.stem, reynolds=found.reynolds)
    return made.airfoil, (
        f'{path.stem} from -180 to 180 deg; cm about the quarter chord, nose up positive',
        f'made by poststall airfoil ({__version__}) of {path.name} ({found.format.value}), '
        f'{math.degrees(alpha[0]):g} to {math.degrees(alpha[-1]):g} deg',
        *_stall_notes('positive', positive, made.solved[1]),
        *(['negative stall: mirror image; cl and cm are odd, cd is even'] if negative is None
          else _stall_notes('negative', negative, made.solved[0])),
        _separated_note(asked.separated))


def _stall_notes(side: str, stall: extension.Stall, solved: tuple[float, float]) -> list[str]:
    deg = math.degrees
    target = "the points' own" if stall.clmax is None else \
        f'clmax {stall.clmax:g} at {deg(stall.alpha_clmax):g} deg'
    return [f'{side} stall (signs as if positive): points to {deg(stall.attached_to):.4g} deg, '
            f'separated from {deg(stall.separated_from):.4g} deg, softness '
            f'{deg(stall.softness):.4g} deg; {target};',
            f'  levels off over {deg(solved[0]):.3f} deg, blend starts at '
            f'{deg(solved[1]):.3f} deg']


def _separated_note(separated: extension.Separated) -> str:
    if separated.aspect_ratio is None:
        return ('separated: CN and CT of K. V. Truong, J. Renewable Sustainable Energy 12, 033303 '
                f'(2020), scaled to cd(90 deg) = {separated.cd90:g}')
    return ('separated: L. A. Viterna and R. D. Corrigan (1981), of a wing of aspect ratio '
            f'{separated.aspect_ratio:g}, CDmax = 1.1 + 0.018 AR')


def result(study: Study, *, aspect_ratio: float, strips: int, ell: float = 1.0) -> Result:
    """Return what a section is like, and how sharp a stall a wing with so many strips stands."""
    airfoil = study.airfoil
    found = airfoil_report.figures(section_polar(airfoil))
    limit = math.radians(airfoil_report.steepest_unique_fall(
        airfoil, aspect_ratio=aspect_ratio, strips=strips, ell=ell))
    falls = [math.radians(each.steepest_fall) for each in (found.positive, found.negative)]
    return {
        'poststall_sim': __version__, 'airfoil': airfoil.name, 'reynolds': airfoil.reynolds,
        'extended': study.extended, 'notes': list(study.notes),
        'zero_lift_deg': math.degrees(found.zero_lift),
        'lift_slope_per_rad': found.lift_slope, 'least_cd': found.least_cd,
        'cm_at_zero_lift': found.cm_at_zero_lift,
        'positive_stall': _stall_figures(found.positive, 1.0),
        'negative_stall': _stall_figures(found.negative, -1.0),
        'wing': {'aspect_ratio': aspect_ratio, 'strips': strips, 'ell_chords': ell,
                 'steepest_unique_fall_per_deg': limit},
        'flags': ['MAY_NOT_BE_UNIQUE'] if min(falls) < limit else [],
        'table': _columns(airfoil.alpha, airfoil.cl, airfoil.cd, airfoil.cm),
        'points': _columns_of(study.points)}


def with_measured(found: Result, path: Path) -> Result:
    """Return a result with points measured elsewhere beside it, to be drawn."""
    points = polar_import.points(path, whole=False)
    return {**found, 'measured': {'name': path.stem, **(_columns_of(points) or {})}}


def _stall_figures(stall: airfoil_report.StallFigures, side: float) -> Result:
    deg = math.degrees
    return {'cl': side * stall.cl, 'alpha_deg': side * deg(stall.alpha),
            'steepest_fall_per_deg': math.radians(stall.steepest_fall),
            'steepest_at_deg': side * deg(stall.steepest_at),
            'softness_deg': deg(stall.softness) if math.isfinite(stall.softness) else None}


def _columns_of(points: Imported | None) -> Result | None:
    if points is None:
        return None
    return _columns(points.alpha, points.cl, points.cd, points.cm)


def _columns(alpha, cl, cd, cm) -> Result:
    return {'alpha_deg': np.degrees(alpha).round(6).tolist(), 'cl': cl.tolist(),
            'cd': None if cd is None else cd.tolist(), 'cm': None if cm is None else cm.tolist()}

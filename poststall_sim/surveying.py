# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The survey of an aircraft as plain results: numbers with units in their keys, and tables."""

import math
from collections.abc import Iterable

from poststall_sim import jobs, survey
from poststall_sim.aero.model import Model
from poststall_sim.polar import Stall
from poststall_sim.survey import Finding, Survey


def result(figures: Survey, stall: Stall | None, found: Iterable[Finding]) -> jobs.Result:
    """Return what ``--json`` writes."""
    return {
        'surfaces': [{
            'name': each.name, 'area_m2': each.area, 'span_m': each.span,
            'aspect_ratio': each.aspect_ratio, 'mean_chord_m': each.mean_chord,
            'quarter_chord_m': [each.quarter_x, 0.0, each.quarter_z],
            'sweep_deg': math.degrees(each.sweep), 'dihedral_deg': math.degrees(each.dihedral),
            'volume': each.volume} for each in figures.planforms],
        'neutral_point_m': figures.neutral_point, 'static_margin': figures.static_margin,
        'CL_alpha': figures.lift_slope, 'Cl_p': figures.roll_damping,
        'stall': stall and jobs.stalled(stall),
        'authority': {name: dict(zip(('Cl', 'Cm', 'Cn'), values))
                      for name, values in figures.authority.items()},
        'findings': [{'subject': each.subject, 'what': each.what, 'advice': each.advice}
                     for each in found]}


def surfaces(figures: Survey) -> tuple[tuple[str, ...], list[list[str]]]:
    """Return head and rows of the table of surfaces."""
    head = ('', 'area [m2]', 'span [m]', 'aspect ratio', 'mean chord [m]', 'at x [m]',
            'sweep [deg]', 'dihedral [deg]', 'volume')
    return head, [[each.name, f'{each.area:.4g}', f'{each.span:.4g}', f'{each.aspect_ratio:.2f}',
                   f'{each.mean_chord:.4g}', f'{each.quarter_x:.4g}',
                   f'{math.degrees(each.sweep):z.1f}', f'{math.degrees(each.dihedral):z.1f}',
                   '' if each.volume is None else f'{each.volume:.3f}']
                  for each in figures.planforms]


def stall_line(stall: Stall | None, model: Model) -> str:
    """Return what the stall is, at sea level and controls neutral, in words."""
    if stall is None:
        return f'no stall: lift rises on to alpha {math.degrees(survey.STALLING[-1]):g} deg'
    return f'{jobs.stall_words(stall, model, 0.0)}, controls neutral'


def lines(figures: Survey) -> list[tuple[str, str]]:
    """Return the other figures, name and value."""
    authority = ((name, ', '.join(
        f'{axis} {value:+z.3f}' for axis, value in zip(('Cl', 'Cm', 'Cn'), values)
        if abs(value) > 5e-4)) for name, values in figures.authority.items())
    return [('neutral point', f'x = {figures.neutral_point:.4g} m'),
            ('static margin', f'{100.0 * figures.static_margin:.1f} % of the reference '
             f'chord of {figures.chord:.4g} m'),
            ('lift slope', f'{figures.lift_slope:.3f} per rad'),
            ('roll damping', f'Cl_p = {figures.roll_damping:.3f}'),
            *((f'full {name}', what or 'nothing') for name, what in authority)]


def findings(found: Iterable[Finding]) -> list[str]:
    """Return a line for each finding: what is odd, and what to do."""
    return [f'{each.subject}: {each.what}. {each.advice[0].upper()}{each.advice[1:]}.'
            for each in found]

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Do the decambering solvers converge, in how few iterations, and which scheme needs fewest.

Random flows from no decambering on aircraft of four sizes, three curves, both angle forms and
both closures, at a tolerance of 1e-4; rechecked in numpy, see test/cold_starts.py. Then any
attitude, the iterations of schemes A to D, and the ratios of test_decambering_speed. Asked of
wing and tail on 26 strips:

* robust (local closure): all converge, 10 iterations in the mean, 20 for 95 %;
* Newton (non-local): all converge, in 10 steps on the gentle and the normal curve, 6 in the mean
  on the sharp one, with averages over 1 and over 1.5 chords;

of the others that all converge, and from any attitude 99.9 %. Tables are printed, and written to
`results/decambering_convergence.json`; counts are asserted, no clocks.

`make soak ARGS='-k convergence --flows 50'` is a quick look. Flows are new at every run;
POSTSTALL_SEED brings them back.
"""

import itertools
import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

import curves
import test_decambering_speed as speed
from cold_starts import (
    ATTITUDES,
    SHAPES,
    TOLERANCE,
    Starts,
    any_attitude,
    asked,
    broken,
)
from dissertation import RANKED, RELAXED, ranking
from report import keep

from poststall_sim.aero.decambering import AngleForm, Closure
from poststall_sim.aero.schemes import Scheme

MANY, FEWER = 2000, 500
ASKED = {'robust, mean iterations': ('<=', 10), 'robust, iterations of 95 %': ('<=', 20),
         'non-local, most iterations, gentle and normal': ('<=', 10),
         'non-local, mean iterations, sharp': ('<=', 6), 'lost': ('<=', 0)}
HEAD = (f'{"shape":18}{"strips":>6}  {"curve":8}{"form":8}{"closure":11}{"ell":>4}{"flows":>7}'
        f'{"lost":>5}{"mean":>8}{"p95":>6}{"max":>7}{"rechecked":>11}  asked')


def summary(outcome, shape, strips, name, form, closure, ell, allowed, missed):
    """Return the row of an outcome; `allowed` may be lost, `missed` is what else it breaks."""
    lost = len(outcome.lost)
    verdict = [f'BROKEN: {what}' for what in missed] \
        + [f'BROKEN: {lost} lost, {allowed} allowed'] * (lost > allowed)
    return {
        'shape': shape, 'strips': strips, 'curve': name, 'form': form.value,
        'closure': closure.value, 'ell': ell, 'flows': len(outcome.worst), 'lost': lost,
        'mean': float(outcome.iterations.mean()),
        'p95': float(np.percentile(outcome.iterations, 95)),
        'max': int(outcome.iterations.max()), 'rechecked': float(outcome.worst.max()),
        'verdict': ', '.join(verdict) or 'holds',
        'lost flows': outcome.lost}


def line(row):
    return (f'{row["shape"]:18}{row["strips"]:>6}  {row["curve"]:8}{row["form"]:8}'
            f'{row["closure"]:11}{row["ell"]:>4g}{row["flows"]:>7}{row["lost"]:>5}'
            f'{row["mean"]:>8.2f}{row["p95"]:>6.0f}{row["max"]:>7}{row["rechecked"]:>11.2e}  '
            + row['verdict'])


def draws(shape, strips, form):
    """Return the number of flows: many, but where solutions cost much and none is in doubt."""
    # Narrow strips in one plane, sines as sines: there, if anywhere, a search ends beside a fold.
    hard = shape == 'wing and tail' and form is AngleForm.EXACT
    return MANY if strips == 26 or hard else FEWER


def rows(seed, most):
    """Yield the table's rows as they are measured, at most `most` flows in each."""
    for shape, form, name in itertools.product(SHAPES, AngleForm, curves.STALLS):
        starts = Starts(shape, name, form, min(most, draws(*shape, form)), seed)
        for closure, ell in asked(name):
            outcome = starts.solve(closure, ell)
            missed = broken(outcome, closure, name, ell) if shape == SHAPES[0] else []
            yield summary(outcome, *shape, name, form, closure, ell, 0, missed)
    for name, ell in ATTITUDES:
        count = min(most, MANY)
        yield summary(any_attitude(name, ell, count, seed), 'any attitude', 26, name,
                      AngleForm.EXACT, Closure.NONLOCAL, ell, count // 1000, [])


def ranking_lines(table):
    """Return the lines of Table 3.1 in kind."""
    lines = [f'{"iterations, undamped":24}' + ''.join(f'{a:>24.0f} deg' for a in RANKED),
             ' ' * 24 + ''.join(f'{scheme.value:>7}' for scheme in RELAXED) * len(RANKED)]
    for name, at in table.items():
        lines.append(f'{name:24}' + ''.join(
            f'{"-" if used == math.inf else used:>7}'
            for needed in at.values() for used in needed.values()))
    return lines


@pytest.mark.soak
@pytest.mark.timeout(7200)
def test_convergence_of_the_decambering_solvers(request, capsys):
    """All in one run: every row holds, and D needs fewest iterations of the four schemes."""
    most = request.config.getoption('--flows') or MANY
    found = []
    with capsys.disabled():
        print()
        seed = curves.fresh_seed()
        print(HEAD)
        for row in rows(seed, most):
            found.append(row)
            print(line(row), flush=True)
        table = ranking()
        print('', *ranking_lines(table), sep='\n')
        costs = [speed.measure(name, form) for name in curves.STALLS for form in AngleForm]
        print('', *speed.table(costs), sep='\n')
    keep('decambering_convergence', ASKED, seed=seed, tolerance=TOLERANCE, rows=found,
         ranking={name: {f'{degrees:g}': {
             scheme.value: None if used == math.inf else used for scheme, used in needed.items()}
             for degrees, needed in at.items()} for name, at in table.items()},
         costs=costs)
    assert not [line(row) for row in found if 'BROKEN' in row['verdict']]
    for name, at in table.items():
        for degrees, needed in at.items():
            assert min(needed, key=needed.get) is Scheme.D, (name, degrees, needed)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Each example runs as a script where nothing else is, and what it prints is physics."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1] / 'examples'
SCRIPTS = sorted(path.stem for path in FOLDER.glob('*.py') if path.stem != 'figures')


def numbers(text, start):
    """Return the numbers of the line that begins so."""
    line, = (each for each in text.splitlines() if each.startswith(start))
    return [float(word) for word in re.findall(r'-?\d+\.?\d*', line[len(start):])]


@pytest.fixture
def run(tmp_path):
    def started(name, *words):
        environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, [
            str(FOLDER.parent), os.environ.get('PYTHONPATH', '')]))}
        done = subprocess.run(
            [sys.executable, str(FOLDER / f'{name}.py'), *words], cwd=tmp_path, timeout=280,
            env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout
    return started


def test_the_polar_follows_the_lifting_line_and_then_stalls(run, tmp_path):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    text = run('polar_past_stall', '--quick', '--figure', 'polar.png')
    slope, line = numbers(text, 'lift slope')
    # A rectangular wing of aspect ratio 12 has some 5 % less than the elliptic one.
    assert 0.90 < slope / line < 1.0
    peak, alpha, attached = numbers(text, 'greatest lift')
    assert 12.0 <= alpha <= 20.0 and peak < attached
    at = numbers(text, 'lift at 30 deg')
    assert at[0] < peak and at[0] < 0.5 * at[1]
    assert (tmp_path / 'polar.png').read_bytes().startswith(b'\x89PNG')


def test_the_gust_loads_the_aircraft_nearly_as_the_estimate_says(run):
    """Pratt's aircraft heaves only; one that pitches up as its wing meets the gust has more."""
    text = run('gust_response', '--quick')
    peak, expected, sharp = numbers(text, 'greatest load factor')
    assert 0.8 * (expected - 1.0) < peak - 1.0 < 1.35 * (expected - 1.0)
    assert peak < sharp
    assert numbers(text, 'share of strips stalled at most') == [0.0]


def test_the_spin_turns_left_with_the_left_wing_stalled(run):
    text = run('spin_entry', '--quick')
    turns, seconds = numbers(text, 'turns')
    rate, = numbers(text, 'rate of turn at the end')
    assert turns < -1.0 and rate < -100.0
    assert abs(turns) * 360.0 / seconds < 1.3 * abs(rate)   # it has gathered way
    left, right = numbers(text, 'share of strips stalled: left')
    assert left > 0.95 and right < 0.8


def test_the_law_saves_most_of_the_height_that_nobody_loses(run):
    text = run('autopilot_in_the_loop', '--quick')
    lost, *_ = numbers(text, 'nobody: lost')
    saved, bank, alpha = numbers(text, 'law: lost')
    assert saved < 0.5 * lost and abs(bank) < 10.0 and 0.0 < alpha < 12.0


def test_the_loci_end_in_a_faster_departure_past_the_stall(run):
    text = run('root_locus', '--quick')
    slow, fast = (numbers(text, f'alpha {alpha} deg') for alpha in (4, 18))
    assert slow[0] > fast[0]        # airspeed of the glide
    assert fast[1] > 3.0 * slow[1]  # growth of the fastest mode
    damping = [float(re.search(r'short period (-?[\d.]+)', line).group(1))
               for line in text.splitlines() if 'short period' in line]
    assert damping[0] < damping[1] < 0.0   # the short period is less damped past the stall


def test_a_law_recovers_with_more_reward_than_chance(run):
    pytest.importorskip('gymnasium', reason='gymnasium is not installed: see extra learning')
    text = run('learning_to_recover', '--quick')
    first, second = numbers(text, 'best of each generation: ')
    assert second >= first   # the best goes along
    chance, = numbers(text, 'random: mean reward')
    law, = numbers(text, 'example law: mean reward')
    found, = numbers(text, 'found law: mean reward')
    assert law > chance and found > chance


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.parametrize('name', SCRIPTS)
def test_each_runs_in_full_and_draws_its_figure(run, tmp_path, name):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    assert 'drawn: figure.png' in run(name, '--figure', 'figure.png')
    assert (tmp_path / 'figure.png').read_bytes().startswith(b'\x89PNG')


def test_examples_are_short_and_listed():
    page = (FOLDER.parent / 'docs' / 'examples.md').read_text()
    assert len(SCRIPTS) == 6
    for name in SCRIPTS:
        assert len((FOLDER / f'{name}.py').read_text().splitlines()) < 80, name
        assert f'../examples/{name}.py' in page and f'images/example_{name}.png' in page

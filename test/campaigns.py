# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Small campaigns for the tests: definitions, a pilot that fails as it is told, a cluster."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

BRIEF = """\
name: brief
aircraft: trainer
duration_s: 0.1
initial: {airspeed_m_s: 12.0, altitude_m: 150.0}
vary:
  - {key: initial.alpha_deg, grid: {from: 2.0, to: 30.0, count: 4}}
  - {key: aircraft.mass.mass_kg, uniform: {from: 8.5, to: 9.5}}
samples: {count: 2}
seed: 3
"""
"""Eight flights of a tenth of a second."""

PILOT = """\
import os
import time


def make(trim, dt, seed):
    def hold(snapshot):
        time.sleep({pause})
        return {{}}
    return hold


def raises(trim, dt, seed):
    raise ValueError('no such thing')


def misnames(trim, dt, seed):
    return lambda snapshot: {{'elevatr': 0.1}}


def says_nothing(trim, dt, seed):
    return lambda snapshot: {{'elevator': float('nan')}}


def kills(trim, dt, seed):
    os._exit(1)


def spins(trim, dt, seed):
    def command(snapshot):
        begun = time.thread_time()
        while time.thread_time() - begun < 0.05:
            pass
        return {{}}
    return command
"""


def written(folder, text=BRIEF, name='brief.yaml', pause=0.0):
    """Write a campaign, and beside it the pilots it may name; return its file."""
    folder.mkdir(exist_ok=True)
    (folder / 'campaign_pilots.py').write_text(PILOT.format(pause=pause))
    path = folder / name
    path.write_text(text)
    return path


def environment(*folders):
    """Return the environment of a process that imports this package, and from folders."""
    paths = [str(ROOT), *map(str, folders), os.environ.get('PYTHONPATH', '')]
    return {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, paths)),
            'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1'}


@contextlib.contextmanager
def started(*words, folder, log, **options):
    """Give a process of a Python module, ended when the block is."""
    with open(log, 'ab') as out:
        process = subprocess.Popen(
            [sys.executable, '-m', *words], env=environment(folder), cwd=folder,
            # Who runs the tests in the background of a shell has interrupts ignored, and so
            # would what the tests begin.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            stdout=out, stderr=subprocess.STDOUT, **options)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def eventually(condition, what, seconds=120.0):
    """Wait for a condition, and return what it gave."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.05)
    raise AssertionError(f'no {what} within {seconds:g} s')

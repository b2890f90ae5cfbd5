# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What the learning environment costs beyond its flights, alone and as a vector.

The yardstick is the bare march: the same flights, stepped with the same controls by nothing but
`Flight.step`. Wall time, on two workers: prints what it finds and writes `results/learning.json`.
"""

import functools
import json
import time

import numpy as np
import pytest
from report import holds, keep

pytest.importorskip('gymnasium', reason='gymnasium is not installed: see extra learning')

from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

from poststall_sim.learning.environment import RecoveryEnv
from poststall_sim.state import Controls

ENVIRONMENTS, STEPS, HELD = 4, 50, 5
ASKED = {'share of a step that is the bare march': ('>=', 0.85)}
make = functools.partial(RecoveryEnv, duration=3600.0, until_recovered=False,
                         steps_per_action=HELD,
                         starts={'turbulence': 0.0, 'wind': 0.0, 'altitude': 5000.0})


def bare(env, action, seed):
    """March a flight of the environment's by itself; return the time of one of its steps [s]."""
    env.reset(seed=seed)
    flight = env.unwrapped._flight
    controls = Controls(action[:-1], float(action[-1]))
    begin = time.perf_counter()
    for _ in range(STEPS * HELD):
        flight.step(controls)
    return (time.perf_counter() - begin) / STEPS


def single(env, action, seed):
    env.reset(seed=seed)
    begin = time.perf_counter()
    for _ in range(STEPS):
        env.step(action)
    return (time.perf_counter() - begin) / STEPS


def together(vector, action):
    """Step a vector; return the time of a step of one of its environments [s]."""
    actions = np.tile(action, (vector.num_envs, 1))
    try:
        vector.reset(seed=0)
        for _ in range(3):
            vector.step(actions)
        begin = time.perf_counter()
        for _ in range(STEPS):
            vector.step(actions)
        return (time.perf_counter() - begin) / STEPS / vector.num_envs
    finally:
        vector.close()


def test_steps_per_second_alone_and_as_a_vector():
    env = make()
    action = env.trim_action
    single(env, action, 0)
    # By turns, and the least of each: what else the machine does passes both by.
    pairs = [(bare(env, action, seed), single(env, action, seed)) for seed in (0, 1, 2, 0, 1, 2)]
    march, one = (sum(min(pair[k] for pair in pairs[seed::3]) for seed in range(3)) / 3
                  for k in (0, 1))
    times = {'bare march': march, 'single': one,
             'synchronous': together(SyncVectorEnv([make] * ENVIRONMENTS), action),
             'asynchronous': together(
                 AsyncVectorEnv([make] * ENVIRONMENTS, context='spawn'), action)}
    try:
        from poststall_sim.learning.vector import DaskVectorEnv
        times['Dask, 2 workers'] = together(
            DaskVectorEnv([make] * ENVIRONMENTS, workers=2), action)
    except ImportError:
        pass   # the extra campaign is not there
    found = {'share of a step that is the bare march': march / one}
    rates = {name: 1.0 / value for name, value in times.items()}
    print(json.dumps({**found, 'steps_per_s': rates}, indent=1))
    keep('learning', ASKED, found=found, steps_per_s=rates, environments=ENVIRONMENTS,
         steps_held=HELD)
    for name, value in found.items():
        assert holds(ASKED[name], value), (name, value)

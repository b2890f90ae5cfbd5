# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The learning environment: gymnasium's contract, same seed same bits, branches, many at once."""

import dataclasses
import functools
import math
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('gymnasium', reason='gymnasium is not installed: see extra learning')

import gymnasium
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

import poststall_sim.learning as learning
from poststall_sim import autopilot_law
from poststall_sim.aircraft import ConfigError
from poststall_sim.autopilot_law import Law, Memory, Seen
from poststall_sim.learning.environment import RecoveryEnv
from poststall_sim.learning.rewards import CRASH, SECOND
from poststall_sim.learning.starts import Starts

make = functools.partial(RecoveryEnv, duration=0.4)


@pytest.fixture(scope='module')
def env():
    return RecoveryEnv()


def actions(env, count, seed=0):
    """Return random actions within the bounds."""
    generator = np.random.default_rng(seed)
    return generator.uniform(env.action_space.low, env.action_space.high,
                             (count, *env.action_space.shape))


def flown(env, given):
    """Step through actions; return all that comes back, until the episode is over."""
    steps = []
    for action in given:
        steps.append(env.step(action))
        if steps[-1][2] or steps[-1][3]:
            break
    return steps


def same(steps, others):
    """Tell whether two runs are the same to the bit, infos included."""
    return len(steps) == len(others) and all(
        a[0].tobytes() == b[0].tobytes() and a[1:] == b[1:] for a, b in zip(steps, others))


def law_action(env, observation, memory):
    """Return what the example law commands where this is seen, and what it remembers."""
    seen = dict(zip((each.name for each in env.observed), observation.tolist()))
    answer, memory = autopilot_law.answer(
        Law(), memory, Seen(**{name: seen[name] for name in Seen.__slots__}), env.dt)
    return np.array([getattr(answer, each.name) for each in env.commanded]), memory


@pytest.mark.filterwarnings('ignore:.*we recommend using a symmetric and normalized space')
@pytest.mark.parametrize('name', [learning.STALL, learning.UPSET])
def test_gymnasium_finds_nothing_wrong(name):
    check_env(gymnasium.make(name).unwrapped)


def test_the_same_seed_and_actions_give_the_same_bits_and_other_seeds_do_not(env):
    given = actions(env, 20)
    first, _ = env.reset(seed=5)
    steps = flown(env, given)
    assert env.reset(seed=6)[0].tobytes() != first.tobytes()
    again, _ = env.reset(seed=5)
    assert again.tobytes() == first.tobytes()
    assert same(flown(env, given), steps)
    assert same(flown_in(RecoveryEnv(), 5, given), steps)


def flown_in(env, seed, given):
    env.reset(seed=seed)
    return flown(env, given)


def test_a_branch_goes_on_as_the_trunk_did_and_leaves_it_alone(env):
    given = actions(env, 24, seed=1)
    env.reset(seed=2, options={'turbulence': 1.0, 'wind': 3.0})
    flown(env, given[:8])
    state = pickle.loads(pickle.dumps(env.get_state()))
    trunk = flown(env, given[8:])
    assert len(trunk) == 16
    env.set_state(state)
    other = flown(env, given[8:][::-1])
    assert not same(other, trunk)
    other = RecoveryEnv()   # the air of the episode comes along
    other.set_state(state)
    assert same(flown(other, given[8:]), trunk)


def test_starts_are_drawn_all_over_their_ranges_and_options_pin_them(env):
    """The mean of 60 even draws is within four of its standard deviations of the middle."""
    seen = [env.reset(seed=seed, options={'wind': 0.0, 'turbulence': 0.0})[0]
            for seed in range(60)]
    columns = dict(zip((each.name for each in env.observed), np.transpose(seen)))
    for name, key in (('airspeed', 'airspeed'), ('alpha', 'alpha'), ('beta', 'beta'),
                      ('roll', 'roll'), ('altitude', 'altitude'), ('p', 'roll_rate'),
                      ('q', 'pitch_rate'), ('r', 'yaw_rate')):
        low, high = getattr(env.starts, key)
        assert low - 1e-9 <= columns[name].min() and columns[name].max() <= high + 1e-9
        error = abs(columns[name].mean() - 0.5 * (low + high))
        assert error < 4.0 * (high - low) / math.sqrt(12.0 * 60.0), name
    one, _ = env.reset(seed=0, options={'alpha': 0.5, 'roll': (0.1, 0.2)})
    pinned = dict(zip(columns, one))
    assert pinned['alpha'] == pytest.approx(0.5, abs=1e-12) and 0.1 <= pinned['roll'] <= 0.2
    assert pinned['p'] == columns['p'][0]   # what is drawn of one leaves the others


@pytest.mark.parametrize('options, message', [
    ({'alfa': 0.3}, "unknown start 'alfa', there are airspeed, alpha"),
    ({'alpha': (0.6, 0.3)}, r'start alpha must be a number, or \(low, high\), from -3.142'),
    ({'alpha': 'high'}, "start alpha must be .* got 'high'"),
    ({'airspeed': math.nan}, 'start airspeed must be'),
    ({'altitude': -3.0}, 'start altitude must be .* from 0.1 to 2e'),
])
def test_a_start_that_cannot_be_is_refused_with_its_name(env, options, message):
    with pytest.raises(ConfigError, match=message):
        env.reset(options=options)


def test_an_action_that_is_none_is_refused_and_one_out_of_bounds_is_cut(env):
    env.reset(seed=0)
    with pytest.raises(ConfigError, match='4 finite numbers, aileron, elevator, rudder, throttle'):
        env.step(np.array([0.0, math.nan, 0.0, 0.0]))
    env.reset(seed=0)
    cut = env.step(10.0 * env.action_space.high)
    env.reset(seed=0)
    assert same([env.step(env.action_space.high)], [cut])


def test_an_action_is_held_for_whole_steps():
    with pytest.raises(ConfigError, match='steps_per_action must be a whole number'):
        RecoveryEnv(steps_per_action=2.5)


def test_the_reward_is_the_height_the_time_and_the_crash(env):
    """Over whole episodes: of a dive into the ground, and of one that runs out of time."""
    env.reset(seed=1, options={'altitude': 6.0})
    steps = flown(env, [env.action_space.low] * 300)
    *_, (_, _, terminated, truncated, info) = steps
    assert (terminated, truncated, info['end']) == (True, False, 'ground')
    assert sum(step[1] for step in steps) == pytest.approx(
        -info['height_lost_m'] - SECOND * info['flown_s'] - CRASH, abs=1e-9)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(env.trim_action)
    short = make()
    short.reset(seed=1, options={'alpha': 0.6, 'roll': 0.8})
    steps = flown(short, [short.trim_action] * 300)
    assert [step[3] for step in steps] == [False] * 9 + [True]   # 0.4 s of 0.04
    assert not steps[-1][2]
    counted = RecoveryEnv(duration=0.4, reward=lambda step: 1.0)
    counted.reset(seed=1)
    assert [step[1] for step in flown(counted, [counted.trim_action] * 300)] == [1.0] * 10


def test_the_example_law_comes_back_with_less_height_lost_than_a_pull(env):
    """What the environment is for: to push out of a stall saves height, to pull loses it."""
    lost = {}
    for way in ('law', 'pull'):
        observation, info = env.reset(seed=4, options={'roll': 0.0, 'alpha': 0.45})
        memory, over = Memory(), False
        while not over:
            action, memory = law_action(env, observation, memory)
            if way == 'pull':
                action = np.array([0.0, env.action_space.low[1], 0.0, 0.0])
            observation, _, end, cut, info = env.step(action)
            over = end or cut
        lost[way] = info['end'], info['height_lost_m']
    assert lost['law'][0] == 'recovered'
    assert lost['pull'][0] != 'recovered' or lost['pull'][1] > 2.0 * lost['law'][1]


def rolled(vector, steps, seed=10):
    """Step a vector of environments through random actions; return all that comes back."""
    generator = np.random.default_rng(0)
    found = [vector.reset(seed=seed)]
    for _ in range(steps):
        found.append(vector.step(generator.uniform(
            vector.action_space.low, vector.action_space.high)))
    return found


def alike(a, b):
    """Require the same to the bit, through tuples, mappings and arrays."""
    assert type(a) is type(b)
    if isinstance(a, dict):
        assert list(a) == list(b)
        a, b = list(a.values()), list(b.values())
    if isinstance(a, (tuple, list)):
        assert len(a) == len(b)
        for x, y in zip(a, b):
            alike(x, y)
    else:
        assert a.dtype == b.dtype and a.shape == b.shape
        assert a.tolist() == b.tolist() if a.dtype == object else a.tobytes() == b.tobytes()


@pytest.fixture(scope='module')
def synchronous():
    """Return what three environments give one after the other, past the end of episodes."""
    vector = SyncVectorEnv([make] * 3)
    found = rolled(vector, 14)
    vector.close()
    return found


def test_each_of_a_vector_is_the_single_environment_of_its_seed(synchronous):
    generator = np.random.default_rng(0)
    low, high = make().action_space.low, make().action_space.high
    given = generator.uniform(np.tile(low, (10, 3, 1)), np.tile(high, (10, 3, 1)))
    for place in range(3):
        alone = flown_in(make(), 10 + place, given[:, place])
        for (observation, reward, *_), step in zip(alone, synchronous[1:]):
            assert step[0][place].tobytes() == observation.tobytes()
            assert step[1][place] == reward
    assert len({row.tobytes() for row in synchronous[0][0]}) == 3   # seeds of their own


def test_processes_of_their_own_give_the_same_bits(synchronous):
    vector = AsyncVectorEnv([make] * 3, context='spawn')
    try:
        alike(rolled(vector, 14), synchronous)
    finally:
        vector.close()


def test_the_engine_of_campaigns_gives_the_same_bits(synchronous):
    pytest.importorskip('distributed', reason='distributed is not installed: see extra campaign')
    from poststall_sim.learning.vector import DaskVectorEnv
    vector = DaskVectorEnv([make] * 3, workers=2)
    try:
        alike(rolled(vector, 14), synchronous)
        states = vector.call('get_state')
        after = vector.step(vector.action_space.low)
        vector.call('set_state', [(state,) for state in states])
        alike(vector.step(vector.action_space.low), after)
    finally:
        vector.close()


@pytest.mark.timeout(120)
def test_a_worker_that_dies_is_said_so():
    pytest.importorskip('distributed', reason='distributed is not installed: see extra campaign')
    from poststall_sim.campaign.engine import EngineError
    from poststall_sim.learning.vector import DaskVectorEnv
    vector = DaskVectorEnv([functools.partial(make, reward=lambda step: os._exit(1))], workers=1)
    try:
        vector.reset(seed=0)
        for _ in range(2):
            with pytest.raises(EngineError, match='a worker has gone'):
                vector.step(vector.action_space.low)
    finally:
        vector.close()


def test_the_page_has_what_is_seen_with_its_unit(env):
    page = (Path(__file__).resolve().parents[1] / 'docs' / 'learning.md').read_text()
    for each in env.observed[:-len(env.commanded)]:
        assert f'| `{each.name}` | {each.unit} |' in page
    assert all(f'`{field.name}`' in page for field in dataclasses.fields(Starts))
    assert learning.STALL in page and learning.UPSET in page


def test_gymnasium_finds_the_environment_by_its_module():
    name = f'poststall_sim.learning:{learning.UPSET}'
    program = (f'import gymnasium; env = gymnasium.make("{name}");'
               'print(env.reset(seed=1)[0].tobytes().hex())')
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                          timeout=120, cwd=Path(__file__).resolve().parents[1])
    assert done.returncode == 0, done.stderr
    here, _ = gymnasium.make(learning.UPSET).reset(seed=1)
    assert done.stdout.split()[-1] == here.tobytes().hex()


def test_a_range_of_starts_may_be_given_by_name():
    assert Starts().changed({'alpha': 0.3}).alpha == (0.3, 0.3)
    assert gymnasium.make(learning.STALL, starts={'alpha': (0.2, 0.3)}).unwrapped.starts.alpha \
        == (0.2, 0.3)

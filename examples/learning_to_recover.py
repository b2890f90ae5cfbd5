# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Recoveries by chance, by the example law, and by gains of it that a search has found."""

import dataclasses

import figures
import numpy as np

from poststall_sim import autopilot_law
from poststall_sim.autopilot_law import Law, Memory, Seen
from poststall_sim.learning.environment import RecoveryEnv

SEARCHED = 'recovery_alpha recovery_alpha_gain recovery_rudder_gain pitch_alpha_gain'.split()
SEEN = tuple(field.name for field in dataclasses.fields(Seen))


class Pilot:
    """The example law with some gains; what it remembers is of one episode."""

    def __init__(self, env, law):
        self.env, self.law, self.memory = env, law, Memory()

    def __call__(self, observation):
        """Return the action where this is observed."""
        seen = dict(zip((each.name for each in self.env.observed), observation.tolist()))
        told, self.memory = autopilot_law.answer(
            self.law, self.memory, Seen(**{name: seen[name] for name in SEEN}), self.env.dt)
        return np.array([getattr(told, each.name) for each in self.env.commanded])


def score(env, made, seeds):
    """Return the mean over some seeds of the rewards of whole episodes."""
    total = 0.0
    for seed in seeds:
        policy, (observation, _), over = made(), env.reset(seed=seed), False
        while not over:
            observation, reward, ended, cut, _ = env.step(policy(observation))
            total, over = total + reward, ended or cut
    return total / len(seeds)


def main(arguments):
    """Search by the cross-entropy method, print scores of other flights than it saw, draw."""
    env = RecoveryEnv(duration=3.0 if arguments.quick else 8.0)
    generator = np.random.default_rng(arguments.seed)
    env.action_space.seed(arguments.seed)
    generations, drawn, best = (2, 3, 2) if arguments.quick else (5, 8, 3)
    trained, tested = ([0], [100]) if arguments.quick else (range(4), range(100, 110))

    def pilot(gains):
        return lambda: Pilot(env, dataclasses.replace(Law(), **dict(zip(SEARCHED, gains))))

    middle = np.array([getattr(Law(), name) for name in SEARCHED])
    spread, curve = 0.4 * middle, []
    for _ in range(generations):   # what was best goes along
        tried = [middle, *(middle + spread * generator.standard_normal((drawn, len(middle))))]
        scores = np.array([score(env, pilot(gains), trained) for gains in tried])
        elite = np.array(tried)[np.argsort(-scores)[:best]]
        middle, spread = elite[0], elite.std(axis=0) + 0.02 * np.abs(middle)
        curve.append(float(scores.max()))
    found = {'random': score(env, lambda: lambda _: env.action_space.sample(), tested),
             'example law': score(env, lambda: Pilot(env, Law()), tested),
             'found law': score(env, pilot(middle), tested)}
    print('best of each generation: ' + ', '.join(f'{value:.2f}' for value in curve))
    print(', '.join(f'{name} {value:.3g}' for name, value in zip(SEARCHED, middle)))
    for name, value in found.items():
        print(f'{name}: mean reward {value:.2f}')
    if arguments.figure:
        with figures.drawn(arguments.figure) as (axes,):
            axes.plot(np.arange(1, generations + 1), curve, 'o-')
            axes.set(xlabel='generation', ylabel='best mean reward',
                     xticks=1 + np.arange(generations))


if __name__ == '__main__':
    parser = figures.options(__doc__)
    parser.add_argument('--seed', type=int, default=0, help='of the search')
    main(parser.parse_args())

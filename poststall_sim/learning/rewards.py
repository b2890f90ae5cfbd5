# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Rewards: functions of one step, any of which may stand in for another."""

import enum
from collections.abc import Callable
from dataclasses import dataclass

from poststall_sim.frames import FloatArray
from poststall_sim.state import Snapshot

SECOND, CRASH = 1.0, 100.0
"""What a second costs that is not recovered, and what the ground or divergence costs [m]."""


class End(enum.Enum):
    """What ends an episode before its time."""

    RECOVERED = 'recovered'
    GROUND = 'ground'
    DIVERGED = 'diverged'


@dataclass(frozen=True, slots=True, eq=False)
class Transition:
    """
    One step of a learner: the instants before and after, and what was commanded between.

    action : as it was given; height_lost [m] : how much deeper it went than ever before, below
    the highest place so far; recovered : by now; end : what ended the episode, None while it goes
    on.
    """

    before: Snapshot
    after: Snapshot
    action: FloatArray
    height_lost: float
    recovered: bool
    end: End | None


Reward = Callable[[Transition], float]


def height_kept(step: Transition) -> float:
    """
    Return the reward of a recovery with the least loss of height [m].

    Summed over an episode: minus the height lost, minus a metre for every second until it has
    recovered (so that to hang on the propeller is no way out), minus a hundred for a crash.
    """
    late = 0.0 if step.recovered else SECOND * (step.after.time - step.before.time)
    crash = CRASH if step.end in (End.GROUND, End.DIVERGED) else 0.0
    return -(step.height_lost + late + crash)

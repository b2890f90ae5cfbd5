# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flights past the stall for programs that learn, behind the interface of `gymnasium`.

To import it makes its environments known to `gymnasium.make`, which imports it itself where it is
named before a colon: ``poststall_sim.learning:poststall_sim/StallRecovery-v0``.
"""

import contextlib
import math
from typing import Any

STALL, UPSET = 'poststall_sim/StallRecovery-v0', 'poststall_sim/UpsetRecovery-v0'
_STARTS: dict[str, dict[str, Any]] = {
    STALL: {},
    # As config/campaigns/upset_recovery.yaml has it, but from any roll.
    UPSET: {'airspeed': (6.0, 10.0), 'alpha': (0.07, math.pi / 3), 'roll': (-math.pi, math.pi),
            'roll_rate': (-7.0, 7.0)}}


def register() -> None:
    """Make the environments known to `gymnasium`, once."""
    from gymnasium.envs import registration
    for name, starts in _STARTS.items():
        if name not in registration.registry:
            registration.register(
                name, entry_point='poststall_sim.learning.environment:RecoveryEnv',
                kwargs={'starts': starts})


with contextlib.suppress(ImportError):   # starts and rewards are there without gymnasium
    register()

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Ten minutes of flight: what a step costs and keeps at the end is what it did at the start."""

import resource
import sys
import time
from pathlib import Path

import numpy as np
import processes
import pytest
import wings

from poststall_sim import coupling, simulation
from poststall_sim.aero import wash
from poststall_sim.state import Controls, Status

AIRSPEED, MINUTES, DT = 15.0, 10, 0.01
PER_MINUTE = round(60.0 / DT)


def resident_MB():
    """Return the memory that the process holds now; where /proc is not, its largest so far."""
    if Path('/proc/self/statm').exists():
        return processes.resident_MB()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == 'darwin'
                                                                 else 1e3)


def shapes(state):
    """Return the sizes of all that a flow remembers."""
    wake = state.flow.wake
    return (wake.rows, wake.moving_A.shape, wake.settled_A.shape, wake.settled.nodes.shape,
            wake.settled.rings.shape, state.flow.circulation.shape)


@pytest.mark.soak
@pytest.mark.timeout(1800)
def test_ten_minutes_end_as_fast_and_as_small_as_they_began():
    """The trainer in gentle turns: rows and arrays stay, memory within 5 MB, time within 1.5."""
    flight = simulation.start(
        wings.shipped_aircraft('trainer'), airspeed=AIRSPEED, altitude=2000.0, dt=DT)
    names = flight.model.aircraft.control_names
    aileron, ahead = names.index('aileron'), flight.trim.deflections
    sizes, memory, cost, pairs = [], [], [], []
    for _ in range(MINUTES):
        taken = np.empty(PER_MINUTE, dtype=np.int64)
        for k in range(PER_MINUTE):
            # Against the bank, so that ten minutes stay upright; a nudge every two seconds.
            bank = flight.state.body.q_NB[1]
            deflections = np.array(ahead)
            deflections[aileron] += -0.3 * bank + 0.01 * np.sign(np.sin(np.pi * k * DT))
            begin = time.thread_time_ns()
            snapshot = flight.step(Controls(deflections, flight.trim.throttle))
            taken[k] = time.thread_time_ns() - begin
            assert snapshot.status is Status.CONVERGED
        assert flight.paused_reason is None
        cost.append(np.median(taken))
        memory.append(resident_MB())
        sizes.append(shapes(flight.state))
        placement = coupling.placement(flight.model.aircraft, flight.state.body)
        pairs.append(wash.velocity(flight.state.flow.wake, flight.model.lattice,
                                   flight.model.felt, placement, True)[1])
    assert all(size == sizes[0] for size in sizes)
    assert max(memory[1:]) - memory[0] < 5.0
    # Medians of a minute each, in one process: the neighbours' load is what is left in them.
    assert cost[-1] < 1.5 * cost[1]
    # The count has no neighbours; how long the rows are goes with the airspeed.
    assert pairs[-1] < 1.1 * pairs[1]

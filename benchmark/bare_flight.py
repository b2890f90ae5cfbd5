# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Fly the trainer in step with wall time without any node: what of a simulator is physics.

Arguments: dt [ns], steps between two reports. Each report is a line: mean CPU time of a step [s].
Between its steps the process sleeps, as a simulator does: a processor that comes back to
a step after something else needs longer for it than one that does nothing else.
"""

import gc
import sys
import time

from poststall_sim import definition, simulation
from poststall_sim.threads import one_blas_thread


def main():
    dt, steps = int(sys.argv[1]) * 1e-9, int(sys.argv[2])
    one_blas_thread()
    flight = simulation.start(definition.aircraft(definition.find('aircraft', 'trainer')),
                              airspeed=12.0, altitude=150.0, dt=dt)
    gc.collect()
    gc.freeze()
    due = time.monotonic()
    while True:
        taken = 0.0
        for _ in range(steps):
            due += dt
            time.sleep(max(due - time.monotonic(), 0.0))
            begin = time.thread_time()
            flight.step(flight.trim)
            taken += time.thread_time() - begin
        print(taken / steps, flush=True)


if __name__ == '__main__':
    main()

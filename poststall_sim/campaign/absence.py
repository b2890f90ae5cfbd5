# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Says when a cluster has lost all of its workers, and when it has some again.

A campaign waits for them: whoever runs the cluster may bring others. The scheduler is asked only
while no row comes, so that one with something to do has nothing to answer.
"""

import asyncio
import concurrent.futures
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

ASK = 5.0
"""After so long without a row the scheduler is asked, and as often again [s]."""
ABSENT = 10.0
"""So long it is without a worker before it is said: the next of a local one comes sooner [s]."""
AGAIN = 600.0
"""So often it is said again [s]."""

Row = TypeVar('Row')


def telling(client: Any, rows: Iterable[Row], told: Callable[[str], None]) -> Iterator[Row]:
    """Pass on the rows that a client's cluster computes, and tell when it has no workers."""
    came, through = threading.Event(), threading.Event()
    asking = threading.Thread(target=_ask, args=(client, came, through, told), daemon=True)
    asking.start()
    try:
        for row in rows:
            came.set()
            yield row
    finally:
        through.set()
        asking.join(ASK)   # a scheduler that stands still may keep it longer


def _ask(client: Any, came: threading.Event, through: threading.Event,
         told: Callable[[str], None]) -> None:
    begun = said = None
    while not through.wait(ASK):
        if came.is_set() and said is None:
            came.clear()
            begun = None
            continue
        try:
            workers = len(client.nthreads())
        except (OSError, RuntimeError, asyncio.CancelledError, concurrent.futures.CancelledError):
            continue   # the scheduler has gone: who waits for the rows hears that as well
        now = time.monotonic()
        if workers:
            if said is not None:
                told(f'the cluster has workers again ({workers}), the campaign goes on')
            begun = said = None
        elif begun is None:
            begun = now
        elif now - begun >= ABSENT and (said is None or now - said >= AGAIN):
            told(f'the cluster has had no worker for {now - begun:.0f} s: waiting until one joins '
                 '(Ctrl-C ends it, --resume goes on)')
            said = now

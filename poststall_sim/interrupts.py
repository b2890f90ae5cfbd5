# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Ctrl-C where it would come at the wrong moment, or to the wrong process.

It goes to every process of a terminal, and is raised wherever Python happens to be.
"""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from types import FrameType

SOON = 0.1
"""So long after an interrupt that came at the wrong moment it comes again [s]."""


@contextmanager
def only_here() -> Iterator[None]:
    """
    Leave it to this thread what Ctrl-C means; it comes when the block has ended.

    Threads begun in the block have interrupts blocked, and so have the processes that they begin,
    from their first instruction on, also those that come in the place of one that died.
    """
    if not hasattr(signal, 'pthread_sigmask'):   # Windows
        yield
        return
    # It would be begun with the first process, and lets interrupts through in who begins it.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def not_in_the_compiler() -> Iterator[None]:
    """
    Have an interrupt wait until LLVM has come back.

    LLVM calls Python with each kernel that it has compiled, and what is raised there is printed
    and lost: the kernel is then missing, and that becomes the error.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler or \
            threading.current_thread() is not threading.main_thread():
        yield   # whoever else takes interrupts knows what to do with them
        return
    signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    at = frame
    while at is not None:
        if at.f_globals.get('__name__', '').startswith('llvmlite.'):
            again = threading.Timer(SOON, os.kill, (os.getpid(), number))
            again.daemon = True
            again.start()
            return
        at = at.f_back
    signal.default_int_handler(number, frame)

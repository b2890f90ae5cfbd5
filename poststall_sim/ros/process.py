# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A node as a process: starting, stopping on signals, exit codes."""

import signal
import sys
import threading
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import (
    Executor,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from poststall_sim.aircraft import ConfigError
from poststall_sim.reader import plain
from poststall_sim.threads import one_blas_thread

BAD_INPUT = 2
"""Exit code of a process that was given what it cannot use."""

_asked = threading.Event()
_dropped: Counter[str] = Counter()
_OURS = str(Path(__file__).parents[1])


def dropped() -> int:
    """Return how many messages rclpy itself has stumbled over; each was dropped."""
    return _dropped.total()


def ending() -> bool:
    """Tell whether a signal has asked this process to end: what takes long is left then."""
    return _asked.is_set()


class _Signals:
    """
    SIGINT and SIGTERM: interrupt what is being built, or ask what spins to end; once.

    Compilers call back from C, where an interrupt gets lost: it is repeated until it is heard.
    """

    REPEAT = 0.1
    """After this long an interrupt that was not heard comes again [s]."""

    def __init__(self) -> None:
        self.building = True
        _asked.clear()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM):
            signal.signal(number, self._heard)
        sys.unraisablehook = self._lost

    def built(self) -> None:
        """Interrupt nothing from now on."""
        self.building = False
        signal.setitimer(signal.ITIMER_REAL, 0.0)

    @staticmethod
    def ended() -> None:
        """Hear nothing any more: the interpreter, on its way out, would die of a signal."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)

    def _heard(self, number: int, frame: object) -> None:
        _asked.set()
        if self.building:
            signal.setitimer(signal.ITIMER_REAL, self.REPEAT)
            raise KeyboardInterrupt

    @staticmethod
    def _lost(unraisable: Any) -> None:
        # After an interrupt, what a compiler has half made complains as it is taken down.
        if not (ending() or issubclass(unraisable.exc_type, KeyboardInterrupt)):
            sys.__unraisablehook__(unraisable)


def run(name: str, make: Callable[[], Node], args: list[str] | None = None, *,
        patience: float | None = 0.1) -> int:
    """
    Make a node and spin it until a signal comes or it ends itself; return the exit code.

    patience : how long to wait at most before looking for signals [s]; None where a timer of the
    node's own wakes it more often, which saves rclpy a new timer for each wait.

    A node ends itself by setting its ``exit_code``. Signals are handled here and not by rclpy,
    which would close the context under a callback that is just publishing. A `ConfigError`
    while the node is made is one line in the log and `BAD_INPUT`. For what is raised later see
    `turn`.
    """
    signals = _Signals()
    one_blas_thread()
    node = None
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = make()
        signals.built()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while rclpy.ok() and not ending() and getattr(node, 'exit_code', None) is None:
            turn(executor, node, patience)
    except KeyboardInterrupt:
        signals.built()
    except ConfigError as error:
        rclpy.logging.get_logger(name).fatal(str(error))
        return BAD_INPUT
    except RuntimeError as error:   # what rclpy raises for --ros-args it cannot read
        if node is not None or rclpy.ok():
            raise
        rclpy.logging.get_logger(name).fatal(str(error).partition(', at /')[0])
        return BAD_INPUT
    finally:
        signals.built()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
        signals.ended()
    return getattr(node, 'exit_code', None) or 0


def turn(executor: Executor, node: Node, patience: float | None) -> None:
    """
    Wait for one callback [s at most, None = as long as it takes] and execute it.

    What rclpy raises over a message that it takes and handles by itself, a request for parameters
    or a /clock, is counted and ends no node. An exception that has passed code of ours goes on
    from here, with its traceback: what it leaves is unknown. So does one of waiting itself, for
    the next turn would do no better.
    """
    # In the two halves that rclpy documents for executors of one's own: of what `spin_once`
    # raises nobody could tell in which it was.
    try:
        handler, _, _ = executor.wait_for_ready_callbacks(patience)
    except (TimeoutException, ShutdownException):
        return
    handler()
    error = handler.exception()
    if error is None:
        return
    if any(frame.f_code.co_filename.startswith(_OURS)
           for frame, _ in traceback.walk_tb(error.__traceback__)):
        raise error
    _drop(node, error)


def _drop(node: Node, error: Exception) -> None:
    """Count a message that rclpy stumbled over; of each place where it does, one is logged."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    kind = f'{type(error).__name__} in {Path(place.filename).name} {place.lineno}'
    if not _dropped[kind]:
        node.get_logger().error(
            f'rclpy cannot handle a message, it is dropped: {kind}: {plain(str(error))}')
    _dropped[kind] += 1

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
from rclpy.executors import SingleThreadedExecutor, await_or_execute
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
    while the node is made is one line in the log and `BAD_INPUT`. What rclpy raises over a
    message that it handles by itself, a request for parameters or a /clock, ends no node; an
    exception that has passed code of ours does, with its traceback: what it leaves is unknown.
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
            try:
                executor.spin_once(timeout_sec=patience)
            except Exception as error:
                if not _of_rclpy_alone(error):
                    raise
                _drop(node, error)
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


def _of_rclpy_alone(error: Exception) -> bool:
    """Tell whether an exception comes out of a callback that has nothing of ours in it."""
    codes = [frame.f_code for frame, _ in traceback.walk_tb(error.__traceback__)]
    if await_or_execute.__code__ not in codes:
        return False   # waiting or taking itself has failed: the next turn would do no better
    called = codes[codes.index(await_or_execute.__code__) + 1:]
    return not any(code.co_filename.startswith(_OURS) for code in called)


def _drop(node: Node, error: Exception) -> None:
    """Count a message that rclpy stumbled over; of each place where it does, one is logged."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    kind = f'{type(error).__name__} in {Path(place.filename).name} {place.lineno}'
    if not _dropped[kind]:
        node.get_logger().error(
            f'rclpy cannot handle a message, it is dropped: {kind}: {plain(str(error))}')
    _dropped[kind] += 1

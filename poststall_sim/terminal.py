# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a command says: tables, complaints, patience, and its result as JSON."""

import json
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, redirect_stdout
from pathlib import Path
from typing import Any

from poststall_sim.option_values import STDOUT


def complain(what: object) -> None:
    """Say in one line what is wrong."""
    print('poststall: ' + ' '.join(str(what).split()), file=sys.stderr)


def warn(what: object) -> None:
    """Say something in one line in the midst of what is `watched`, not within its bar."""
    try:
        from tqdm import tqdm
    except ImportError:
        complain(what)
        return
    with tqdm.external_write_mode(file=sys.stderr):
        complain(what)


@contextmanager
def telling_of_compiling(patience: float = 2.0) -> Iterator[None]:
    """Say once that kernels are compiled, where that has taken so long [s]."""
    from numba.core import event

    class Compiling(event.Listener):
        """Numba's word on what it compiles, callees within their callers; not what it loads."""

        depth, spent, begun, said = 0, 0.0, 0.0, False

        def on_start(self, _event: event.Event) -> None:
            if not self.depth:
                self.begun = time.monotonic()
            self.depth += 1
            self.tell(self.spent + time.monotonic() - self.begun)

        def on_end(self, _event: event.Event) -> None:
            self.depth -= 1
            if not self.depth:
                self.spent += time.monotonic() - self.begun

        def tell(self, spent: float) -> None:
            if spent >= patience and not self.said:
                self.said = True
                print('compiling the solver, once: up to a minute ...', file=sys.stderr,
                      flush=True)

    with event.install_listener('numba:compile', Compiling()):
        yield


@contextmanager
def patience(what: str) -> Iterator[None]:
    """Say what takes the time if the block takes more than two seconds."""
    timer = threading.Timer(2.0, lambda: print(f'{what} ...', file=sys.stderr, flush=True))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def watched(items: Iterable, total: int, what: str) -> Iterator:
    """Yield items behind a progress bar, shown on a terminal after two seconds."""
    try:
        from tqdm import tqdm
    except ImportError:
        yield from items
        return
    yield from tqdm(items, total=total, desc=what, delay=2.0, disable=None, leave=False)


def print_table(head: tuple[str, ...], rows: Iterable[list[str]]) -> None:
    """Print columns, right-aligned below their heads; those without a head, text, to the left."""
    rows = [list(head), *rows]
    widths = [max(len(row[k]) for row in rows) for k in range(len(head))]
    for row in rows:
        print('  '.join(cell.ljust(width) if not name else cell.rjust(width)
                        for cell, width, name in zip(row, widths, head)).rstrip())


def print_rows(title: str, rows: Iterable[tuple[str, object]]) -> None:
    """Print what is said in pairs, one a line, below a title."""
    print(title)
    for name, value in rows:
        print(f'  {name:<19} {value}')


def say(text: str) -> None:
    """Print a line, at once: somebody may wait for it."""
    print(text, flush=True)


def drawn(path: Path) -> None:
    """Say where a figure is."""
    print(f'figure {path}')


def leaving_output_to(json_file: Path | None) -> AbstractContextManager:
    """Return a context in which what is said goes to stderr, if the JSON goes to stdout."""
    return redirect_stdout(sys.stderr) if json_file == STDOUT else nullcontext()


def write_json(path: Path | None, result: dict[str, Any]) -> None:
    """Write a result, where a file is given."""
    if path is None:
        return
    # The standard output as it was handed on: opened by its name it would begin anew, and take
    # away what a shell has put into the file before.
    to_stdout = path == STDOUT
    with open(1 if to_stdout else path, 'w', closefd=not to_stdout, encoding='utf-8') as file:
        file.write(json.dumps(result, indent=1, allow_nan=False) + '\n')

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Cases computed by Dask: on a cluster of this machine's own, or on one that is there.

No more cases are with the scheduler than there are threads: it stays small however many cases
there are, and a worker that dies takes one case with it, that which it computed.
"""

import asyncio
import concurrent.futures
import faulthandler
import os
import sys
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from poststall_sim import __version__, interrupts, threads
from poststall_sim.campaign import case as cases
from poststall_sim.campaign import compute
from poststall_sim.campaign.case import Case, Flying, Outcome, Result

TRIES = 2
"""So often a case is begun, if the worker that computes it dies."""
GRACE = 120.0
"""Wall time [s] beyond five times its processor time in which a case must come back."""
WAIT = 30.0
"""How long a cluster may be without a worker when a campaign begins [s]."""
BEGIN = 300.0
"""How long workers on this machine, all at a time, may take to begin [s]."""
LOOK = 2.0
"""How often the size of the cluster is looked at [s]."""
QUIET = {'distributed.worker.profile.enabled': False,
         'distributed.admin.tick.interval': '500ms',
         'distributed.admin.system-monitor.interval': '2s'}
"""
Of Dask, for our own workers: by default each looks a hundred times a second at what its thread
does, and takes a tenth of its time for that.
"""
_TALLY = 'poststall_sim'
TOGETHER = 1000
"""The tallies of so many cases are forgotten at once."""


class EngineError(RuntimeError):
    """The cluster is not there, or has gone."""


@dataclass(frozen=True, slots=True, eq=False)
class Computed:
    """A row, its history, and what it cost: processor and wall time [s], where, which try."""

    row: dict[str, Any]
    history: Any
    cost: dict[str, Any]


@cache
def versions() -> dict[str, str]:
    """Return the versions that numbers depend on, by column."""
    import numba
    import numpy
    import scipy
    return {'poststall_sim': __version__, 'numpy': numpy.__version__,
            'scipy': scipy.__version__, 'numba': numba.__version__}


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise ImportError(
            "campaigns need Dask: pip install '.[campaign]' in the checkout") from None
    return distributed


@contextmanager
def cluster(scheduler: str | None, workers: int | None,
            folder: Path | None = None) -> Iterator[Any]:
    """
    Give a client: of the scheduler at an address, or of so many processes of this machine.

    folder : from which workers on this machine import as well, for functions of the user's.
    """
    distributed = _distributed()
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout='10s', set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise EngineError(f'no scheduler answers at {scheduler}: {error}') from None
        with client:
            try:
                client.wait_for_workers(1, timeout=WAIT)
            except TimeoutError:
                raise EngineError(f'the cluster at {scheduler} has had no worker for {WAIT:g} s') \
                    from None
            _require_alike(client)
            yield client
        return
    path = os.pathsep.join(filter(None, [
        str(folder.resolve()) if folder else '', str(Path(__file__).resolve().parents[2]),
        os.environ.get('PYTHONPATH', '')]))
    import dask
    with dask.config.set(QUIET), ExitStack() as open_ones:
        with interrupts.only_here():
            local = open_ones.enter_context(distributed.LocalCluster(
                n_workers=0, threads_per_worker=1, processes=True, host='127.0.0.1',
                dashboard_address='127.0.0.1:0', silence_logs=50, env={'PYTHONPATH': path}))
            client = open_ones.enter_context(distributed.Client(local, set_as_default=False))
        count = workers or _cores()
        local.scale(count)
        try:
            client.wait_for_workers(count, timeout=BEGIN)
        except TimeoutError:
            raise EngineError(f'of {count} workers on this machine {len(client.nthreads())} have '
                              f'begun in {BEGIN:g} s') from None
        yield client


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else \
        os.cpu_count() or 1


def _require_alike(client: Any) -> None:
    """Refuse a cluster whose workers would compute other numbers than this program."""
    try:
        everywhere = client.run(versions)
    except ImportError as error:
        raise EngineError(f'a worker lacks something: {error}') from None
    for address, found in everywhere.items():
        _require_versions(address, found)


def _require_versions(address: str, found: Mapping[str, Any]) -> None:
    for name, here in versions().items():
        if found.get(name, here) != here:
            raise EngineError(f'worker {address} has {name} {found[name]}, here is {here}')


def computed(case: Case, session: str) -> Computed:
    """Compute a case on a worker, unless it has been begun too often already."""
    from distributed import get_worker
    worker = get_worker()
    begun = 1 + _tally(worker, session, case)
    if begun > TRIES:
        return lost(case)
    # Before it begins: what kills this process cannot keep it from having been counted.
    _tally(worker, session, case, begun)
    _settle()
    alone = worker.state.nthreads == 1
    if alone and isinstance(case.task, Flying):
        # What hangs, in a compiled loop perhaps, is not to be stopped but with its process.
        faulthandler.dump_traceback_later(
            GRACE + 5.0 * case.task.cpu_limit, exit=True, file=sys.__stderr__)
    wall, cpu = time.perf_counter(), time.thread_time()
    try:
        result = compute.compute(case)
    finally:
        if alone:
            faulthandler.cancel_dump_traceback_later()
    # Counted is what did not end: a result that goes with its worker is computed once more.
    _tally(worker, session, case, begun - 1)
    return _with_cost(case, result, cpu_s=time.thread_time() - cpu,
                      wall_s=time.perf_counter() - wall, worker=worker.address, tries=begun)


def _tally(worker: Any, session: str, case: Case, value: int | None = None) -> int:
    """Return how often a case was begun without an end, as the scheduler knows; or set it."""
    from distributed.utils import sync
    keys = _keys(session, case)
    if value is None:
        return sync(worker.loop, worker.scheduler.get_metadata, keys=keys, default=0)
    sync(worker.loop, worker.scheduler.set_metadata, keys=keys, value=value)
    return value


def _keys(session: str, case: Case) -> list[str]:
    return [_TALLY, session, str(case.index // TOGETHER), str(case.index)]


@cache
def _settle() -> None:
    threads.one_blas_thread()


def _with_cost(case: Case, result: Result, **cost: Any) -> Computed:
    return Computed(cases.row(case, result, versions()), result.history,
                    {'case': case.index, **cost})


def lost(case: Case) -> Computed:
    """Return the row of a case whose worker died each time that it was begun."""
    reason = f'its worker died, or hung, each of the {TRIES} times that it was begun'
    return _with_cost(case, Result(Outcome.LOST, reason, {}), cpu_s=0.0, wall_s=0.0, worker='',
                      tries=TRIES)


def _failed(case: Case, error: BaseException) -> Computed:
    reason = ' '.join(f'{type(error).__name__}: {error}'.split())[:300]
    return _with_cost(case, Result(Outcome.ERROR, reason, {}), cpu_s=0.0, wall_s=0.0, worker='',
                      tries=1)


def run(client: Any, cases: Iterable[Case],
        function: Callable[[Case, str], Computed] = computed) -> Iterator[Computed]:
    """Yield each case computed, as they come; what fails is a row as well."""
    distributed = _distributed()
    session, pending = uuid.uuid4().hex[:12], iter(cases)
    flying: dict[Any, Case] = {}
    coming = distributed.as_completed([], loop=client.loop, raise_errors=False)
    width, looked, turn, forgotten = _width(client), time.monotonic(), 0, 0

    def submit(case: Case) -> None:
        nonlocal turn
        turn += 1
        future = client.submit(function, case, session, pure=False,
                               key=f'case-{session}-{case.index}-{turn}')
        flying[future] = case
        coming.add(future)

    def fill() -> None:
        while len(flying) < width and (case := next(pending, None)) is not None:
            submit(case)

    fill()
    for future in coming:
        case = flying.pop(future)
        try:
            result = future.result()
            # Of a worker that has joined since: its numbers are not of this table.
            _require_versions(result.cost.get('worker', ''), result.row)
            yield result
        except distributed.KilledWorker:
            if client.get_metadata(_keys(session, case), 0) < TRIES:
                submit(case)   # it only waited where another one died
            else:
                yield lost(case)
        except (asyncio.CancelledError, concurrent.futures.CancelledError):
            raise EngineError(f'the scheduler has gone, and case {case.index} with it') from None
        except Exception as error:
            if future.status != 'error':
                raise   # not the case's own
            if isinstance(error, ImportError) and (error.name or '').startswith('poststall_sim'):
                raise EngineError(f'a worker lacks something: {error}') from None
            yield _failed(case, error)
        if time.monotonic() - looked > LOOK:
            width, looked = _width(client), time.monotonic()
        fill()
        # The scheduler forgets what all are through with: it has other campaigns to come.
        reached = min((each.index for each in flying.values()), default=0) // TOGETHER
        for through in range(forgotten, reached):
            client.set_metadata([_TALLY, session, str(through)], {})
        forgotten = max(forgotten, reached)
    client.set_metadata([_TALLY, session], {})


def _width(client: Any) -> int:
    return max(1, sum(client.nthreads().values()))

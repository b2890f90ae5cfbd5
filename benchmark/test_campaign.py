# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What a campaign costs beyond its flights: on two cores, and with ten thousand idle tasks.

The first is measured on the command itself, in processor time of all its processes, so that a
machine that does other things gives the same answer. The whole question, in one command, is

    pytest -m soak benchmark/test_campaign.py -k 'two_cores or to_the_byte' -s --flights 2000

which takes some eighty minutes on two cores; by default it is asked of 60 flights, of 10 s like
those. All print what they find, and write it to `results/campaign*.json`.
"""

import concurrent.futures
import dataclasses
import functools
import hashlib
import json
import multiprocessing
import resource
import subprocess
import sys
import time

import pytest
from report import holds, keep

pytest.importorskip('distributed', reason='distributed is not installed: see extra campaign')
pytest.importorskip('pyarrow', reason='pyarrow is not installed: see extra campaign')
pytest.importorskip('zarr', reason='zarr is not installed: see extra campaign')

import distributed
import psutil
import pyarrow.parquet

from poststall_sim.campaign import cases, compute, engine, table
from poststall_sim.campaign import definition as files

WORKERS = 2
ASKED = {'efficiency against two single runs': ('>=', 0.9),
         'growth of a worker from a quarter of the flights on [MB]': ('<=', 10.0)}
TINY = 10_000
LOOK = 1.0
"""How often the memory of workers is looked at [s]."""

pytestmark = [pytest.mark.soak, pytest.mark.timeout(36000)]

CAMPAIGN = """\
name: cost
aircraft: trainer
autopilot: example
duration_s: {seconds}
initial: {{trim_airspeed_m_s: 12.0, airspeed_m_s: 10.0, altitude_m: 400.0}}
vary:
  - {{key: initial.alpha_deg, uniform: {{from: 5.0, to: 40.0}}}}
  - {{key: initial.roll_rate_deg_s, uniform: {{from: -200.0, to: 200.0}}}}
  - {{key: law.stall_alpha, uniform: {{from: 0.2, to: 0.3}}}}
samples: {{count: {flights}}}
keep: {{history_every_s: 0.1}}
"""


def written(folder, flights, seconds):
    """Write a campaign into a folder and return its path."""
    path = folder / 'cost.yaml'
    path.write_text(CAMPAIGN.format(flights=flights, seconds=seconds))
    return path


def made(folder, flights, seconds):
    """Return the cases of a campaign."""
    return list(cases.Builder(files.campaign(written(folder, flights, seconds))).cases())


def alone(given):
    """Fly cases one after the other; return the processor time that they took [s]."""
    engine.threads.one_blas_thread()
    compute.compute(given[0])   # what comes once: imports, the lattice, the trim
    begin = time.process_time()
    for case in given:
        compute.compute(case)
    return time.process_time() - begin


@dataclasses.dataclass(frozen=True)
class Flown:
    """A campaign that was flown: by row its processor time, of all its processes, and so on."""

    own: dict[int, float]
    cpu: float
    wall: float
    ends: set[str]
    workers_MB: list[dict[int, float]]
    sha256: list[str]

    @property
    def beyond(self):
        """Processor time that was not a flight's [s]."""
        return self.cpu - sum(self.own.values())


def fly(folder, flights, seconds, workers):
    """Fly a campaign by its command and look at its processes as it goes."""
    folder.mkdir()
    begin, before, looks = time.monotonic(), _children_s(), []
    with open(folder / 'said', 'w') as said:
        command = subprocess.Popen(
            [sys.executable, '-m', 'poststall_sim.cli', 'campaign',
             written(folder, flights, seconds), '--output', folder / 'out',
             '--workers', str(workers)], stdin=subprocess.DEVNULL, stdout=said, stderr=said)
        while command.poll() is None:
            time.sleep(LOOK)
            looks.append(_workers_MB(psutil.Process()))
    assert command.returncode == 0, (folder / 'said').read_text()
    rows = pyarrow.parquet.read_table(folder / 'out' / table.TABLE).to_pydict()
    costs = pyarrow.parquet.read_table(folder / 'out' / table.COSTS).to_pydict()
    chunks = sorted((folder / 'out' / table.HISTORIES / 'history').glob('[0-9]*'))
    assert len(chunks) == len(rows['case']) == flights
    return Flown(
        own=dict(zip(costs['case'], costs['cpu_s'])), cpu=_children_s() - before,
        wall=time.monotonic() - begin, ends=set(rows['status']), workers_MB=looks,
        sha256=[hashlib.sha256(whole).hexdigest() for whole in (
            (folder / 'out' / table.TABLE).read_bytes(),
            b''.join(each.read_bytes() for each in chunks))])


def _children_s():
    """Return the processor time of all processes that were begun below this one and have ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def _workers_MB(process):
    found = {}
    for each in process.children(recursive=True):
        try:
            if '--multiprocessing-fork' in each.cmdline():
                found[each.pid] = each.memory_info().rss / 1e6
        except psutil.Error:
            continue   # it has ended meanwhile
    return found


@pytest.fixture(scope='module')
def flown(tmp_path_factory, request):
    """Return a function of a number of workers that gives the campaign flown by so many, once."""
    flights = request.config.getoption('--flights') or 60
    seconds = request.config.getoption('--flight-seconds') or 10.0
    folder = tmp_path_factory.mktemp('flown')

    @functools.cache
    def by(workers):
        return fly(folder / str(workers), flights, seconds, workers)

    by.flights, by.seconds = flights, seconds
    return by


def test_efficiency_memory_and_cost_on_two_cores(flown, tmp_path):
    given = made(tmp_path, flown.flights, flown.seconds)
    few = given[::max(1, flown.flights // 12)]
    context = multiprocessing.get_context('spawn')
    with concurrent.futures.ProcessPoolExecutor(WORKERS, mp_context=context) as pool:
        single = sum(pool.map(alone, [few[::2], few[1::2]]))
    # What comes once, of a campaign that is hardly more than that: imports, workers, a look at
    # every case.
    once = fly(tmp_path / 'once', WORKERS, flown.seconds, WORKERS).beyond
    whole = flown(WORKERS)
    pids = max(whole.workers_MB, key=len)
    together = [look for look in whole.workers_MB if look.keys() >= pids.keys()]
    quarter = together[len(together) // 4:]
    growth = max(quarter[-1][pid] - quarter[0][pid] for pid in pids)
    # Flights differ: those flown alone are compared with the same, the rest with these.
    slowed = sum(whole.own[case.index] for case in few) / single
    within = sum(whole.own.values())
    found = {'efficiency against two single runs': within / (whole.cpu - once) / slowed,
             'growth of a worker from a quarter of the flights on [MB]': growth}
    more = {'flights': flown.flights, 'seconds': flown.seconds, 'workers': WORKERS,
            'flown_alone': len(few), 'slower_than_alone': slowed,
            'cpu_s_per_flight': whole.cpu / flown.flights,
            'cpu_s_per_flight_within': within / flown.flights, 'cpu_s_once': once,
            'efficiency_with_what_comes_once': within / whole.cpu / slowed,
            'wall_s': whole.wall, 'worker_MB': max(quarter[-1].values()),
            'cpu_hours_per_thousand': whole.cpu / flown.flights / 3.6}
    print(json.dumps({**found, **more}, indent=1))
    keep('campaign', ASKED, found=found, **more)
    for name, value in found.items():
        assert holds(ASKED[name], value), (name, value)


def test_one_two_and_four_workers_write_the_same_table_to_the_byte(flown):
    """And the same histories; on two cores four take turns."""
    runs = {workers: flown(workers) for workers in (2, 1, 4)}
    found = {'flights': flown.flights, 'seconds': flown.seconds,
             'wall_s_by_workers': {workers: run.wall for workers, run in runs.items()},
             'sha256_of_table_and_histories': {
                 workers: run.sha256 for workers, run in runs.items()}}
    print(json.dumps(found, indent=1))
    keep('campaign_identity', {}, **found)
    assert all(run.ends == {'done'} for run in runs.values())
    assert runs[1].sha256 == runs[2].sha256 == runs[4].sha256


@pytest.mark.parametrize('threads', [1, 200])
def test_ten_thousand_tasks_that_do_nothing(tmp_path, threads):
    """As many as a hundred machines have: two workers of so many threads, which only answer."""
    given = made(tmp_path, TINY, 1.0)
    sent = len(distributed.protocol.pickle.dumps(given[0]))

    def nothing(case, session):
        worker = distributed.get_worker()
        begun = 1 + engine._tally(worker, session, case)
        engine._tally(worker, session, case, begun)
        engine._tally(worker, session, case, begun - 1)
        return engine.Computed({'case': case.index}, None, {})

    with distributed.LocalCluster(n_workers=WORKERS, threads_per_worker=threads, processes=True,
                                  host='127.0.0.1', dashboard_address=None) as cluster, \
            distributed.Client(cluster, set_as_default=False) as client:
        begin, cpu = time.monotonic(), time.process_time()
        numbers, tallies = [], 0
        for each in engine.run(client, given, nothing):
            numbers.append(each.row['case'])
            if len(numbers) % 1000 == 999:
                kept, = client.get_metadata([engine._TALLY]).values()
                tallies = max(tallies, sum(map(len, kept.values())))
        wall, cpu = time.monotonic() - begin, time.process_time() - cpu
    assert sorted(numbers) == list(range(TINY))
    assert 0 < tallies <= 2 * engine.TOGETHER + WORKERS * threads
    found = {'tasks': TINY, 'threads': WORKERS * threads, 'wall_s': wall,
             'tasks_per_s': TINY / wall, 'scheduler_and_client_ms_per_task': 1e3 * cpu / TINY,
             'bytes_sent_per_task': sent, 'tallies_kept': tallies}
    print(json.dumps(found, indent=1))
    keep(f'campaign_tasks_{WORKERS * threads}', {}, **found)

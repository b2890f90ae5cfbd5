# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What a campaign costs beyond its flights: on two cores, and with ten thousand idle tasks.

The first is measured in processor time, of all processes of cluster and client, so that a machine
that does other things gives the same answer. The whole question, in one command, is

    pytest -m soak benchmark/test_campaign.py -k 'two_cores or to_the_byte' -s --flights 2000

and by default it is asked of 60 flights, of 10 s like those. Tables are held against each other
over 200 flights at most. All print what they find, and write it to `results/campaign*.json`.
"""

import concurrent.futures
import hashlib
import json
import multiprocessing
import time

import pytest
from report import holds, keep

pytest.importorskip('distributed', reason='distributed is not installed: see extra campaign')
pytest.importorskip('pyarrow', reason='pyarrow is not installed: see extra campaign')
pytest.importorskip('zarr', reason='zarr is not installed: see extra campaign')

import processes

from poststall_sim.campaign import cases, compute, engine, job, table
from poststall_sim.campaign import definition as files

WORKERS = 2
ASKED = {'efficiency against two single runs': ('>=', 0.9),
         'growth of a worker from a quarter of the flights on [MB]': ('<=', 10.0)}
TINY = 10_000

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
"""


def read(tmp_path, flights, seconds, more=''):
    path = tmp_path / 'cost.yaml'
    path.write_text(CAMPAIGN.format(flights=flights, seconds=seconds) + more)
    return files.campaign(path)


def made(tmp_path, flights, seconds):
    return list(cases.Builder(read(tmp_path, flights, seconds)).cases())


def alone(given):
    """Fly cases one after the other; return the processor time that they took [s]."""
    engine.threads.one_blas_thread()
    compute.compute(given[0])   # what comes once: imports, the lattice, the trim
    begin = time.process_time()
    for case in given:
        compute.compute(case)
    return time.process_time() - begin


def test_efficiency_memory_and_cost_on_two_cores(tmp_path, request):
    flights = request.config.getoption('--flights') or 60
    seconds = request.config.getoption('--flight-seconds') or 10.0
    given = made(tmp_path, flights, seconds)
    few = given[::max(1, flights // 12)]
    context = multiprocessing.get_context('spawn')
    with concurrent.futures.ProcessPoolExecutor(WORKERS, mp_context=context) as pool:
        single = sum(pool.map(alone, [few[::2], few[1::2]]))

    def spent(client):
        return time.process_time() + sum(client.run(time.process_time).values())

    memory = []
    with engine.cluster(None, WORKERS) as client:
        list(engine.run(client, given[:WORKERS]))
        before, begin, own = spent(client), time.monotonic(), {}
        for number, each in enumerate(engine.run(client, given)):
            own[each.row['case']] = each.cost['cpu_s']
            if number % max(1, flights // 20) == 0:
                memory.append(list(client.run(processes.resident_MB).values()))
        wall, cpu = time.monotonic() - begin, spent(client) - before
    quarter = memory[len(memory) // 4:]
    growth = max(last - first for first, last in zip(quarter[0], quarter[-1]))
    # Flights differ: those flown alone are compared with the same, the rest with these.
    slowed, within = sum(own[case.index] for case in few) / single, sum(own.values())
    found = {'efficiency against two single runs': within / cpu / slowed,
             'growth of a worker from a quarter of the flights on [MB]': growth}
    more = {'flights': flights, 'seconds': seconds, 'workers': WORKERS,
            'flown_alone': len(few),
            'slower_than_alone': slowed, 'cpu_s_per_flight': cpu / flights,
            'cpu_s_per_flight_within': within / flights, 'wall_s': wall,
            'worker_MB': max(memory[-1]), 'cpu_hours_per_thousand': cpu / flights / 3.6}
    print(json.dumps({**found, **more}, indent=1))
    keep('campaign', ASKED, found=found, **more)
    for name, value in found.items():
        assert holds(ASKED[name], value), (name, value)


def test_one_two_and_four_workers_write_the_same_table_to_the_byte(tmp_path, request):
    """And the same histories; on two cores four take turns."""
    flights = min(request.config.getoption('--flights') or 24, 200)
    seconds = request.config.getoption('--flight-seconds') or 10.0
    campaign = read(tmp_path, flights, seconds, 'keep: {history_every_s: 0.1}\n')
    prints, wall = {}, {}
    for workers in (1, 2, 4):
        folder, begin = tmp_path / str(workers), time.monotonic()
        done = job.run(campaign, folder, watch=lambda rows, total: iter(rows), workers=workers)
        wall[workers] = time.monotonic() - begin
        assert done['ends'] == {'done': flights}
        chunks = sorted((folder / table.HISTORIES / 'history').glob('[0-9]*'))
        assert len(chunks) == flights
        prints[workers] = [hashlib.sha256((folder / table.TABLE).read_bytes()).hexdigest(),
                           hashlib.sha256(b''.join(each.read_bytes() for each in chunks)
                                          ).hexdigest()]
    found = {'flights': flights, 'seconds': seconds, 'wall_s_by_workers': wall,
             'sha256_of_table_and_histories': prints}
    print(json.dumps(found, indent=1))
    keep('campaign_identity', {}, **found)
    assert prints[1] == prints[2] == prints[4]


@pytest.mark.parametrize('threads', [1, 200])
def test_ten_thousand_tasks_that_do_nothing(tmp_path, threads):
    """As many as a hundred machines have: two workers of so many threads, which only answer."""
    import distributed
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

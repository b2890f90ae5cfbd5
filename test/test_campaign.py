# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Campaigns on Dask: the same table whoever computed it, failures that are rows, nothing lost."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import campaigns
import pytest

from poststall_sim import cli
from poststall_sim.aircraft import ConfigError

pytest.importorskip('distributed', reason='distributed is not installed: see extra campaign')
pytest.importorskip('pyarrow', reason='pyarrow is not installed: see extra campaign')
pytest.importorskip('xarray', reason='xarray is not installed: see extra campaign')
pytest.importorskip('zarr', reason='zarr is not installed: see extra campaign')

from poststall_sim.campaign import absence, cases, compute, engine, job, table
from poststall_sim.campaign import definition as files

HISTORIES = campaigns.BRIEF + 'keep: {history_every_s: 0.02}\n'


def quietly(items, total):
    return iter(items)


def flown(path, folder, **options):
    """Compute a campaign, and return the bytes of its table."""
    campaign = files.campaign(path)
    cases.check(campaign)
    job.run(campaign, folder, watch=quietly, **options)
    return (folder / table.TABLE).read_bytes()


def rows(folder):
    """Return the rows of a table as mappings."""
    _, columns = table.read(folder)
    return [dict(zip(columns, values)) for values in zip(*columns.values())]


def histories(folder):
    """Return the bytes of every chunk of the histories."""
    root = folder / table.HISTORIES
    # What Zarr was writing when it was killed, it leaves beside the chunk.
    return {path.relative_to(root): path.read_bytes() for path in root.rglob('*.*')
            if path.is_file() and path.suffix != '.partial'}


def test_one_worker_and_two_write_the_same_table_to_the_byte(tmp_path):
    path = campaigns.written(tmp_path / 'given', HISTORIES)
    one = flown(path, tmp_path / 'one', workers=1)
    assert flown(path, tmp_path / 'two', workers=2) == one
    found = rows(tmp_path / 'one')
    assert [row['case'] for row in found] == list(range(8))
    assert {row['status'] for row in found} == {'done'}
    assert len({row['final_alpha_deg'] for row in found}) == 8
    chunks = histories(tmp_path / 'one')
    assert chunks == histories(tmp_path / 'two') and len(chunks) >= 8
    costs = table.costs(tmp_path / 'one')
    assert costs['case'] == list(range(8)) and min(costs['cpu_s']) > 0.0


def test_what_fails_is_a_row_with_its_reason_and_the_rest_goes_on(tmp_path):
    head, _, _ = campaigns.BRIEF.replace('_s: 0.1', '_s: 0.5').partition('vary:')
    path = campaigns.written(tmp_path / 'given', head + (
        'cpu_limit_s: 0.5\nvary:\n'
        '  - {key: autopilot, values: [none, "campaign_pilots:raises", "campaign_pilots:kills",\n'
        '                              "campaign_pilots:spins", "campaign_pilots:misnames",\n'
        '                              "campaign_pilots:says_nothing"]}\n'))
    sys.path.insert(0, str(tmp_path / 'given'))   # as the command does
    try:
        flown(path, tmp_path / 'out', workers=2)
    finally:
        sys.path.remove(str(tmp_path / 'given'))
    found = rows(tmp_path / 'out')
    ends = [row['status'] for row in found]
    assert ends == ['done', 'error', 'lost', 'timed_out', 'error', 'error']
    assert found[1]['reason'] == 'ValueError: no such thing'
    assert 'each of the 2 times' in found[2]['reason']
    assert 'more than 0.5 s of processor time' in found[3]['reason']
    assert "commands 'elevatr', there are aileron, elevator" in found[4]['reason']
    assert 'commands nan for elevator' in found[5]['reason']
    assert found[0]['height_lost_m'] is not None and found[2]['height_lost_m'] is None


def test_a_campaign_is_gone_on_with_and_one_of_another_definition_is_not(tmp_path):
    path = campaigns.written(tmp_path / 'given')
    campaign, out = files.campaign(path), tmp_path / 'out'
    whole = flown(path, tmp_path / 'whole', workers=1)

    # As it is after a kill: five of the rows are in a part, and there is no table.
    with table.opened(out, job.identity(campaign), job.columns(campaign), resume=False) as store:
        found = rows(tmp_path / 'whole')
        for row in found[3:]:
            store.add({**row}, None, {'cpu_s': 1.0, 'wall_s': 1.0, 'worker': 'x', 'tries': 1})
    assert rows(out) == found[3:]   # what they cost is no part of what is drawn meanwhile
    begun = []
    original = engine.run
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, 'run', lambda client, left: original(
            client, (begun.append(case.index) or case for case in left)))
        assert flown(path, out, workers=1, resume=True) == whole
    assert begun == [0, 1, 2]

    with pytest.raises(ConfigError, match='give --resume'):
        flown(path, out, workers=1)
    other = campaigns.written(tmp_path / 'given', campaigns.BRIEF.replace('seed: 3', 'seed: 4'))
    with pytest.raises(ConfigError, match='another definition'):
        flown(other, out, workers=1, resume=True)
    with pytest.raises(ConfigError, match='no campaign to go on with'):
        flown(path, tmp_path / 'nowhere', workers=1, resume=True)


def test_a_row_of_a_worker_with_another_version_ends_the_run(tmp_path):
    """One that joined after the cluster was looked over: its row is not to be in the table."""
    builder = cases.Builder(files.campaign(campaigns.written(tmp_path / 'given')))

    def other(case, session):
        return engine.Computed({'case': case.index, 'numpy': '0.1'}, None, {'worker': 'tcp://x:1'})

    with engine.cluster(None, 1) as client:
        with pytest.raises(engine.EngineError, match='worker tcp://x:1 has numpy 0.1, here is'):
            list(engine.run(client, builder.cases(), other))


def test_a_part_that_is_none_is_said_so(tmp_path):
    """Cut off by a disk, perhaps: without it its rows are computed again."""
    campaign, out = files.campaign(campaigns.written(tmp_path / 'given')), tmp_path / 'out'
    given = job.identity(campaign), job.columns(campaign)
    with table.opened(out, *given, resume=False):
        (out / table.PARTS / 'part-000000.parquet').write_bytes(b'PAR1')
    with pytest.raises(ConfigError, match=r'part-000000.parquet: no file of rows, remove it'):
        table.read(out)
    with pytest.raises(ConfigError, match=r'part-000000.parquet: no file of rows, remove it'):
        with table.opened(out, *given, resume=True):
            pass


def test_room_for_the_histories_of_a_million_cases_is_made_at_once(tmp_path):
    given = {'name': 'brief'}, {'case': int}
    with table.opened(tmp_path / 'out', *given, resume=False) as store:
        begin = time.process_time()
        store.make_histories(1_000_000, 100, ['alpha', 'beta'])
        assert time.process_time() - begin < 10.0   # block by block more than a minute
    assert len(histories(tmp_path / 'out')) < 10    # none of their blocks is written


def test_two_programs_do_not_write_into_one_folder(tmp_path):
    campaign = files.campaign(campaigns.written(tmp_path / 'given'))
    given = job.identity(campaign), job.columns(campaign)
    with table.opened(tmp_path / 'out', *given, resume=False):
        with pytest.raises(ConfigError, match='another campaign is writing'):
            with table.opened(tmp_path / 'out', *given, resume=True):
                pass


def test_the_command_checks_flies_and_draws(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = campaigns.written(tmp_path / 'given')
    assert cli.main(['campaign', str(path), '--check']) == 0
    assert 'brief: 8 cases' in capsys.readouterr().out
    assert cli.main(['campaign', str(path), '--check', '--json', 'check.json']) == 0
    assert json.loads((tmp_path / 'check.json').read_text())['cases'] == 8
    assert cli.main(['campaign', str(path), '--workers', '1', '--json', 'summary.json']) == 0
    assert 'done' in capsys.readouterr().out
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    assert cli.main(['campaign', 'plot', 'brief']) == 0
    drawn = {each.name for each in (tmp_path / 'brief' / 'figures').iterdir()}
    assert {'distributions.png', 'scatter.png', 'sensitivity.png'} <= drawn
    assert cli.main(['campaign', 'plot', 'brief', '--json', 'figures.json']) == 0
    assert len(json.loads((tmp_path / 'figures.json').read_text())['figures']) == len(drawn)


def test_a_full_disk_is_one_line_that_says_how_to_go_on(tmp_path, capsys, monkeypatch):
    def full(*_, **given):
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(compute, 'warm', full)
    path, out = campaigns.written(tmp_path / 'given'), str(tmp_path / 'out')
    assert cli.main(['campaign', str(path), '--output', out]) == 2
    said = capsys.readouterr().err
    assert f'No space left on device; what has come is in {out}: go on with --resume' in said
    monkeypatch.setattr(Path, 'mkdir', full)
    assert cli.main(['campaign', str(path), '--output', str(tmp_path / 'other')]) == 2
    said = capsys.readouterr().err
    assert 'No space left on device; nothing has come: give the same command again' in said


def test_a_folder_whose_rows_all_failed_has_nothing_to_draw_and_says_so(tmp_path, capsys):
    campaign = files.campaign(campaigns.written(tmp_path / 'given'))
    given = job.identity(campaign), job.columns(campaign)
    with table.opened(tmp_path / 'out', *given, resume=False) as store:
        for case in cases.Builder(campaign).cases():
            failed = engine._failed(case, ValueError('x'))
            store.add(failed.row, None, failed.cost)
    assert cli.main(['campaign', 'plot', str(tmp_path / 'out')]) == 1
    assert 'nothing to draw, no quantity differs between its rows, 8 of' in capsys.readouterr().err


def test_a_scheduler_that_is_not_there_is_said_so(tmp_path, capsys):
    path = campaigns.written(tmp_path / 'given')
    assert cli.main(['campaign', str(path), '--output', str(tmp_path / 'out'),
                     '--scheduler', 'tcp://127.0.0.1:9']) == 2
    assert 'no scheduler answers at tcp://127.0.0.1:9' in capsys.readouterr().err


@pytest.mark.skipif(not hasattr(os, 'killpg'), reason='interrupts as a POSIX terminal does')
def test_an_interrupt_is_one_line_and_says_how_to_go_on(tmp_path):
    """Ctrl-C reaches the workers too, as all that runs in a terminal."""
    head, _, _ = campaigns.BRIEF.partition('vary:')
    path = campaigns.written(tmp_path / 'given', head + (
        'autopilot: "campaign_pilots:make"\nvary:\n'
        '  - {key: initial.alpha_deg, grid: {from: 2, to: 24, count: 400}}\n'), pause=0.1)
    out, log = tmp_path / 'out', tmp_path / 'log.txt'
    with campaigns.started('poststall_sim.cli', 'campaign', str(path), '--output', str(out),
                           '--workers', '1', folder=tmp_path, log=log,
                           start_new_session=True) as process:
        # Some rows have come, so that no worker is compiling, which would have to end first.
        campaigns.eventually(lambda: any((out / table.PARTS).glob('*')), 'rows')
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(60) == 130
    assert complaints(log) == [
        f'poststall: interrupted; what has come is in {out}: go on with --resume']
    assert not (out / table.TABLE).exists()


def importing(process, out):
    """Tell whether a command has begun to import what it needs."""
    return '/numpy/' in Path(f'/proc/{process.pid}/maps').read_text()


def compiling(process, out):
    """Tell whether the first case is flown, or what flies it compiled."""
    return (out / 'campaign.json').exists()


def beginning_workers(process, out):
    """Tell whether there is a process but the client's, and the one that Python keeps."""
    threads = Path(f'/proc/{process.pid}/task').iterdir()
    return sum(len((each / 'children').read_text().split()) for each in threads) > 1


GO_ON = '; what has come is in {}: go on with --resume'


@pytest.mark.skipif(not Path('/proc/self/maps').exists(), reason='looks where Linux shows it')
@pytest.mark.parametrize('begun, after, left', [
    (importing, 0.0, ''), (beginning_workers, 0.1, GO_ON),
    *(pytest.param(begun, after, left, marks=pytest.mark.soak) for begun, after, left in (
        (importing, 0.3, ''), (compiling, 0.0, GO_ON), (compiling, 0.5, GO_ON),
        (compiling, 1.0, GO_ON), (beginning_workers, 0.0, GO_ON), (beginning_workers, 0.05, GO_ON),
        (beginning_workers, 0.3, GO_ON), (beginning_workers, 0.6, GO_ON),
        (beginning_workers, 1.2, GO_ON), (beginning_workers, 2.4, GO_ON)))])
def test_an_interrupt_in_the_first_seconds_is_one_line_and_leaves_no_process(
        tmp_path, begun, after, left):
    path = campaigns.written(tmp_path / 'given')
    out, log = tmp_path / 'out', tmp_path / 'log.txt'
    with campaigns.started('poststall_sim', 'campaign', str(path), '--output', str(out),
                           '--workers', '2', folder=tmp_path, log=log,
                           start_new_session=True) as process:
        campaigns.eventually(lambda: begun(process, out), begun.__name__)
        time.sleep(after)
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(60) == 130, log.read_text()
        # Of its session nobody is left, soon: the process that Python keeps for shared memory
        # goes when it sees that its parent has.
        campaigns.eventually(lambda: not alive(process.pid), 'end of all processes', 20.0)
    assert complaints(log) == ['poststall: interrupted' + left.format(out)]


def complaints(log):
    """Return what a campaign says but how it begins, and that it compiles."""
    return [line for line in log.read_text().splitlines()
            if 'cases on' not in line and 'compiling the solver' not in line]



@pytest.mark.soak
@pytest.mark.skipif(not Path('/proc/self/stat').exists(), reason='looks where Linux shows it')
@pytest.mark.parametrize('after', [1.0, 2.0, 3.0, 4.0, 6.0, 8.0])
def test_an_interrupt_while_kernels_are_compiled_is_one_line(tmp_path, monkeypatch, after):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path / 'kernels'))   # none of which is there
    test_an_interrupt_in_the_first_seconds_is_one_line_and_leaves_no_process(
        tmp_path, compiling, after, GO_ON)


def alive(session):
    """Return the processes of a session that run."""
    found = []
    for path in Path('/proc').glob('[0-9]*/stat'):
        try:
            state, _, _, its_session = path.read_text().rpartition(') ')[2].split()[:4]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(its_session) == session and state not in 'XZ':
            found.append(path.parent.name)
    return found


def test_a_cluster_without_workers_is_told_again_and_when_it_has_some(monkeypatch):
    import distributed
    for name, seconds in (('ASK', 0.1), ('ABSENT', 0.2), ('AGAIN', 0.3)):
        monkeypatch.setattr(absence, name, seconds)
    said = []

    def answer(case, session):
        time.sleep(1.0)   # that it is seen to work while it does
        return engine.Computed({}, None, {})

    with distributed.LocalCluster(n_workers=0, processes=False, dashboard_address='127.0.0.1:0',
                                  silence_logs=50) as local:
        with distributed.Client(local, set_as_default=False) as client:
            def told(text):
                said.append(text)
                if len(said) == 2:
                    local.scale(1)

            rows = engine.run(client, [SimpleNamespace(index=0)], answer)
            assert len(list(absence.telling(client, rows, told))) == 1
    assert [text.partition(' for ')[0] for text in said] == [
        *2 * ['the cluster has had no worker'],
        'the cluster has workers again (1), the campaign goes on']


def test_a_cluster_from_which_rows_come_is_not_asked(monkeypatch):
    monkeypatch.setattr(absence, 'ASK', 0.2)

    def rows():
        for row in range(10):
            time.sleep(0.05)
            yield row

    # Without a client there is nobody to ask: that would be an error of its thread.
    assert list(absence.telling(None, rows(), pytest.fail)) == list(range(10))


KILLED = """
import os
import sys
from pathlib import Path

import dask.array
import xarray
import zarr
from poststall_sim.campaign import table

COLUMNS = {'case': int, 'status': str, 'height_lost_m': float}
COST = {'cpu_s': 1.0, 'wall_s': 1.0, 'worker': 'x', 'tries': 1}
table.EVERY_ROWS = 2


def campaign(folder, instant, resume):
    events = 0

    def look(event, given):
        nonlocal events
        if event in ('open', 'os.rename', 'os.mkdir', 'os.remove', 'os.rmdir', 'fcntl.flock') and (
                event == 'fcntl.flock' or folder in map(str, given[:2]) or
                any(str(each).startswith(folder + os.sep) for each in given[:2])):
            events += 1
            if events == instant:
                os._exit(9)   # as SIGKILL: nothing is flushed, nothing cleaned up

    sys.addaudithook(look)
    with table.opened(Path(folder), {'name': 'brief'}, COLUMNS, resume=resume) as store:
        store.make_histories(5, 2, ['alpha', 'beta'])
        for case in range(5):
            if case not in store.done:
                history = [[case, 0.5], [case + 0.1, 0.25]]
                store.add({'case': case, 'status': 'done', 'height_lost_m': case / 3.0}, history,
                          COST)
        ends, _ = store.finish()
    os._exit(0 if ends == {'done': 5} else 1)


def ended(*given):
    child = os.fork()   # of a process that has used none of these libraries' threads yet
    if child == 0:
        try:
            campaign(*given)
        except BaseException as error:
            print(given, repr(error), file=sys.stderr, flush=True)
        os._exit(2)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


for instant in range(1, 400, int(sys.argv[2])):
    folder = os.path.join(sys.argv[1], str(instant))
    end = ended(folder, instant, False)
    if end != 0:
        assert end == 9, end
        resume = os.path.exists(os.path.join(folder, 'campaign.json'))
        assert ended(folder, 0, resume) == 0, (instant, resume)
    else:
        break
"""


@pytest.mark.skipif(not hasattr(os, 'fork'), reason='kills children as POSIX has them')
@pytest.mark.parametrize('every', [24, pytest.param(1, marks=pytest.mark.soak)])
def test_killed_before_any_write_it_is_gone_on_with_to_the_same_folder(tmp_path, every):
    """At every call, or every 24th, that changes or opens a file in the folder."""
    done = subprocess.run([sys.executable, '-c', KILLED, str(tmp_path), str(every)], timeout=280,
                          env=campaigns.environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    instants = sorted(map(int, (path.name for path in tmp_path.iterdir())))
    assert instants[-1] > 80   # else the calls are not seen
    whole = tmp_path / str(instants[-1])   # the one that nothing ended
    for instant in instants[:-1]:
        folder = tmp_path / str(instant)
        assert (folder / table.TABLE).read_bytes() == (whole / table.TABLE).read_bytes(), instant
        assert histories(folder) == histories(whole), instant


@pytest.mark.soak
@pytest.mark.timeout(900)
def test_killed_frozen_and_resumed_it_is_the_table_of_an_undisturbed_run(tmp_path):
    """
    A scheduler and three workers on loopback, each a process: none of 40 rows is lost, none twice.

    One worker is killed in mid-run, one stands still for 10 s, and the client is killed and
    resumed. Flights pause for wall time, so that there is a mid-run on any machine.
    """
    head, _, _ = campaigns.BRIEF.partition('vary:')
    text = head + ('autopilot: "campaign_pilots:make"\nvary:\n'
                   '  - {key: initial.alpha_deg, grid: {from: 2, to: 24, count: 40}}\n')
    given, out = tmp_path / 'given', tmp_path / 'out'
    path = campaigns.written(given, text, pause=0.1)
    address, log = tmp_path / 'scheduler.json', tmp_path / 'log.txt'

    def client(*more):
        return campaigns.started(
            'poststall_sim.cli', 'campaign', str(path), '--output', str(out),
            '--scheduler', dask_address(), *more, folder=given, log=log)

    def dask_address():
        return json.loads(address.read_text())['address']

    def written():
        return table.read(out)[1]['case'] if list(out.glob('parts/part-*.parquet')) else []

    words = ('distributed.cli.dask_worker', '--scheduler-file', str(address), '--nthreads', '1',
             '--no-dashboard', '--host', '127.0.0.1')
    with campaigns.started('distributed.cli.dask_scheduler', '--scheduler-file', str(address),
                           '--host', '127.0.0.1', '--port', '0', '--no-dashboard',
                           folder=given, log=log):
        campaigns.eventually(lambda: address.exists() and address.read_text(), 'scheduler')
        with campaigns.started(*words, '--no-nanny', folder=given, log=log) as killed, \
                campaigns.started(*words, '--no-nanny', folder=given, log=log) as frozen, \
                campaigns.started(*words, '--no-nanny', folder=given, log=log):
            with client() as first:
                campaigns.eventually(written, 'rows')
                killed.send_signal(signal.SIGKILL)
                frozen.send_signal(signal.SIGSTOP)
                time.sleep(10.0)
                frozen.send_signal(signal.SIGCONT)
                before = campaigns.eventually(
                    lambda: written() if len(written()) > 12 else None, 'rows after the freeze')
                first.send_signal(signal.SIGKILL)
                first.wait()
            kept = written()
            assert 12 < len(kept) < 40 and set(before) <= set(kept)
            with client('--resume') as second:
                assert second.wait(300) == 0, log.read_text()[-3000:]
    parts = sorted(written())
    assert parts == list(range(40))   # none lost, none twice
    quick = campaigns.written(tmp_path / 'quick', text)   # the same definition, without pauses
    undisturbed = tmp_path / 'undisturbed'
    done = subprocess.run(
        [sys.executable, '-m', 'poststall_sim.cli', 'campaign', str(quick), '--output',
         str(undisturbed), '--workers', '1'], env=campaigns.environment(tmp_path / 'quick'),
        capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (undisturbed / table.TABLE).read_bytes() == (out / table.TABLE).read_bytes()
    assert {row['status'] for row in rows(out)} == {'done'}


@pytest.mark.soak
@pytest.mark.timeout(600)
def test_a_cluster_that_loses_all_its_workers_is_waited_for(tmp_path):
    """Its only worker is killed; half a minute later there is another, and every row comes."""
    head, _, _ = campaigns.BRIEF.partition('vary:')
    given, out = tmp_path / 'given', tmp_path / 'out'
    path = campaigns.written(given, head + (
        'autopilot: "campaign_pilots:make"\nvary:\n'
        '  - {key: initial.alpha_deg, grid: {from: 2, to: 24, count: 20}}\n'), pause=0.1)
    address, log = tmp_path / 'scheduler.json', tmp_path / 'log.txt'
    theirs = tmp_path / 'dask.txt'
    words = ('distributed.cli.dask_worker', '--scheduler-file', str(address), '--nthreads', '1',
             '--no-dashboard', '--host', '127.0.0.1', '--no-nanny')
    with campaigns.started('distributed.cli.dask_scheduler', '--scheduler-file', str(address),
                           '--host', '127.0.0.1', '--port', '0', '--no-dashboard',
                           folder=given, log=theirs):
        campaigns.eventually(lambda: address.exists() and address.read_text(), 'scheduler')
        with campaigns.started(*words, folder=given, log=theirs) as only, campaigns.started(
                'poststall_sim', 'campaign', str(path), '--output', str(out), '--scheduler',
                json.loads(address.read_text())['address'], folder=given, log=log) as client:
            campaigns.eventually(lambda: list(out.glob('parts/part-*.parquet')), 'rows')
            only.send_signal(signal.SIGKILL)
            campaigns.eventually(lambda: 'poststall: the cluster has had no worker for' in
                                 log.read_text(), 'word of it', 60.0)
            assert client.poll() is None
            with campaigns.started(*words, folder=given, log=theirs):
                assert client.wait(300) == 0, log.read_text()
    said = log.read_text()
    assert said.count('has had no worker') == said.count('has workers again (1)') == 1
    assert [row['status'] for row in rows(out)] == 20 * ['done']


@pytest.mark.soak
@pytest.mark.skipif(not hasattr(os, 'fork'), reason='counts processes as POSIX has them')
def test_four_workers_write_the_table_of_one(tmp_path):
    path = campaigns.written(tmp_path / 'given', HISTORIES.replace('count: 4', 'count: 10'))
    assert flown(path, tmp_path / 'four', workers=4) == flown(path, tmp_path / 'one', workers=1)

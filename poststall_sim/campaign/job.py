# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A campaign from its definition to its table."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from poststall_sim import flight_file
from poststall_sim.campaign import cases, compute, definition, engine, measures, pilots, table
from poststall_sim.campaign.definition import FLIGHT, Campaign
from poststall_sim.campaign.sampling import Distribution

Watch = Callable[[Iterable, int], Iterator]
"""Passes items on, of which there will be so many, and shows how it goes."""


def columns(campaign: Campaign) -> dict[str, type]:
    """Return the columns of a campaign's table and their kinds."""
    kinds = {**measures.KINDS, **dict.fromkeys(compute.WHOLE, int)}
    inputs = {each.key: float if isinstance(each.over, Distribution) or
              type(each.over[0]) is int else type(each.over[0]) for each in campaign.variables}
    return {'case': int, 'seed': int, **inputs, 'status': str, 'reason': str,
            **{name: kinds.get(name, float) for name in campaign.quantities},
            **dict.fromkeys(engine.versions(), str)}


def identity(campaign: Campaign) -> dict[str, Any]:
    """Return all that rows depend on: with another of it they are not of one table."""
    first = cases.Builder(campaign).case(0, campaign.design[0])
    plain = {**definition.as_plain(campaign), 'versions': engine.versions(),
             'aircraft': flight_file.fingerprint(first.aircraft),   # with its section curves
             'functions': {name: hashlib.sha256(pilots.source(name).read_bytes()).hexdigest()
                           for name in cases.functions(campaign)},
             'columns': [*columns(campaign)]}
    return json.loads(json.dumps(plain))


def run(campaign: Campaign, folder: Path, *, watch: Watch, scheduler: str | None = None,
        workers: int | None = None, resume: bool = False,
        told: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Compute what a campaign has left, write its table, and return what came out."""
    builder = cases.Builder(campaign)
    with table.opened(folder, identity(campaign), columns(campaign), resume=resume) as store:
        total = len(campaign.design)
        if campaign.history_every is not None:
            first = builder.case(0, campaign.design[0])
            longest = max((builder.case(i, values).task.duration for i, values in
                           enumerate(campaign.design)), default=0.0)
            store.make_histories(total, 2 + int(longest / campaign.history_every),
                                 measures.columns(first.aircraft.control_names))
        left = total - len(store.done)
        if left:
            _warm(builder)
            with engine.cluster(scheduler, workers,
                                Path(campaign.where.file).absolute().parent) as client:
                if scheduler is not None:   # to machines that have not the user's files
                    for name in cases.functions(campaign):
                        client.upload_file(str(pilots.source(name)))
                told(f'{left} of {total} cases on {len(client.nthreads())} workers; '
                     f'{client.dashboard_link}')
                rows = engine.run(client, builder.cases(store.done))
                for each in watch(rows, left):
                    store.add(each.row, each.history, each.cost)
        found = store.finish()
    return summary(campaign, found.to_pydict(), table.costs(folder))


def _warm(builder: cases.Builder) -> None:
    """Compile what workers will load: once here, not in each of them."""
    if builder.campaign.kind == FLIGHT:
        compute.warm(builder.case(0, builder.campaign.design[0]))


def summary(campaign: Campaign, rows: dict[str, list[Any]],
            costs: dict[str, list[Any]]) -> dict[str, Any]:
    """Return how many cases ended how, and what they cost."""
    ends = {status: rows['status'].count(status) for status in sorted(set(rows['status']))}
    cpu = [each for each in costs['cpu_s'] if each > 0.0]
    mean = sum(cpu) / max(len(cpu), 1)
    return {'campaign': campaign.name, 'kind': campaign.kind, 'cases': len(rows['case']),
            'ends': ends, 'cpu_s_per_case': mean, 'cpu_hours_per_thousand': mean / 3.6}

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A campaign from its definition to its table."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from poststall_sim.campaign import (
    absence,
    cases,
    compute,
    definition,
    engine,
    measures,
    pilots,
    table,
)
from poststall_sim.campaign.definition import Campaign
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
    plain = {**definition.as_plain(campaign), 'versions': engine.versions(),
             'aircraft': cases.files_read(campaign),
             'functions': {name: hashlib.sha256(pilots.source(name).read_bytes()).hexdigest()
                           for name in cases.functions(campaign)},
             'columns': [*columns(campaign)]}
    return json.loads(json.dumps(plain))


def run(campaign: Campaign, folder: Path, *, watch: Watch, scheduler: str | None = None,
        workers: int | None = None, resume: bool = False,
        told: Callable[[str], None] = lambda text: None,
        warned: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """
    Compute what a campaign has left, write its table, and return what came out.

    told : how it begins; warned : in the midst of it, when the cluster loses all of its workers.
    """
    builder = cases.Builder(campaign)
    with table.opened(folder, identity(campaign), columns(campaign), resume=resume) as store:
        total = len(builder.design)
        if campaign.history_every is not None:
            store.make_histories(total, 2 + int(cases.longest(builder) / campaign.history_every),
                                 measures.columns(builder.case(0).aircraft.control_names))
        left = total - len(store.done)
        if left:
            # Compiled here once, and loaded by the workers, not compiled in each of them.
            compute.warm(builder.case(0))
            with engine.cluster(scheduler, workers,
                                Path(campaign.where.file).absolute().parent) as client:
                if scheduler is not None:   # to machines that have not the user's files
                    for name in cases.functions(campaign):
                        client.upload_file(str(pilots.source(name)))
                told(f'{left} of {total} cases on {len(client.nthreads())} workers; '
                     f'{client.dashboard_link}')
                rows = engine.run(client, builder.cases(store.done))
                for each in watch(absence.telling(client, rows, warned), left):
                    store.add(each.row, each.history, each.cost)
        ends, mean = store.finish()
    return {'campaign': campaign.name, 'kind': campaign.kind, 'cases': sum(ends.values()),
            'ends': ends, 'cpu_s_per_case': mean, 'cpu_hours_per_thousand': mean / 3.6}

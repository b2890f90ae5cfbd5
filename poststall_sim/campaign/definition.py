# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Campaign files: what is computed, what varies, what is kept.

One tree holds all that a case can be given: the files of the aircraft and the scenario as they
were parsed, and the campaign's own blocks. A case is that tree with its values at their key paths,
read by the same readers as ever, so that all their checks apply.
"""

import dataclasses
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from poststall_sim import air_reader, definition
from poststall_sim.campaign.compute import STEADY_QUANTITIES
from poststall_sim.campaign.measures import QUANTITIES
from poststall_sim.campaign.sampling import (
    Design,
    Distribution,
    Method,
    Samples,
    Value,
    Variable,
)
from poststall_sim.definition import Kind
from poststall_sim.reader import Place, Reader, listed, open_yaml, shown, suggestion

FLIGHT = 'flight'
KINDS = (FLIGHT, *STEADY_QUANTITIES)
EXAMPLE, NOBODY = 'example', 'none'
"""Autopilots by name: the law of `autopilot_law`, and controls that stay at trim."""

_DISTRIBUTIONS = {
    'uniform': ('from', 'to'), 'normal': ('mean', 'deviation'),
    'triangular': ('from', 'mode', 'to'), 'lognormal': ('median', 'sigma')}
_NUMBERS = ('duration_s', 'dt_s', 'cpu_limit_s', 'spin_alpha_deg')
"""Of a flight, which a file may leave out."""
_MOST = 10_000_000
SHORTEST_SAMPLE = 1e-3
"""Between two samples of a history [s]: no step of a flight is shorter, but room would be kept."""


@dataclass(frozen=True, slots=True, eq=False)
class Campaign:
    """
    A campaign as it was read.

    tree : see the module; where : the campaign file, aircraft_file and scenario_file, None
    without one, for errors and for what is named beside them.
    """

    name: str
    kind: str
    seed: int
    tree: dict[str, Any]
    where: Place
    aircraft_file: Path
    scenario_file: Path | None
    variables: tuple[Variable, ...]
    samples: Samples
    quantities: tuple[str, ...]
    history_every: float | None

    @property
    def design(self) -> Design:
        """The values of all variables for each case."""
        return Design(self.variables, self.samples, self.seed)


def campaign(path: str | os.PathLike[str]) -> Campaign:
    """Read a campaign from a YAML file, and the files it names."""
    read, folder = open_yaml(path), Path(path).parent
    read.text('description', default='', free=True)
    kind = read.choice('kind', {kind: kind for kind in KINDS}, default=FLIGHT)
    aircraft_file = definition.find(Kind.AIRCRAFT, read.text('aircraft'), beside=folder)
    # In a file of AVL nothing has a key by which it could vary: it is read as it stands.
    tree: dict[str, Any] = {'aircraft': {} if definition.is_avl(aircraft_file)
                            else open_yaml(aircraft_file).tree}
    for block in ('initial' if kind == FLIGHT else 'condition', 'air', 'settings'):
        tree[block] = read.mapping(block, default={}).tree
    scenario_file = None
    if kind == FLIGHT:
        scenario_file = _pilot(read, tree, folder)
        for block in ('stop', 'recovered'):
            tree[block] = read.mapping(block, default={}).tree
        for key in _NUMBERS:
            number = read.number_if_any(key, above=0)
            if number is not None:
                tree[key] = number
    keep = read.mapping('keep', default={})
    where = read.where
    variables = tuple(_variable(item, tree, aircraft_file) for item in read.mappings('vary'))
    for i, each in enumerate(variables):
        if each.key in [other.key for other in variables[:i]]:
            raise where.error(f'vary[{i}]: {each.key} varies already')
    quantities = _quantities(keep, kind)
    every = keep.number_if_any('history_every_s', at_least=SHORTEST_SAMPLE) \
        if kind == FLIGHT else None
    keep.done()
    samples = _samples(read, variables)
    seed = air_reader.whole_seed(read)
    name = read.name('name')
    read.done()
    total = samples.count if any(isinstance(v.over, Distribution) for v in variables) else 1
    for each in variables:
        total *= 1 if isinstance(each.over, Distribution) else len(each.over)
    if total > _MOST:
        raise where.error(f'vary: these are {total} cases, at most {_MOST}')
    return Campaign(
        name=name, kind=kind, seed=seed, tree=tree, where=where, aircraft_file=aircraft_file,
        scenario_file=scenario_file, variables=variables, samples=samples,
        quantities=quantities, history_every=every)


def _pilot(read: Reader, tree: dict[str, Any], folder: Path) -> Path | None:
    """Put who flies into the tree; return the file of the scenario, if one flies."""
    if 'scenario' in read.tree:
        if 'autopilot' in read.tree or 'law' in read.tree:
            raise read.where.error('scenario: flies alone, there is an autopilot or law as well')
        path = definition.find(Kind.SCENARIO, read.text('scenario'), beside=folder)
        tree['scenario'] = open_yaml(path).tree
        return path
    tree['autopilot'] = read.text('autopilot', default=NOBODY)
    law = read.tree.get('law', {})
    if isinstance(law, str):   # saved gains, in a file of their own
        tree['law'] = open_yaml(folder / read.text('law')).tree
    else:
        tree['law'] = read.mapping('law', default={}).tree
    return None


def _variable(read: Reader, tree: dict[str, Any], aircraft_file: Path) -> Variable:
    key = read.text('key')
    root = key.partition('.')[0]
    if root == 'aircraft' and definition.is_avl(aircraft_file):
        raise read.where.key('key').error(
            f'{key}: nothing of {aircraft_file.name} can vary, it is a file of AVL; poststall new '
            f'NAME --from {aircraft_file.name} makes one of ours of it')
    if root not in tree:
        free = _NUMBERS if 'initial' in tree else ()
        if key not in free:
            known = list(dict.fromkeys([*tree, *sorted(free)]))
            raise read.where.key('key').error(
                f'key {key}: there is no {root} here, there are {listed(known)}'
                + suggestion(root, known))
    ways = [way for way in ('values', 'grid', *_DISTRIBUTIONS, 'distribution')
            if way in read.tree]
    if len(ways) != 1:
        raise read.where.error(
            f'{key} must have one of values, grid, {", ".join(_DISTRIBUTIONS)}, distribution; got '
            f'{listed(ways)}')
    over = _over(read, key, ways[0])
    if not isinstance(over, Distribution) and len(set(over)) < len(over):
        raise read.where.error(f'{key} is given one value twice: {shown(list(over))}')
    if not isinstance(over, Distribution) and len(over) < 2:
        raise read.where.error(f'{key} does not vary: it is given {shown(list(over))}')
    return read.build(Variable, key=key, over=over)


def _over(read: Reader, key: str, way: str) -> tuple[Value, ...] | Distribution:
    if way == 'values':
        values = read.value('values')
        here = read.where.key('values')
        if not isinstance(values, list):
            raise here.error(f'{key} must be given a list, got {shown(values)}')
        for index, value in enumerate(values):
            if isinstance(value, (list, dict)) or value is None:
                raise here.item(index).error(f'{key} must be a number, a text, true or false, '
                                             f'got {shown(value)}')
        kinds = {float if type(value) is int else type(value) for value in values}
        if len(kinds) > 1:
            raise here.error(f'{key} must be given values of one kind, got {shown(values)}')
        return tuple(values)
    if way == 'distribution':
        free = read.mapping('distribution')
        name = free.text('name')
        parameters = {each: free.number(each) for each in free.tree if each != 'name'}
        return free.build(Distribution, name=name, parameters=parameters)
    inner = read.mapping(way)
    if way == 'grid':
        low, high = inner.number('from'), inner.number('to')
        count = inner.count('count', at_most=1_000_000)
        inner.done()
        if count == 1:
            return (low,)
        return tuple(round(low + (high - low) * i / (count - 1), 12) for i in range(count))
    numbers = {name: inner.number(name) for name in _DISTRIBUTIONS[way]}
    inner.done()
    return inner.where.build(Distribution, **_of_scipy(way, numbers, inner.where))


def _of_scipy(way: str, numbers: dict[str, float], where: Place) -> dict[str, Any]:
    """Return name and parameters that `scipy.stats` has for a distribution."""
    if way in ('uniform', 'triangular'):
        low, high = numbers['from'], numbers['to']
        if not low < high:
            raise where.error(f'must go up, got from {low:g} to {high:g}')
        if way == 'uniform':
            return {'name': 'uniform', 'parameters': {'loc': low, 'scale': high - low}}
        mode = (numbers['mode'] - low) / (high - low)
        return {'name': 'triang', 'parameters': {'c': mode, 'loc': low, 'scale': high - low}}
    spread = 'deviation' if way == 'normal' else 'sigma'
    if not numbers[spread] > 0.0:
        raise where.error(f'{spread} must be above 0, got {numbers[spread]:g}')
    if way == 'normal':
        return {'name': 'norm',
                'parameters': {'loc': numbers['mean'], 'scale': numbers['deviation']}}
    return {'name': 'lognorm', 'parameters': {'s': numbers['sigma'], 'scale': numbers['median']}}


def _quantities(keep: Reader, kind: str) -> tuple[str, ...]:
    known = tuple(QUANTITIES) if kind == FLIGHT else STEADY_QUANTITIES[kind]
    asked = keep.value('quantities', default=list(known))
    if not isinstance(asked, list):
        raise keep.where.key('quantities').error(f'must be a list, got {shown(asked)}')
    for index, name in enumerate(asked):
        if name not in known:
            raise keep.where.key('quantities').item(index).error(
                f'must be one of {listed(known)}, got {shown(name)}' + suggestion(name, known))
    return tuple(dict.fromkeys(asked))


def _samples(read: Reader, variables: tuple[Variable, ...]) -> Samples:
    drawn = [each.key for each in variables if isinstance(each.over, Distribution)]
    if not drawn:
        if 'samples' in read.tree:
            raise read.where.error('samples: nothing is drawn from a distribution, they would '
                                   'change nothing')
        return Samples()
    inner = read.mapping('samples')
    return inner.build(
        Samples, count=inner.count('count', at_most=_MOST),
        method=inner.choice('method', {each.value: each for each in Method},
                            default=Method.LATIN_HYPERCUBE.value))


def as_plain(read: Campaign) -> dict[str, Any]:
    """Return all that makes a campaign what it is, as JSON has it."""
    return {
        'name': read.name, 'kind': read.kind, 'seed': read.seed, 'tree': read.tree,
        'variables': [[each.key, dataclasses.asdict(each.over)
                       if isinstance(each.over, Distribution) else list(each.over)]
                      for each in read.variables],
        'samples': [read.samples.method.value, read.samples.count],
        'quantities': list(read.quantities), 'history_every_s': read.history_every}

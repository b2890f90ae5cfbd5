# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Key paths into a definition: ``aircraft.surfaces.wing.sections.0.chord_m``.

A step of a path is a key of a mapping, the index of a list's item, or the ``name`` of one.
"""

from collections.abc import Mapping
from typing import Any

from poststall_sim.reader import Place, listed, shown, suggestion


def changed(tree: Mapping[str, Any], values: Mapping[str, Any], where: Place) -> dict[str, Any]:
    """
    Return a tree with values at key paths; what is not on their way is shared with the old one.

    A last step may be a key that is not there: whoever reads the mapping knows which may be.
    """
    result = dict(tree)
    for path, value in values.items():
        _set(result, path.split('.'), value, path, where)
    return result


def _set(tree: Any, steps: list[str], value: Any, path: str, where: Place) -> None:
    """Set a value below a tree that is ours, of which only the top is copied yet."""
    step, rest = _step(tree, steps[0], path, where, last=len(steps) == 1), steps[1:]
    if not rest:
        tree[step] = value
        return
    below = tree[step]
    if not isinstance(below, (dict, list)):
        raise where.error(f'key {path}: {steps[0]} is {shown(below)}, there is nothing below it')
    tree[step] = below.copy()
    _set(tree[step], rest, value, path, where)


def _step(tree: Any, step: str, path: str, where: Place, *, last: bool) -> Any:
    """Return the key or the index that a step means in a mapping or a list."""
    if isinstance(tree, dict):
        if step in tree or (last and step):
            return step
        known: list[str] = list(tree)
    else:
        named = {item['name']: index for index, item in enumerate(tree)
                 if isinstance(item, dict) and isinstance(item.get('name'), str)}
        if step in named:
            return named[step]
        if step.isdecimal() and int(step) < len(tree):
            return int(step)
        known = [*named] or [str(index) for index in range(len(tree))]
    raise where.error(f'key {path}: there is no {shown(step)}, '
                      + (f'there are {listed(known)}' if known else 'nothing is there')
                      + suggestion(step, known))

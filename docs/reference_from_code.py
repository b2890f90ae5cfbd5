# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Directives for the interface reference: its tables are made from the code when the site is built.

    {topics} published        or heard
    {parameters} poststall_sim.ros.parameters.PilotSettings
    {services}
    {keys} aircraft           or scenario: every key that a reader asks for
    {commands}                every command with its options
"""

import argparse
import dataclasses
import importlib
import inspect
import re
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import yaml
from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from poststall_sim import cli, definition, inlets, reader, topics

TESTS = Path(__file__).resolve().parent.parent / 'test'
_CODE = re.compile(r'`+([^`]+)`+')
Cell = str | nodes.Node
Key = tuple[str, str, str]
"""What a key of a definition must be, its limits, and what holds where it is left out."""
DEPENDING = {
    'airfoils.NAME.reynolds': 'for any Reynolds number',
    'airfoils.NAME[].reynolds': 'as the table says',
    'air.density_kg_m3': 'by altitude',
    'engines[].battery.empty_voltage_V': 'voltage_V',
    'engines[].blades.hub_radius_m': '0.15 of the radius',
}
"""What holds where a key is left out, where that depends on something else."""


def setup(app):
    """Register the directives with Sphinx."""
    for name, directive in (('topics', Topics), ('parameters', Parameters),
                            ('services', Services), ('keys', Keys),
                            ('commands', Commands)):
        app.add_directive(name, directive)
    return {'parallel_read_safe': True}


class Topics(SphinxDirective):
    """The table of topics that the simulator publishes, or hears."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        if self.arguments[0] == 'heard':
            return [table(('topic and type', 'meaning', 'QoS'), (
                (named(topic), topic.meaning, quality(topic)) for topic in inlets.SUBSCRIBED))]
        return [table(('topic and type', 'meaning', 'rate [Hz] and QoS'), (
            (named(topic), topic.meaning, [rate(topic), quality(topic)])
            for topic in topics.PUBLISHED))]


class Parameters(SphinxDirective):
    """The parameters that a frozen record of settings has."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        module, _, name = self.arguments[0].rpartition('.')
        fields = dataclasses.fields(getattr(importlib.import_module(module), name))
        return [table(('parameter and default', 'meaning', 'range', 'may be set in flight'), (
            ([code(field.metadata['name']), written(field.default)],
             field.metadata['description'], limits(field.metadata),
             'yes' if field.metadata['writable'] else '') for field in fields))]


class Services(SphinxDirective):
    """The services of the simulator."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        from poststall_sim.ros import operations
        rows = [(code(name), kind, re.split(r' \w+ : ', ' '.join(
                    inspect.getdoc(operation).split()))[0])   # without its arguments
                for kind, table_ in (('std_srvs/Trigger', operations.TRIGGERED),
                                     ('std_srvs/SetBool', operations.SWITCHED))
                for name, operation in table_.items()]
        return [table(('service', 'type', 'what it does'), rows)]


class Keys(SphinxDirective):
    """Every key of a definition, as its reader asks for it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        asked = keys(self.arguments[0])
        return [table(('key', 'value', 'limits', 'if left out'), (
            (code(path), kind, bounds, default) for path, (kind, bounds, default)
            in asked.items()))]


class Commands(SphinxDirective):
    """Every command: what it does, its usage, its options by their groups, its examples."""

    def run(self) -> list[nodes.Node]:
        """Return a section for each command."""
        commands = next(action for action in cli._parser()._actions
                        if isinstance(action, argparse._SubParsersAction))
        return [self._section(name, parser) for name, parser in commands.choices.items()]

    def _section(self, name: str, parser: argparse.ArgumentParser) -> nodes.Node:
        section = nodes.section(ids=[f'poststall-{name}'])
        title = f'poststall {name}'
        section += nodes.title(title, title)
        section += nodes.paragraph(parser.description, parser.description)
        with mock.patch.dict('os.environ', COLUMNS='88'):
            usage = parser.format_usage()
        section += nodes.literal_block(usage, usage, language='text')
        for group in parser._action_groups:
            rows = [(code(_called(action)), _help(action)) for action in group._group_actions
                    if action.dest != 'help']
            if rows:
                section += nodes.paragraph('', '', nodes.strong(group.title, group.title))
                section += table(('', 'meaning'), rows)
        examples = parser.epilog.partition('exit codes')[0].strip()
        section += nodes.literal_block(examples, examples, language='text')
        return section


def _called(action: argparse.Action) -> str:
    """Return how an option or an argument is written."""
    value = action.metavar or ('{' + ','.join(map(str, action.choices)) + '}'
                               if action.choices else '')
    value = ' '.join(value) if isinstance(value, tuple) else value
    return ' '.join((', '.join(action.option_strings) or ('' if value else action.dest),
                     value if action.nargs != 0 else '')).strip()


def _help(action: argparse.Action) -> str:
    """Return what an option means, its default filled in as argparse does."""
    return (action.help or '') % {**vars(action), 'prog': 'poststall'}


def named(topic: topics.Topic) -> list[Cell]:
    """Return the name of a topic, and below it the type."""
    return [code(topic.name), topic.type.replace('/msg/', '/')]


def rate(topic: topics.Topic) -> str:
    """Return which parameter gives the rate of a topic, and its default."""
    return f'`{topic.rate.parameter}` {topic.rate.default:g}' if topic.rate.parameter \
        else 'once'


def quality(topic: topics.Topic) -> str:
    """Return the quality of service of a topic."""
    return (f'{"reliable" if topic.qos.reliable else "best effort"}, depth {topic.qos.depth}'
            + (', transient local' if topic.qos.latched else ''))


def written(value: Any) -> str:
    """Return a default as it stands in a parameter file."""
    if value in ('', [], {}):
        return 'none'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f'[{", ".join(repr(x) if isinstance(x, str) else written(x) for x in value)}]'
    return f'{value:g}' if isinstance(value, float) else repr(value)


def limits(entry: dict[str, Any]) -> str:
    """Return what a parameter may be."""
    if entry['choices']:
        return ', '.join(f'`{choice}`' for choice in entry['choices'])
    span = '' if entry['low'] is None else f'{entry["low"]:g} to {entry["high"]:g}'
    return '; '.join(part for part in (span, entry['constraints']) if part)


def keys(kind: str) -> dict[str, Key]:
    """
    Return the keys that a reader asks for: type, limits and what holds where one is left out.

    The definitions that are read have every key; a test holds them to that.
    """
    sys.path.insert(0, str(TESTS))
    import everything
    asked: dict[str, Key] = {}
    with tempfile.TemporaryDirectory() as name, mock.patch.multiple(
            reader.Reader, **dict(_listening(asked))):
        folder = Path(name)
        everything.write_curves(folder)
        path = folder / f'{kind}.yaml'
        path.write_text(getattr(everything, kind.upper()))
        getattr(definition, kind)(path)
        if kind == 'scenario':   # the keys that exclude some of the others
            tree = {**everything.SCENARIO_TREE, 'air': {
                'shear': {'law': 'power', 'exponent': 0.1},
                'turbulence': {'sigma_m_s': 1.0, 'scale_m': 50.0}}}
            path.write_text(yaml.safe_dump(tree))
            definition.scenario(path)
    tops = [path.partition('.')[0].rstrip('[]') for path in asked]
    return dict(sorted(asked.items(), key=lambda item: tops.index(
        item[0].partition('.')[0].rstrip('[]'))))


def _listening(asked: dict[str, Key]) -> Iterator[tuple[str, Any]]:
    """Give the methods of a reader, each noting what it is asked for."""
    words = {'value': 'any', 'number': 'number', 'number_if_any': 'number',
             'count': 'whole number', 'boolean': 'true or false', 'text': 'text',
             'name': 'name', 'choice': 'word',
             'vector': 'list of numbers', 'numbers': 'list of numbers',
             'rows': 'list of lists of numbers', 'points': 'list of [time in s, value]',
             'mapping': 'mapping', 'mappings': 'list of mappings',
             'files': 'file, or list of them'}
    has, optional = reader.Reader.has, set()

    def noted_has(self, key):
        optional.add(_path(self, key))
        return has(self, key)
    yield 'has', noted_has
    asking = {name for name, each in vars(reader.Reader).items() if inspect.isfunction(each)
              and 'key' in inspect.signature(each).parameters and not name.startswith('_')}
    if unheard := asking ^ {'has', *words}:
        raise RuntimeError(f'a Reader is asked in other ways than here: {sorted(unheard)}')
    for method, word in words.items():
        yield method, _noting(getattr(reader.Reader, method), word, asked, optional)


def _path(read: reader.Reader, key: str) -> str:
    """Return where a key stands, without numbers of items and names of the user's choice."""
    path = re.sub(r'\[\d+\]', '[]', read.where.key(key).path)
    return re.sub(r'^(airfoils|controls|channels)\.\w+', r'\1.NAME', path)


def _noting(method, word: str, asked: dict[str, Key], optional: set[str]):
    """Return a method that notes what it is asked for; optional : keys that may be missing."""
    def noted(self, key, *rest, **limits):
        path = _path(self, key)
        bounds = ', '.join(f'{name.replace("_", " ")} {written(value)}'
                           for name, value in limits.items()
                           if name not in ('default', 'free'))
        if word == 'word':
            bounds = 'a name of this file' if 'wing' in rest[0] else ', '.join(
                f'`{choice}`' for choice in rest[0])
        left_out = DEPENDING.get(path) or (
            written(limits['default']) if 'default' in limits else
            '' if path in optional or method.__name__ == 'number_if_any' else 'required')
        asked.setdefault(path, (word, bounds, left_out))
        return method(self, key, *rest, **limits)
    return noted


def code(text: str) -> nodes.Node:
    """Return a text as code."""
    return nodes.literal(text, text)


def table(heads: tuple[str, ...], rows: Iterable[tuple[Cell | list[Cell], ...]]) -> nodes.Node:
    """Return a table; between backquotes is code, and a list is lines below each other."""
    group = nodes.tgroup(cols=len(heads))
    group += [nodes.colspec(colwidth=1) for _ in heads]
    group += nodes.thead('', _row(heads))
    group += nodes.tbody('', *map(_row, rows))
    return nodes.table('', group, classes=['from-code'])


def _row(cells: Iterable[Cell | list[Cell]]) -> nodes.Node:
    return nodes.row('', *(
        nodes.entry('', *(nodes.paragraph('', '', *_inline(line))
                          for line in (cell if isinstance(cell, list) else [cell])))
        for cell in cells))


def _inline(cell: Cell) -> list[nodes.Node]:
    if isinstance(cell, nodes.Node):
        return [cell]
    return [code(text) if index % 2 else nodes.Text(text)
            for index, text in enumerate(_CODE.split(cell)) if text]

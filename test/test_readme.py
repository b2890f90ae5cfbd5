# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the README and the pages of docs say of topics, commands, files and tests is there."""

import ast
import re
import shlex
from pathlib import Path

from poststall_sim import cli, inlets, topics

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / 'README.md').read_text(encoding='utf-8')
PAGES = {path.name: path.read_text(encoding='utf-8')
         for path in (ROOT / 'README.md', *sorted((ROOT / 'docs').glob('*.md')))}


def test_every_topic_stands_in_the_readme_with_its_type_rate_and_meaning():
    for topic in topics.PUBLISHED:
        rate = f'{topic.rate.parameter} {topic.rate.default:g}' if topic.rate.parameter \
            else 'once, latched'
        if topic.switch:
            rate += f', {topic.switch.parameter} {str(topic.switch.default).lower()}'
        row = (f'| `{topic.name}` | {topic.type.replace("/msg/", "/")} | {rate} | '
               f'{topic.meaning} |')
        assert row in README, f'the README should have the row\n{row}'


def test_every_command_topic_stands_in_the_readme():
    for topic in inlets.SUBSCRIBED:
        assert f'`{topic.name}`' in README


def test_the_axes_and_buttons_of_a_stick_stand_in_the_readme():
    # Not by the settings' class, which wants ROS.
    source = (ROOT / 'poststall_sim' / 'ros' / 'parameters.py').read_text(encoding='utf-8')
    found = re.findall(r"(axis|button)_entry\(\s*'(\w+)', (\d+)", source)
    said = {'pause': '{} pauses', 'reset': '{} resets', 'trim': '{} trims'}
    assert len(found) == 7
    for kind, name, number in found:
        assert (f'{name} (axis {number})' if kind == 'axis'
                else said[name].format(number)) in ' '.join(README.split()), name


def test_every_file_that_the_pages_link_exists():
    for name, text in PAGES.items():
        folder = ROOT if name == 'README.md' else ROOT / 'docs'
        links = re.findall(r'\]\(([^)#:]+)\)', text)
        missing = [link for link in links if not (folder / link).exists()]
        assert not missing, name


def test_every_test_that_the_pages_name_exists():
    """A reference that no test holds any more would be a claim."""
    named = set(re.findall(r'`(test_\w+\.py)::(test_\w+)`', ''.join(PAGES.values())))
    assert len(named) > 30
    for file, function in named:
        tree = ast.parse((ROOT / 'test' / file).read_text(encoding='utf-8'))
        assert function in {node.name for node in tree.body
                            if isinstance(node, ast.FunctionDef)}, (file, function)


def test_the_readme_has_the_table_of_the_validation_and_is_short():
    """One table, written into both by `make figures`; a stranger's first page is no manual."""
    summaries = [re.findall(r'<!-- table summary -->\n(.*?)<!-- end -->', PAGES[name], re.DOTALL)
                 for name in ('README.md', 'validation.md')]
    assert summaries[0] == summaries[1] and len(summaries[0]) == 1
    assert summaries[0][0].count('\n') > 15
    assert README.count('\n') < 270
    assert (ROOT / 'docs' / 'images' / 'flight.gif').stat().st_size < 2_000_000


def test_every_command_line_of_the_readme_parses(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)   # what is written there must need no folder
    blocks = re.findall(r'^```[^\n]*\n(.*?)^```', README, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.replace('\\\n', ' ').splitlines()
             if line.startswith('poststall ')]
    commands = [cli.parse(shlex.split(line, comments=True)[1:]).command for line in lines]
    assert set(commands) == {'new', 'show', 'check', 'polar', 'trim', 'modes', 'derivatives',
                             'database', 'fly', 'plot', 'report', 'watch', 'export', 'airfoil',
                             'campaign'}

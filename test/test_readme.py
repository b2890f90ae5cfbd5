# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the README says of topics, commands and files is what there is."""

import re
import shlex
from pathlib import Path

from poststall_sim import cli, inlets, topics

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / 'README.md').read_text(encoding='utf-8')


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
    said = {'pause': '{} pauses', 'reset': '{} resets', 'trim': '{}\ntrims'}
    assert len(found) == 7
    for kind, name, number in found:
        assert (f'{name} (axis {number})' if kind == 'axis'
                else said[name].format(number)) in README, name


def test_every_file_that_the_readme_links_exists():
    links = re.findall(r'\]\(([^)#:]+)\)', README)
    assert links and all((ROOT / link).exists() for link in links)


def test_every_command_line_of_the_readme_parses(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)   # what is written there must need no folder
    blocks = re.findall(r'^```\w*\n(.*?)^```', README, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.replace('\\\n', ' ').splitlines()
             if line.startswith('poststall ')]
    commands = [cli.parse(shlex.split(line, comments=True)[1:]).command for line in lines]
    assert set(commands) == {'new', 'show', 'check', 'polar', 'trim', 'modes', 'derivatives',
                             'database', 'fly', 'plot', 'report', 'export', 'airfoil', 'campaign'}

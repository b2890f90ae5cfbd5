# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What a user can be told: every refusal in the source, in the words that stand in messages.txt.

A message that is new or changed is read here as a user would, beside its neighbours, and then
written into the list. What a message stands for is tested where its subject is.
"""

import ast
import re
from pathlib import Path

import pytest

TEST = Path(__file__).parent
PACKAGE = TEST.parent / 'poststall_sim'
LIST = TEST / 'messages.txt'

RAISED = {'ConfigError', 'NotWrittenError', 'NoResultError', 'BagError', 'EngineError',
          'DemoError', 'ImportError', 'OSError', 'ArgumentTypeError', 'ArgumentError',
          'RefusedState', 'RefusedCommand', 'error', '_unknown', '_broken'}
"""Names of what is raised to be shown: the errors, and the methods that make them."""


def words(node):
    """Return the text of an expression, with {} for what only the run knows."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return ''.join(words(value) for value in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return words(node.left) + words(node.right)
    if isinstance(node, ast.IfExp):
        return f'{words(node.body)}|{words(node.orelse)}'
    return '{}'


def messages():
    """Yield a line for each refusal: its module and its words."""
    for path in sorted(PACKAGE.rglob('*.py')):
        for node in ast.walk(ast.parse(path.read_text())):
            if not (isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)):
                continue
            made = node.exc.func
            name = made.attr if isinstance(made, ast.Attribute) else made.id
            text = words(node.exc.args[-1]) if name in RAISED and node.exc.args else ''
            # without a word it hands on what another says
            if re.search('[a-z]', text):
                yield f'{path.relative_to(PACKAGE)}: {text!r}'


def test_every_message_stands_in_the_list():
    said, listed = set(messages()), set(LIST.read_text().splitlines())
    assert sorted(said - listed) == [], 'read these and add them to test/messages.txt'
    assert sorted(listed - said) == [], 'nobody says these any more'


@pytest.mark.parametrize('message', [*LIST.read_text().splitlines()])
def test_it_is_one_plain_line(message):
    text = ast.literal_eval(message.partition(': ')[2])
    assert '\n' not in text
    assert not re.search(r'[.!]$|please|invalid|illegal', text, re.IGNORECASE), text

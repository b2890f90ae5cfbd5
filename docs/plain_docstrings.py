# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Docstrings as they are written here, plain text, made into what Sphinx reads.

Stars, bars and underscores stand for themselves, what is indented below a paragraph is a formula,
and `name` is code. Sections are numpy's, and definitions below them stay definitions.
"""

import re
from collections.abc import Iterator

_CODE = re.compile(r'(``.+?``|(?<!`)`[^`\n]+`(?!`))')
_BULLET = re.compile(r' *[*-] ')
_RULE = re.compile(r'-{3,}')


def setup(app):
    """Register the conversion with Sphinx."""
    app.connect('autodoc-process-docstring', _convert)
    return {'parallel_read_safe': True}


def _convert(app, what, name, thing, options, lines: list[str]) -> None:
    """Put reStructuredText in the place of the lines of a docstring."""
    lines[:] = [line for block in _blocks(lines) for line in (*_block(block), '')]


def _blocks(lines: list[str]) -> Iterator[list[str]]:
    """Give the lines between empty ones."""
    block: list[str] = []
    for line in [*lines, '']:
        if line.strip():
            block.append(line)
        elif block:
            yield block
            block = []


def _block(block: list[str]) -> list[str]:
    """Return a paragraph, a formula, or a section's title with what follows it."""
    if block == ['::']:
        return []   # a formula follows, which is told by its indent
    if len(block) > 1 and _RULE.fullmatch(block[1]):
        return [f'**{block[0]}**', '', *map(_plain, block[2:])]
    if all(line.startswith('    ') for line in block):
        return ['..', '', '::', '', *block]
    return [*map(_plain, block)]


def _plain(line: str) -> str:
    """Return a line in which nothing but code is markup."""
    bullet = _BULLET.match(line)
    mark = bullet.group() if bullet else ''
    parts = _CODE.split(line[len(mark):])
    return mark + ''.join(
        f'``{part.strip("`")}``' if index % 2 else re.sub(r'([*|_\\])', r'\\\1', part)
        for index, part in enumerate(parts))

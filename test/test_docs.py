# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the documentation says to type works when it is typed, page by page, in an empty folder."""

import pkgutil
import re

import pages
import pytest

import poststall_sim

PAGES = pages.pages()
WORDS = re.compile(r'|background|(background )?soak|file=[\w./-]+|not run: .+')


def starts_nodes(blocks):
    return any(block.background for block in blocks)


def in_soak(page, blocks):
    """Tell whether a page is in the soak whole: tasks with a node, each of many seconds."""
    return page.startswith('docs/how-to/') and starts_nodes(blocks)


def marked(page, blocks):
    """Return a page with its marks: those that start nodes talk DDS."""
    ros = [pytest.mark.ros] if starts_nodes(quick(blocks)) else []
    return pytest.param(page, marks=[pytest.mark.slow, *ros], id=page)


def quick(blocks):
    return [block for block in blocks if block.done and not block.soak]


@pytest.mark.parametrize('page', [
    marked(page, blocks) for page, blocks in PAGES.items()
    if any(block.language in pages.RUN for block in quick(blocks)) and not in_soak(page, blocks)])
def test_the_commands_of_a_page_work(page, tmp_path):
    with pages.Reader(tmp_path) as reader:
        for block in quick(PAGES[page]):
            reader.does(block)


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('page', [
    marked(page, blocks) for page, blocks in PAGES.items()
    if any(block.soak for block in blocks) or in_soak(page, blocks)])
def test_the_commands_of_a_page_that_take_long_work(page, tmp_path):
    if any('poststall campaign' in block.text for block in PAGES[page] if block.done):
        pytest.importorskip('distributed', reason='needs the extra campaign')
    with pages.Reader(tmp_path) as reader:
        for block in PAGES[page]:
            if block.done:
                reader.does(block)


@pytest.mark.parametrize('block', [
    pytest.param(block, id=f'{page}:{block.line}') for page, blocks in PAGES.items()
    for block in blocks if block.why_not])
def test_a_block_that_is_not_run_says_why(block):
    pytest.skip(block.why_not)


def test_every_fence_says_how_it_is_taken_and_yaml_is_yaml():
    for blocks in PAGES.values():
        for block in blocks:
            where = f'{block.page}, line {block.line}'
            if block.language in (*pages.RUN, 'yaml'):
                assert WORDS.fullmatch(block.words), f'{where}: {block.words!r}'
            if block.language == 'yaml':
                assert pages.is_yaml(block.text), where


def test_every_module_stands_in_the_python_reference():
    there = {module.name for module in pkgutil.walk_packages(
        poststall_sim.__path__, 'poststall_sim.') if not module.ispkg}
    listed = {name for page in (pages.ROOT / 'docs/reference/python').glob('*.md')
              for name in re.findall(r'automodule:: (\S+)', page.read_text())}
    # The commands are in the reference of the command line.
    missing = {name for name in there - listed if '.commands.' not in name}
    assert not missing and listed <= there | {'poststall_sim.plots', 'poststall_sim.report'}

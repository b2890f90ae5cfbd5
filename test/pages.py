# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Pages of the documentation as what a reader does with them: code blocks, run in their order.

What follows the language of a fence says how its block is taken:

    ```bash                     run, and must succeed; so is ```python
    ```console                  lines with `$ ` are run, what they print must be what stands below,
                                `...` standing for anything
    ```yaml file=mine.yaml      written to that file; any language
    ```bash background          started, and ended by Ctrl-C at the end of the page: a node
    ```bash soak                run apart from the tests, by CI and `make soak`: it takes long;
                                also `background soak`
    ```bash not run: why        not run, for this reason

`ros2` is the stand-in of `ros2_stand_in`, or the real one where there is one.
"""

import doctest
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import yaml
from processes import free_domain

ROOT = Path(__file__).resolve().parents[1]
STAND_IN = Path(__file__).with_name('ros2_stand_in.py')
RUN = ('bash', 'console', 'python')
LIMIT, SOAK_LIMIT = 240.0, 900.0
"""How long a block may take [s]: kernels may have to be compiled first."""
END_LIMIT = 20.0
"""How long a node may take to end [s]."""

_FENCE = re.compile(r'^```(\w+)([^\n]*)\n(.*?)^```$', re.MULTILINE | re.DOTALL)
_SAME = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block: where it stands, its language, what the fence says of it, its text."""

    page: str
    line: int
    language: str
    words: str
    text: str

    @property
    def file(self) -> str | None:
        """The name of the file that it is, if it is one."""
        found = re.fullmatch(r'file=([\w./-]+)', self.words)
        return found and found[1]

    @property
    def background(self) -> bool:
        """Tell whether it is started and goes on beside what follows."""
        return 'background' in self.words.split()

    @property
    def soak(self) -> bool:
        """Tell whether only the soak runs it."""
        return self.why_not is None and 'soak' in self.words.split()

    @property
    def why_not(self) -> str | None:
        """Why it is not run, if it says so."""
        found = re.fullmatch(r'not run: (.+)', self.words)
        return found and found[1]

    @property
    def done(self) -> bool:
        """Tell whether there is anything to be done with it, now or in the soak."""
        return self.file is not None or (self.language in RUN and self.why_not is None)


def pages() -> dict[str, list[Block]]:
    """Return the blocks of each page that has any, by its path: of the README and of docs."""
    found = {}
    for path in (ROOT / 'README.md', *sorted((ROOT / 'docs').rglob('*.md'))):
        if '_build' not in path.parts and (blocks := blocks_of(path)):
            found[path.relative_to(ROOT).as_posix()] = blocks
    return found


def blocks_of(path: Path) -> list[Block]:
    """Return the fenced blocks of a page that have a language."""
    text = path.read_text(encoding='utf-8')
    return [Block(path.relative_to(ROOT).as_posix(), text.count('\n', 0, match.start()) + 1,
                  match[1], match[2].strip(), match[3]) for match in _FENCE.finditer(text)]


class Reader:
    """Somebody who does what a page says, in an empty folder."""

    def __init__(self, folder: Path) -> None:
        tools, home = folder / '.tools', folder / '.home'
        tools.mkdir()
        home.mkdir()
        self._folder = folder
        self._nodes: list[tuple[Block, subprocess.Popen, Path]] = []
        path = f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'
        if shutil.which('ros2') is None:
            (tools / 'ros2').write_text(
                f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {shlex.quote(str(STAND_IN))} '
                '"$@"\n')
            (tools / 'ros2').chmod(0o755)
            path = f'{tools}{os.pathsep}{path}'
        self._env = {**os.environ, 'PATH': path, 'MPLBACKEND': 'Agg', 'HOME': str(home),
                     'MPLCONFIGDIR': str(Path.home() / '.cache/matplotlib'),   # its list of fonts
                     'PYTHONPATH': str(ROOT), 'ROS_DOMAIN_ID': str(free_domain()),
                     'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}

    def __enter__(self) -> 'Reader':
        return self

    def __exit__(self, kind, *rest) -> None:
        failures = [self._ended(*each) for each in reversed(self._nodes)]
        if kind is None:
            assert not any(failures), '\n'.join(filter(None, failures))

    def does(self, block: Block) -> None:
        """Write a block to its file, start it, or run it; fail where it fails."""
        where, limit = f'{block.page}, line {block.line}', SOAK_LIMIT if block.soak else LIMIT
        if block.file:
            path = self._folder / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text)
        elif block.background:
            self._start(block)
        elif block.language == 'console':
            for command, expected in conversation(block.text):
                printed = self._run(['bash', '-euo', 'pipefail', '-c', command], where, limit)
                assert doctest.OutputChecker().check_output(expected, printed, _SAME), \
                    f'{where}: {command} printed\n{printed}\nand the page says\n{expected}'
        elif block.language == 'python':
            self._run([sys.executable, '-c', block.text], where, limit)
        else:
            self._run(['bash', '-euo', 'pipefail', '-c', block.text], where, limit)

    def _run(self, command: list[str], where: str, limit: float) -> str:
        for told, node, log in self._nodes:
            assert node.poll() is None, f'{told.text} has ended:\n{log.read_text()}'
        done = subprocess.run(command, cwd=self._folder, env=self._env, timeout=limit, text=True,
                              stdin=subprocess.DEVNULL, capture_output=True)
        said = ''.join(f'\n{node.text}{log.read_text()}' for node, _, log in self._nodes)
        assert done.returncode == 0, \
            f'{where}: {command[-1]}\n{done.stdout}{done.stderr}{said}'
        return done.stdout

    def _start(self, block: Block) -> None:
        log = self._folder / '.tools' / f'{len(self._nodes)}.log'
        command = ' '.join(block.text.replace('\\\n', ' ').split())
        assert '\n' not in block.text.replace('\\\n', ' ').strip(), \
            f'{block.page}, line {block.line}: one command can be started, not several'
        with open(log, 'wb') as output:
            node = subprocess.Popen(
                ['bash', '-c', f'exec {command}'], cwd=self._folder, env=self._env,
                stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                start_new_session=True)
        self._nodes.append((block, node, log))

    def _ended(self, block: Block, node: subprocess.Popen, log: Path) -> str | None:
        """End a node as Ctrl-C does; return what was wrong with it, if anything."""
        if node.poll() is None:
            node.send_signal(signal.SIGINT)
        try:
            code = node.wait(END_LIMIT)
        except subprocess.TimeoutExpired:
            node.kill()
            code = node.wait()
        return None if code == 0 else \
            f'{block.page}, line {block.line}: ended with {code}:\n{log.read_text()}'


def conversation(text: str) -> list[tuple[str, str]]:
    """Return the commands of a console and what each prints."""
    parts = re.split(r'^\$ ((?:.*\\\n)*.*\n)', text, flags=re.MULTILINE)
    assert not parts[0].strip(), f'a console begins with `$ `, not with {parts[0]!r}'
    return list(zip(parts[1::2], parts[2::2]))


def is_yaml(text: str) -> bool:
    """Tell whether a text is YAML."""
    try:
        yaml.safe_load(text)
    except yaml.YAMLError:
        return False
    return True

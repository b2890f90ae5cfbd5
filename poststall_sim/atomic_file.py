# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Files written whole or not at all: beside their place first, and moved there once on the disk.

Whoever reads at the same time, or after a process or a machine was stopped, finds what was there
before or what is new, never a part.
"""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from poststall_sim.records import ConfigError


class NotWrittenError(ConfigError):
    """The system does not write a file: no room, no right, no such folder."""


def unfinished(path: Path) -> Path:
    """Return where a file is written before it is moved to its place."""
    return path.with_name(path.name + '.part')


@contextmanager
def writing(path: Path) -> Iterator[BinaryIO]:
    """
    Give a file to write, which takes the place of another at the end of the block.

    Whatever ends the block before leaves the other one as it was. Raises `ConfigError` where
    something else than a file is there, which would be replaced or waited for, and
    `NotWrittenError` where the system cannot write.
    """
    part = unfinished(path)
    for each in (path, part):
        require_regular(each)
    try:
        try:
            with part.open('wb') as file:
                yield file
                file.flush()
                # Else a machine that loses power may have the new name and not what is in it.
                os.fsync(file.fileno())
            os.replace(part, path)
        except BaseException:
            part.unlink(missing_ok=True)   # on a full disk it takes what room there was
            raise
    except OSError as problem:
        raise NotWrittenError(
            f'{path}: cannot be written: {problem.strerror or problem}') from None


def require_regular(path: Path) -> os.stat_result | None:
    """Return what there is of a file, None for nothing; `ConfigError` if it is something else."""
    try:
        found = path.stat()
    except OSError:
        return None   # what reads or writes it says why not
    if not stat.S_ISREG(found.st_mode):
        raise ConfigError(f'{path}: not a regular file')
    return found

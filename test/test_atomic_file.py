# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Files that are written whole or not at all, by all that write results."""

import os
import resource
from pathlib import Path

import pytest

from poststall_sim import atomic_file
from poststall_sim.aircraft import ConfigError


def write(path, text=b'new'):
    with atomic_file.writing(path) as file:
        file.write(text)


def test_a_file_takes_the_place_of_another_and_only_at_the_end(tmp_path):
    path = tmp_path / 'a.csv'
    write(path, b'old')
    with atomic_file.writing(path) as file:
        file.write(b'new')
        file.flush()
        assert path.read_bytes() == b'old'
    assert path.read_bytes() == b'new'
    assert os.listdir(tmp_path) == ['a.csv']


@pytest.mark.parametrize('stops', [KeyboardInterrupt, ZeroDivisionError])
def test_what_ends_the_writing_leaves_what_was_there(tmp_path, stops):
    path = tmp_path / 'a.csv'
    write(path, b'old')
    with pytest.raises(stops), atomic_file.writing(path) as file:
        file.write(b'half')
        raise stops
    assert path.read_bytes() == b'old'
    assert os.listdir(tmp_path) == ['a.csv']


def test_a_disk_with_no_room_is_one_line_and_is_given_back_what_was_taken(tmp_path):
    """By a limit on the size of files: a disk that is full, ENOSPC, needs root to mount."""
    path = tmp_path / 'a.csv'
    write(path, b'old')
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, before[1]))
    try:
        with pytest.raises(atomic_file.NotWrittenError,
                           match=r'a\.csv: cannot be written: File too large'):
            write(path, bytes(1_000_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert path.read_bytes() == b'old'
    assert os.listdir(tmp_path) == ['a.csv']


@pytest.mark.skipif(not hasattr(os, 'geteuid') or os.geteuid() == 0, reason='root may write all')
def test_a_folder_that_nobody_may_write_to_is_one_line(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(atomic_file.NotWrittenError, match='cannot be written: Permission denied'):
        write(tmp_path / 'a.csv')


@pytest.mark.parametrize('name, reason', [
    ('none/a.csv', 'No such file or directory'), ('file/a.csv', 'Not a directory'),
    ('x' * 300, 'File name too long')])
def test_a_place_where_no_file_can_be_is_one_line(tmp_path, name, reason):
    (tmp_path / 'file').write_text('')
    with pytest.raises(atomic_file.NotWrittenError, match=f'cannot be written: {reason}'):
        write(tmp_path / name)


def test_a_pipe_or_a_folder_is_neither_replaced_nor_waited_for(tmp_path):
    path = tmp_path / 'a.csv'
    os.mkfifo(path)
    with pytest.raises(ConfigError, match=r'a\.csv: not a regular file'):
        write(path)
    with pytest.raises(ConfigError, match='not a regular file'):
        write(tmp_path)
    assert path.is_fifo()
    os.mkfifo(tmp_path / 'b.csv.part')
    with pytest.raises(ConfigError, match=r'b\.csv\.part: not a regular file'):
        write(tmp_path / 'b.csv')


def test_a_device_is_not_replaced():
    ours, terminal = os.openpty()
    try:
        with pytest.raises(ConfigError, match='not a regular file'):
            write(Path(os.ttyname(terminal)))
    finally:
        os.close(ours)
        os.close(terminal)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Completion, by the shell that asks for it."""

import shutil
import subprocess
import sys

import pytest

from poststall_sim import cli, definition

pytest.importorskip('shtab')


@pytest.fixture(scope='module')
def script(tmp_path_factory):
    """Return the file that a user of bash would source."""
    path = tmp_path_factory.mktemp('completion') / 'poststall'
    done = subprocess.run(
        [sys.executable, '-m', 'poststall_sim.cli', '--print-completion', 'bash'],
        capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    path.write_text(done.stdout)
    return path


def offered(script, *words, cwd=None):
    """Return what bash offers for the last of the words."""
    line = ' '.join(f"'{word}'" for word in words)
    asked = (f'source {script}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; '
             'COMPREPLY=(); _shtab_poststall; printf "%s\\n" "${COMPREPLY[@]}"')
    done = subprocess.run(['bash', '-c', asked], capture_output=True, text=True, timeout=20,
                          cwd=cwd)
    return done.stdout.split()


def test_bash_completes_commands_options_choices_and_names(script):
    assert offered(script, 'poststall', 'tr') == ['trim']
    assert set(offered(script, 'poststall', '')) >= {module.__name__.rpartition('.')[2]
                                                     for module in cli.COMMANDS}
    assert '--angle-form' in offered(script, 'poststall', 'polar', '--an')
    assert 'robust' in offered(script, 'poststall', 'polar', '--scheme', '')
    assert offered(script, 'poststall', 'polar', '--aircraft', 'trai') == ['trainer']
    assert 'naca4415_re4e5' in offered(script, 'poststall', 'airfoil', 'naca4415')
    scenarios = offered(script, 'poststall', 'fly', '--scenario', '')
    assert set(scenarios) >= set(definition.names('scenarios'))


def test_bash_completes_files_where_a_file_is_asked_for(script, tmp_path):
    (tmp_path / 'mine.yaml').write_text('')
    (tmp_path / 'bag_of_today').mkdir()
    assert offered(script, 'poststall', 'show', '--aircraft', 'mi', cwd=tmp_path) == ['mine.yaml']
    assert offered(script, 'poststall', 'plot', 'bag', cwd=tmp_path) == ['bag_of_today']
    assert offered(script, 'poststall', 'modes', '--export', 'mi', cwd=tmp_path) == ['mine.yaml']
    assert offered(script, 'poststall', 'modes', '--json', 'mi', cwd=tmp_path) == ['mine.yaml']
    assert offered(script, 'poststall', 'fly', '--record', 'bag', cwd=tmp_path) == ['bag_of_today']


@pytest.mark.skipif(shutil.which('zsh') is None, reason='no zsh here')
def test_zsh_reads_its_script(tmp_path, capsys):
    with pytest.raises(SystemExit):
        cli.main(['--print-completion', 'zsh'])
    path = tmp_path / '_poststall'
    path.write_text(capsys.readouterr().out)
    assert subprocess.run(['zsh', '-n', path], timeout=20).returncode == 0


def test_without_the_library_it_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'shtab', None)
    with pytest.raises(SystemExit) as end:
        cli.main(['--print-completion', 'bash'])
    assert end.value.code == 2
    assert capsys.readouterr().err == (
        "poststall: --print-completion needs shtab: pip install '.[completion]' in the checkout "
        '(see poststall --help)\n')

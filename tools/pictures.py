# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The pictures of docs/scenarios.md and docs/modes.md, as a user draws them: by the command line.

Each is a function of the file that it goes to, called `picture_` and its name.
"""

import io
import shutil
import tempfile
from contextlib import redirect_stdout
from pathlib import Path

from poststall_sim import cli, plots


def _poststall(*words: str) -> None:
    """Run a command, and keep what it prints to ourselves."""
    with redirect_stdout(io.StringIO()):
        code = cli.main(list(words))
    if code != 0:
        raise RuntimeError(f'poststall {" ".join(words)} ended with {code}')


def _of_a_flight(aircraft: str, scenario: str, name: str, file: Path) -> None:
    """Fly a scenario and take one of the figures of its bag."""
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / 'bag'
        _poststall('fly', '--aircraft', aircraft, '--scenario', scenario, '--record', str(bag))
        drawn = {path.stem: path for path in plots.flight_figures(bag, folder)}
        shutil.copyfile(drawn[name], file)


def picture_wing_drop(file: Path) -> None:
    """Draw how a wing drops and how it is caught."""
    _of_a_flight('trainer', 'wing_drop', 'summary', file)


def picture_spin(file: Path) -> None:
    """Draw a spin of four turns and the recovery."""
    _of_a_flight('trainer', 'spin', 'summary', file)


def picture_deep_stall(file: Path) -> None:
    """Draw what the elevator of the T-tail does in a deep stall."""
    _of_a_flight('t_tail', 'deep_stall', 'elevator_alpha', file)


def picture_modes(file: Path) -> None:
    """Draw root loci of the trainer, and their parts over alpha."""
    _poststall('modes', 'trainer', '--alpha', '1:25:1', '--decambering', 'all', '--plot',
               str(file))

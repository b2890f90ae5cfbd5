# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The pictures of docs/images, as a user draws them: by the command line, or by an example.

Each is a function of the file that it goes to, called `picture_` and its name.
"""

import io
import shutil
import subprocess
import sys
import tempfile
from contextlib import redirect_stdout
from pathlib import Path

import screenshots
from screenshots import need

from poststall_sim import cli, plots

EXAMPLES = Path(__file__).resolve().parents[1] / 'examples'
CAMPAIGN = 'upset_recovery'


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


def picture_stall_and_recovery(file: Path) -> None:
    """Draw the demo's flight."""
    _of_a_flight('trainer', 'stall_and_recovery', 'summary', file)


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


def picture_campaign(file: Path) -> None:
    """Draw where the trainer comes back from: 648 flights."""
    need('distributed', 'pyarrow', 'xarray', 'zarr', extra='campaign')
    with tempfile.TemporaryDirectory() as folder:
        _poststall('campaign', CAMPAIGN, '--output', f'{folder}/flown')
        _poststall('campaign', 'plot', f'{folder}/flown', '--output', f'{folder}/drawn')
        shutil.copyfile(f'{folder}/drawn/envelope_recovered.png', file)


def picture_report(file: Path) -> None:
    """Draw the report of the demo's flight in a browser."""
    need('playwright', extra='browser')
    with tempfile.TemporaryDirectory() as folder:
        bag, page = f'{folder}/bag', Path(folder) / 'report.html'
        _poststall('fly', '--scenario', 'stall_and_recovery', '--record', bag)
        _poststall('report', bag, '--output', str(page))
        screenshots.of_report(page, file)


def picture_watch(file: Path) -> None:
    """Draw the live page as the trainer stalls."""
    screenshots.of_live_page(file)


def example(name: str, file: Path) -> None:
    """Draw what an example draws."""
    if name == 'learning_to_recover':
        need('gymnasium', extra='learning')
    subprocess.run([sys.executable, EXAMPLES / f'{name}.py', '--figure', file], check=True,
                   stdout=subprocess.DEVNULL)

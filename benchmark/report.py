# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What benchmarks share: what is asked against what was measured, and the file it is kept in."""

import datetime
import json
import platform
from pathlib import Path

import numba
import numpy as np

FOLDER = Path(__file__).resolve().parent / 'results'


def holds(asked, value, slack=1.0):
    """Tell whether a value is what is asked, (sign, bound), with a factor of slack."""
    sign, bound = asked
    return value <= bound * slack if sign == '<=' else value >= bound / slack


def keep(name, asked, **measured):
    """Write what was measured to results/NAME.json, with what was asked and where it was."""
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f'{name}.json').write_text(json.dumps({
        'when': datetime.datetime.now(datetime.UTC).isoformat(timespec='seconds'),
        'machine': platform.processor() or platform.machine(),
        'python': platform.python_version(), 'numpy': np.__version__,
        'numba': numba.__version__, 'threads': 1,
        'asked': {key: ' '.join(map(str, value)) for key, value in asked.items()},
        **measured}, indent=1) + '\n')

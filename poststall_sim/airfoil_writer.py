# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Section curves into CSV files, as `airfoil_reader` reads them."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from poststall_sim.aircraft import Airfoil


def write(path: Path, airfoil: Airfoil, notes: Iterable[str]) -> None:
    """Write the curves of a section with lines of comment; alpha in degrees, five decimals."""
    lines = [*notes, *([f'reynolds: {airfoil.reynolds:.0f}'] if airfoil.reynolds else [])]
    columns = (np.degrees(airfoil.alpha), airfoil.cl, airfoil.cd, airfoil.cm)
    with path.open('w', encoding='utf-8', newline='\n') as file:
        file.writelines(f'# {line}\n' for line in lines)
        file.write('alpha_deg,cl,cd,cm\n')
        for row in zip(*columns):
            alpha = f'{round(row[0], 4) + 0.0:.4f}'.rstrip('0')   # + 0.0: no minus zeros
            cells = [alpha + '0' * alpha.endswith('.')]
            cells += [f'{round(value, 5) + 0.0:.5f}' for value in row[1:]]
            file.write(','.join(cells) + '\n')

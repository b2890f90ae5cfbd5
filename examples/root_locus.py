# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The modes of an aircraft along its trimmed glides, from below the stall to past it."""

import figures
import numpy as np

from poststall_sim import definition, modal_analysis
from poststall_sim.aero import model as models
from poststall_sim.stability.motion import Decambering

ALTITUDE = 100.0


def main(arguments):
    """Trim and linearise at each angle of attack, print the modes, draw their loci."""
    trainer = definition.aircraft(definition.find('aircraft', 'trainer'))
    model = models.build(trainer)
    degrees = [4.0, 18.0] if arguments.quick else np.arange(2.0, 21.0, 1.0)
    found = []
    for [point] in modal_analysis.modes(
            model, np.radians(degrees), altitude=ALTITUDE, climb_angle=None,
            kinds=(Decambering.VARIABLE,), rows=arguments.rows):
        modes = [(mode['name'], complex(mode['real'], mode['imag'])) for mode in point['modes']]
        found.append(modes)
        fastest = max(value.real for _, value in modes)
        print(f'alpha {point["alpha_deg"]:.0f} deg, V {point["trim"]["airspeed_m_s"]:.1f} m/s, '
              f'fastest growth {fastest:.3f} 1/s: '
              + ', '.join(f'{name} {value:.3f}' for name, value in modes[:8]))
    if arguments.figure:
        with figures.drawn(arguments.figure, rows=2) as (locus, parts):
            for alpha, modes in zip(degrees, found):
                values = np.array([value for _, value in modes])
                shade = str(0.8 - 0.8 * (alpha - degrees[0]) / (degrees[-1] - degrees[0]))
                locus.plot(values.real, values.imag, 'o', markersize=3, color=shade)
                parts.plot(np.full(len(values), alpha), values.real, 'k.', markersize=3)
            locus.set(xlim=(-12.0, 5.0), ylim=(-0.2, 12.0), xlabel='real [1/s]',
                      ylabel='imaginary [1/s]', title='pale: below the stall, dark: past it')
            parts.set(ylim=(-12.0, 5.0), xlabel='alpha [deg]', ylabel='real [1/s]')


if __name__ == '__main__':
    parser = figures.options(__doc__)
    parser.add_argument('--rows', type=int, default=12, help='of wake that is linearised')
    main(parser.parse_args())

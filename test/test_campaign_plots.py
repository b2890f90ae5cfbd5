# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of a campaign: what ranks first is what matters, and a table of any kind is drawn."""

import numpy as np
import pytest

from poststall_sim.plots import campaign


def test_sensitivity_is_one_where_an_input_rules_and_small_where_it_does_not():
    generator = np.random.default_rng(2)
    x, other = generator.normal(size=(2, 400))
    assert campaign.sensitivity(x, np.exp(-3.0 * x), False) == pytest.approx(1.0)
    # Of independent ranks the correlation has a deviation of 1/sqrt(n - 1) = 0.05.
    assert campaign.sensitivity(other, x ** 3, False) < 0.2
    group = (generator.random(400) < 0.5).astype(float)
    # Two halves that do not overlap: three quarters of the variance of ranks is between them.
    assert campaign.sensitivity(group, group * 100.0 + x, True) == pytest.approx(0.75 ** 0.5,
                                                                                 abs=0.01)
    assert campaign.sensitivity(group, x, True) < 0.2
    assert campaign.sensitivity(x, np.full(400, np.nan), False) == 0.0


def test_every_kind_of_figure_is_drawn_of_a_table_with_gaps(tmp_path):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    alpha, roll = (each.ravel().tolist() for each in np.meshgrid([5.0, 15.0, 25.0], [0.0, 90.0]))
    rows = {'case': list(range(12)), 'seed': [1] * 12, 'autopilot': ['none'] * 6 + ['example'] * 6,
            'initial.alpha_deg': alpha * 2, 'initial.roll_rate_deg_s': roll * 2,
            'status': ['done'] * 11 + ['lost'], 'reason': [''] * 12,
            'recovered': [False] * 5 + [True] * 6 + [None],
            'height_lost_m': [*np.linspace(1.0, 9.0, 11).tolist(), None], 'numpy': ['2'] * 12}
    definition = {'name': 'x', 'quantities': ['recovered', 'height_lost_m'],
                  'variables': [[key, []] for key in (
                      'autopilot', 'initial.alpha_deg', 'initial.roll_rate_deg_s')]}
    drawn = campaign.draw_campaign(definition, rows, tmp_path)
    assert [path.name for path in drawn] == [
        'distributions.png', 'scatter.png', 'sensitivity.png', 'envelope_recovered.png']
    assert all(path.stat().st_size > 5000 for path in drawn)


def test_a_map_has_the_mean_of_each_cell():
    x, y, mean = campaign._mean(np.array([1.0, 1.0, 2.0, 2.0]), np.array([5.0, 5.0, 5.0, 6.0]),
                                np.array([0.0, 1.0, np.nan, 3.0]))
    assert x.tolist() == [1.0, 2.0] and y.tolist() == [5.0, 6.0]
    np.testing.assert_array_equal(mean, [[0.5, np.nan], [np.nan, 3.0]])

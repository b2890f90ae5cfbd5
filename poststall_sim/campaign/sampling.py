# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The values that cases are given: grids crossed with each other, and with samples.

What has a list or a grid is crossed, the first named varies slowest. What has a distribution is
sampled, all of them together; every point of the grid gets the same samples, so that what a grid
compares (a law and no law, say) is compared under the same conditions.
"""

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.stats import qmc

from poststall_sim.aircraft import ConfigError

Value = float | int | bool | str


class Method(enum.Enum):
    """How samples are spread."""

    LATIN_HYPERCUBE = 'latin_hypercube'
    SOBOL = 'sobol'
    RANDOM = 'random'


@dataclass(frozen=True, slots=True)
class Distribution:
    """A distribution of `scipy.stats` by its name there, and its parameters."""

    name: str
    parameters: Mapping[str, float]

    def __post_init__(self) -> None:
        """Refuse parameters that make no distribution."""
        found = getattr(stats, self.name, None)
        if not isinstance(found, (stats.rv_continuous, stats.rv_discrete)):
            raise ConfigError(f'scipy.stats has no distribution {self.name}')
        try:
            ends = found(**self.parameters).ppf([1e-3, 0.5, 1.0 - 1e-3])
        except (TypeError, ValueError) as error:
            raise ConfigError(f'{self.name} is no distribution of these parameters: {error}') \
                from None
        if not np.isfinite(ends).all() or not ends[0] < ends[2]:
            raise ConfigError(f'{self.name} of {dict(self.parameters)} has no range: its '
                              f'quantiles are {ends.tolist()}')

    def quantile(self, share: np.ndarray) -> np.ndarray:
        """Return the values below which shares 0..1 of the distribution lie."""
        return getattr(stats, self.name)(**self.parameters).ppf(share)


@dataclass(frozen=True, slots=True)
class Variable:
    """What varies, by its key path: over given values, or by a distribution."""

    key: str
    over: tuple[Value, ...] | Distribution


@dataclass(frozen=True, slots=True)
class Samples:
    """How many samples, and how they are spread."""

    method: Method = Method.LATIN_HYPERCUBE
    count: int = 1

    def __post_init__(self) -> None:
        """Refuse a number that loses what the method is for."""
        if self.method is Method.SOBOL and self.count & (self.count - 1):
            raise ConfigError(f'a Sobol sequence is even over powers of two only, got a count '
                              f'of {self.count}')

    def points(self, dimensions: int, seed: int) -> np.ndarray:
        """Return points (count, dimensions) in the open unit cube."""
        generator = np.random.default_rng(seed)
        if self.method is Method.RANDOM:
            points = generator.random((self.count, dimensions))
        else:
            kind = qmc.Sobol if self.method is Method.SOBOL else qmc.LatinHypercube
            sampler = kind(dimensions, seed=generator)
            points = sampler.random(self.count)
        tiny = np.finfo(float).eps
        return np.clip(points, tiny, 1.0 - tiny)


class Design(Sequence):
    """The values of all variables, in their order, for each case: made as they are asked for."""

    def __init__(self, variables: Sequence[Variable], samples: Samples, seed: int) -> None:
        drawn = [each for each in variables if isinstance(each.over, Distribution)]
        points = samples.points(len(drawn), seed) if drawn else np.empty((1, 0))
        columns = {each.key: each.over.quantile(points[:, k]) for k, each in enumerate(drawn)}
        self._columns = [columns.get(each.key, each.over) for each in variables]
        self._samples = len(points)

    def __len__(self) -> int:
        return self._samples * math.prod(
            len(column) for column in self._columns if isinstance(column, tuple))

    def ends(self, place: int) -> tuple[float, float]:
        """Return the least and the greatest value of a variable that is drawn, by its place."""
        column = self._columns[place]
        return float(column.min()), float(column.max())

    def __getitem__(self, index: int) -> tuple[Value, ...]:
        if not 0 <= index < len(self):
            raise IndexError(index)
        grid, sample = divmod(index, self._samples)
        values: list[Value] = []
        for column in reversed(self._columns):   # what was named last varies fastest
            if isinstance(column, tuple):
                grid, place = divmod(grid, len(column))
                values.append(column[place])
            else:
                values.append(float(column[sample]))
        return tuple(reversed(values))


def case_seed(seed: int, index: int) -> int:
    """Return the seed of a case, which depends on nothing but the campaign's and its number."""
    state = np.random.SeedSequence(entropy=seed, spawn_key=(index,)).generate_state(1, np.uint64)
    return int(state[0] >> np.uint64(1))   # 63 bits: tables have no column for 64

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Turbulence of the Dryden and the von Karman spectrum, as a field that is frozen in the air.

A sum of plane waves, each across its own direction (so the field has no divergence where it is
isotropic), with normal amplitudes. Their variances are those of the three-dimensional energy
spectrum E(k) that belongs to the one-dimensional spectra of MIL-F-8785C: over many seeds the
spectra along any straight path are those, longitudinal and transverse, for waves longer than
`SHORTEST`. Near the ground the vertical component has a scale and an intensity of its own: each
of the three spectra along a level path is then still the specification's, but the field has
divergence, as any with these three has.
"""

import enum
import functools
import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from poststall_sim.frames import FloatArray
from poststall_sim.records import ConfigError

FOOT = 0.3048
"""[m]"""
KNOT = 1852.0 / 3600.0
"""[m/s]"""
LOW, MEDIUM = 1000.0 * FOOT, 2000.0 * FOOT
"""Below the one and above the other altitude [m] the scales are the specification's."""
LOWEST = 10.0 * FOOT
"""Nearer to the ground the scales do not change any more [m], MIL-F-8785C, 3.7.3."""
DIRECTIONS = 16
"""Of waves: with so many a step of the trainer costs half more (benchmark)."""
LONGEST = 0.25
"""Least wave number times scale: what is longer has 0.03 % of a Dryden field's energy."""
SHORTEST = 1.0
"""Least wave length [m]."""
BLOCK = 128
"""Points that are computed together."""


class Spectrum(enum.Enum):
    """The form of the spectra."""

    DRYDEN = 'dryden'
    VON_KARMAN = 'von_karman'


class Severity(enum.Enum):
    """How rough the air is: the wind at 20 ft [knots] that stands for it in MIL-F-8785C."""

    LIGHT = 15.0
    MODERATE = 30.0
    SEVERE = 45.0


SCALE_ALOFT = {Spectrum.DRYDEN: 1750.0 * FOOT, Spectrum.VON_KARMAN: 2500.0 * FOOT}
"""Of all components above `MEDIUM` [m], MIL-F-8785C, 3.7.2."""
_ALTITUDE = FOOT * np.array([
    1750.0, 3750.0, 7500.0, 15000.0, 25000.0, 35000.0, 45000.0, 55000.0, 65000.0])
_ALOFT = {
    Severity.LIGHT: FOOT * np.array([6.9, 7.4, 6.7, 4.6, 2.7, 0.4, 0.0, 0.0, 0.0]),
    Severity.MODERATE: FOOT * np.array([9.6, 10.6, 10.1, 8.0, 6.6, 5.0, 4.2, 2.7, 0.0]),
    Severity.SEVERE: FOOT * np.array([17.6, 23.0, 23.6, 22.1, 20.0, 16.0, 15.1, 12.1, 7.9])}
"""
Intensities [m/s] over altitude [m] that are exceeded with a probability of 1e-2, 1e-3 and 1e-5,
read from MIL-F-8785C, Figure 7.
"""


@dataclass(frozen=True, slots=True)
class Turbulence:
    """
    A field of turbulence, the same one for the same numbers.

    horizontal, vertical : root mean squares of the components [m/s]; their scales [m] are those
    that MIL-F-8785C has in its spectra.
    """

    spectrum: Spectrum
    horizontal: float
    vertical: float
    horizontal_scale: float
    vertical_scale: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what is not a field."""
        for name, value, low, high, unit in (
                ('intensity', self.horizontal, 0.0, 100.0, 'm/s'),
                ('intensity', self.vertical, 0.0, 100.0, 'm/s'),
                ('scale', self.horizontal_scale, 1.0, 1e5, 'm'),
                ('scale', self.vertical_scale, 1.0, 1e5, 'm'),
                ('seed', self.seed, 0, 2 ** 63 - 1, '')):
            if not low <= value <= high:
                raise ConfigError(f'turbulence: {name} must be {low:g} to {high:g} {unit}'.rstrip()
                                  + f', got {value!r}')


def scales(spectrum: Spectrum, altitude: float) -> tuple[float, float]:
    """
    Return the horizontal and the vertical scale [m] at an altitude above the ground [m].

    Linear in between, from 1000 ft to 2000 ft. MIL-HDBK-1797 has half the lateral and vertical
    scales and twice them in its spectra: the same.

    References
    ----------
    MIL-F-8785C, 3.7.2 and 3.7.3.

    """
    low = min(max(altitude, LOWEST), LOW)
    share = min(max((altitude - LOW) / (MEDIUM - LOW), 0.0), 1.0)
    horizontal, vertical = low / _gain(low) ** 1.2, low
    return (horizontal + share * (SCALE_ALOFT[spectrum] - horizontal),
            vertical + share * (SCALE_ALOFT[spectrum] - vertical))


def _gain(altitude: float) -> float:
    """Return 0.177 + 0.000823 h, h in feet, of an altitude of at most 1000 ft [m]."""
    return 0.177 + 0.000823 * altitude / FOOT


def intensity(severity: Severity, altitude: float) -> float:
    """
    Return the root mean square of the vertical component [m/s] at an altitude [m].

    References
    ----------
    MIL-F-8785C, 3.7.3: a tenth of the wind at 20 ft below 1000 ft, Figure 7 above 2000 ft.

    """
    near = 0.1 * severity.value * KNOT
    aloft = float(np.interp(max(altitude, MEDIUM), _ALTITUDE, _ALOFT[severity]))
    share = min(max((altitude - LOW) / (MEDIUM - LOW), 0.0), 1.0)
    return near + share * (aloft - near)


def military(spectrum: Spectrum, vertical: float, *, altitude: float, seed: int = 0) -> Turbulence:
    """
    Return the turbulence of MIL-F-8785C at an altitude above the ground [m].

    vertical : its root mean square [m/s], see `intensity`. The horizontal one is greater near the
    ground, where sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4, h in feet.
    """
    horizontal = vertical / _gain(min(max(altitude, LOWEST), LOW)) ** 0.4
    return Turbulence(spectrum, horizontal, vertical, *scales(spectrum, altitude), seed)


def energy(spectrum: Spectrum, wave_number: FloatArray, scale: float) -> FloatArray:
    """
    Return the energy spectrum E(k) [m] of a field of unit root mean square, isotropic.

    From the longitudinal spectrum F(k) of the specification by E = k^3 d(F'/k)/dk / 2:

        Dryden      E = (8 L / pi) (L k)^4 / (1 + (L k)^2)^3
        von Karman  E = (55 L / 9 pi) (a k)^4 / (1 + (a k)^2)^(17/6),  a = 1.339 L

    Its integral over k > 0 is 3/2.

    References
    ----------
    G. K. Batchelor, The Theory of Homogeneous Turbulence, 1953, section 3.4.

    """
    if spectrum is Spectrum.DRYDEN:
        square = (scale * wave_number) ** 2
        return 8.0 * scale / math.pi * square ** 2 / (1.0 + square) ** 3
    square = (1.339 * scale * wave_number) ** 2
    return 55.0 * scale / (9.0 * math.pi) * square ** 2 / (1.0 + square) ** (17.0 / 6.0)


@dataclass(frozen=True, slots=True, eq=False)
class Waves:
    """
    Plane waves in octaves, velocity = sum of cosine cos(2^j t) + sine sin(2^j t).

    turns (d, 3) : t over 2 pi is turns @ place [1/m]; cosine, sine (d, octaves, 3) in N [m/s], an
    even number of octaves.
    """

    turns: FloatArray
    cosine: FloatArray
    sine: FloatArray

    def velocity(self, points: FloatArray) -> FloatArray:
        """Return the velocity (k, 3) in N [m/s] at places (k, 3) [m] in the air."""
        out = np.empty((len(points), 3))
        _sum(points, self.turns, self.cosine, self.sine, out)
        return out


@functools.lru_cache(maxsize=4)
def waves(field: Turbulence) -> Waves:
    """
    Return the waves of a field.

    The directions lie evenly over a hemisphere that is turned at random; each has a wave in every
    octave, the first of them spread evenly over its octave in log k. Of E(k) dk = E(k) k d(ln k)
    each wave takes its part, half as across the one and half as across the other direction.
    """
    generator = np.random.Generator(np.random.PCG64(field.seed))
    least = LONGEST / max(field.horizontal_scale, field.vertical_scale)
    octaves = 2 * math.ceil(0.5 * math.log2(2.0 * math.pi / SHORTEST / least))
    direction = _directions(generator)
    place = (generator.permutation(DIRECTIONS) + generator.random(DIRECTIONS)) / DIRECTIONS
    first = least * 2.0 ** place
    number = first[:, None] * 2.0 ** np.arange(octaves)
    level = np.column_stack([-direction[:, 1], direction[:, 0], np.zeros(DIRECTIONS)])
    level /= np.linalg.norm(level, axis=1)[:, None]
    upright = np.cross(level, direction)

    deviation = np.stack([
        sigma * np.sqrt(energy(field.spectrum, number, scale) * number * math.log(2.0)
                        / DIRECTIONS)
        for sigma, scale in ((field.horizontal, field.horizontal_scale),
                             (field.horizontal, field.horizontal_scale),
                             (field.vertical, field.vertical_scale))], axis=-1)
    # Octave by octave, so that a field that reaches farther begins with the same numbers.
    drawn = generator.standard_normal((octaves, DIRECTIONS, 4)).transpose(2, 1, 0)[..., None]
    cosine, sine = (
        np.ascontiguousarray(deviation * (a * level[:, None] + b * upright[:, None]))
        for a, b in (drawn[:2], drawn[2:]))
    return Waves(first[:, None] * direction / (2.0 * math.pi), cosine, sine)


def _directions(generator: np.random.Generator) -> FloatArray:
    """Return unit vectors (d, 3), evenly on a hemisphere (Fibonacci's lattice), turned."""
    i = np.arange(DIRECTIONS) + 0.5
    z, angle = i / DIRECTIONS, math.pi * (3.0 - math.sqrt(5.0)) * i
    radius = np.sqrt(1.0 - z * z)
    even = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    turn, upper = np.linalg.qr(generator.standard_normal((3, 3)))
    return even @ (turn * np.sign(np.diag(upper)))


@njit(cache=True, nogil=True, fastmath={'contract', 'nsz', 'arcp'})
def _sum(points, turns, cosine, sine, out):
    """
    Fill out (k, 3) with the sum of waves at points (k, 3).

    Powers of exp(i t) are squares of each other, so that a direction costs one sine and cosine:
    those of half the angle, by their series to 1e-16, in loops without a branch or a call, which
    compilers make vector code of. Octaves go by twos: half the sums are read and written back.
    """
    north, east, down = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    x, y, z = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    c, s = np.empty(BLOCK), np.empty(BLOCK)
    for begin in range(0, points.shape[0], BLOCK):
        here = min(BLOCK, points.shape[0] - begin)
        for i in range(here):
            x[i], y[i], z[i] = points[begin + i, 0], points[begin + i, 1], points[begin + i, 2]
        for i in range(here):
            east[i] = north[i] = down[i] = 0.0
        for d in range(turns.shape[0]):
            kx, ky, kz = turns[d, 0], turns[d, 1], turns[d, 2]
            for i in range(here):
                t = kx * x[i] + ky * y[i] + kz * z[i]
                half = math.pi * (t - np.rint(t))
                q = half * half
                sin = half * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (
                    -1.0 / 5040.0 + q * (1.0 / 362880.0 + q * (-1.0 / 39916800.0 + q * (
                        1.0 / 6227020800.0 + q * (-1.0 / 1307674368000.0 + q * (
                            1.0 / 355687428096000.0)))))))))
                cos = 1.0 + q * (-0.5 + q * (1.0 / 24.0 + q * (-1.0 / 720.0 + q * (
                    1.0 / 40320.0 + q * (-1.0 / 3628800.0 + q * (1.0 / 479001600.0 + q * (
                        -1.0 / 87178291200.0 + q * (1.0 / 20922789888000.0 + q * (
                            -1.0 / 6402373705728000.0)))))))))
                c[i] = (cos - sin) * (cos + sin)
                s[i] = 2.0 * sin * cos
            for j in range(0, cosine.shape[1], 2):
                a, b, e, f = cosine[d, j], sine[d, j], cosine[d, j + 1], sine[d, j + 1]
                a0, a1, a2, b0, b1, b2 = a[0], a[1], a[2], b[0], b[1], b[2]
                e0, e1, e2, f0, f1, f2 = e[0], e[1], e[2], f[0], f[1], f[2]
                for i in range(here):
                    cos, sin = c[i], s[i]
                    twice, both = (cos - sin) * (cos + sin), 2.0 * sin * cos
                    north[i] += a0 * cos + b0 * sin + e0 * twice + f0 * both
                    east[i] += a1 * cos + b1 * sin + e1 * twice + f1 * both
                    down[i] += a2 * cos + b2 * sin + e2 * twice + f2 * both
                    c[i] = (twice - both) * (twice + both)
                    s[i] = 2.0 * both * twice
        for i in range(here):
            out[begin + i, 0], out[begin + i, 1], out[begin + i, 2] = north[i], east[i], down[i]

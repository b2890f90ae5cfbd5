# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Turbulence against the formulas of MIL-F-8785C, 3.7, over many seeds.

A field is a sum of a few hundred waves: what one seed has along one path scatters about the
formula, as flights in real air do. The mean over seeds does not, and what it may be off by is
taken from the scatter itself: four standard errors, which 1 in 16 000 exceeds.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import gamma, kv

from poststall_sim.aircraft import ConfigError
from poststall_sim.turbulence import (
    FOOT,
    LONGEST,
    SHORTEST,
    Severity,
    Spectrum,
    Turbulence,
    energy,
    intensity,
    military,
    scales,
    waves,
)

SIGMA, SCALE = 1.5, 50.0
SEEDS = 250
DRYDEN, VON_KARMAN = Spectrum.DRYDEN, Spectrum.VON_KARMAN


def longitudinal(spectrum, k, sigma, scale):
    """Phi_u of the specification, one-sided over the wave number along the path."""
    if spectrum is DRYDEN:
        return sigma ** 2 * 2.0 * scale / math.pi / (1.0 + (scale * k) ** 2)
    return sigma ** 2 * 2.0 * scale / math.pi / (1.0 + (1.339 * scale * k) ** 2) ** (5.0 / 6.0)


def transverse(spectrum, k, sigma, scale):
    """Phi_v and Phi_w of the specification."""
    if spectrum is DRYDEN:
        square = (scale * k) ** 2
        return sigma ** 2 * scale / math.pi * (1.0 + 3.0 * square) / (1.0 + square) ** 2
    square = (1.339 * scale * k) ** 2
    return (sigma ** 2 * scale / math.pi * (1.0 + 8.0 / 3.0 * square)
            / (1.0 + square) ** (11.0 / 6.0))


def isotropic(spectrum, seed):
    return Turbulence(spectrum, SIGMA, SIGMA, SCALE, SCALE, seed)


def turn(generator):
    """Return a rotation (3, 3) at random; its columns are axes."""
    matrix, upper = np.linalg.qr(generator.standard_normal((3, 3)))
    return matrix * np.sign(np.diag(upper))


def level(generator):
    """Return axes along a level path, across it to the right, and down."""
    angle = generator.uniform(0.0, 2.0 * math.pi)
    north, east = math.cos(angle), math.sin(angle)
    return np.array([[north, -east, 0.0], [east, north, 0.0], [0.0, 0.0, 1.0]])


def periodograms(field_of, axes_of, spacing, samples=2048):
    """
    Return wave numbers (k,) and periodograms (SEEDS, 3, k), one-sided, along straight paths.

    Velocities are those along the first of the axes and along the two others. A Hann window keeps
    what leaks from the great waves, 1/k^6, below spectra that fall as 1/k^2.
    """
    window = np.hanning(samples)
    window /= np.sqrt(np.mean(window ** 2))
    along = spacing * np.arange(samples)
    found = []
    for seed in range(SEEDS):
        generator = np.random.default_rng(1000 + seed)
        axes = axes_of(generator)
        points = generator.uniform(-5e3, 5e3, 3) + along[:, None] * axes[:, 0]
        velocity = waves(field_of(seed)).velocity(points) @ axes
        density = np.abs(np.fft.rfft(window[:, None] * velocity, axis=0)) ** 2
        found.append(density.T * spacing / (math.pi * samples))
    return 2.0 * math.pi * np.fft.rfftfreq(samples, spacing), np.array(found)


def assert_within_the_bounds(wave_number, found, formula, bands):
    """Compare the mean over seeds in bands of wave number with a formula."""
    for low, high in zip(bands, bands[1:]):
        inside = (wave_number >= low) & (wave_number < high)
        assert np.count_nonzero(inside) >= 5
        ratio = (found[:, inside] / formula(wave_number[inside])).mean(axis=1)
        error = ratio.std(ddof=1) / math.sqrt(len(ratio))
        assert error < 0.04, 'more seeds: this says nothing'
        assert ratio.mean() == pytest.approx(1.0, abs=4.0 * error), (low, high)
        # One seed is no more regular than chi-square of two degrees for each of the waves that
        # the window tells apart, of which there are two for three of its lines.
        assert ratio.std(ddof=1) > 0.7 * math.sqrt(1.5 / np.count_nonzero(inside))


# Of 4 km in steps of 2 m, what lies above six lines (0.009 1/m) and far below the waves of 4 m
# that alias; of 500 m in steps of 0.25 m, below a tenth of SHORTEST's wave number, where 2 % of
# the energy that belongs to it is missing.
@pytest.mark.parametrize('spacing, bands', [
    (2.0, (0.01, 0.02, 0.04, 0.08)), (0.25, (0.08, 0.15, 0.3, 0.5))])
@pytest.mark.parametrize('spectrum', list(Spectrum))
def test_spectra_along_any_straight_path_are_the_specification_s(spectrum, spacing, bands):
    """At scale times wave number from 0.5 to 25, in every direction."""
    k, found = periodograms(lambda seed: isotropic(spectrum, seed), turn, spacing)
    for component, formula in enumerate((longitudinal, transverse, transverse)):
        assert_within_the_bounds(
            k, found[:, component], lambda k, formula=formula: formula(
                spectrum, k, SIGMA, SCALE), bands)


@pytest.mark.parametrize('spectrum', list(Spectrum))
def test_near_the_ground_each_component_has_its_own_scale_along_a_level_path(spectrum):
    """At 30 m: scales of 152 m and 30 m, and a vertical part of 0.58 of the horizontal one."""
    low = military(spectrum, 1.0, altitude=30.0)
    assert low.horizontal_scale > 4.0 * low.vertical_scale and low.horizontal > 1.6
    k, found = periodograms(lambda seed: replace(low, seed=seed), level, 2.0)
    for component, formula, sigma, scale in (
            (0, longitudinal, low.horizontal, low.horizontal_scale),
            (1, transverse, low.horizontal, low.horizontal_scale),
            (2, transverse, low.vertical, low.vertical_scale)):
        assert_within_the_bounds(
            k, found[:, component], lambda k, formula=formula, sigma=sigma, scale=scale: formula(
                spectrum, k, sigma, scale), (0.01, 0.02, 0.04, 0.08))


def samples(spectrum, offset):
    """Return velocities (seeds, 200, 3) at places far apart, and an offset [m] in y from them."""
    first, second = [], []
    for seed in range(SEEDS):
        points = np.random.default_rng(seed).uniform(-5e3, 5e3, (200, 3))
        field = waves(isotropic(spectrum, seed))
        first.append(field.velocity(points))
        second.append(field.velocity(points + [0.0, offset, 0.0]))
    return np.array(first), np.array(second)


def bounded(values, expected, missing=0.0):
    """Compare the mean of (seeds, ...) with what is expected, up to what the waves leave out."""
    each = values.reshape(len(values), -1).mean(axis=1)
    error = each.std(ddof=1) / math.sqrt(len(each))
    assert error < 0.03 * SIGMA ** 2
    assert each.mean() == pytest.approx(expected, abs=4.0 * error + missing)


def lateral_correlation(spectrum, distance):
    """Correlation of a component at two places across it, from the theory of isotropic fields."""
    if spectrum is DRYDEN:
        return (1.0 - 0.5 * distance / SCALE) * math.exp(-distance / SCALE)
    z = distance / (1.339 * SCALE)
    return 2.0 ** (2.0 / 3.0) / gamma(1.0 / 3.0) * z ** (1.0 / 3.0) * (
        kv(1.0 / 3.0, z) - 0.5 * z * kv(2.0 / 3.0, z))


@pytest.mark.parametrize('spectrum', list(Spectrum))
def test_variance_and_correlation_across_a_span(spectrum):
    """Vertical velocities at the tips of semi-spans of 5 and 25 m, with a scale of 50 m."""
    kept, _ = quad(lambda k: energy(spectrum, k, SCALE), LONGEST / SCALE, 2 * math.pi / SHORTEST,
                   limit=400)
    missing = SIGMA ** 2 * (1.0 - kept / 1.5)
    assert 0.0 < missing < 0.03 * SIGMA ** 2   # von Karman's spectrum has more in small waves
    for distance in (5.0, 25.0):
        here, there = samples(spectrum, distance)
        bounded(here ** 2, SIGMA ** 2, missing)
        bounded(here[..., 2] * there[..., 2],
                SIGMA ** 2 * lateral_correlation(spectrum, distance), missing)
        # Their difference is what rolls a wing; the small waves count twice in it.
        bounded(0.5 * (here[..., 2] - there[..., 2]) ** 2,
                SIGMA ** 2 * (1.0 - lateral_correlation(spectrum, distance)), missing)


@pytest.mark.parametrize('spectrum', list(Spectrum))
def test_energy_spectrum_holds_the_longitudinal_one(spectrum):
    """Batchelor's integral of E over the planes across the path, back to Phi_u; its whole: 3/2."""
    for k in (0.2 / SCALE, 1.0 / SCALE, 8.0 / SCALE):
        value, _ = quad(lambda n, k=k: energy(spectrum, n, SCALE) / n * (1.0 - k * k / (n * n)),
                        k, np.inf)
        assert value == pytest.approx(longitudinal(spectrum, k, 1.0, SCALE), rel=1e-6)
    whole, _ = quad(lambda x: energy(spectrum, np.exp(x), SCALE) * np.exp(x), -20.0, 40.0,
                    limit=400)
    assert whole == pytest.approx(1.5, rel=1e-4)   # 1.339 is rounded


@pytest.mark.parametrize('spectrum', list(Spectrum))
def test_isotropic_field_has_no_divergence(spectrum):
    """
    Central differences over 1 mm against the gradients themselves.

    They are off by (k h)^2 / 6 of a wave's part: 3e-5 for the shortest, half a metre long.
    """
    field, h = waves(isotropic(spectrum, 7)), 1e-3
    points = np.random.default_rng(0).uniform(-500.0, 500.0, (300, 3))
    gradient = np.stack([
        (field.velocity(points + h * axis) - field.velocity(points - h * axis)) / (2.0 * h)
        for axis in np.eye(3)], axis=1)
    divergence = np.trace(gradient, axis1=1, axis2=2)
    assert np.abs(divergence).max() < 1e-4 * np.sqrt(np.mean(gradient ** 2))


def test_a_seed_is_one_field_to_the_last_bit():
    points = np.random.default_rng(0).uniform(-1e4, 1e4, (500, 3))
    waves.cache_clear()
    once = waves(isotropic(DRYDEN, 3)).velocity(points)
    waves.cache_clear()
    assert once.tobytes() == waves(isotropic(DRYDEN, 3)).velocity(points).tobytes()
    other = waves(isotropic(DRYDEN, 4)).velocity(points)
    assert abs(np.corrcoef(once[:, 2], other[:, 2])[0, 1]) < 0.3
    # A place has one velocity, whatever is asked beside it.
    alone = np.array([waves(isotropic(DRYDEN, 3)).velocity(point[None])[0] for point in points])
    assert alone == pytest.approx(once, abs=1e-9)


def test_sum_of_waves_against_sine_and_cosine():
    """Octaves by squaring: an error of 1e-16 doubles in each, sixteen of them at most here."""
    field = waves(military(VON_KARMAN, 1.0, altitude=3000.0))
    points = np.random.default_rng(1).uniform(-1e4, 1e4, (200, 3))
    octaves = field.cosine.shape[1]
    angle = 2.0 * math.pi * (points @ field.turns.T)[..., None] * 2.0 ** np.arange(octaves)
    plain = np.einsum('pdo,doc->pc', np.cos(angle), field.cosine) \
        + np.einsum('pdo,doc->pc', np.sin(angle), field.sine)
    assert field.velocity(points) == pytest.approx(plain, abs=1e-9)


def test_scales_and_intensities_of_the_specification():
    """Both meet at 1000 ft, where L = h; from 2000 ft on they are those of clear air aloft."""
    assert scales(DRYDEN, 1000.0 * FOOT) == pytest.approx((1000.0 * FOOT, 1000.0 * FOOT))
    assert scales(DRYDEN, 2000.0 * FOOT) == pytest.approx((1750.0 * FOOT,) * 2)
    assert scales(VON_KARMAN, 9000.0) == pytest.approx((2500.0 * FOOT,) * 2)
    assert scales(DRYDEN, 1500.0 * FOOT) == pytest.approx((1375.0 * FOOT,) * 2)
    # 200 ft: 0.177 + 0.1646 = 0.3416; 200 / 0.3416^1.2 = 725.8 ft, 1 / 0.3416^0.4 = 1.5368.
    assert scales(DRYDEN, 200.0 * FOOT) == pytest.approx((725.8 * FOOT, 200.0 * FOOT), rel=1e-4)
    assert military(DRYDEN, 1.0, altitude=200.0 * FOOT).horizontal == pytest.approx(
        1.5368, rel=1e-4)
    assert military(DRYDEN, 1.0, altitude=5000.0).horizontal == pytest.approx(1.0)
    assert scales(DRYDEN, 0.0) == scales(DRYDEN, 10.0 * FOOT)
    # A tenth of 15, 30 and 45 knots; 8 ft/s once in a thousand at 15 000 ft.
    assert [intensity(each, 100.0) for each in Severity] == pytest.approx(
        [0.7717, 1.5433, 2.3150], rel=1e-4)
    assert intensity(Severity.MODERATE, 15000.0 * FOOT) == pytest.approx(8.0 * FOOT)
    assert intensity(Severity.LIGHT, 60000.0 * FOOT) == 0.0


@pytest.mark.parametrize('changes, what', [
    ({'vertical': -1.0}, 'intensity'), ({'horizontal': math.nan}, 'intensity'),
    ({'vertical_scale': 0.0}, 'scale'), ({'seed': -1}, 'seed')])
def test_what_is_no_turbulence_is_refused(changes, what):
    with pytest.raises(ConfigError, match=f'turbulence: {what} must be'):
        replace(isotropic(DRYDEN, 0), **changes)

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The atmosphere against the tables of the U.S. Standard Atmosphere, 1976."""

import exact
import numpy as np
import pytest
from scipy.integrate import quad

from poststall_sim.atmosphere import GAS_CONSTANT, Atmosphere, standard_air
from poststall_sim.frames import GRAVITY
from poststall_sim.records import ConfigError

TABLE = [row for row in exact.ISA_TABLE_GEOMETRIC if row.altitude <= 20000.0]


def last_digit(value, digits):
    """Return one unit of the last of so many digits: some of the table's are cut."""
    return 1.001 * 10.0 ** (np.floor(np.log10(value)) - digits + 1)


@pytest.mark.parametrize('row', TABLE, ids=lambda row: f'{row.altitude:.0f} m')
def test_against_the_table_over_geometric_altitude(row):
    air = standard_air(row.altitude)
    assert air.temperature == pytest.approx(row.temperature, abs=last_digit(200.0, 6))
    assert air.pressure == pytest.approx(row.pressure, abs=last_digit(row.pressure, 5))
    assert air.density == pytest.approx(row.density, abs=last_digit(row.density, 5))


@pytest.mark.parametrize('altitude, viscosity', [
    (0.0, 1.4607e-5), (5000.0, 2.2110e-5), (10000.0, 3.5251e-5), (20000.0, 1.5989e-4)])
def test_kinematic_viscosity_against_the_same_table(altitude, viscosity):
    """Its table III, with the five digits printed there."""
    assert standard_air(altitude).kinematic_viscosity == pytest.approx(
        viscosity, abs=last_digit(viscosity, 5))


@pytest.mark.parametrize('altitude', np.arange(-4900.0, 20001.0, 1245.0).tolist())
def test_between_the_rows_against_the_formulas(altitude):
    air = standard_air(altitude)
    closed = exact.isa(float(exact.geopotential_altitude(altitude)))
    assert air.temperature == pytest.approx(closed.temperature, rel=1e-14)
    # The gas constant of ISO 2533 (287.05287) is 7.04e-7 below that of 1976 (8314.32/28.9644);
    # it stands in the density, and in the exponent of the pressure.
    constants = 7.05e-7
    depth = abs(np.log(closed.pressure / exact.isa(0.0).pressure))
    assert air.pressure == pytest.approx(closed.pressure, rel=constants * depth + 1e-12)
    assert air.density == pytest.approx(closed.density, rel=constants * (1.0 + depth))


def test_the_layers_meet_without_a_step():
    tropopause = 11019.067735   # geometric altitude of 11 km geopotential
    below, above = standard_air(tropopause - 1e-3), standard_air(tropopause + 1e-3)
    # 2 mm of altitude are 3e-7 of the pressure.
    assert above.pressure == pytest.approx(below.pressure, rel=5e-7)
    assert above.density == pytest.approx(below.density, rel=5e-7)


def test_outside_the_table_the_nearest_end_goes_on():
    assert standard_air(1e6) == standard_air(20000.0)
    assert standard_air(-1e6) == standard_air(-5000.0)


@pytest.mark.parametrize('row', TABLE, ids=lambda row: f'{row.altitude:.0f} m')
def test_speed_of_sound_against_the_table(row):
    assert standard_air(row.altitude).speed_of_sound == pytest.approx(row.sound_speed, abs=0.01)


@pytest.mark.parametrize('altitude', [0.0, 500.0, 11000.0, 19000.0])
def test_a_hot_day_of_low_pressure_is_in_hydrostatic_balance(altitude):
    """The weight of the air above 0 m is what the pressure falls by; density by the gas law."""
    hot = Atmosphere(temperature_offset=25.0, sea_level_pressure=98000.0)
    here = hot.at(altitude)
    assert here.temperature == pytest.approx(standard_air(altitude).temperature + 25.0)
    assert here.density == pytest.approx(here.pressure / (GAS_CONSTANT * here.temperature))

    def weight(height):
        """Of a metre of geometric height; gravity falls with it as in the table."""
        return hot.at(height).density * GRAVITY * (6356766.0 / (6356766.0 + height)) ** 2

    lost, _ = quad(weight, 0.0, altitude, points=[min(11019.0677, altitude)])
    assert 98000.0 - here.pressure == pytest.approx(lost, rel=1e-7, abs=1e-6)


def test_a_hot_day_at_sea_level_in_numbers():
    """30 K above standard: 101325 / (287.053 x 318.15) = 1.1095 kg/m^3, sound at 357.6 m/s."""
    hot = Atmosphere(temperature_offset=30.0).at(0.0)
    assert hot.density == pytest.approx(1.1095, abs=5e-5)
    assert hot.speed_of_sound == pytest.approx(357.57, abs=0.01)
    assert Atmosphere(sea_level_pressure=1.02 * 101325.0).at(3000.0).density == pytest.approx(
        1.02 * standard_air(3000.0).density)


def test_one_density_at_every_altitude():
    tunnel = Atmosphere(density=1.2)
    assert tunnel.at(0.0).density == tunnel.at(9000.0).density == 1.2
    assert tunnel.at(9000.0).pressure == standard_air(9000.0).pressure
    assert tunnel.at(0.0).kinematic_viscosity == pytest.approx(
        1.225 / 1.2 * standard_air(0.0).kinematic_viscosity, rel=1e-5)


@pytest.mark.parametrize('wrong, what', [
    ({'temperature_offset': 288.0}, 'temperature offset must be'),
    ({'sea_level_pressure': 1013.25}, 'sea level pressure must be 50000 to 150000 Pa'),
    ({'density': 0.0}, 'density must be'), ({'temperature_offset': float('nan')}, 'must be')])
def test_air_that_nobody_flew_in_is_refused(wrong, what):
    with pytest.raises(ConfigError, match=what):
        Atmosphere(**wrong)

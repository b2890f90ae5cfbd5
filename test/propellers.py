# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Propellers that tests share, made by formula, and the published one they are held to."""

import dataclasses
import math

import numpy as np
import wings

from poststall_sim.engines import (
    Battery,
    Coefficients,
    ElectricMotor,
    Governor,
    Propeller,
)

RPM = 2.0 * math.pi / 60.0
PLAIN = Coefficients([0.0, 0.4, 0.8], [0.10, 0.06, 0.0], [0.045, 0.040, 0.012])
FLAT = Coefficients([0.0, 0.5, 1.0], [0.10, 0.06, 0.0], [0.04, 0.04, 0.04])
"""Of one CP, so that the torque is a square of the speed."""
BATTERY = Battery(voltage=22.2, empty_voltage=22.2, resistance=0.05, capacity=5.0 * 3600.0)
MOTOR = ElectricMotor(400.0 * RPM, 0.04, 1.0, BATTERY)
GOVERNOR = Governor(9000.0 * RPM, 0.3)

# APC thin electric 10 x 5, in a wind tunnel. r/R, c/R, angle [deg], and J, CT, CP at 5000 rpm or
# so: Brandt, Deters, Ananda, Dantsker & Selig, UIUC Propeller Database, vol. 1.
APC_10X5_BLADE = np.array([
    [0.15, 0.130, 32.76], [0.20, 0.149, 37.19], [0.25, 0.173, 33.54], [0.30, 0.189, 29.25],
    [0.35, 0.197, 25.64], [0.40, 0.201, 22.54], [0.45, 0.200, 20.27], [0.50, 0.194, 18.46],
    [0.55, 0.186, 17.05], [0.60, 0.174, 15.97], [0.65, 0.160, 14.87], [0.70, 0.145, 14.09],
    [0.75, 0.128, 13.39], [0.80, 0.112, 12.84], [0.85, 0.096, 12.25], [0.90, 0.081, 11.37],
    [0.95, 0.061, 10.19], [1.00, 0.041, 8.99]])
APC_10X5 = np.array([
    [0.113, 0.0912, 0.0381], [0.145, 0.0890, 0.0386], [0.174, 0.0864, 0.0389],
    [0.200, 0.0834, 0.0389], [0.233, 0.0786, 0.0387], [0.260, 0.0734, 0.0378],
    [0.291, 0.0662, 0.0360], [0.316, 0.0612, 0.0347], [0.346, 0.0543, 0.0323],
    [0.375, 0.0489, 0.0305], [0.401, 0.0451, 0.0291], [0.432, 0.0401, 0.0272],
    [0.466, 0.0345, 0.0250], [0.493, 0.0297, 0.0229], [0.519, 0.0254, 0.0210],
    [0.548, 0.0204, 0.0188], [0.581, 0.0145, 0.0162]])


def propeller(**changes):
    """Return a propeller of 0.4 m with a motor, at the origin unless told otherwise."""
    return Propeller(**{'diameter': 0.4, 'coefficients': PLAIN, 'drive': MOTOR,
                        'position_G': (0.0, 0.0, 0.0), 'inertia': 6e-4, **changes})


def trainer(*engines):
    """Return the trainer with other engines."""
    return dataclasses.replace(wings.shipped_aircraft('trainer'), engines=engines)


def at_nose(**changes):
    """Return the trainer with one propeller where its engine was."""
    return trainer(propeller(position_G=(-0.45, 0.0, -0.05), **changes))

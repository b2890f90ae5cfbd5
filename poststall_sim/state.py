# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What changes in flight, as frozen records: the body, its controls, the strips, a snapshot."""

import enum
import math
from dataclasses import dataclass

from poststall_sim.aircraft import read_only
from poststall_sim.atmosphere import Air
from poststall_sim.frames import GRAVITY, FloatArray, rotation


class Status(enum.Enum):
    """How a solution ended."""

    CONVERGED = 'converged'
    NOT_CONVERGED = 'not converged: the best iterate is kept, see the residual'
    DIVERGED = 'diverged: a value is not finite'


@dataclass(frozen=True, slots=True, eq=False)
class BodyState:
    """
    A rigid body: position_N (3,) [m] and velocity_B (3,) [m/s] of its centre of gravity,
    rates_B (3,) [rad/s] and attitude q_NB (4,) [w, x, y, z].
    """  # noqa: D205

    position_N: FloatArray
    velocity_B: FloatArray
    rates_B: FloatArray
    q_NB: FloatArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for key in ('position_N', 'velocity_B', 'rates_B', 'q_NB'):
            object.__setattr__(self, key, read_only(getattr(self, key)))

    @property
    def altitude(self) -> float:
        """Height above the origin of N [m]."""
        return -float(self.position_N[2])

    def is_finite(self) -> bool:
        """Tell whether every number is finite."""
        return all(map(math.isfinite, (*self.position_N.tolist(), *self.velocity_B.tolist(),
                                       *self.rates_B.tolist(), *self.q_NB.tolist())))


@dataclass(frozen=True, slots=True, eq=False)
class Controls:
    """Deflections (n,) [rad] in the order of ``aircraft.control_names``, and throttle 0..1."""

    deflections: FloatArray
    throttle: float = 0.0

    def __post_init__(self) -> None:
        """Make the array read-only."""
        object.__setattr__(self, 'deflections', read_only(self.deflections))


@dataclass(frozen=True, slots=True, eq=False)
class EngineState:
    """
    What engines remember, each array (k,) in the order of ``aircraft.engines``.

    speed : of the propellers' shafts [rad/s], 0 where there is none; charge : of the batteries,
    from 1, full, to 0, empty; 1 where there is none.
    """

    speed: FloatArray
    charge: FloatArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for key in ('speed', 'charge'):
            object.__setattr__(self, key, read_only(getattr(self, key)))


@dataclass(frozen=True, slots=True, eq=False)
class EngineReadings:
    """
    What engines do at an instant, each array (k,) in the order of ``aircraft.engines``.

    speed, charge : see `EngineState`; axial : airspeed along the thrust [m/s]; thrust [N];
    torque : of the air against the propeller's turning [N m]; voltage and current : of the
    battery at its clamps [V, A], 0 where there is none; failed : 1 where it has failed, else 0.
    """

    speed: FloatArray
    charge: FloatArray
    axial: FloatArray
    thrust: FloatArray
    torque: FloatArray
    voltage: FloatArray
    current: FloatArray
    failed: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Strips:
    """
    Operating points of all strips, each array (n,), in the lattice's order.

    alpha : angle of attack at which the section works [rad]; cl, cd, cm : section coefficients
    [-]; delta : decambering [rad]; circulation [m^2/s]; residual : of the closure in use [rad];
    stalled : past the section's angle of maximum (or minimum) lift.
    """

    alpha: FloatArray
    cl: FloatArray
    cd: FloatArray
    cm: FloatArray
    delta: FloatArray
    circulation: FloatArray
    residual: FloatArray
    stalled: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """
    One instant of a flight, everything that can be shown or published.

    controls : as they stand; control_rates : how fast they went there in the step before [rad/s;
    throttle 1/s]; commanded : what they were told, within their limits; angles (k,) of the
    movable parts [rad] and angle_rates, likewise [rad/s];
    force_B, moment_B : aerodynamic, about the centre of gravity, added mass included [N, N m];
    thrust_B, thrust_moment_B : of the engines, with the torque on their mounts and the moment of
    turning shafts that are turned; engines : each by itself; velocity_air_B : through the air
    [m/s];
    acceleration_B : d(velocity)/dt seen from N, in B, gravity included [m/s^2];
    rate_change_B [rad/s^2]; load_factor : lift-wise specific force over g, 1 in level flight;
    wind_N : velocity of the air at the centre of gravity, where it blows to [m/s]; air : what it
    is there; iterations, max_residual and status of the decambering.
    """

    time_ns: int
    body: BodyState
    controls: Controls
    control_rates: Controls
    commanded: Controls
    angles: FloatArray
    angle_rates: FloatArray
    velocity_air_B: FloatArray
    airspeed: float
    alpha: float
    beta: float
    acceleration_B: FloatArray
    rate_change_B: FloatArray
    load_factor: float
    force_B: FloatArray
    moment_B: FloatArray
    thrust_B: FloatArray
    thrust_moment_B: FloatArray
    engines: EngineReadings
    wind_N: FloatArray
    air: Air
    strips: Strips
    iterations: int
    max_residual: float
    status: Status

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.time_ns * 1e-9

    @property
    def density(self) -> float:
        """Density of the air [kg/m^3]."""
        return self.air.density

    @property
    def mach(self) -> float:
        """Mach number [-]."""
        return self.airspeed / self.air.speed_of_sound

    @property
    def specific_force_B(self) -> FloatArray:
        """What an accelerometer at the centre of gravity feels (3,): all but gravity [m/s^2]."""
        return self.acceleration_B - GRAVITY * rotation(self.body.q_NB)[2]

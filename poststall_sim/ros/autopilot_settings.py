# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the example autopilot: what it holds, gains and limits, all writable."""

import dataclasses
from dataclasses import dataclass

from poststall_sim.autopilot_law import Law
from poststall_sim.ros.parameters import entry

_LAW = Law()


def law_entry(key: str, name: str, description: str, low: float, high: float) -> float:
    """Return a dataclass field that is a writable parameter, with the default of the law."""
    return entry(name, getattr(_LAW, key), description, low=low, high=high, writable=True)


@dataclass(frozen=True, slots=True)
class AutopilotSettings:
    """Parameters of the autopilot; but for ``lockstep`` they are the fields of `Law`."""

    lockstep: bool = entry(
        'lockstep', False, 'For a simulator with lockstep command: answer a state when '
        'strip_stalled has come too, and send again until the next one comes')
    pitch: float = law_entry('pitch', 'hold.pitch', 'Pitch to hold, nose up [rad]', -1.0, 1.0)
    roll: float = law_entry('roll', 'hold.roll', 'Bank to hold, to the right [rad]', -1.2, 1.2)
    airspeed: float = law_entry(
        'airspeed', 'hold.airspeed', 'True airspeed to hold [m/s]', 0.1, 400.0)
    pitch_gain: float = law_entry(
        'pitch_gain', 'pitch.gain', 'Pitch rate wanted per error in pitch [1/s]', 0.0, 100.0)
    pitch_rate_limit: float = law_entry(
        'pitch_rate_limit', 'pitch.rate_limit', 'Pitch rate wanted at most [rad/s]', 0.0, 10.0)
    pitch_alpha_gain: float = law_entry(
        'pitch_alpha_gain', 'pitch.alpha_gain', 'Pitch rate wanted at most per angle of attack '
        'that is left to recovered.alpha [1/s]', 0.0, 100.0)
    pitch_rate_gain: float = law_entry(
        'pitch_rate_gain', 'pitch.rate_gain', 'Elevator up per pitch rate that is lacking [s]',
        0.0, 10.0)
    pitch_integral_gain: float = law_entry(
        'pitch_integral_gain', 'pitch.integral_gain', 'The same per its integral [-]', 0.0, 100.0)
    roll_gain: float = law_entry(
        'roll_gain', 'roll.gain', 'Roll rate wanted per error in bank [1/s]', 0.0, 100.0)
    roll_rate_limit: float = law_entry(
        'roll_rate_limit', 'roll.rate_limit', 'Roll rate wanted at most [rad/s]', 0.0, 10.0)
    roll_rate_gain: float = law_entry(
        'roll_rate_gain', 'roll.rate_gain', 'Aileron per roll rate that is lacking [s]',
        0.0, 10.0)
    roll_integral_gain: float = law_entry(
        'roll_integral_gain', 'roll.integral_gain', 'The same per its integral [-]', 0.0, 100.0)
    yaw_rate_gain: float = law_entry(
        'yaw_rate_gain', 'yaw.rate_gain', 'Rudder against yaw that is not of the turn [s]',
        0.0, 10.0)
    sideslip_gain: float = law_entry(
        'sideslip_gain', 'yaw.sideslip_gain', 'Rudder into the sideslip [-]', 0.0, 10.0)
    airspeed_gain: float = law_entry(
        'airspeed_gain', 'airspeed.gain', 'Throttle per airspeed that is lacking [s/m]',
        0.0, 10.0)
    airspeed_integral_gain: float = law_entry(
        'airspeed_integral_gain', 'airspeed.integral_gain', 'Throttle per its integral [1/m]',
        0.0, 10.0)
    stall_alpha: float = law_entry(
        'stall_alpha', 'stall.alpha', 'Angle of attack beyond which it is a stall [rad]',
        0.0, 1.6)
    stall_share: float = law_entry(
        'stall_share', 'stall.share', 'Share of stalled strips beyond which it is a stall; '
        '1 = alpha alone decides [-]', 0.0, 1.0)
    recovered_alpha: float = law_entry(
        'recovered_alpha', 'recovered.alpha', 'Angle of attack below which ailerons work again, '
        'and the recovery may end [rad]', 0.0, 1.6)
    recovered_airspeed: float = law_entry(
        'recovered_airspeed', 'recovered.airspeed', 'True airspeed above which the recovery may '
        'end [m/s]', 0.0, 400.0)
    recovery_alpha: float = law_entry(
        'recovery_alpha', 'recovery.alpha', 'Angle of attack that the recovery goes to [rad]',
        -0.5, 1.6)
    recovery_alpha_gain: float = law_entry(
        'recovery_alpha_gain', 'recovery.alpha_gain', 'Elevator down per angle of attack beyond '
        'that [-]', 0.0, 100.0)
    recovery_rudder_gain: float = law_entry(
        'recovery_rudder_gain', 'recovery.rudder_gain', 'Rudder against the bank in the stall '
        '[-]', 0.0, 10.0)
    recovery_throttle: float = law_entry(
        'recovery_throttle', 'recovery.throttle', 'Throttle in the recovery, 0..1 [-]', 0.0, 1.0)
    elevator_limit: float = law_entry(
        'elevator_limit', 'limit.elevator', 'Elevator at most, both ways [rad]', 0.0, 1.6)
    aileron_limit: float = law_entry(
        'aileron_limit', 'limit.aileron', 'Aileron at most, both ways [rad]', 0.0, 1.6)
    rudder_limit: float = law_entry(
        'rudder_limit', 'limit.rudder', 'Rudder at most, both ways [rad]', 0.0, 1.6)

    @property
    def law(self) -> Law:
        """The law with these numbers."""
        return Law(**{field.name: getattr(self, field.name) for field in dataclasses.fields(Law)})

# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Messages, see the package."""

from geometry_msgs.msg import Accel, Pose, Twist
from std_msgs.msg import Header


class Result:
    """How a call went."""

    RESULT_FEATURE_UNSUPPORTED = 0
    RESULT_OK = 1
    RESULT_NOT_FOUND = 2
    RESULT_INCORRECT_STATE = 3
    RESULT_OPERATION_FAILED = 4

    def __init__(self):
        self.result = 0
        self.error_message = ''


class SimulationState:
    """How a simulation stands."""

    STATE_STOPPED = 0
    STATE_PLAYING = 1
    STATE_PAUSED = 2
    STATE_QUITTING = 3
    STATE_INITIALIZING = 4

    def __init__(self):
        self.state = 0


class SimulatorFeatures:
    """What a simulator can do."""

    SPAWNING = 0
    ENTITY_STATE_GETTING = 10
    ENTITY_STATE_SETTING = 11
    SIMULATION_RESET = 20
    SIMULATION_RESET_TIME = 21
    SIMULATION_RESET_STATE = 22
    SIMULATION_RESET_SPAWNED = 23
    SIMULATION_STATE_GETTING = 24
    SIMULATION_STATE_SETTING = 25
    SIMULATION_STATE_PAUSE = 26
    STEP_SIMULATION_SINGLE = 31
    STEP_SIMULATION_MULTIPLE = 32
    STEP_SIMULATION_ACTION = 33

    def __init__(self):
        self.features = []
        self.spawn_formats = []
        self.custom_info = ''


class EntityState:
    """Where an entity is and how it moves, in the frame of its header."""

    def __init__(self):
        self.header, self.pose = Header(), Pose()
        self.twist, self.acceleration = Twist(), Accel()

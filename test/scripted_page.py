# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The server of the live page without a simulator: the standard input says what is shown."""

import asyncio
import json
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from pathlib import Path

SCRIPT = Path(__file__)
AS_IT_LIES = (0.0, 0.0, 100.0), (0.0, 0.0, 0.7071, 0.7071), (15.0, 0.0, 0.0)
"""Place, attitude and velocity of level flight to the north."""


class Scripted:
    """A page as a process, told what to show."""

    def __init__(self):
        self.process = subprocess.Popen([sys.executable, str(SCRIPT)], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()

    def show(self, seconds, **values):
        """Show a state: level flight, and what else is given."""
        self.process.stdin.write(json.dumps([seconds, values]) + '\n')
        self.process.stdin.flush()

    def stumble(self):
        """Say what whoever is to show it fails at."""
        self.process.stdin.write('a state that is none\n')
        self.process.stdin.flush()

    def end(self):
        """Kill what has not ended."""
        self.process.kill()
        self.process.communicate()


class _Simulator:
    def __init__(self, scene):
        self.scene = scene

    def command(self, values):
        """Nobody flies."""

    def act(self, action, answered):
        answered(True, 'done')


def main():
    from poststall_sim.watch.scene import Scene
    from poststall_sim.watch.server import Server
    scene = Scene('/')

    listening = Future()

    def hear():
        try:
            for line in sys.stdin:
                seconds, values = json.loads(line)
                scene.values(**values)
                scene.pose(time.monotonic(), seconds, *AS_IT_LIES)
                scene.look(time.monotonic(), 1, '/odom')
        except ValueError as error:
            listening.set_exception(error)

    threading.Thread(target=hear, daemon=True).start()
    asyncio.run(Server(_Simulator(scene), control=True, rate=50.0).serve(
        0, lambda url: print(url, flush=True), listening))


if __name__ == '__main__':
    main()

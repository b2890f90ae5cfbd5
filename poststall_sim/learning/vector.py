# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Environments on the engine of campaigns: Dask's workers, of this machine or of a cluster.

Each worker is one actor with its share of the environments. They are stepped as
`gymnasium.vector.SyncVectorEnv` steps its own, and what comes back is the same to the bit.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, suppress
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array, iterate

from poststall_sim import threads
from poststall_sim.campaign import engine
from poststall_sim.campaign.engine import EngineError

GONE = 'a worker has gone, and its environments with it'
Seeds = int | Sequence[int | None] | None


class Share:
    """The environments of one worker, each reset in the step after its episode is over."""

    def __init__(self, makers: Sequence[Callable[[], gymnasium.Env]]) -> None:
        threads.one_blas_thread()
        self._envs = [make() for make in makers]
        self._over = [False] * len(makers)

    def spaces(self) -> tuple[gymnasium.Space, gymnasium.Space]:
        """Return the spaces of observations and of actions."""
        return self._envs[0].observation_space, self._envs[0].action_space

    def reset(self, seeds: Sequence[int | None], options: dict[str, Any] | None) -> list[tuple]:
        """Reset all; return observation and info of each."""
        self._over = [False] * len(self._envs)
        return [env.reset(seed=seed, options=options) for env, seed in zip(self._envs, seeds)]

    def step(self, actions: Sequence[Any]) -> list[tuple]:
        """Step all, or reset those whose episode is over; return what `step` returns of each."""
        results = []
        for place, (env, action) in enumerate(zip(self._envs, actions)):
            if self._over[place]:
                observation, info = env.reset()
                result = observation, 0.0, False, False, info
            else:
                result = env.step(action)
            self._over[place] = result[2] or result[3]
            results.append(result)
        return results

    def call(self, name: str, values: Sequence[tuple]) -> list[Any]:
        """Call a method of each with its own arguments; return what they return."""
        return [getattr(env.unwrapped, name)(*given) for env, given in zip(self._envs, values)]

    def close(self) -> None:
        """Close all."""
        for env in self._envs:
            env.close()


class DaskVectorEnv(VectorEnv):
    """
    Environments stepped together, shared out to Dask's workers.

    makers : what makes one environment each, of modules that workers can import, as
    ``functools.partial(RecoveryEnv, duration=4.0)``; scheduler : address of
    a cluster that is there, None for so many workers of this machine's own. Workers are closed
    with it. Raises `EngineError` where there is no cluster, or a worker has gone with its
    environments.
    """

    def __init__(self, makers: Iterable[Callable[[], gymnasium.Env]], *,
                 scheduler: str | None = None, workers: int | None = None) -> None:
        makers, self._gone = list(makers), False
        if not makers:
            raise ValueError('a vector has one environment at least, got none')
        self.num_envs = len(makers)
        self.metadata = {'autoreset_mode': AutoresetMode.NEXT_STEP, 'render_modes': []}
        with ExitStack() as stack:
            client = stack.enter_context(engine.cluster(scheduler, workers))
            addresses = sorted(client.nthreads())[:self.num_envs]
            # Neighbours stay together, so that results come back in their order.
            self._shares = [slice(part[0], part[-1] + 1) for part in
                            np.array_split(np.arange(self.num_envs), len(addresses))]
            # Kept: a worker lets go of an actor with the last of the futures that it came of.
            self._made = [
                client.submit(Share, makers[share], actor=True, workers=[address], pure=False)
                for share, address in zip(self._shares, addresses)]
            self._actors = [made.result() for made in self._made]
            with client.as_current():   # an actor asks for its client once, when first called
                spaces = self._all('spaces')
            self.single_observation_space, self.single_action_space = spaces[0]
            self._cluster = stack.pop_all()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(self, *, seed: Seeds = None,
              options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset all; a whole number seeds them with it and those that follow."""
        if isinstance(seed, (int, np.integer)):
            seed = [int(seed) + i for i in range(self.num_envs)]
        seeds = [None] * self.num_envs if seed is None else list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f'there are {self.num_envs} environments, got {len(seeds)} seeds')
        results = self._shared('reset', seeds, options)
        observations, infos = zip(*results)
        return self._stacked(observations), self._infos(infos)

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Step all; one whose episode was over is reset instead, with a reward of 0."""
        each = [np.array(action) for action in iterate(self.action_space, actions)]
        observations, rewards, ends, cuts, infos = zip(*self._shared('step', each))
        return (self._stacked(observations), np.array(rewards, dtype=np.float64),
                np.array(ends, dtype=np.bool_), np.array(cuts, dtype=np.bool_),
                self._infos(infos))

    def call(self, name: str, values: Sequence[tuple] | None = None) -> list[Any]:
        """Call a method of each environment, with arguments of its own: `get_state`, say."""
        return self._shared('call', [()] * self.num_envs if values is None else values, name=name)

    def close_extras(self, **kwargs: Any) -> None:
        """Close the environments, and the workers if they are our own."""
        with self._cluster, suppress(EngineError):
            self._all('close')

    def _shared(self, method: str, values: Sequence[Any], *more: Any,
                name: str | None = None) -> list[Any]:
        """Give each actor its share of values; return what they return in one list."""
        first = () if name is None else (name,)
        return [result for part in self._answers([
            (actor, method, *first, values[share], *more)
            for actor, share in zip(self._actors, self._shares)]) for result in part]

    def _all(self, method: str) -> list[Any]:
        return self._answers([(actor, method) for actor in self._actors])

    def _answers(self, asked: list[tuple]) -> list[Any]:
        """Return the answers of actors to (actor, method, arguments), asked all at once."""
        if self._gone:   # not asked again: Dask would try for half a minute
            raise EngineError(GONE)
        try:
            methods = [getattr(actor, method) for actor, method, *_ in asked]
        except RuntimeError:   # Dask's, of an actor it knows to be lost
            self._gone = True
            raise EngineError(GONE) from None
        futures = [method(*given) for method, (_, _, *given) in zip(methods, asked)]
        try:
            return [future.result() for future in futures]
        except (OSError, TimeoutError, CancelledError):
            self._gone = True
            raise EngineError(GONE) from None

    def _stacked(self, observations: Sequence[Any]) -> Any:
        room = create_empty_array(self.single_observation_space, self.num_envs, np.zeros)
        return concatenate(self.single_observation_space, observations, room)

    def _infos(self, infos: Sequence[dict[str, Any]]) -> dict[str, Any]:
        together: dict[str, Any] = {}
        for place, info in enumerate(infos):
            together = self._add_info(together, info, place)
        return together

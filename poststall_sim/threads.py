# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""One thread for linear algebra: on matrices of our size a second one costs more than it gives."""

try:
    from threadpoolctl import threadpool_limits
except ImportError:
    threadpool_limits = None


def one_blas_thread() -> None:
    """
    Keep BLAS and LAPACK of this process to one thread, where threadpoolctl is installed.

    With two, a solve of a hundred unknowns waits for the scheduler: 0.8 ms became 8 ms on two busy
    cores. For programs to call; the library leaves its user's process alone.
    """
    if threadpool_limits is not None:
        threadpool_limits(limits=1)

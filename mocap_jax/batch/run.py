"""`run_jobs`: jobs one after the other in this process, or side by side by Dask."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from mocap_jax.batch.jobs import Job
from mocap_jax.batch.perform import Work, describe_failure, perform
from mocap_jax.errors import InputError

MISSING = (
    "batch needs Dask for its worker processes: pip install 'mocap_jax[batch]'; or --workers 0 to "
    "do all in one process"
)
# Workers share a GPU; each would take three quarters of its memory at once.
_ENVIRONMENT = {"XLA_PYTHON_CLIENT_PREALLOCATE": "false"}
_PATIENCE = "30s"


def run_jobs(
    jobs: Sequence[Job],
    work: Work,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    done: Callable[[Job, dict[str, Any]], None] = lambda job, record: None,
) -> list[dict[str, Any]]:
    """Do all jobs; one that fails is recorded so and stops no other.

    Args:
        jobs: what to do.
        work: see `Work`.
        workers: processes of a local cluster; 0 for none, one job after the other in this process;
            None for half the processors.
        scheduler: address of a Dask scheduler whose workers see the same files, instead.
        done: told each job with its record, in the order in which they end.

    Returns:
        The records, in the order of the jobs.

    Raises:
        InputError: Dask is absent, or the scheduler does not answer.
    """
    if not jobs:
        return []
    records: dict[Job, dict[str, Any]] = {}

    def keep(job: Job, record: dict[str, Any]) -> None:
        records[job] = record
        done(job, record)

    if workers == 0 and scheduler is None:
        for job in jobs:
            keep(job, perform(work, job))
    else:
        count = min(workers or max((os.cpu_count() or 2) // 2, 1), len(jobs))
        with _client(count, scheduler) as client:
            for job, record in _side_by_side(client, jobs, work):
                keep(job, record)
    return [records[job] for job in jobs]


def _side_by_side(
    client: Any, jobs: Sequence[Job], work: Work
) -> Iterator[tuple[Job, dict[str, Any]]]:
    from distributed import as_completed

    def submit(job: Job) -> Any:
        return client.submit(perform, work, job, pure=False, retries=0)

    job_of = {submit(job): job for job in jobs}
    lost = []
    for future in as_completed(job_of):
        if future.exception() is None:
            yield job_of[future], future.result()
        else:  # a worker died, and with it what it had done and what it was yet to do
            lost.append(job_of[future])
    for job in lost:
        record = job.finished
        if record is None:
            record = _alone(submit(job), job)
        yield job, record


def _alone(future: Any, job: Job) -> dict[str, Any]:
    """The record of a job that was lost once and runs by itself: its own fault, if again."""
    error = future.exception()
    if error is None:
        return future.result()
    why = f"its worker process ended ({describe_failure(error)})"
    return {"source": str(job.source), "solution": None, "failed": why}


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """A Dask client; its local cluster ends with it."""
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise InputError(MISSING) from error

    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"--scheduler {scheduler}: no Dask scheduler answers there ({error})"
            ) from error
        with client:
            yield client
        return
    # A job that ends its worker (memory) is not tried again on the next one, and is the only one
    # that it had.
    quiet = {
        "distributed.scheduler.allowed-failures": 0, "distributed.scheduler.worker-saturation": 1.0,
    }  # fmt: skip
    with (
        dask.config.set(quiet),
        LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None,
            memory_limit=None, silence_logs=logging.CRITICAL, env=_ENVIRONMENT,
        ) as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        yield client

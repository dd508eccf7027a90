"""Many recordings, one job each: resumable, in worker processes, failures told and not spread."""

from mocap_jax.batch.jobs import Job, jobs_of
from mocap_jax.batch.perform import Work
from mocap_jax.batch.run import run_jobs
from mocap_jax.batch.summary import Summary

__all__ = ["Job", "Summary", "Work", "jobs_of", "run_jobs"]

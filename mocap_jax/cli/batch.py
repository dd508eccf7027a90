"""`mocap-jax batch`: many recordings, resumable."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocap_jax.cli.batch_work import work
from mocap_jax.cli.estimation import Estimation, add_estimation_arguments, estimation_of
from mocap_jax.cli.exit_codes import FAILURE, SALVAGED, SUCCESS, UsageError
from mocap_jax.cli.files import output_file, output_folder, possible_folder, write_text
from mocap_jax.cli.human_text import is_human
from mocap_jax.cli.parser import add_json_argument, count
from mocap_jax.cli.results import write_json
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.batch import Job, Summary

SUMMARY = "estimate the motions in many recordings; run again to go on where it ended"
EXAMPLE = "mocap-jax batch session1.mcap session2.mcap -o results --workers 2"
NOTE = """Written are NAME.solution.mcap and NAME.json for every recording, summary.json and
summary.csv. A recording whose results are there already, made of the same files with the same
options and version, is not estimated again; one that failed is.

exit codes:
  0  all recordings were estimated, now or earlier
  1  at least one failed (the summary says why); the others have their results
  2  wrong usage
  3  all were estimated, at least one from a damaged file"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument(
        "inputs", metavar="INPUT", nargs="+", help="recordings (.mcap), or folders of them"
    )
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder for results")
    parser.add_argument(
        "--workers", type=count, metavar="N",
        help="processes of a local cluster (default: half the processors); 0: one recording after "
        "the other in this process, without Dask",
    )  # fmt: skip
    parser.add_argument(
        "--scheduler", metavar="ADDRESS",
        help="Dask scheduler, as tcp://host:8786, whose workers see the same files",
    )  # fmt: skip
    parser.add_argument("--again", action="store_true", help="estimate also what is there already")
    add_estimation_arguments(parser, initial="DIR")
    add_json_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    if arguments.workers is not None and arguments.scheduler is not None:
        raise UsageError("--workers is for a local cluster; a --scheduler has workers of its own")
    asked = estimation_of(arguments)
    json_file = output_file(arguments.json) if arguments.json else None
    from mocap_jax.batch import Summary, run_jobs

    # Before all recordings are read for their fingerprints; made when nothing is refused any more.
    jobs = _jobs(arguments.inputs, possible_folder(arguments.output), asked)
    folder = output_folder(arguments.output)
    kept = {} if arguments.again else {j: r for j in jobs if (r := j.finished) is not None}
    todo = [job for job in jobs if job not in kept]
    if kept:
        print(f"{len(kept)} of {len(jobs)} are there already", flush=True)
    with _Lines(len(jobs), len(kept)) as lines:
        made = run_jobs(
            todo, partial(work, asked), workers=arguments.workers, scheduler=arguments.scheduler,
            done=lines.tell,
        )  # fmt: skip
    records = {**kept, **dict(zip(todo, made, strict=True))}
    summary = Summary(
        tuple(records[job] for job in jobs), frozenset(str(job.source) for job in kept)
    )
    _write(folder, summary, json_file)
    print(f"\n{summary}\n\nresults in {folder}")
    if summary.failed:
        return FAILURE
    return SALVAGED if summary.lossy else SUCCESS


def _jobs(inputs: list[str], folder: Path, asked: Estimation) -> list[Job]:
    """Jobs, with the fingerprints of all that their results depend on."""
    from mocap_jax import __version__
    from mocap_jax.batch import jobs_of

    more: dict[str, list[Path]] = {}
    if asked.body is not None and not is_human(asked.body):
        if not Path(asked.body).is_file():
            raise InputError(f"{asked.body}: no such MJCF file")
        more[""] = [Path(asked.body)]
    if asked.initial is not None:
        if not Path(asked.initial).is_dir():
            raise UsageError(f"--initial {asked.initial}: not a folder of solutions")
        more |= {
            p.name.removesuffix(".solution.mcap"): [p]
            for p in sorted(Path(asked.initial).glob("*.solution.mcap"))
        }
    if asked.setup is not None:
        from mocap_jax.io import read_setup_figures

        read_setup_figures(asked.setup)  # a fault in it is told before the work
        more.setdefault("", []).append(Path(asked.setup))
    options = {**dataclasses.asdict(asked), "version": __version__}
    return jobs_of(inputs, folder, options, more=more)


def _write(folder: Path, summary: Summary, json_file: Path | None) -> None:
    content = summary.as_json()
    write_json(folder / "summary.json", content)
    write_text(folder / "summary.csv", summary.as_csv())
    if json_file is not None:
        write_json(json_file, content)


class _Lines:
    """A progress bar, and a line for every recording as it ends."""

    def __init__(self, total: int, already: int) -> None:
        from tqdm import tqdm

        self._bar = tqdm(total=total, initial=already, desc="batch", unit="rec", disable=None)

    def __enter__(self) -> _Lines:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def tell(self, job: Job, record: dict[str, Any]) -> None:
        """One recording has ended."""
        self._bar.update()
        text = record.get("failed") or record.get("status", "")
        failed = "failed: " if record.get("failed") else ""
        self._bar.write(f"{job.source.name}: {failed}{text}", file=sys.stdout)
        sys.stdout.flush()

"""Jobs in the background run in order, and do not keep a process that wants to end."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time

from mocap_jax.estimate.background import compile_once, wait_for

# Five programs are queued; the process waits for the first to be under way.
BEGIN = """
import threading
import jax, jax.numpy as jnp
from mocap_jax.estimate.background import compile_once, wait_for

begun = threading.Event()

def program(x, n):
    for i in range(30):
        x = jnp.sin(x @ x + n + i)
    return x

def job(n):
    print("begun", n, flush=True)
    begun.set()
    jax.jit(program).lower(jnp.eye(3), n).compile()
    print("done", n, flush=True)

jobs = compile_once("programs", *(lambda n=n: job(n) for n in range(5)))
begun.wait()
"""


def started(ending: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN + ending],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_a_process_that_ends_begins_no_more_jobs() -> None:
    out, error = (process := started("")).communicate(timeout=300)
    assert process.returncode == 0, error
    assert not error
    assert out.split("\n") == ["begun 0", "done 0", ""]


def test_an_interrupted_process_begins_no_more_jobs() -> None:
    process = started("wait_for(jobs)")
    assert process.stdout is not None and process.stdout.readline() == "begun 0\n"
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=300)
    assert "KeyboardInterrupt" in error and "Fatal" not in error
    assert "begun" not in out


def test_jobs_run_in_order_and_survive_failures() -> None:
    done: list[str] = []

    def fails() -> None:
        raise RuntimeError

    def slow() -> None:
        time.sleep(0.05)
        done.append(threading.current_thread().name)

    key = object()
    wait_for(compile_once(key, fails, slow, lambda: done.append("second")))
    assert done == ["compile", "second"]
    assert compile_once(key, slow) == []
    # The thread ends with its work; a new one takes the next.
    wait_for(compile_once(object(), lambda: done.append("third")))
    assert done[-1] == "third"

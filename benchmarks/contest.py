"""Contestants, and the turns they take: a, b, a, b, so that a noisy machine is noisy for all of them.

A contestant is a whole process, or a function in a process that stays (see `worker.py`).
This process imports nothing large: a child's peak memory counts from what its parent had when it was started.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Protocol

REPEATS = 5
ROOT = Path(__file__).parent.parent
NO_PEERS = "no environment with peers"

_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_KILOBYTE = 1 if sys.platform == "darwin" else 1024  # unit of ru_maxrss, bytes


class ContestError(Exception):
    """A contestant failed, or two that should agree do not."""


class PeerError(ContestError):
    """A peer is absent or broken: what depends on it is skipped."""


@dataclass
class Runs:
    """What a contestant did.

    Attributes:
        seconds: Time of the processor in each run, children included.
        peaks: Peak memory of each run, bytes; of whole processes only.
        skipped: Why there are no runs.
    """

    seconds: list[float] = field(default_factory=list)
    peaks: list[float] = field(default_factory=list)
    skipped: str | None = None

    def add(self, seconds: float, peak: float | None) -> None:
        """Count one run."""
        self.seconds.append(seconds)
        if peak is not None:
            self.peaks.append(peak)


class Contestant(Protocol):
    """Something that can be run again and again."""

    peer: bool

    def open(self, stack: ExitStack) -> None:
        """Get ready; what must be put away afterwards is left to `stack`."""

    def run(self) -> tuple[float, float | None]:
        """Return the time of the processor in one run, s, and its peak memory, bytes."""

    def numbers(self) -> list[float]:
        """Return numbers that must be the same for all contestants; none where nothing can be compared."""


@dataclass
class Command:
    """A process, from its start to its end; what it writes to standard output is dropped.

    Attributes:
        arguments: The first is the program; None where it is a peer's that there is none of.
        peer: Whether it may fail.
        compared: Whether it writes rows as CSV, to be compared with the others' before the clock starts.
    """

    arguments: Sequence[str | None]
    peer: bool = False
    compared: bool = False

    def open(self, stack: ExitStack) -> None:
        """Nothing is needed beforehand."""
        if None in self.arguments:
            raise PeerError(NO_PEERS)

    def run(self) -> tuple[float, float | None]:
        """Return the time of the processor and the peak memory of one process."""
        with tempfile.TemporaryFile() as complaints:
            child = self._start(stdout=subprocess.DEVNULL, stderr=complaints)
            _, status, usage = os.wait4(child.pid, 0)
            seconds = usage.ru_utime + usage.ru_stime  # those of its own children are counted in
            child.returncode = os.waitstatus_to_exitcode(status)
            complaints.seek(0)
            self._require(child.returncode, complaints.read())
        return seconds, float(usage.ru_maxrss * _KILOBYTE)

    def numbers(self) -> list[float]:
        """Return the numbers of some of the rows that the process writes."""
        if not self.compared:
            return []
        child = self._start(stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        text, complaints = child.communicate()
        self._require(child.returncode, complaints)
        lines = text.decode().splitlines()[1:]
        return [float(cell) for line in lines[:: max(1, len(lines) // 4)] for cell in line.split(",")]

    def _start(self, stdout: int, stderr: int | IO[bytes]) -> subprocess.Popen[bytes]:
        arguments = [each for each in self.arguments if each is not None]
        try:
            return subprocess.Popen(arguments, cwd=ROOT, env=_environment(), stdout=stdout, stderr=stderr)
        except OSError as error:
            raise _failure(self.peer, b"", f"{self.arguments[0]}: {error.strerror}") from error

    def _require(self, code: int, complaints: bytes) -> None:
        if code:
            raise _failure(self.peer, complaints, f"exit code {code}")


@dataclass
class Function:
    """A function of a benchmark module, called over and over in one process that stays; one thread each.

    Attributes:
        python: The interpreter; None where it is the peers' and there is none.
        module: Such as "benchmarks.evaluation".
        name: The function that prepares the runs.
        peer: Whether it may fail.
    """

    python: str | None
    module: str
    name: str
    peer: bool = False

    def open(self, stack: ExitStack) -> None:
        """Start the process, and wait until it has prepared itself."""
        if self.python is None:
            raise PeerError(NO_PEERS)
        self._complaints = stack.enter_context(tempfile.TemporaryFile())  # noqa: SIM115
        try:
            self._process: Any = subprocess.Popen(
                [self.python, "-m", "benchmarks.worker", self.module, self.name],
                cwd=ROOT,
                env=_environment() | _ONE_THREAD,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._complaints,
                text=True,
            )
        except OSError as error:
            raise _failure(self.peer, b"", f"{self.python}: {error.strerror}") from error
        stack.callback(self._close)

    def run(self) -> tuple[float, float | None]:
        """Return the time of the processor in one call."""
        return float(self._ask("run")), None

    def numbers(self) -> list[float]:
        """Return some of the numbers that the function makes."""
        return list(map(float, self._ask("numbers")))

    def _ask(self, word: str) -> Any:
        with suppress(BrokenPipeError):
            self._process.stdin.write(word + "\n")
            self._process.stdin.flush()
            answer = self._process.stdout.readline()
            if answer:
                return json.loads(answer)
        self._process.wait()
        self._complaints.seek(0)
        raise _failure(self.peer, self._complaints.read(), "it ended without a word")

    def _close(self) -> None:
        with suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()


def compete(contestants: Mapping[str, Contestant], repeats: int = REPEATS) -> dict[str, Runs]:
    """Let the contestants run in turns, after one run each that does not count.

    Returns:
        The runs by the contestants' names. A peer that fails has none, and the reason.

    Raises:
        ContestError: When one of ours fails, or a peer does something else than we do.
    """
    results = {name: Runs() for name in contestants}
    with ExitStack() as stack:
        left: dict[str, Contestant] = {}
        expected: list[float] = []
        for name, contestant in contestants.items():
            try:
                contestant.open(stack)
                contestant.run()
                numbers = contestant.numbers()
            except PeerError as error:
                results[name].skipped = str(error)
                continue
            expected = expected or numbers
            _require_equal(numbers, expected, name)
            left[name] = contestant
        for _ in range(repeats):
            for name, contestant in list(left.items()):
                try:
                    results[name].add(*contestant.run())
                except PeerError as error:
                    results[name] = Runs(skipped=str(error))
                    del left[name]
    return results


def _environment() -> dict[str, str]:
    """Return the environment of a child: without byte code ours would be compiled anew in each run."""
    return {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}


def _require_equal(numbers: Sequence[float], expected: Sequence[float], name: str) -> None:
    if not numbers:
        return
    if len(numbers) != len(expected):
        raise ContestError(f"{name} makes {len(numbers)} numbers where the first makes {len(expected)}")
    worst = max(abs(a - b) for a, b in zip(numbers, expected, strict=True))
    if not worst <= 2e-9:  # two roundings to nine decimals
        raise ContestError(f"{name} does not compute the same: the numbers differ by {worst:.3g}")


def _failure(peer: bool, complaints: bytes, otherwise: str) -> ContestError:
    """Return the error of a contestant: of a peer the last line says enough, of ours all is wanted."""
    text = complaints.decode(errors="replace").strip() or otherwise
    return PeerError(text.splitlines()[-1].strip()) if peer else ContestError(text)

"""Smoke test of an installed trajcli: the example of every command's help, every example job, every format.

`python tests/smoke.py TRAJCLI` wants all of it to work. With `--slim` each call may also end with exit code 2 and one line
that names a library and the command that installs it.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[1]
ABSENT = re.compile(r"(error: .*the library \S+ is not installed.*python -m pip install '[^']+'.*)")
FORMATS = ("csv", "jsonl", "mcap", "yaml")
MOTION = "t,q1\n0,0\n1,1\n"


def furnish(folder: Path) -> None:
    """Put there what the commands read."""
    shutil.copytree(ROOT / "examples", folder / "examples")
    shutil.copy(ROOT / "tests/urdf/models/ur5.urdf", folder / "arm.urdf")
    for name in ("old", "new", "there"):
        (folder / f"{name}.csv").write_text(MOTION)
    (folder / "back.csv").write_text("t,q1\n0,1\n1,0\n")


def run(program: str, words: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command as somebody who has nothing but the package."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return subprocess.run(
        [program, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def calls(program: str, folder: Path) -> Iterator[list[str]]:
    """Yield the words of each call, that of `plan` which writes what others read first."""
    told = run(program, ["--help"], folder).stdout
    commands = re.findall(r"^  (\w+)  ", told.partition("Commands:")[2], re.MULTILINE)
    for command in commands:
        (example,) = re.findall(
            r"^ *Example: trajcli (.*)$", run(program, [command, "--help"], folder).stdout, re.MULTILINE
        )
        yield shlex.split(example)
    for job in sorted((folder / "examples").glob("*.yaml")):
        if "\nmoves:" in job.read_text():
            yield [
                "plan",
                f"examples/{job.name}",
                "-o",
                f"{job.stem}.rows.csv",
                "--report",
                f"{job.stem}.json",
            ]
            yield ["explain", f"examples/{job.name}"]
    for form in FORMATS:
        yield ["plan", "examples/cubic.yaml", "-o", f"cubic.{form}", *(["--si"] if form == "csv" else [])]
    yield ["plan", "examples/time_optimal.yaml", "--reference", "--no-output"]
    for form in ("svg", "png", "pdf"):
        yield ["plot", "examples/cubic.yaml", "-o", f"cubic.{form}"]


def readers(folder: Path) -> Iterator[list[str]]:
    """Yield the calls that read what has been written."""
    for form in FORMATS:
        if (folder / f"cubic.{form}").exists():
            yield ["check", f"cubic.{form}", "--job", "examples/cubic.yaml"]


def complaint(done: subprocess.CompletedProcess[str], *, slim: bool) -> str | None:
    """Return what is wrong with the end of a call; None where it ended as it should."""
    lines = done.stderr.splitlines()
    absent = [line for line in lines if ABSENT.search(line)]
    if "Traceback" not in done.stderr and (
        done.returncode == 0 or (slim and absent and done.returncode == 2)
    ):
        return None
    return f"exit {done.returncode}: {' / '.join(lines[-3:])}"


def main() -> int:
    """Print what is wrong, and how many calls were made; return 1 where something is."""
    program, slim = str(Path(sys.argv[1]).absolute()), "--slim" in sys.argv
    wrong = lacking = count = 0
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(2) as pool:
        folder = Path(name)
        furnish(folder)
        words = [["--version", "--verbose"], *calls(program, folder)]
        run(program, next(each for each in words if each[0] == "plan"), folder)
        for part in (words, readers):
            part = part if isinstance(part, list) else list(part(folder))
            ended = pool.map(lambda each: run(program, each, folder), part)
            for each, done in zip(part, ended, strict=True):
                count += 1
                said = complaint(done, slim=slim)
                if done.returncode == 2 and said is None:
                    lacking += 1
                    print(f"trajcli {shlex.join(each)}: {done.stderr.splitlines()[-1]}")
                if said is not None:
                    wrong += 1
                    print(f"trajcli {shlex.join(each)}: {said}")
    print(f"{count} calls, {wrong} wrong" + (f", {lacking} for want of a library" if slim else ""))
    return int(wrong > 0 or count < 80)


if __name__ == "__main__":
    sys.exit(main())

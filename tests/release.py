"""Check of a release: its two files are built, judged as an index judges them, installed and tried.

`make release-check` runs it. Each environment stands in a folder of its own, which is removed at the end.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
DIST = ROOT / "dist"
LARGEST_WHEEL = 1_500_000  # bytes
SLIM = ("numpy", "pydantic", "pyyaml", "ruckig", "typer")


def run(*command: str | Path) -> None:
    """Run a command, and end where it fails."""
    print("$", *command, flush=True)
    if subprocess.run([str(word) for word in command], cwd=ROOT, check=False).returncode:
        sys.exit(f"failed: {' '.join(map(str, command))}")


def lowest() -> list[str]:
    """Return the lowest version of each library that is declared, as constraints for pip."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return [requirement.replace(">=", "==") for requirement in project["dependencies"]]


def built() -> tuple[Path, Path]:
    """Return the wheel and the sdist, which are made anew."""
    for old in DIST.glob("trajcli-*"):
        old.unlink()
    run(sys.executable, "-m", "build", "--outdir", DIST)
    (wheel,), (sdist,) = DIST.glob("trajcli-*.whl"), DIST.glob("trajcli-*.tar.gz")
    run(sys.executable, "-m", "twine", "check", "--strict", wheel, sdist)
    size = wheel.stat().st_size
    print(f"{wheel.name}: {size} bytes, at most {LARGEST_WHEEL}")
    if size > LARGEST_WHEEL:
        sys.exit("the wheel is too large")
    return wheel, sdist


def environment(folder: Path, *installed: list[str | Path]) -> Path:
    """Return the folder of programs of a new environment, after calls of pip install."""
    venv.create(folder, with_pip=True)
    programs = folder / ("Scripts" if sys.platform == "win32" else "bin")
    for words in installed:
        run(programs / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *words)
    return programs


def main() -> None:
    """Build both files and try them."""
    wheel, sdist = built()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        constraints = folder / "lowest.txt"
        constraints.write_text("\n".join(lowest()) + "\n")
        for what, slim, *installed in (
            ("wheel", False, [wheel]),
            ("sdist", False, [sdist]),
            ("lowest", False, ["-c", constraints, wheel]),
            ("slim", True, ["--no-deps", wheel], [*SLIM]),
        ):
            print(f"== {what}")
            programs = environment(folder / what, *installed)
            run(sys.executable, ROOT / "tests/smoke.py", programs / "trajcli", *(["--slim"] if slim else []))
            if not slim:
                os.environ["TRAJCLI_COMMANDS"] = str(programs)
                run(sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "tests/test_ci_use.py")


if __name__ == "__main__":
    main()

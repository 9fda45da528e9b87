"""Libraries that are missing, broken or too old: one line that names library and command, and no traceback."""

from __future__ import annotations

import importlib.metadata
import platform
import subprocess
import sys
from pathlib import Path

import pytest
from tiers import few

from tests.cli.running import EXAMPLES, ROOT, call
from trajcli.__main__ import _print_version
from trajcli.errors import TrajcliError
from trajcli.version import Library, libraries, library_error, version_lines

Capture = pytest.CaptureFixture[str]
DECLARED = ["numpy>=1.26", "ruckig>=0.19", "plain", "mkdocs<2,>=1.6; extra == 'docs'"]
# what needs a library, and nothing else that is asked for here
NEEDING = {
    "ruckig": ["plan", EXAMPLES / "stop.yaml", "--no-output"],
    "matplotlib": ["plot", EXAMPLES / "cubic.yaml", "-o", "cubic.svg"],
    "toppra": ["plan", EXAMPLES / "time_optimal.yaml", "--reference", "--no-output"],
    "mcap": ["check", "cubic.mcap", "--job", EXAMPLES / "cubic.yaml"],
}
WITHOUT_RUCKIG = [
    "cubic",
    "quintic",
    "septic",
    "trapezoid",
    "spline",
    "blends",
    "helix",
    "time_optimal",
]


class Environment:
    """What is installed, as importlib.metadata says it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._patch, self._versions = monkeypatch, importlib.metadata.version
        self._changed: dict[str, str | None] = {}
        monkeypatch.setattr(importlib.metadata, "version", self._version)

    def _version(self, name: str) -> str:
        found = self._changed[name] if name in self._changed else self._versions(name)
        if found is None:
            raise importlib.metadata.PackageNotFoundError(name)
        return found

    def has(self, name: str, version: str | None) -> None:
        self._changed[name] = version
        if version is None:
            for module in [each for each in sys.modules if each.partition(".")[0] == name]:
                self._patch.delitem(sys.modules, module)
            self._patch.setitem(sys.modules, name, None)


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch) -> Environment:
    return Environment(monkeypatch)


@pytest.mark.parametrize("name", NEEDING)
def test_a_missing_library_is_one_line_with_its_command(
    name: str, environment: Environment, capfd: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if name == "mcap":
        call(capfd, "plan", EXAMPLES / "cubic.yaml", "-o", "cubic.mcap", "-q")
    environment.has(name, None)
    code, out, err = call(capfd, *NEEDING[name])
    (least,) = [library.least for library in libraries() if library.name == name]
    assert (code, out) == (2, "")
    assert err == (
        f"error: the library {name} is not installed, which this needs: python -m pip install '{name}>={least}'\n"
    )


@pytest.mark.parametrize("job", few(WITHOUT_RUCKIG, 3))
def test_what_needs_no_ruckig_works_without_it(job: str, environment: Environment, capfd: Capture) -> None:
    environment.has("ruckig", None)
    code, _, err = call(capfd, "plan", EXAMPLES / f"{job}.yaml", "--no-output")
    assert code == 0
    assert "verified" in err


@pytest.mark.parametrize("form", ["github", "json"])
def test_the_gate_says_so_too(form: str, environment: Environment, capfd: Capture) -> None:
    environment.has("ruckig", None)
    jobs = [EXAMPLES / "cubic.yaml", EXAMPLES / "stop.yaml"]
    code, _, err = call(capfd, "plan", "--no-output", "-q", "--errors", form, *jobs)
    (line,) = err.splitlines()
    assert code == 2
    assert "the library ruckig is not installed" in line
    assert "pip install" in line


def test_jobs_of_a_batch_fail_alone(environment: Environment, capfd: Capture, tmp_path: Path) -> None:
    environment.has("ruckig", None)
    jobs = [EXAMPLES / "cubic.yaml", EXAMPLES / "stop.yaml"]
    code, _, err = call(capfd, "batch", *jobs, "-o", tmp_path, "-j", "1", "-q")
    assert code == 2
    assert "the library ruckig is not installed" in err
    assert [path.name for path in tmp_path.glob("*.csv")] == ["cubic.csv"]


@pytest.mark.parametrize("name", ["typer", "numpy", "yaml", "pydantic"])
def test_a_start_without_a_library_of_every_plan(name: str, tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(f"import sys\nsys.modules['{name}'] = None\n")
    words = [sys.executable, "-m", "trajcli", "plan", str(EXAMPLES / "cubic.yaml")]
    done = subprocess.run(
        words,
        env={"PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    (line,) = done.stderr.splitlines()
    distribution = "pyyaml" if name == "yaml" else name
    assert (done.returncode, done.stdout) == (2, "")
    assert line.startswith(f"error: the library {distribution} ")
    assert f"pip install --force-reinstall '{distribution}>=" in line


def said(error: BaseException) -> str | None:
    found: TrajcliError | None = library_error(error)
    return None if found is None else str(found)


def test_a_library_that_is_too_old_is_the_cause_of_whatever_fails(environment: Environment) -> None:
    mended = "python -m pip install 'numpy>=1.26'"
    environment.has("numpy", "1.25.2")
    assert said(AttributeError("trapezoid")) == (
        f"the library numpy 1.25.2 is installed, and trajcli needs 1.26 or later: {mended}"
    )
    for fitting in ("1.26", "1.26.4", "2.0.0rc1", "10.0"):
        environment.has("numpy", fitting)
        assert said(AttributeError("trapezoid")) is None


def test_a_library_that_does_not_load_is_named_with_the_reason() -> None:
    line = said(ImportError("libstdc++.so.6: cannot open", name="ruckig"))
    assert line is not None
    assert "the library ruckig" in line
    assert "cannot be loaded (libstdc++.so.6: cannot open)" in line
    assert "pip install --force-reinstall 'ruckig>=0.19" in line


def test_a_module_of_our_own_is_no_library() -> None:
    assert said(ModuleNotFoundError("no module", name="trajcli.nothing")) is None


INSTALLED_AS = {
    "yaml.events": "pyyaml",
    "pydantic_core._core": "pydantic",
    "mpl_toolkits.mplot3d": "matplotlib",
    "PIL.Image": "pillow",
    "dateutil": "python-dateutil",
}


@pytest.mark.parametrize("module", INSTALLED_AS)
def test_a_module_is_of_the_library_under_whose_name_it_is_installed(
    module: str, environment: Environment
) -> None:
    name = INSTALLED_AS[module]
    environment.has(name, "99.0")
    line = said(ImportError("bad magic", name=module))
    assert line is not None
    assert line.startswith(
        f"the library {name} 99.0 cannot be loaded (bad magic): python -m pip install --force"
    )
    assert f" '{name}" in line


def test_what_nobody_declares_or_an_extra_lacks_is_no_cause_of_other_errors(environment: Environment) -> None:
    environment.has("nothing", None)
    wanted = "the library nothing is not installed, which this needs: python -m pip install 'nothing'"
    assert said(ModuleNotFoundError("no module", name="nothing.at_all")) == wanted
    environment.has("dask", "1.0")
    environment.has("toppra", None)
    assert said(AttributeError("trapezoid")) is None


def test_the_report_of_a_bug_has_each_library_and_all_that_extras_lack(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    extras = ["a>=1; extra == 'x'", "b>=2; extra == 'x'", "c; extra == 'y'"]
    versions = {"numpy": "1.26", "ruckig": "0.18.9", "b": "1.10", "c": "3"}
    monkeypatch.setattr(importlib.metadata, "requires", lambda _: [*DECLARED[:2], *extras])
    monkeypatch.setattr(importlib.metadata, "version", versions.get)
    _, python, *lines = version_lines()
    assert python == f"Python {platform.python_version()} on {platform.system()} {platform.machine()}"
    mended = "python -m pip install 'ruckig>=0.19'"
    assert lines == [
        "numpy 1.26",
        f"the library ruckig 0.18.9 is installed, and trajcli needs 0.19 or later: {mended}",
        "extra x: lacks a, b",
        "extra y: installed",
    ]


def test_a_clone_that_is_not_installed_declares_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def requires(name: str) -> list[str]:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", requires)
    assert libraries() == []
    assert len(list(version_lines())) == 2


def test_requirements_are_read_as_they_are_declared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda _: DECLARED)
    monkeypatch.setattr(importlib.metadata, "version", {"numpy": "2.1", "ruckig": "0.18.9"}.get)
    assert libraries() == [
        Library("numpy", "1.26", "", "2.1"),
        Library("ruckig", "0.19", "", "0.18.9"),
        Library("plain"),
        Library("mkdocs", "1.6", "docs"),
    ]
    assert [library.fits() for library in libraries()] == [True, False, False, False]


def test_the_version_with_those_of_the_libraries(environment: Environment, capsys: Capture) -> None:
    environment.has("toppra", None)
    assert _print_version(["--verbose"]) == 0
    lines = capsys.readouterr().out.splitlines()
    version = ".".join(map(str, sys.version_info[:3]))
    assert lines[0] == f"trajcli {importlib.metadata.version('trajcli')}"
    assert lines[1].startswith(f"Python {version}")
    assert f"numpy {importlib.metadata.version('numpy')}" in lines
    assert any(line.startswith("the library toppra is not installed") for line in lines)
    assert any(line.startswith("extra dask: ") for line in lines)
    assert _print_version(["-v"]) == 0
    assert capsys.readouterr().out.splitlines() == lines
    assert _print_version([]) == 0
    assert capsys.readouterr().out == f"{lines[0]}\n"
    for words in (["--nothing"], ["--verbose", "-v"]):
        assert _print_version(words) == 2
        told = capsys.readouterr()
        assert (told.out, "--verbose" in told.err) == ("", True)

"""What an index shows of the package: its description, its links, and one address behind all of them."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import pytest

from docs.markdown import ROOT, links
from docs.site_hook import on_config

ADDRESS = "https://forge.test/trajcli"
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def hooks(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The hooks of the build; hatchling itself is there only while a package is built."""
    for name, base in (("metadata", "MetadataHookInterface"), ("builders.hooks", "BuildHookInterface")):
        interface = ModuleType(f"hatchling.{name}.plugin.interface")
        setattr(interface, base, SimpleNamespace)
        monkeypatch.setitem(sys.modules, interface.__name__, interface)
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def metadata(hooks: ModuleType) -> dict[str, Any]:
    """The metadata that the hook makes for an address."""
    made: dict[str, Any] = {}
    hooks.AddressHook(root=str(ROOT), config={"address": f"{ADDRESS}/"}).update(made)
    return made


def test_a_wheel_is_packed_smaller_with_the_same_files(hooks: ModuleType, tmp_path: Path) -> None:
    wheel, source = tmp_path / "a.whl", (ROOT / "trajcli/errors.py").read_bytes()
    files = {"a/errors.py": source, "a/empty.py": b"", "a.dist-info/RECORD": b"a/errors.py,,\n"}
    with ZipFile(wheel, "w", ZIP_DEFLATED) as built:
        for name, content in files.items():
            built.writestr(ZipInfo(name, (2026, 11, 26, 12, 0, 0)), content, ZIP_DEFLATED)
    before = wheel.stat().st_size
    hooks.SmallWheel().finalize("editable", {}, str(wheel))
    assert wheel.stat().st_size == before
    hooks.SmallWheel().finalize("standard", {}, str(wheel))
    assert wheel.stat().st_size < before
    with ZipFile(wheel) as packed:
        assert packed.testzip() is None
        assert {info.filename: packed.read(info) for info in packed.infolist()} == files
        assert {info.date_time for info in packed.infolist()} == {(2026, 11, 26, 12, 0, 0)}


def test_the_description_has_the_links_of_the_readme_from_anywhere(metadata: dict[str, Any]) -> None:
    text = metadata["readme"]["text"]
    shown, kept = links(text), links(README)
    assert len(shown) == len(kept) > 20
    for link, relative in zip(shown, kept, strict=True):
        if "://" in relative or relative.startswith("#"):
            assert link == relative
            continue
        assert re.fullmatch(rf"{ADDRESS}/(blob|raw)/HEAD/{re.escape(relative)}", link)
        assert (ROOT / relative.partition("#")[0]).exists()
    pictures = re.findall(r"!\[[^\]]*\]\((\S+)\)", text)
    assert pictures
    assert all(picture.startswith(f"{ADDRESS}/raw/HEAD/docs/pictures/") for picture in pictures)


def test_what_is_no_link_stays_as_it_is(metadata: dict[str, Any]) -> None:
    def without_links(text: str) -> str:
        return re.sub(r"\]\([^)\s]+\)", "]", text)

    assert without_links(metadata["readme"]["text"]) == without_links(README)


def test_the_links_of_the_project_lead_to_its_address(metadata: dict[str, Any]) -> None:
    assert {"Homepage", "Documentation", "Changelog", "Issues"} <= metadata["urls"].keys()
    for url in metadata["urls"].values():
        assert url.startswith(ADDRESS)
        file = url.partition("/blob/HEAD/")[2]
        assert not file or (ROOT / file).exists()


def test_one_line_holds_the_address() -> None:
    (address,) = PROJECT["tool"]["hatch"]["metadata"]["hooks"]["custom"].values()
    pages = [*ROOT.glob("*.md"), *ROOT.glob("*.yml"), *ROOT.glob("*.toml"), *ROOT.glob("docs/**/*.md")]
    naming = [page for page in pages for _ in range(page.read_text(encoding="utf-8").count(address))]
    assert naming == [ROOT / "pyproject.toml"]
    assert {"readme", "urls"} <= set(PROJECT["project"]["dynamic"])


@pytest.mark.parametrize(
    ("address", "led_to"), [("https://example.org/trajcli", None), (ADDRESS, ADDRESS)], ids=["none", "real"]
)
def test_the_site_leads_there_once_the_address_is_real(
    address: str, led_to: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("docs.site_hook.ROOT", tmp_path)
    (tmp_path / "pyproject.toml").write_text(f"[tool.hatch.metadata.hooks.custom]\naddress = '{address}'\n")
    config = SimpleNamespace(repo_url="")
    assert on_config(config).repo_url == led_to


def test_the_commands_of_a_fresh_clone_do_what_the_readme_says(tmp_path: Path) -> None:
    """`make demo` where the environment is set up: what is printed, and the file that it leaves."""
    shown = re.search(r"```console\n\$ make demo +# sets up .venv, plans (\S+) into (\S+), shows", README)
    assert shown is not None
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    shutil.copy(ROOT / "Makefile", tmp_path)
    stamp = str(tmp_path / ".venv/.installed")
    words = ["make", "demo", f"BIN={Path(sys.executable).parent}", f"STAMP={stamp}", "-o", stamp]
    outer = {
        name: value for name, value in os.environ.items() if not name.startswith("MAKE")
    }  # it says its folders
    done = subprocess.run(words, cwd=tmp_path, env=outer, capture_output=True, text=True, check=True)
    rows = (tmp_path / shown[2]).read_text(encoding="utf-8").splitlines()
    assert rows == (ROOT / "tests/golden/ur5e_pick.csv").read_text(encoding="utf-8").splitlines()
    assert done.stdout.splitlines()[-4:] == rows[:4]
    assert "ur5e_pick: verified, 9 moves, 6.8513 s, 858 rows" in done.stderr
    asked = subprocess.run(
        ["make", "-n", "test", "-o", ".venv/.installed"],
        cwd=ROOT,
        env=outer,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "-m pytest" in asked.stdout


def test_the_readme_fits_three_screens() -> None:
    assert len(README.splitlines()) <= 3 * 50
    assert all(f"trajcli {command}" in README for command in ("plan", "check", "view", "fk"))

"""The page as text: its policy, its size, what names may hold, and that the bundle was built from its sources."""

from __future__ import annotations

import gzip
import json
import re
import sys
from base64 import b64decode, b64encode
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

import pytest

from trajcli.errors import InputError
from trajcli.job.read import job_from_text, load_job
from trajcli.planning.plan import plan_job
from trajcli.player.page import BUNDLE, page_of
from trajcli.player.scene import scene_of_plan

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "player"


class Elements(HTMLParser):
    """The scripts, styles and attributes of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.texts: list[tuple[str, dict[str, str | None], str]] = []
        self.links: list[str] = []
        self.policy = ""
        self.title = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self.texts.append((tag, given, ""))
        self.links += [value or "" for key, value in attributes if key in ("src", "href")]
        if given.get("http-equiv") == "Content-Security-Policy":
            self.policy = given["content"] or ""

    def handle_endtag(self, tag: str) -> None:
        self.texts.append((f"/{tag}", {}, ""))  # what follows is no text of it

    def handle_data(self, data: str) -> None:
        if self.texts:
            tag, given, text = self.texts[-1]
            self.texts[-1] = (tag, given, text + data)

    def of(self, tag: str) -> list[tuple[dict[str, str | None], str]]:
        return [(given, text) for name, given, text in self.texts if name == tag]


def job(joints: int, seconds: float = 10.0) -> str:
    rows = ", ".join(
        f"{{theta: 0, d: {0.1 * (k % 3)}, a: {0.2 * (k % 2)}, alpha: {90 * (k % 3 - 1)}, velocity: 90}}"
        for k in range(joints)
    )
    points = [[(17 * k + 31 * m) % 90 - 45 for k in range(joints)] for m in range(9)]
    listed = ", ".join(f"{{joints: {point}}}" for point in points)
    return f"""\
version: 1
units: {{angle: deg}}
robot: {{name: chain, convention: standard, joints: [{rows}]}}
start: {{joints: {[0] * joints}}}
moves: [{{planner: spline, through: [{listed}], duration: {seconds}, rule: natural}}]
"""


def page(text: str, *, compress: bool = False) -> bytes:
    return page_of(scene_of_plan(plan_job(job_from_text(text, "chain.yaml"))), compress=compress)


@pytest.mark.parametrize("joints", [1, 6, 7, 12])
def test_ten_seconds_fit(joints: int) -> None:
    assert len(page(job(joints))) <= 800_000
    assert len(page(job(joints), compress=True)) <= 450_000


@pytest.mark.parametrize("compress", [False, True])
def test_the_policy_allows_exactly_what_stands_in_the_page(compress: bool) -> None:
    elements = Elements(page(job(2), compress=compress).decode())
    directives = dict(part.strip().split(" ", 1) for part in elements.policy.split(";"))
    assert directives["default-src"] == "'none'"
    assert "unsafe" not in elements.policy
    assert "http" not in elements.policy

    def hashes(texts: list[str]) -> set[str]:
        return {f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in texts}

    run = [text for given, text in elements.of("script") if "type" not in given]
    if compress:
        run += [
            gzip.decompress(b64decode(text)).decode()
            for given, text in elements.of("script")
            if given.get("id") == "packed-player"
        ]
    assert set(directives["script-src"].split()) == hashes(run)
    assert set(directives["style-src"].split()) == hashes([text for _, text in elements.of("style")])
    assert elements.links == ["data:,"]


def test_names_cannot_leave_the_data() -> None:
    name = "</script><script>alert(1)</script><!--"
    text = job(2).replace("version: 1", f"version: 1\nname: '{name}'")
    elements = Elements(page(text).decode())
    scene = next(content for given, content in elements.of("script") if given.get("id") == "scene")
    assert json.loads(scene)["title"] == name
    assert len(elements.of("script")) == 2
    assert elements.of("title")[0][1] == name


@pytest.mark.full
def test_a_page_is_the_same_each_time() -> None:
    assert page(job(3)) == page(job(3))
    assert page(job(3), compress=True) == page(job(3), compress=True)


def test_the_bundle_was_built_from_the_sources() -> None:
    manifest = json.loads((BUNDLE / "manifest.json").read_text())
    names = [
        "build.js",
        "lean.js",
        "package.json",
        "package-lock.json",
        *(f"src/{path.name}" for path in (SOURCES / "src").iterdir()),
    ]
    now = {name: sha256((SOURCES / name).read_bytes()).hexdigest() for name in names}
    assert manifest["sources"] == now, "run `make player`"


def test_the_bundle_is_what_was_built() -> None:
    manifest = json.loads((BUNDLE / "manifest.json").read_text())
    built = {
        path.name: sha256(path.read_bytes()).hexdigest()
        for path in BUNDLE.iterdir()
        if path.name != "manifest.json"
    }
    assert manifest["files"] == built, "run `make player`"


def test_the_script_is_small() -> None:
    """A wheel has 1.5 MB: whoever needs more of a library says so here."""
    assert (BUNDLE / "player.js.xz").stat().st_size < 120_000


def test_without_lzma_one_line_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lzma", None)
    with pytest.raises(InputError, match="this Python has no module lzma"):
        page(job(1))


def test_versions_are_pinned_and_licences_stand_in_every_page() -> None:
    wanted = json.loads((SOURCES / "package.json").read_text())
    versions = wanted["dependencies"] | wanted["devDependencies"]
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in versions.values())
    text = page(job(1)).decode()
    for name in wanted["dependencies"]:
        assert f"{name} {versions[name]} (MIT)" in text
    assert text.count("The above copyright notice and this permission notice") == 2


def test_limits_by_move_and_findings_are_in_the_scene() -> None:
    loaded = load_job(ROOT / "examples/ur5e_pick.yaml", ["moves.8.duration=0.5"])
    plan = plan_job(loaded)
    scene = scene_of_plan(plan)
    assert scene["verdict"] == {"state": "violated", "text": "1 finding"}  # the move is too short
    assert sorted(index for cause in scene["causes"] for index in cause) == list(
        range(len(scene["findings"]))
    )
    assert [finding["time"] for finding in scene["findings"]] == [f.time for f in plan.verdict.findings]
    rad = 3.141592653589793 / 180
    slow = next(
        part for part in scene["limits"] if part["start"] <= plan.trajectory.spans[1].start < part["end"]
    )
    assert slow["bounds"][1][0] == pytest.approx([-30 * rad, 30 * rad])  # move 1 goes down at 30 deg/s
    assert len(scene["waypoints"]) == 5  # home, above_pick, pick, above_place, place


def test_a_robot_without_geometry_says_so() -> None:
    scene = scene_of_plan(plan_job(load_job(ROOT / "examples/cubic.yaml")))
    assert scene["robot"] is None
    assert "Denavit-Hartenberg" in scene["no_geometry"]


def test_ten_seconds_full_of_jumps_fit() -> None:
    """Blends of twelve joints through many points: their acceleration jumps."""
    text = job(12).partition("moves:")[0].replace("velocity: 90", "velocity: 9000, acceleration: 90000")
    points = ", ".join(f"{{joints: {[(41 * k + 29 * m) % 80 - 40 for k in range(12)]}}}" for m in range(48))
    plan = plan_job(
        job_from_text(
            f"{text}moves: [{{planner: blends, duration: 10, through: [{points}]}}]\n", "chain.yaml"
        )
    )
    assert 9 < plan.trajectory.duration < 12
    assert len(plan.verdict.steps) > 1000
    assert len(page_of(scene_of_plan(plan))) <= 800_000

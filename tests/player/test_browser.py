"""The page in a browser: what is drawn is where kinematics says, it is silent, and it can be played and read."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extras import require_module
from tiers import few

from docs.player_picture import PICTURE, screenshot, wait_until
from trajcli.curves.piecewise import derivative_coefficients
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import Plan, plan_job
from trajcli.player.page import page_of
from trajcli.player.recorded import scene_of_file
from trajcli.player.scene import scene_of_plan

ROOT = Path(__file__).parents[2]
PICK = ROOT / "examples/ur5e_pick.yaml"
PANDA = """\
version: 1
units: {angle: deg, length: mm}
robot: panda
base: {xyz: [300, -200, 700], rpy: [180, 0, 30]}
tool: {xyz: [10, 20, 120], rpy: [0, 15, 40]}
start: {joints: [0, -30, 0, -120, 0, 90, 0]}
moves:
  - {planner: septic, to: {joints: [60, -50, 20, -90, 30, 120, -40]}, duration: 2}
  - {planner: trapezoid, to: {joints: [-40, 10, -20, -140, 0, 60, 50]}, duration: 1.5}
"""
SIGNS = """\
version: 1
robot:
  convention: standard
  joints:
    - {type: prismatic, theta: 0.4, d: 0.2, alpha: 0.7, sign: -1}
    - {theta: 0.3, d: -0.1, a: 0.3, alpha: -1.2, sign: -1}
    - {type: prismatic, theta: -0.9, d: 0.1, a: 0.2, alpha: 0.5}
    - {theta: 1, a: -0.25, d: 0.15}
start: {joints: [0, 0, 0, 0]}
moves: [{planner: cycloidal, to: {joints: [0.4, 2, -0.3, -1]}, duration: 2}]
"""
SIZES = {
    "small": (700, 500),
    "phone": (390, 844),
    "landscape": (844, 390),
    "tablet": (820, 1180),
    "desktop": (1280, 800),
    "wide": (2560, 1300),
}


def planned(source: Path | str) -> Plan:
    return plan_job(load_job(source) if isinstance(source, Path) else job_from_text(source, "job.yaml"))


def written(folder: Path, plan: Plan, *, compress: bool = False) -> Path:
    file = folder / "view.html"
    file.write_bytes(page_of(scene_of_plan(plan), compress=compress))
    return file


@pytest.fixture(scope="module")
def pick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("pick"), planned(PICK))


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Plan]:
    plan = plan_job(load_job(PICK, ["moves.8.duration=0.5"]))
    return written(tmp_path_factory.mktemp("refused"), plan), plan


@pytest.mark.full
@pytest.mark.parametrize(
    "source",
    [
        PICK,
        ROOT / "examples/scara_pick.yaml",
        ROOT / "examples/gantry.yaml",
        ROOT / "examples/helix.yaml",
        ROOT / "examples/two_tools.yaml",
        PANDA,
        SIGNS,
    ],
    ids=["ur5e", "scara", "gantry", "helix", "two_tools", "panda", "signs"],
)
def test_the_tool_is_drawn_where_kinematics_says(
    view: Callable[..., Any], tmp_path: Path, source: Path | str
) -> None:
    plan = planned(source)
    viewed = view(written(tmp_path, plan), 700, 500)
    times = np.append(
        np.random.default_rng(3).uniform(0, plan.trajectory.duration, 8), [0.0, plan.trajectory.duration]
    )
    q, spans = plan.trajectory.curve.evaluate(times), plan.trajectory.spans
    owners = [max(k for k, span in enumerate(spans) if span.start <= time) for time in times]
    expected = np.array([forward(plan.moves[k].robot, row)[:3, 3] for k, row in zip(owners, q, strict=True)])
    drawn = np.array(
        [viewed.page.evaluate("time => trajcli.toolPosition(time)", time) for time in times.tolist()]
    )
    assert np.abs(drawn - expected).max() < 3e-6
    assert viewed.messages == []


@pytest.mark.parametrize("compress", [False, True])
def test_it_asks_for_nothing_and_says_nothing(
    view: Callable[..., Any], tmp_path: Path, compress: bool
) -> None:
    file = written(tmp_path, planned(PICK), compress=compress)
    viewed = view(file)
    viewed.page.evaluate("trajcli.clock.toggle()")
    viewed.page.wait_for_timeout(300)
    viewed.page.keyboard.press("j")
    viewed.page.keyboard.press("d")
    viewed.page.wait_for_timeout(200)
    assert viewed.requests == [file.as_uri()]
    assert viewed.messages == []


def test_keys(view: Callable[..., Any], pick: Path) -> None:
    viewed = view(pick)
    page = viewed.page
    end = page.evaluate("trajcli.clock.end")
    page.keyboard.press("End")
    assert viewed.time() == end
    page.keyboard.press("Home")
    assert viewed.time() == 0
    page.keyboard.press("ArrowRight")
    assert viewed.time() == pytest.approx(1 / 60)
    page.keyboard.press("Shift+ArrowRight")
    assert viewed.time() == pytest.approx(11 / 60)
    page.keyboard.press("ArrowLeft")
    assert viewed.time() == pytest.approx(10 / 60)
    page.keyboard.press("ArrowDown")
    assert viewed.time() == pytest.approx(planned(PICK).trajectory.spans[1].start)
    page.keyboard.press("ArrowUp")
    assert viewed.time() == 0
    page.keyboard.press("+")
    assert page.evaluate("trajcli.clock.speed") == 2
    page.keyboard.press("-")
    page.keyboard.press("-")
    assert page.evaluate("trajcli.clock.speed") == 0.5
    page.keyboard.press("Space")
    wait_until(page, "trajcli.clock.time > 0.05")
    page.keyboard.press("Space")
    assert not page.evaluate("trajcli.clock.playing")
    page.keyboard.press("?")
    assert page.locator("dialog").is_visible()
    page.keyboard.press("Escape")
    assert not page.locator("dialog").is_visible()


@pytest.mark.full
def test_playing_ends_at_the_end_and_may_repeat(view: Callable[..., Any], pick: Path) -> None:
    page = view(pick).page
    page.evaluate("trajcli.clock.setSpeed(4); trajcli.seek(6.7); trajcli.clock.toggle()")
    wait_until(page, "!trajcli.clock.playing")
    assert page.evaluate("trajcli.clock.time === trajcli.clock.end")
    page.keyboard.press("l")
    page.evaluate("trajcli.seek(6.7); trajcli.clock.toggle()")
    wait_until(page, "trajcli.clock.playing && trajcli.clock.time < 3")


@pytest.mark.full
def test_the_time_line_is_dragged(view: Callable[..., Any], pick: Path) -> None:
    viewed = view(pick)
    box = viewed.page.locator(".track").bounding_box()
    middle = box["y"] + box["height"] / 2
    viewed.page.mouse.move(box["x"] + 0.25 * box["width"], middle)
    viewed.page.mouse.down()
    duration = viewed.page.evaluate("trajcli.clock.end")
    assert viewed.time() == pytest.approx(0.25 * duration, abs=0.02)
    viewed.page.mouse.move(box["x"] + 0.75 * box["width"], middle + 60)  # beside the line it still holds
    assert viewed.time() == pytest.approx(0.75 * duration, abs=0.02)
    viewed.page.mouse.up()
    viewed.page.mouse.move(box["x"], middle)
    assert viewed.time() == pytest.approx(0.75 * duration, abs=0.02)


@pytest.mark.full
def test_a_click_in_a_plot_seeks_and_all_cursors_follow(view: Callable[..., Any], pick: Path) -> None:
    viewed = view(pick)
    plot = viewed.page.locator(".u-over").nth(1)
    box = plot.bounding_box()
    viewed.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 20)
    duration = viewed.page.evaluate("trajcli.clock.end")
    assert viewed.time() == pytest.approx(0.5 * duration, abs=0.03)
    places = viewed.page.evaluate(
        "[...document.querySelectorAll('.playhead')].map(e => e.getBoundingClientRect().x)"
    )
    assert len(places) == 3
    assert places == pytest.approx([box["x"] + 0.5 * box["width"]] * 3, abs=2)


@pytest.mark.full
def test_plots_hold_the_curves_on_both_sides_of_breaks(view: Callable[..., Any], tmp_path: Path) -> None:
    plan = planned(ROOT / "examples/trapezoid.yaml")
    viewed = view(written(tmp_path, plan))
    curve, (first, second) = plan.trajectory.curve, plan.trajectory.curve.breaks[1:3]
    middle = (first + second) / 2
    values = viewed.page.evaluate("t => trajcli.motion.value('qdd', 0, t)", middle)
    stated = np.abs(derivative_coefficients(curve.coefficients, 2)[0])
    low, high = stated.min(), stated.max()
    assert values == pytest.approx(curve.evaluate(middle, 2)[0], abs=1e-4 * high + low * 1e-9)
    for time in (first, second):
        rows = viewed.page.evaluate(
            "t => [...trajcli.motion.times].flatMap((time, k) => time === t ? [trajcli.motion.values.qdd[0][k]] : [])",
            time,
        )
        sides = [curve.evaluate(time, 2, side=side)[0] for side in ("left", "right")]
        assert rows == pytest.approx(sides, abs=1e-4 * high)


@pytest.mark.full
def test_a_joint_at_rest_has_no_velocity(view: Callable[..., Any], pick: Path) -> None:
    hold = planned(PICK).trajectory.spans[2]
    values = "t => ['qd', 'qdd'].flatMap(name => trajcli.motion.values[name].map((_, joint) => trajcli.motion.value(name, joint, t)))"
    assert view(pick).page.evaluate(values, (hold.start + hold.end) / 2) == [0] * 12


@pytest.mark.full
def test_a_load_is_drawn_while_it_is_carried(view: Callable[..., Any], tmp_path: Path) -> None:
    plan = planned(ROOT / "examples/pick_carry_place.yaml")
    page = view(written(tmp_path, plan)).page
    assert page.locator(".joints thead th").all_inner_texts()[-2:] == ["τ N m", "use"]
    assert page.locator("[data-quantity=tau] canvas").count() == 1
    assert page.locator("[data-quantity=tau] .limit-key").count() == 1
    span, robot = plan.trajectory.spans[2], plan.moves[2].robot
    ball = """time => { trajcli.seek(time); const { mesh } = trajcli.stage.loads.all[0]; const { elements } = mesh.matrixWorld;
        return [mesh.visible, elements[12], elements[13], elements[14]]; }"""
    for time, carried in (
        (0.0, False),
        (span.start - 1e-6, False),
        (span.start, True),
        (0.3 * span.start + 0.7 * span.end, True),
        (span.end, False),
        (plan.trajectory.duration, False),
    ):
        visible, *place = page.evaluate(ball, time)
        assert visible == carried
        pose = forward(robot, plan.trajectory.curve.evaluate(time))
        assert place == pytest.approx((pose @ [0, 0, 0.08, 1])[:3].tolist(), abs=3e-6)
        shown = "visible" if carried else "hidden"  # with the next frame
        wait_until(page, f"document.querySelector('.label.load').style.visibility === '{shown}'", 10)


@pytest.mark.full
def test_zones_signals_and_the_move_of_now(view: Callable[..., Any], tmp_path: Path) -> None:
    plan = planned(ROOT / "examples/signals.yaml")
    viewed = view(written(tmp_path, plan))
    page = viewed.page
    (zone,) = plan.flyby.zones if plan.flyby is not None else ()
    balls = "trajcli.stage.zones.group.children.filter(one => one.geometry.type === 'SphereGeometry').map(one => [...one.position.toArray(), one.scale.x])"
    corner = forward(plan.loaded.robot, zone.programmed[len(zone.programmed) // 2])[:3, 3]
    assert page.evaluate(balls)[0] == pytest.approx([*corner, 0.015], abs=1e-6)
    assert page.evaluate("trajcli.stage.zones.dashes.count") > 10
    page.keyboard.press("z")
    assert not page.evaluate("trajcli.stage.zones.group.visible")
    assert page.locator(".lane-name").all_inner_texts() == ["pressure", "glue"]
    lit = "[...document.querySelectorAll('.move')].findIndex(one => one.classList.contains('current'))"
    for index, span in enumerate(span for span in plan.trajectory.spans if not span.handles):
        page.evaluate("t => trajcli.seek(t)", (span.start + span.end) / 2)
        assert page.locator(".status-move").inner_text() == f"{span.index} {span.title}"
        assert page.evaluate(lit) == index
    time = 0.4
    page.evaluate(f"trajcli.seek({time})")
    position, angles, speed = page.locator(".status-tool > span").all_inner_texts()
    pose = forward(plan.loaded.robot, plan.trajectory.curve.evaluate(time))
    numbers = [float(word.replace("\N{MINUS SIGN}", "-")) for word in position.split()[1:4]]
    assert numbers == pytest.approx(1e3 * pose[:3, 3], abs=0.051)
    roll, pitch, yaw = (
        np.deg2rad(float(word.replace("\N{MINUS SIGN}", "-"))) for word in angles.split()[1:4]
    )
    turned = np.eye(3)
    for axis, angle in ((0, roll), (1, pitch), (2, yaw)):  # about the fixed axes x, y, z, in this order
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        about = np.eye(3)
        about[i, i] = about[j, j] = np.cos(angle)
        about[i, j], about[j, i] = -np.sin(angle), np.sin(angle)
        turned = about @ turned
    assert np.abs(turned - pose[:3, :3]).max() < 2e-3
    nearby = forward(plan.loaded.robot, plan.trajectory.curve.evaluate([time - 1e-4, time + 1e-4]))
    assert float(speed.split()[0]) == pytest.approx(
        1e3 * np.linalg.norm(np.diff(nearby[:, :3, 3], axis=0)) / 2e-4, rel=0.02
    )
    assert viewed.messages == []


@pytest.mark.full
def test_bars_of_use_name_the_limit_of_which_a_joint_uses_most(
    view: Callable[..., Any], tmp_path: Path
) -> None:
    job = """\
version: 1
units: {angle: deg}
robot: {joints: [{velocity: [-80, 50], acceleration: 100}, {}]}
start: {joints: [0, 0]}
moves:
  - {planner: trapezoid, to: {joints: [40, 0]}, velocity: 40, acceleration: 100}
  - {planner: trapezoid, to: {joints: [0, 0]}, velocity: 40, acceleration: 50}
"""
    plan = planned(job)
    page = view(written(tmp_path, plan)).page
    bar = "time => { trajcli.seek(time); const [one, other] = document.querySelectorAll('.use-bar'); return [one.title, one.innerText, other.hidden]; }"
    # 40 deg/s at 100 deg/s^2: 0.4 s to speed, 1 s to the end of the cruise; back at 50 deg/s^2: 0.8 s to speed.
    turned = plan.trajectory.spans[1].start
    for time, words, percent in (
        (0.1, "acceleration: 100.0 of 100.0 deg/s²", 100),
        (0.7, "velocity: 40.00 of 50.00 deg/s", 80),
        (turned + 0.01, "acceleration: −50.00 of −100.0 deg/s²", 50),
        (turned + 0.9, "velocity: −40.00 of −80.00 deg/s", 50),
    ):
        assert page.evaluate(bar, time) == [f"{words}, {percent} % used", f"{percent} %", True]


@pytest.mark.full
def test_the_values_under_the_pointer_are_shown(view: Callable[..., Any], pick: Path) -> None:
    page = view(pick).page
    plot = page.locator(".u-over").nth(1)
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + 30)
    shown = page.locator(".values:visible")
    assert shown.count() == 1
    lines = shown.inner_text().split()
    time = float(lines[0])
    curve = planned(PICK).trajectory.curve
    assert time == pytest.approx(0.75 * curve.end, abs=0.03)
    assert float(lines[-1].replace("\N{MINUS SIGN}", "-")) == pytest.approx(
        np.rad2deg(curve.evaluate(time, 1)[-1]), rel=0.01
    )


def test_findings_of_one_cause_are_one_and_the_page_opens_there(
    view: Callable[..., Any], refused: tuple[Path, Plan]
) -> None:
    file, plan = refused
    findings = plan.verdict.findings
    assert len(findings) == 7  # a move that is too short: velocity, acceleration and jerk of several joints
    viewed = view(file)
    page = viewed.page
    assert page.locator(".verdict.violated").inner_text() == "1 finding"
    assert page.locator(".line.bad").count() == page.locator(".hint").count() == 1
    worst = max(findings, key=lambda finding: abs((finding.value or 0) / (finding.limit or 1)))
    assert viewed.time() == pytest.approx(worst.time)
    page.keyboard.press("Home")
    page.locator(".line.bad").first.click()
    assert viewed.time() == pytest.approx(worst.time)
    page.locator(".alike summary").click()
    page.locator(".line.bad").nth(6).wait_for()  # a browser tells a list later that it was opened
    assert page.locator(".line.bad").count() == 7
    page.locator(".line.bad").nth(3).click()
    others = [finding for finding in findings if finding is not worst]
    assert viewed.time() == pytest.approx(others[2].time)
    assert page.locator(".mark").count() == 7
    assert viewed.messages == []


@pytest.mark.full
def test_the_jerk_is_shown_when_asked_for(view: Callable[..., Any], pick: Path) -> None:
    page = view(pick).page
    assert page.locator(".plot:visible h3 > :first-child").all_inner_texts() == [
        "Position q",
        "Velocity q̇",
        "Acceleration q̈",
    ]
    page.get_by_text("Jerk", exact=True).first.click()
    assert page.locator(".plot:visible").count() == 4
    assert page.locator(".plot:visible canvas").count() == 4


@pytest.mark.full
def test_joints_have_plots_of_their_own(view: Callable[..., Any], pick: Path) -> None:
    viewed = view(pick)
    page = viewed.page
    page.keyboard.press("p")
    assert page.locator(".plot:visible canvas").count() == 18  # 6 joints: q, qd, qdd
    page.locator(".joint").nth(2).click()
    assert page.locator(".plot:visible").count() == 15
    page.keyboard.press("j")
    assert page.locator(".plot:visible").count() == 20
    shown = "trajcli.plots.cards.map(card => card.plot?.series.slice(1).filter(one => one.show).length ?? 0)"
    assert set(page.evaluate(shown)) == {0, 1}
    page.keyboard.press("p")
    assert page.locator(".plot:visible").count() == 4
    assert viewed.messages == []


@pytest.mark.full
@pytest.mark.parametrize("source", ["scara_pick", "gantry", "ur5e_pick"])
def test_the_first_view_has_the_whole_arm_and_tool(
    view: Callable[..., Any], tmp_path: Path, source: str
) -> None:
    plan = planned(ROOT / f"examples/{source}.yaml")
    page = view(written(tmp_path, plan), 900, 700).page
    seen = """time => { trajcli.seek(time); const { arm, camera } = trajcli.stage;
        const inside = [];
        arm.root.traverse((part) => {
          if (!part.isMesh || !part.visible || !part.parent.visible) return;
          const place = part.geometry.getAttribute('position');
          for (let k = 0; k < place.count; k += 1) {
            const point = part.position.clone().set(place.getX(k), place.getY(k), place.getZ(k));
            const { x, y, z } = point.applyMatrix4(part.matrixWorld).project(camera);
            inside.push(Math.max(Math.abs(x), Math.abs(y), z));
          }
        });
        return Math.max(...inside); }"""
    for time in np.linspace(0, plan.trajectory.duration, 9).tolist():
        assert page.evaluate(seen, time) < 1


@pytest.mark.full
def test_joints_can_be_hidden(view: Callable[..., Any], pick: Path) -> None:
    page = view(pick).page
    page.locator(".joint").nth(2).click()
    assert page.evaluate("[...trajcli.plots.hidden]") == [2]
    assert page.locator(".joint[aria-pressed=false]").count() == 1


@pytest.mark.full
def test_parts_of_the_view_can_be_hidden(view: Callable[..., Any], pick: Path) -> None:
    page = view(pick).page
    shown = "[trajcli.stage.ghosts.visible, trajcli.stage.trace.line.visible, trajcli.stage.grid.visible, trajcli.stage.arm.axes[0].visible]"
    assert page.evaluate(shown) == [True, True, True, False]
    for key in "gtrf":
        page.keyboard.press(key)
    assert page.evaluate(shown) == [False, False, False, True]


def test_dark_and_light(view: Callable[..., Any], pick: Path) -> None:
    page = view(pick, color_scheme="dark").page
    background = (
        "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number).reduce((a, b) => a + b)"
    )
    assert page.evaluate(background) < 150
    page.keyboard.press("d")
    assert page.evaluate(background) > 600
    page.emulate_media(color_scheme="light")
    page.keyboard.press("d")
    assert page.evaluate(background) < 150  # chosen


LAYOUT = """() => {
  const box = (selector) => document.querySelector(selector).getBoundingClientRect();
  const [header, view, transport, aside] = ['header', '.viewport', '.transport', 'aside'].map(box);
  const apart = (a, b) => a.right <= b.left + 0.5 || b.right <= a.left + 0.5 || a.bottom <= b.top + 0.5 || b.bottom <= a.top + 0.5;
  const parts = { header, view, transport, aside };
  const overlaps = [];
  const among = (boxes) => Object.entries(boxes).forEach(([name, a], k, all) =>
    all.slice(k + 1).forEach(([other, b]) => apart(a, b) || overlaps.push(`${name} and ${other}`)));
  among(parts);
  const named = (selector) => Object.fromEntries([...document.querySelectorAll(selector)].map((e, k) => [`${selector} ${k}`, e.getBoundingClientRect()]));
  among(named('.controls button, .controls select, .controls .time'));
  among(named('header > *'));
  among({ ...named('.viewport .chip'), ...named('.legend > *') });
  among(named('aside > *'));
  const outside = [...document.querySelectorAll('button, select, h1, .verdict, .legend > *, .joints td')].filter((e) => {
    const { left, right, width } = e.getBoundingClientRect();
    return width && (left < -0.5 || right > innerWidth + 0.5);
  }).map((e) => e.outerHTML);
  const wide = [document.documentElement, document.body, document.querySelector('aside'), document.querySelector('.joints')].filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) => e.tagName);
  return { overlaps, outside, wide, view: [view.width, view.height], scrolls: document.documentElement.scrollHeight > innerHeight };
}"""


@pytest.mark.full
@pytest.mark.parametrize("size", SIZES)
def test_nothing_overlaps_and_nothing_is_cut(
    view: Callable[..., Any], refused: tuple[Path, Plan], size: str
) -> None:
    width, height = SIZES[size]
    page = view(refused[0], width, height).page
    layout = page.evaluate(LAYOUT)
    assert [layout[flaw] for flaw in ("overlaps", "outside", "wide")] == [[], [], []]
    assert not layout["scrolls"]
    assert layout["view"][0] >= 0.5 * min(width, 1000)
    assert layout["view"][1] >= 0.28 * height


def pixels(png: bytes | Path) -> np.ndarray:
    from PIL import Image

    with Image.open(io.BytesIO(png) if isinstance(png, bytes) else png) as image:
        return np.asarray(image.convert("RGB"), dtype=float)


@pytest.mark.parametrize(
    ("size", "scheme"),
    few([("phone", "light"), ("desktop", "light"), ("desktop", "dark"), ("phone", "dark")], 2),
)
def test_the_arm_and_the_curves_are_drawn(
    view: Callable[..., Any], pick: Path, size: str, scheme: str
) -> None:
    page = view(pick, *SIZES[size], color_scheme=scheme).page
    page.evaluate(
        "for (const e of document.querySelectorAll('.viewport div')) e.hidden = true"
    )  # buttons, legend
    page.wait_for_timeout(300)
    view_in_space = pixels(page.locator(".viewport").screenshot())
    red, green, blue = np.moveaxis(view_in_space, 2, 0)
    joints = (blue > 2 * red) & (blue > 1.35 * green) & (blue > 110)
    assert 0.007 < joints.mean() < 0.1  # the balls at the joints; without them 0.001 to 0.004 has such a blue
    assert 0.4 < (np.abs(view_in_space - view_in_space[-1, -1]).max(axis=2) < 25).mean() < 0.97  # background
    plot = pixels(page.locator(".plot-room").first.screenshot())
    colorful = np.ptp(plot, axis=2) > 60
    assert colorful.mean() > 0.004


@pytest.mark.full
def test_the_picture_of_the_documents_is_what_is_drawn(chromium: Any) -> None:
    require_module("PIL")
    now, then = pixels(screenshot(chromium)), pixels(PICTURE)
    assert now.shape == then.shape
    # Fonts, and the rounding of a graphics card, differ from machine to machine: cells of 20 pixels are compared.
    now, then = (each.reshape(38, 20, 60, 20, 3).mean(axis=(1, 3)) for each in (now, then))
    assert np.abs(now - then).max() < 40, "run `make picture`, and look at it"
    assert np.abs(now - then).mean() < 3, "run `make picture`, and look at it"


@pytest.mark.full
def test_a_file_without_a_robot_has_plots_only(view: Callable[..., Any], tmp_path: Path) -> None:
    recorded = tmp_path / "recorded.csv"
    recorded.write_text("t,q1_deg,q2_mm\n" + "".join(f"{5 + k / 10},{k * k},{-k}\n" for k in range(21)))
    file = tmp_path / "view.html"
    file.write_bytes(page_of(scene_of_file(str(recorded))))
    viewed = view(file)
    assert "--robot" in viewed.page.locator(".viewport").inner_text()
    assert viewed.page.locator(".plot:visible").count() == 1
    assert viewed.page.locator(".viewport canvas").count() == 0
    viewed.page.evaluate("trajcli.seek(6.05)")
    q = viewed.page.evaluate("trajcli.joints(6.05)")
    assert q == pytest.approx([np.deg2rad((100 + 121) / 2), -10.5e-3], abs=1e-6)  # straight between rows
    assert viewed.messages == []


@pytest.mark.full
def test_a_motion_of_no_length(view: Callable[..., Any], tmp_path: Path) -> None:
    text = (
        PANDA[: PANDA.index("moves:")]
        + "moves: [{planner: jerk_limited, to: {joints: [0, -30, 0, -120, 0, 90, 0]}, limits: {jerk: 100, acceleration: 100}}]\n"
    )
    viewed = view(written(tmp_path, planned(text)))
    for key in ("ArrowRight", "End", "Space", "Home", "j"):
        viewed.page.keyboard.press(key)
    viewed.page.wait_for_timeout(200)
    assert viewed.messages == []
    assert viewed.page.locator(".plot:visible canvas").count() == 4
    assert viewed.page.locator(".now").inner_text() == "0.000"


@pytest.mark.full
def test_without_webgl_there_are_plots(chromium: Any, pick: Path) -> None:
    context = chromium.new_context(offline=True)
    page = context.new_page()
    page.add_init_script(
        "HTMLCanvasElement.prototype.getContext = (get => function (kind, ...rest) { return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest); })(HTMLCanvasElement.prototype.getContext)"
    )
    page.goto(pick.as_uri())
    wait_until(page, "window.trajcli?.ready")
    assert "plots only" in page.locator(".viewport").inner_text()
    assert page.locator(".plot:visible canvas").count() == 3
    context.close()

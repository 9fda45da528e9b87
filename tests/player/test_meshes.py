"""A page with the visual meshes of a URDF: in their colours, without a word to the console."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.player.conftest import Viewed
from trajcli.job.read import load_job
from trajcli.planning.plan import plan_job
from trajcli.player.page import page_of
from trajcli.player.scene import scene_of_plan

ARM = """<robot name="arm">
<link name="base"><visual><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.1" length="0.2"/></geometry><material name="r"><color rgba="1 0 0 1"/></material></visual></link>
<link name="upper"><visual><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.1 0.1"/></geometry><material name="g"><color rgba="0 1 0 1"/></material></visual></link>
<link name="hand"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="2"/></joint>
<joint name="end" type="fixed"><parent link="upper"/><child link="hand"/><origin xyz="0.4 0 0"/></joint>
</robot>"""


def test_meshes_are_drawn_in_their_colours(tmp_path: Path, view: Callable[..., Viewed]) -> None:
    from PIL import Image

    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "job.yaml").write_text(
        "version: 1\nrobot: {urdf: arm.urdf}\nlimits: {acceleration: 5}\nstart: {joints: [0]}\n"
        "moves: [{planner: trapezoid, to: {joints: [0.5]}}]\n"
    )
    plan = plan_job(load_job(tmp_path / "job.yaml"))
    counts = []
    for budget in (0.5, 0.0):
        (tmp_path / "page.html").write_bytes(page_of(scene_of_plan(plan, budget)))
        shown = view(tmp_path / "page.html", 1000, 700)
        pixels = np.asarray(Image.open(io.BytesIO(shown.page.screenshot())).convert("RGB"), int)
        red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
        counts.append(
            [int((red > 2 * green + 2 * blue + 40).sum()), int((green > 2 * red + 2 * blue + 40).sum())]
        )
        assert shown.messages == []
        assert all(address.startswith("file:") for address in shown.requests)
    assert min(counts[0]) > 1000
    assert max(counts[1]) < min(counts[0]) / 3

"""What joints that are found back from rows of the tool are known to: their decimals cover what rounding of the rows makes.

Rows are made of smooth joints by the forward kinematics and the Jacobian, and rounded to some decimals of metres or of
millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from judge.rows.test_joints_found_back import TOOLS, TWO_MOVES, planned

import trajcli
from trajcli.geometry.rotation import quaternion_from_matrix
from trajcli.judge.rows.tool_rows import joints_found_back
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import jacobian_dot_qd, tcp_twist
from trajcli.output.delivery.joined import write_plan
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.row_sources import EXACT, ArrayRows

ROOT = Path(__file__).resolve().parents[3]
T = np.linspace(0.0, 0.5, 11)
BENT = np.array([0.2, -1.3, 1.6, -1.4, 1.2, 0.3, 0.4])  # far from singularities
LENGTHS = ("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az")
GROUPS = {
    "pose": ("x", "y", "z", "qw", "qx", "qy", "qz"),
    "twist": ("vx", "vy", "vz", "wx", "wy", "wz"),
    "twistd": ("ax", "ay", "az", "ex", "ey", "ez"),
}


def joints(start: np.ndarray) -> list[np.ndarray]:
    """Return joints that turn by 0.1 rad and back, with two derivatives, each (N, n)."""
    way = 0.1 * np.cos(np.arange(start.size))
    u = 4.0 * T[:, None]
    return [start + np.sin(u) * way, 4.0 * np.cos(u) * way, -16.0 * np.sin(u) * way]


def table(name: str, start: np.ndarray, groups: Sequence[str]) -> dict[str, np.ndarray]:
    """Return columns of the tool of an arm, in SI."""
    robot, (q, qd, qdd) = trajcli.load_robot(name), joints(start)
    poses = forward(robot, q)
    pose = np.hstack([poses[:, :3, 3], quaternion_from_matrix(poses[:, :3, :3])])
    twistd = tcp_twist(robot, q, qdd) + jacobian_dot_qd(robot, q, qd)
    values = {"pose": pose, "twist": tcp_twist(robot, q, qd), "twistd": twistd}
    return {"t": T} | {kind: values[group][:, k] for group in groups for k, kind in enumerate(GROUPS[group])}


def written(file: Path, columns: dict[str, np.ndarray], decimals: int, *, mm: bool) -> None:
    """Write columns with some decimals of m and rad; lengths in mm have three less."""
    names, texts = [], []
    for name, values in columns.items():
        length = mm and name in LENGTHS
        names.append(f"{name}_mm" if length else name)
        texts.append([f"{v * 1e3:.{decimals - 3}f}" if length else f"{v:.{decimals}f}" for v in values])
    lines = [",".join(names), *(",".join(row) for row in zip(*texts, strict=True))]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def found(file: Path, name: str, start: np.ndarray) -> ArrayRows | None:
    """Return the joints of an arm that stands where its rows begin."""
    plan = SimpleNamespace(
        moves=[], trajectory=SimpleNamespace(start=SimpleNamespace(position=start), spans=[])
    )
    return joints_found_back(ByteSource(str(file)), trajcli.load_robot(name), plan)  # type: ignore[arg-type]


@pytest.mark.parametrize("mm", [False, True])
@pytest.mark.parametrize("decimals", [7, 9])
@pytest.mark.parametrize("wrist", [1.2, 0.35, 0.1, 0.08])
def test_decimals_of_joints_cover_what_rounding_of_poses_and_rates_makes(
    wrist: float, decimals: int, *, mm: bool, tmp_path: Path
) -> None:
    """And not a hundred times as much of positions, nor a thousand times of rates, of which a straighter wrist loses more."""
    file, bent = tmp_path / "rows.csv", np.where(np.arange(6) == 4, wrist, BENT[:6])
    written(file, table("ur5e", bent, ("pose", "twist", "twistd")), decimals, mm=mm)
    back = found(file, "ur5e", joints(bent)[0][0])
    assert back is not None
    (block,) = back.blocks(range(19), ())
    half = 0.5 * 10.0 ** -back.decimals(range(19)).astype(float)
    assert half[0] == 0.5 * 10.0**-decimals
    for order in range(3):
        at = slice(1 + 6 * order, 7 + 6 * order)
        off = np.abs(block[:, at] - joints(bent)[order]).max()
        assert 0.0 < off <= half[at].min()
        assert half[at].max() <= (1e3 if order else 1e2) * off


@pytest.mark.parametrize(
    ("groups", "decimals"),
    [(("pose", "twist", "twistd"), 4), (("twist", "twistd"), 3)],
    ids=["poses", "rates"],
)
def test_joints_of_few_decimals_are_not_taken_for_exact(
    groups: tuple[str, ...], decimals: int, tmp_path: Path
) -> None:
    """Where all decimals are lost one is left: numbers without any are taken as they are."""
    bent = np.where(np.arange(6) == 4, 0.08, BENT[:6])
    written(tmp_path / "rows.csv", table("ur5e", bent, groups), decimals, mm=False)
    back = found(tmp_path / "rows.csv", "ur5e", joints(bent)[0][0])
    assert back is not None
    assert back.decimals(range(len(back.named.names))).min() == 1


def test_joints_of_rows_that_were_not_rounded_are_not_either(tmp_path: Path) -> None:
    columns = table("ur5e", BENT[:6], ("pose", "twist", "twistd"))
    rows = np.zeros(T.size, [(name, "f8") for name in columns])
    for name, values in columns.items():
        rows[name] = values
    np.save(tmp_path / "rows.npy", rows)
    back = found(tmp_path / "rows.npy", "ur5e", joints(BENT[:6])[0][0])
    assert back is not None
    assert back.decimals(range(19)).tolist() == [EXACT] * 19


@pytest.mark.parametrize(
    ("name", "start", "known"),
    [
        ("ur5e", BENT[:6], True),
        ("ur5e", BENT[:6] * [1, 1, 1, 1, 0, 1] + [0, 0, 0, 0, -0.1 * np.cos(4) * np.sin(2) + 1e-4, 0], False),
        ("iiwa14", np.array([0.1, 0.5, 0.2, -1.2, 0.3, 0.9, 0.1]), False),
    ],
    ids=["regular", "the wrist is nearly straight at the end", "seven joints"],
)
def test_rates_of_joints_are_those_of_the_tool_where_it_tells_them(
    name: str, start: np.ndarray, tmp_path: Path, *, known: bool
) -> None:
    file, begins = tmp_path / "rows.csv", joints(start)[0][0]
    written(file, table(name, start, ("pose", "twist")), 15, mm=False)
    back = found(file, name, begins)
    assert back is not None
    assert any(each.startswith("qd") for each in back.named.names) is known


@pytest.mark.parametrize("lost", ["t", "qw", None])
def test_rows_that_name_no_joints_are_none(lost: str | None, tmp_path: Path) -> None:
    """Without times nothing is found back; of positions without turns what an arm of three slides does, and no rates."""
    columns = table("ur5e", BENT[:6], ("twist",) if lost == "qw" else ("pose",))
    columns = {
        name: values for name, values in columns.items() if name not in (lost, "wx" if lost == "qw" else "")
    }
    written(tmp_path / "rows.csv", columns, 9, mm=False)
    back = found(tmp_path / "rows.csv", "ur5e", joints(BENT[:6])[0][0])
    assert (back is None) == (lost is not None)


def test_an_arm_without_geometry_has_no_tool_to_find_it_by(tmp_path: Path) -> None:
    written(tmp_path / "rows.csv", table("ur5e", BENT[:6], ("pose",)), 9, mm=False)
    (tmp_path / "robot.yaml").write_text("{joints: 6}", encoding="utf-8")
    assert found(tmp_path / "rows.csv", str(tmp_path / "robot.yaml"), BENT[:6]) is None


@pytest.mark.parametrize(("job", "mm"), [(TWO_MOVES, True), (TOOLS, False)])
def test_decimals_of_joints_cover_what_rounding_of_distances_makes(
    job: str, tmp_path: Path, *, mm: bool
) -> None:
    """Distances of 6 decimals of a metre; the moves of the rows come with them."""
    plan, file = planned(job, "[t, path, move]"), tmp_path / "rows.csv"
    write_plan(plan, str(file), "full")
    head, *lines = file.read_text(encoding="utf-8").splitlines()
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    rounded = (
        ",".join([f"{t:.9f}", *(f"{v:.{3 if mm else 6}f}" for v in s), f"{m:.0f}"]) for t, *s, m in values
    )
    file.write_text("\n".join([head, *rounded]) + "\n", encoding="utf-8")
    back = joints_found_back(ByteSource(str(file)), plan.loaded.robot_of_rows, plan)
    assert back is not None
    assert (back.named.names[0], back.named.names[-1]) == ("t", "move")
    (block,) = back.blocks(range(20), ())
    assert block[:, -1].tolist() == values[:, -1].tolist()
    half = 0.5 * 10.0 ** -back.decimals(range(20)).astype(float)
    for order, too_much in enumerate((1e2, 1e3, 1e3)):
        at = slice(1 + 6 * order, 7 + 6 * order)
        off = np.abs(
            block[:, at]
            - plan.trajectory.curve.evaluate(np.minimum(values[:, 0], plan.trajectory.duration), order)
        )
        assert 0.0 < off.max() <= half[at].min()
        assert half[at].max() <= too_much * off.max()


def test_joints_of_distances_in_whole_millimetres_are_not_taken_for_exact(tmp_path: Path) -> None:
    plan, file = planned(TWO_MOVES, "[t, path]"), tmp_path / "rows.csv"
    write_plan(plan, str(file), "full")
    head, *lines = file.read_text(encoding="utf-8").splitlines()
    rows = ([float(cell) for cell in line.split(",")] for line in lines)
    texts = (",".join([f"{t:.9f}", *(f"{v:.0f}" for v in s)]) for t, *s in rows)
    file.write_text("\n".join([head, *texts]) + "\n", encoding="utf-8")
    back = joints_found_back(ByteSource(str(file)), plan.loaded.robot_of_rows, plan)
    assert back is not None
    assert back.decimals(range(1, 19)).min() == 1


@pytest.mark.parametrize(("lengths", "turns"), [(9, 6), (6, 9)])
@pytest.mark.parametrize("groups", [("pose",), ("twist", "twistd")], ids=["poses", "rates"])
def test_joints_are_known_as_well_as_the_coarser_of_places_and_turns(
    groups: tuple[str, ...], lengths: int, turns: int, tmp_path: Path
) -> None:
    """A place in mm has three decimals more than it is written with, a quaternion has not."""
    columns = table("ur5e", BENT[:6], groups)
    rounded = {
        name: np.round(values, lengths if name in LENGTHS else turns) for name, values in columns.items()
    }
    text = [
        [f"{v:.{lengths if name in LENGTHS else 6 if name == 't' else turns}f}" for v in values]
        for name, values in rounded.items()
    ]
    lines = [",".join(columns), *(",".join(row) for row in zip(*text, strict=True))]
    (tmp_path / "rows.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    back = found(tmp_path / "rows.csv", "ur5e", joints(BENT[:6])[0][0])
    assert back is not None
    (block,) = back.blocks(range(7), ())
    off = np.abs(block[:, 1:] - joints(BENT[:6])[0]).max()
    half = 0.5 * 10.0 ** -float(back.decimals(range(7))[1:].min())
    assert half >= 5e-6 if groups == ("pose",) else half >= 5e-4
    assert half >= min(off, 5e-6)


def test_turns_that_stay_as_they_are_may_be_whole_numbers(tmp_path: Path) -> None:
    """The tool of a gantry points down: its quaternion is written 0,1,0,0, and x, which stays, as 0.3."""
    gantry, start = str(ROOT / "examples" / "robots" / "gantry.yaml"), np.array([0.3, 0.2, 0.2])
    columns = table(gantry, start, ("pose",))
    assert np.ptp(columns["qx"]) < 1e-12
    columns["x"][:], decimals = 0.3, {"x": 1, "y": 6, "z": 6, "t": 6}
    text = [[f"{v + 0.0:.{decimals.get(name, 0)}f}" for v in values] for name, values in columns.items()]
    lines = [",".join(columns), *(",".join(row) for row in zip(*text, strict=True))]
    (tmp_path / "rows.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    back = found(tmp_path / "rows.csv", gantry, joints(start)[0][0])
    assert back is not None
    assert back.decimals(range(4)).tolist() == [6, 5, 5, 5]

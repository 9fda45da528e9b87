"""The columns about the tool through the command line: what `fk` says of the same rows, and what `diff` does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from running import EXAMPLES, call

from trajcli.streams.table import Table, read_csv

EXAMPLE = EXAMPLES / "ur5e_pose_columns.yaml"
DEG_MM = ["--set", "units={angle: deg, length: mm}"]


def planned(capfd: pytest.CaptureFixture[str], path: Path, *arguments: str) -> Table:
    """Return the rows of the example, which are also in the file."""
    assert call(capfd, "plan", EXAMPLE, "-o", path, *arguments).code == 0
    return read_csv(str(path))


@pytest.mark.parametrize("units", [[], DEG_MM], ids=["SI", "deg and mm"])
def test_poses_are_those_of_fk(units: list[str], tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rows.csv"
    rows = planned(capfd, path, *units, "--set", "output.columns=[t, q, pose]")
    done = call(capfd, "fk", "--robot", "ur5e", "--si", "-", stdin=path.read_text(encoding="utf-8"))
    assert done.code == 0, done.err
    (tmp_path / "fk.csv").write_text(done.out, encoding="utf-8")
    peer = read_csv(str(tmp_path / "fk.csv"))
    assert peer.names == ("t", "x", "y", "z", "qw", "qx", "qy", "qz")
    lengths = 1e-3 if units else 1.0
    found = rows.columns[:, -7:] * ([lengths] * 3 + [1.0] * 4)
    assert len(peer.columns) == len(rows.columns) == 85
    np.testing.assert_allclose(found, peer.columns[:, 1:], rtol=0, atol=1e-8)


def test_diff_compares_them_in_any_units(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    si, other, changed = (tmp_path / name for name in ("si.csv", "other.csv", "changed.csv"))
    planned(capfd, si)
    names = planned(capfd, other, *DEG_MM).names
    assert names[1:8] == ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")
    assert names[11:14] == ("wx_deg", "wy_deg", "wz_deg")
    same = call(capfd, "diff", si, si)
    assert (same.code, "20 columns compared" in same.out + same.err) == (0, True)
    assert call(capfd, "diff", si, other, "--atol", "2e-9").code == 0
    lines = si.read_text(encoding="utf-8").splitlines()
    cells = lines[40].split(",")
    cells[12] = f"{float(cells[12]) + 1e-3:.9f}"
    changed.write_text("\n".join([*lines[:40], ",".join(cells), *lines[41:]]) + "\n", encoding="utf-8")
    different = call(capfd, "diff", si, changed, "--atol", "x=1,wx=1e-6")
    assert different.code == 1
    assert "wy" in different.out + different.err
    assert call(capfd, "diff", si, changed, "--atol", "wy=2e-3").code == 0


def test_diff_interpolates_them_by_their_derivatives(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    fine, coarse = tmp_path / "fine.csv", tmp_path / "coarse.csv"
    planned(capfd, fine, "--rate", "200")
    planned(capfd, coarse, "--rate", "50")
    # Cubic through twist and twistd: h^4/384 of the fourth derivative. Straight lines miss by more than 1e-4.
    ask = ["--resample", "--atol", "1,x=1e-7,y=1e-7,z=1e-7,vx=1e-6,vy=1e-6,vz=1e-6,wx=1e-6,wy=1e-6,wz=1e-6"]
    found = call(capfd, "diff", fine, coarse, *ask)
    assert found.code == 0, found.out + found.err
    without = call(capfd, "diff", fine, coarse, "--resample", "--atol", "1,ax=1e-5")
    assert without.code == 1


@pytest.mark.parametrize(("off", "told"), [(0.9e-6, False), (1.1e-6, True), (-1.1e-6, True)])
def test_rows_of_another_tool_are_told_from_rounded_ones(
    off: float, told: bool, capfd: pytest.CaptureFixture[str]
) -> None:
    """An arm of 0.3 m and 0.2 m stands stretched along x, and the rows say so or a micrometre beside."""
    rows = f"q1,q2,x,y,z,qw,qx,qy,qz\n0,0,0.5,0,0,1,0,0,0\n0,0,0.5,{off:.9f},0,1,0,0,0\n"
    done = call(capfd, "fk", "--robot", "planar2r", "-", stdin=rows)
    assert done.code == 0
    assert (f"up to {abs(off):.6g} m from that of Planar 2R" in done.err) == told
    assert "tcp" not in call(capfd, "fk", "--robot", "planar2r", "--frame", "base", "-", stdin=rows).err

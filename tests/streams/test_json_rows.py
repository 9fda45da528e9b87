"""JSON lines of anybody, and messages in YAML: numbers, decimals, one clear error for any text."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.errors import InputError, TrajcliError
from trajcli.streams.recorded_motion import open_motion
from trajcli.streams.ros_messages import read_ros_yaml

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(["a", "1", "'...'"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["t", "q", "joint_names", "points", "positions", "time_from_start", "sec"]), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


def opened(path):
    """Return the motion of a file; None where it is refused, which must be by one problem."""
    try:
        return open_motion(path, units="rad,m")
    except TrajcliError as error:
        (_,) = error.problems
        return None


def test_decimals_of_json_are_those_of_its_shortest_numbers(tmp_path):
    path = tmp_path / "a.jsonl"
    for second, half in ((0.5, 0.05), (0.0, 0.005)):  # a joint that stands has the decimals of the other one
        rows = ({"time": k / 8, "pos": [k * 0.25, 1.5 + k * second]} for k in range(4))
        path.write_text("".join(json.dumps(row) + "\n" for row in rows))
        resolution = open_motion(path, units="rad").resolution
        assert resolution.time == 0.0005
        assert resolution.q.tolist() == [0.005, half]
    path.write_text(json.dumps({"t": 0.5, "q": [1 / 3, 1.5]}) + "\n")
    resolution = open_motion(path).resolution
    assert (resolution.time, resolution.q.tolist()) == (0.0, [0.0, 0.0])


@pytest.mark.parametrize("number", ["1e999", "1" + "0" * 400, "-1e305", "null", "true", '"1"'])
def test_values_that_are_no_numbers(number, tmp_path):
    (tmp_path / "a.jsonl").write_text('{"t": 0, "q": [1]}\n{"t": 1, "q": [' + number + "]}\n")
    with pytest.raises(InputError) as caught:
        open_motion(tmp_path / "a.jsonl")
    assert caught.value.problems[0].place.line == 2


MESSAGE = """joint_names: [a, b]
points:
- positions: [1e-05, -0.5000]
  velocities: [0.25, 3]
  effort: [1.5, 2.5]
  time_from_start: {secs: 1, nsecs: 500000000}
- positions: [.5, 2.5e-3]
  velocities: [0.125, 4]
  effort: [1.5, 2.5]
  time_from_start: {secs: 2, nsecs: 1}
"""


def test_decimals_of_a_message_and_numbers_that_yaml_takes_for_texts(tmp_path):
    (tmp_path / "a.yaml").write_text(MESSAGE + "---\njoint_names: [c]\n")
    message = read_ros_yaml(tmp_path / "a.yaml")
    assert message.position.tolist() == [[1e-5, -0.5], [0.5, 2.5e-3]]
    assert message.times.tolist() == [1.5, 2.000000001]
    assert message.decimals.tolist() == [9, 5, 4, 3, 0, 1, 1]
    motion = open_motion(tmp_path / "a.yaml").whole()
    assert motion.tau.tolist() == [[1.5, 2.5]] * 2
    assert motion.qdd is None
    np.testing.assert_allclose(motion.resolution.q, [0.5e-5, 0.5e-4])


def test_a_stream_behind_the_first_message_is_not_read(tmp_path):
    (tmp_path / "a.yaml").write_text(MESSAGE + "---\n" + "x" * (70 << 20))
    assert open_motion(tmp_path / "a.yaml").rows == 2


@settings(max_examples=200, deadline=None)
@given(st.lists(JSON, max_size=3), st.booleans())
def test_any_json_is_a_motion_or_one_error(tmp_path_factory, values, as_yaml):
    path = tmp_path_factory.mktemp("fuzz") / ("a.yaml" if as_yaml else "a.jsonl")
    lines = [yaml.safe_dump(value) if as_yaml else json.dumps(value) for value in values]
    path.write_text(("---\n" if as_yaml else "\n").join(lines))
    found = opened(path)
    assert found is None or np.isfinite(found.whole().q).all()


@settings(max_examples=150, deadline=None)
@given(
    st.integers(0, len(MESSAGE)), st.text(st.sampled_from("[]{}:,-'. \n0e1x"), max_size=5), st.integers(0, 5)
)
def test_a_changed_message_is_a_motion_or_one_error(tmp_path_factory, at, text, removed):
    path = tmp_path_factory.mktemp("fuzz") / "a.yaml"
    path.write_text(MESSAGE[:at] + text + MESSAGE[at + removed :])
    found = opened(path)
    assert found is None or np.isfinite(found.whole().q).all()


@pytest.mark.parametrize("name", ["a.jsonl", "a"])
def test_lines_as_others_write_them(name, tmp_path):
    """With a mark of UTF-8 in front, blank lines, and keys in any order."""
    text = '\ufeff\n{"t": 0, "q": [1, 2]}\n\n{"q": [3, 4], "t": 1}\r\n \n'
    (tmp_path / name).write_bytes(text.encode())
    motion = open_motion(tmp_path / name).whole()
    assert (motion.t.tolist(), motion.q.tolist()) == ([0.0, 1.0], [[1.0, 2.0], [3.0, 4.0]])
    (tmp_path / name).write_text(text + '{"t": 2, "qd": [3, 4]}\n', encoding="utf-8")
    with pytest.raises(InputError) as caught:
        open_motion(tmp_path / name)
    assert caught.value.problems[0].place.line == 6


LINE = '{"t": 0.0, "q": [0, 0]}\n'


@pytest.mark.parametrize(
    ("second", "message"),
    [
        ('{"t": 1.0, "q": [0, 0], "qd": [0, 0]}', "other keys or lists than in the first row"),
        ('{"t": 1.0}', "other keys or lists than in the first row"),
        ('{"t": 1.0, "q": [0, 0, 0]}', "other keys or lists than in the first row"),
        ('{"t": [1.0], "q": [0, 0]}', "other keys or lists than in the first row"),
        ('{"t": 1.0, "q": [0, true]}', "a value is no number"),
        ('{"t": 1.0, "q": [0, [1]]}', "a value is no number"),
        ('{"t": 1.0, "q": [0, 1e301]}', "a value is no number"),
        ('{"t": 1.0, "q": [0, NaN]}', "no JSON"),
        ("[1.0, 0, 0]", "expected an object of numbers"),
        ("{}", "expected an object of numbers"),
        ('{"t": 1.0, "q": [0,', "the file may have been cut"),
    ],
)
def test_each_row_is_an_object_like_the_first(second, message, tmp_path):
    (tmp_path / "a.jsonl").write_text(f"\n{LINE}\n{second}")
    with pytest.raises(InputError) as caught:
        open_motion(tmp_path / "a.jsonl", units="rad")
    (problem,) = caught.value.problems
    assert message in problem.text() or message in (problem.hint or "")
    assert str(problem.place).endswith("a.jsonl:4:1")


def test_the_decimals_of_all_blocks_count(tmp_path):
    """Six in the first of 5000 rows, which are read 4096 at a time, and one in the others."""
    rows = [f'{{"t": {k}.5, "q": [0.{"123456" if k == 0 else "5"}]}}' for k in range(5000)]
    (tmp_path / "a.jsonl").write_text("\n".join(rows))
    found = open_motion(tmp_path / "a.jsonl", units="rad")
    assert found.resolution.q.tolist() == [pytest.approx(5e-7)]
    assert (found.rows, found.resolution.time) == (5000, 0.05)


def test_lists_of_texts_are_left_out_and_lists_of_unknown_numbers_refused(tmp_path):
    (tmp_path / "a.jsonl").write_text('{"t": 0, "q": [0, 0], "names": ["a", "b"], "frame": "base"}\n')
    assert open_motion(tmp_path / "a.jsonl", units="rad").notes[0] == "keys that are not read: names, frame"
    (tmp_path / "a.jsonl").write_text('\n{"t": 0, "q": [0, 0], "gains": [1, 2]}\n')
    with pytest.raises(InputError, match="unexpected list 'gains' of 2 numbers") as caught:
        open_motion(tmp_path / "a.jsonl", units="rad")
    assert str(caught.value.problems[0].place) == f"{tmp_path / 'a.jsonl'}:2:1"
    for count in (3, 8):
        (tmp_path / "a.jsonl").write_text(f'{{"t": 0, "q": [0, 0], "pose": {[0.5] * count}}}\n')
        with pytest.raises(InputError, match=f"unexpected list 'pose' of {count} numbers"):
            open_motion(tmp_path / "a.jsonl", units="rad")
    (tmp_path / "a.jsonl").write_text("\n \n")
    with pytest.raises(InputError, match="has no rows"):
        open_motion(tmp_path / "a.jsonl", units="rad")


def test_what_is_wrong_with_keys_and_lines_is_told_at_its_line(tmp_path):
    """Blank lines count; a line that is no JSON in the middle of a file says nothing of its end."""
    path = tmp_path / "a.jsonl"
    path.write_text('\n\n{"q": [0, 0]}\n')
    with pytest.raises(InputError, match="no column is the time") as caught:
        open_motion(path, units="rad")
    assert str(caught.value.problems[0].place) == f"{path}:3:1"
    for end, hint in (("\n" + LINE, None), ("", "the file may have been cut")):
        path.write_text(LINE + '{"t": 1.0, "q": [0,' + end)
        with pytest.raises(InputError, match="no JSON") as caught:
            open_motion(path, units="rad")
        assert caught.value.problems[0].hint == hint


def test_a_writer_of_all_digits_rounds_nothing_whichever_key_shows_it(tmp_path):
    """Also one that is not read."""
    path = tmp_path / "a.jsonl"
    path.write_text(
        "".join(f'{{"t": {k}.5, "q": [{k}.25], "load": 0.12345678901234567}}\n' for k in range(3))
    )
    resolution = open_motion(path, units="rad").resolution
    assert (resolution.time, resolution.q.tolist()) == (0.0, [0.0])

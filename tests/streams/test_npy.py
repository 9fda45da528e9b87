"""Arrays of numpy files: layouts that are read, and those that are refused with what would be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.errors import InputError, TrajcliError
from trajcli.streams.recorded_motion import open_motion

ROWS = np.random.default_rng(0).normal(size=(40, 19)).cumsum(axis=0)
ROWS[:, 0] = np.arange(40) / 50


def saved(folder, array):
    np.save(folder / "a.npy", array)
    return folder / "a.npy"


@pytest.mark.parametrize("orders", [1, 2, 3])
@pytest.mark.parametrize("kind", ["f8", ">f8", "f4", "f2"])
def test_plain_arrays_are_time_and_states(orders, kind, tmp_path):
    array = ROWS[:, : 1 + 6 * orders].astype(kind)
    found = open_motion(saved(tmp_path, array), units="rad", joints=[f"j{k}" for k in range(6)])
    motion, numbers = found.whole(), array.astype(float)
    np.testing.assert_array_equal(motion.t, numbers[:, 0])
    for k, quantity in enumerate(("q", "qd", "qdd")):
        values = getattr(motion, quantity)
        assert (values is not None) == (k < orders)
        if values is not None:
            np.testing.assert_array_equal(values, numbers[:, 1 + 6 * k : 7 + 6 * k])
    # half a unit in the last place of the significand: 24 bits, 11 bits
    share = {"f4": 2.0**-24, "f2": 2.0**-11}.get(kind, 0.0)
    assert found.resolution.relative == tuple(share * (k < orders) for k in range(3))
    assert found.notes[0].startswith("columns are read as t, q1")


def test_fields_have_names_and_widths(tmp_path):
    array = np.zeros(
        5,
        dtype=[
            ("timestamp", "f8"),
            ("joint_pos", "f4", (3,)),
            ("vel1", "f8"),
            ("vel2", "f8"),
            ("vel3", "f8"),
        ],
    )
    array["timestamp"], array["joint_pos"], array["vel2"] = np.arange(5), np.arange(15).reshape(5, 3), 7
    found = open_motion(saved(tmp_path, array), units="deg")
    np.testing.assert_allclose(found.whole().q, np.radians(np.arange(15.0).reshape(5, 3)))
    np.testing.assert_allclose(found.whole().qd, np.radians([[0.0, 7, 0]] * 5))


@pytest.mark.parametrize(
    ("array", "message", "hint"),
    [
        (np.zeros(5), r"shape \(5,\)", r"(N, 1 + n)"),
        (np.zeros((2, 2, 5, 7)), "shape", "(K, N, ...)"),
        (np.zeros((0, 7)), "shape", "(N, 1 + n)"),
        (
            np.zeros((5, 6)),
            "6 columns for 6 joints; it seems to lack the time, which --rate says",
            "(N, 1 + n)",
        ),
        (np.zeros((5, 9)), "9 columns for 6 joints", "(N, 1 + n)"),
        (np.zeros((5, 25)), "25 columns for 6 joints", "(N, 1 + n)"),
        (np.zeros((5, 7), dtype=complex), "complex", "(N, 1 + n)"),
        (np.array([None, 1]), "object", "(N, 1 + n)"),
        (np.asfortranarray(np.zeros((5, 7))), "column by column", "ascontiguousarray"),
        (np.where(np.arange(35).reshape(5, 7) == 17, np.nan, 1.0), "q3 is nan in row 3", "finite"),
    ],
)
def test_other_arrays_are_refused(array, message, hint, tmp_path):
    with pytest.raises(InputError, match=message) as caught:
        open_motion(saved(tmp_path, array), units="rad", joints=["a", "b", "c", "d", "e", "f"])
    assert hint in (caught.value.problems[0].hint or "")


def test_units_of_arrays_are_asked_for(tmp_path):
    with pytest.raises(InputError, match=r"nothing says the unit of q1 \.\. q6"):
        open_motion(saved(tmp_path, ROWS[:, :7]))


def test_a_cut_array_is_one_error(tmp_path):
    path = saved(tmp_path, ROWS[:, :7])
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="is cut: it has 38 of 40 rows"):
        open_motion(path, units="rad")


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_any_header_is_an_array_or_one_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("fuzz") / "a.npy"
    descr = data.draw(
        st.sampled_from(
            [
                "'<f8'",
                "'|O'",
                "[('t','<f8'),('q','<f4',(3,))]",
                "'<U5'",
                "x",
                "[]",
                "'<f8'*9",
                "[('q','<f8',(99999999,))]",
            ]
        )
    )
    shape = data.draw(
        st.sampled_from(
            ["(3, 3)", "(-1, 3)", "(3, 99999999999)", "(9999999999999, 3)", "3", "()", "(3,", "(3, 0)"]
        )
    )
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    version = data.draw(st.sampled_from([b"\x01\x00", b"\x02\x00", b"\x09\x00"]))
    size = len(header).to_bytes(2 if version[0] == 1 else 4, "little")
    path.write_bytes(b"\x93NUMPY" + version + size + header + bytes(data.draw(st.integers(0, 100))))
    try:
        open_motion(path, units="rad")
    except TrajcliError as error:
        (_,) = error.problems

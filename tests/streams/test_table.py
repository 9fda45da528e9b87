from __future__ import annotations

import io
from decimal import Decimal

import numpy as np
import pytest
from tiers import few

from trajcli.columns import parse_column
from trajcli.errors import FileError, InputError
from trajcli.streams import table
from trajcli.streams.csv import write_csv
from trajcli.streams.table import read_csv
from trajcli.streams.text_layout import read_header


def read(tmp_path, text):
    path = tmp_path / "in.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_csv(path)


def flaws(tmp_path, text):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert caught.value.exit_code == 2
    return [
        (str(flaw.place).removeprefix(f"{tmp_path}/"), flaw.message) if flaw.place else flaw.message
        for flaw in caught.value.problems
    ]


@pytest.mark.parametrize("digits", ["fixed", "full"])
def test_what_is_written_is_read(tmp_path, digits):
    rows = np.random.default_rng(0).normal(size=(20000, 4)) * [1, 100, 1e4, 0]
    rows[:, 3] = np.arange(20000) // 100
    out = io.BytesIO()
    columns = [parse_column(name) for name in ("t", "q1", "q2_deg", "move")]
    write_csv([rows], columns, out, digits)
    found = read(tmp_path, out.getvalue())
    assert found.names == ("t", "q1", "q2_deg", "move")
    if digits == "full":
        np.testing.assert_array_equal(found.columns, rows)
    else:
        np.testing.assert_allclose(found.columns, rows, rtol=0, atol=5.01e-10)
        assert found.decimals.tolist() == [9, 9, 9, 0]
    np.testing.assert_array_equal(found.column("q1"), found.columns[:, 1])


@pytest.mark.parametrize(
    "text",
    [
        "t,q1\n0,1.5\n1,-2\n",
        "t,q1\r\n0,1.5\r\n1,-2\r\n",
        "t,q1\n0,1.5\n1,-2",
        "\ufefft,q1\n0,1.5\n1,-2\n",
        "t,q1\n\n0,1.5\n\n1,-2\n\n\n",
        "t,q1\n  \n0,1.5\n\t\n1,-2\n  \n",
        't , "q1"\n0 , 1.5\n 1,\t-2 \n',
        "# t,q1\n0,1.5\n1,-2\n",
        '"t","q1"\n"0","1.5"\n"1","-2"\n',
        't;q1\n0;"1,5"\n"1";-2\n',
        "t,q1\n0.,+1.5e0\n.1E1,-200e-2\n",
        "t,q1\n0.000000000,1.500000000\n1.000000000,-2.000000000\n",
    ],
)
def test_every_way_to_write_the_same(tmp_path, text):
    found = read(tmp_path, text)
    assert found.names == ("t", "q1")
    np.testing.assert_array_equal(found.columns, [[0, 1.5], [1, -2]])


@pytest.mark.parametrize(
    ("cells", "decimals"),
    [
        (["1", "2"], 0),
        (["1.25", "2.5"], 2),
        (["1.", "2"], 0),
        (["1.5e-3", "7.25"], 4),
        (["1.5e3", "2e2"], 0),
        ([" 1.125", "2"], 3),
        (["1E-9", "2"], 9),
        (["-1.250", "2"], 3),
    ],
)
def test_the_decimals_are_the_most_that_a_column_shows(tmp_path, cells, decimals):
    text = "t,q1\n" + "".join(f"{k}.5,{cell}\n" for k, cell in enumerate(cells))
    assert read(tmp_path, text).decimals.tolist() == [1, decimals]


def test_a_table_cannot_be_written_to(tmp_path):
    found = read(tmp_path, "t\n1\n")
    with pytest.raises(ValueError, match="read-only"):
        found.columns[0] = 2


def test_chunks_join_without_a_seam(tmp_path, monkeypatch):
    rows = np.arange(900.0).reshape(300, 3) / 8
    lines = [
        ",".join(f"{value:.9f}" if k % 50 else repr(value) for value in row)
        for k, row in enumerate(rows.tolist())
    ]
    text = "t,q1,q2\n" + "\n".join(lines)
    monkeypatch.setattr(table, "_CHUNK", 100)
    np.testing.assert_array_equal(read(tmp_path, text).columns, rows)
    with pytest.raises(InputError) as caught:
        read(tmp_path, text.replace(lines[277], "1,2"))
    assert caught.value.problems[0].place.line == 279


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("t,q1\r\n0,1\r5\r\n", [("in.csv:2:3", "q1 is '1\r5', expected a finite number")]),
        ("t,q1\n0,1\n1,abc\n", [("in.csv:3:3", "q1 is 'abc', expected a finite number")]),
        ("t,q1\n0,\n", [("in.csv:2:3", "q1 is empty, expected a finite number")]),
        ("t,q1\nnan,1\n", [("in.csv:2:1", "t is 'nan', expected a finite number")]),
        ("t,q1\n0,-inf\n", [("in.csv:2:3", "q1 is '-inf', expected a finite number")]),
        ("t,q1\n0,1e999\n", [("in.csv:2:3", "q1 is '1e999', expected a finite number")]),
        ("t,q1\n0,1_000\n", [("in.csv:2:3", "q1 is '1_000', expected a finite number")]),
        ("t,q1\n0,0x10\n", [("in.csv:2:3", "q1 is '0x10', expected a finite number")]),
        ("t,q1\n0,1\n\n1\n", [("in.csv:4:1", "the line has 1 values, expected 2 as in line 1")]),
        ("t,q1\n0,1,2\n", [("in.csv:2:1", "the line has 3 values, expected 2 as in line 1")]),
        ("t,q1\n0,\xe9\xe9,\n", [("in.csv:2:3", "q1 is 'éé', expected a finite number")]),
        ("t,q1\nx,1\n0,y\n", [("in.csv:2:1", "t is 'x', expected a finite number")]),
        ("t;q1\n0;1\n0;a\n", [("in.csv:3:3", "q1 is 'a', expected a finite number")]),
        ("t,q1,t\n0,1,2\n", [("in.csv:1:6", "there are two columns 't'")]),
        ("t,,q1\n0,1,2\n", [("in.csv:1:3", "column 2 of 3 has no name")]),
        ("0,1\n0,1\n", [("in.csv:1:1", "0 stands where a column's name should be")]),
        ("\n0,1\n", [("in.csv:1:1", "column 1 of 1 has no name")]),
        ("t,q1\n", [("in.csv:1:1", "the file has no rows, only the columns' names")]),
        ("t,q1\n\n", [("in.csv:1:1", "the file has no rows, only the columns' names")]),
        ("# an arm\nt,q1\n", [("in.csv:2:1", "the file has no rows, only the columns' names")]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_place(tmp_path, text, expected):
    assert flaws(tmp_path, text) == expected


def test_a_long_cell_is_shown_by_its_beginning(tmp_path):
    with pytest.raises(InputError) as caught:
        read(tmp_path, f"t,q1\n0,{'xy' * 150}\n")
    (problem,) = caught.value.problems
    assert problem.message == f"q1 is '{'xy' * 20}...', expected a finite number"
    assert problem.place.source == f"0,{'xy' * 99}"


def test_one_thing_is_said(tmp_path):
    assert len(flaws(tmp_path, "t,q1,q2\n" + "x,y,z\n" * 100)) == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", "is empty"), (b"\x89MCAP0\r\n\x00\x01", "is not text"), (b"t\0\n1\n", "is not text"), (b"x" * 10**6, "is not text")],
)  # fmt: skip
def test_what_is_no_csv_at_all_is_named(tmp_path, content, message):
    (said,) = flaws(tmp_path, content)
    assert said.endswith(message)


@pytest.mark.parametrize("name", ["missing.csv", ""])
def test_a_file_that_cannot_be_read(tmp_path, name):
    with pytest.raises(
        FileError, match=r"cannot read .*: (No such file or directory|Is a directory)"
    ) as caught:
        read_csv(f"{tmp_path}/{name}")
    assert caught.value.exit_code == 4


def test_a_dash_is_standard_input(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"t,q1\n0,1\n")))
    found = read_csv("-")
    assert found.file == "stdin"
    np.testing.assert_array_equal(found.columns, [[0, 1]])
    monkeypatch.setattr("sys.stdin", None)
    with pytest.raises(FileError, match="cannot read stdin: it is closed"):
        read_csv("-")


@pytest.mark.parametrize("separator", [";", "\t", " "])
def test_decimal_commas_may_begin_behind_the_first_row(tmp_path, separator):
    text = "t;q1;q2\n0;0;0\n1;2;3\n2;0,5;-4,25\n3;1;,5\n".replace(";", separator)
    assert read(tmp_path, text).columns.tolist() == [[0, 0, 0], [1, 2, 3], [2, 0.5, -4.25], [3, 1, 0.5]]


def test_a_comma_is_no_decimal_one_where_points_came_before(tmp_path):
    """It may separate thousands."""
    ((place, message),) = flaws(tmp_path, "t;q1;note\n0;1;1\n1;0.5;1\n2;1,234;1\n")
    assert place.startswith("in.csv:4")
    assert "q1 is '1,234'" in message or "the line has" in message


WAYS = [  # separator, decimal mark, what stands around cells, at the end of a line, line feed
    (separator, mark, around, behind, feed)
    for separator in (",", ";", "\t", " ")
    for mark in (".", ",")[: 1 + (separator != ",")]
    for around in ("", " ", "  ", *(["\t"] if separator in ",;" else []))
    for behind in ("", separator)[: 1 + (separator != " ")]
    for feed in ("\n", "\r\n")
]


def laid_out(cells, way):
    """Return a table of texts in a layout; names have neither decimals nor a separator behind the last."""
    separator, mark, around, behind, feed = way
    beside = around if separator != " " else around + " "
    glue = f"{beside}{separator}{beside}" if separator != " " else beside
    lines = [around + glue.join(cells[0]) + feed]
    lines += [around + glue.join(row).replace(".", mark) + around + behind + feed for row in cells[1:]]
    return "".join(lines).encode()


@pytest.mark.parametrize("chunk", [1 << 20, 48])
@pytest.mark.parametrize("way", few(WAYS, 24))
def test_a_table_is_the_same_in_every_layout(tmp_path, monkeypatch, way, chunk):
    """Values are those of `float`, decimals those of exact arithmetic, and flaws stand where the cell does."""
    monkeypatch.setattr(table, "_CHUNK", chunk)
    generator = np.random.default_rng(7)
    rows = [
        [str(k), f"{generator.normal():.{4 - k % 4}f}", f"{generator.normal():.3e}", str(-2.5 * (k % 3))]
        for k in range(12)
    ]
    cells = [["t", "aq1", "q1", "q2"], *rows]
    found = read(tmp_path, laid_out(cells, way))
    assert found.names == tuple(cells[0])
    np.testing.assert_array_equal(found.columns, [[float(cell) for cell in row] for row in rows])
    shown = [[-Decimal(cell).as_tuple().exponent for cell in row] for row in rows]
    assert found.decimals.tolist() == np.maximum(shown, 0).max(axis=0).tolist()
    for row, column in ((1, 0), (1, 3), (7, 1), (12, 3)):
        wrong = [list(line) for line in cells]
        wrong[row][column] = "1x"
        with pytest.raises(InputError) as caught:
            read(tmp_path, laid_out(wrong, way))
        (problem,) = caught.value.problems
        assert problem.message == f"{cells[0][column]} is '1x', expected a finite number"
        place = problem.place
        assert (place.line, place.source[place.column - 1 :][: place.length].strip()) == (row + 1, "1x")
        assert place.source.strip() == laid_out(wrong, way).decode().splitlines()[row].strip()


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
@pytest.mark.parametrize("sign", ["", "# ", "#"])
def test_a_name_is_shown_where_its_own_column_is_named(separator, sign):
    """Also where another name holds it, in front of it or behind."""
    names = ("aq1", "q1", "q10", "t", "q")
    text = sign + separator.join(names)
    header, _ = read_header(io.BytesIO(f"{text}\n1,2,3,4,5\n".encode()), "in.csv")
    assert header.names == names
    begins = len(sign)
    for name in names:
        place = header.place(name)
        assert (place.column - 1, place.length) == (begins, len(name)), name
        begins += len(name) + 1
    whole = header.place()
    assert (whole.column, whole.length) == (1, len(text))


@pytest.mark.parametrize(
    "row",
    [
        '"1","2","x"',
        '"1",  "2" ,x',
        '1,2,"x"',
        '"x1x","2","x"',
        '1,"nan",3',
        '"1e5","2","e"',
        '"2","1e5","e"',
    ],
)
def test_a_wrong_cell_in_quotation_marks_is_shown_where_it_stands(tmp_path, row):
    with pytest.raises(InputError) as caught:
        read(tmp_path, f'"t","q1","q2"\n"0","1","2"\n{row}\n')
    place = caught.value.problems[0].place
    cells = [cell.strip().strip('"') for cell in row.split(",")]
    wrong = next(k for k, cell in enumerate(cells) if cell != "1e5" and not cell.isdecimal())
    begins = len(",".join(row.split(",")[:wrong])) + bool(wrong)
    begins += len(row.split(",")[wrong]) - len(row.split(",")[wrong].lstrip(' "'))
    assert (place.line, place.column - 1, place.length) == (3, begins, len(cells[wrong]))


def test_a_line_without_an_end_is_no_table(tmp_path, monkeypatch):
    monkeypatch.setattr(table, "_CHUNK", 48)
    with pytest.raises(InputError, match="no table: it has a line of more than 65536 bytes"):
        read(tmp_path, "t,q1\n" + "1," * 40_000)


@pytest.mark.parametrize("chunk", [1 << 20, 48])
def test_empty_lines_are_counted(tmp_path, monkeypatch, chunk):
    monkeypatch.setattr(table, "_CHUNK", chunk)
    for empty in (1, 60, 200):
        place = f"in.csv:{2 + empty + 1}:3"
        assert flaws(tmp_path, "t,q1\n" + "\n" * empty + "0,1\n1,x\n") == [
            (place, "q1 is 'x', expected a finite number")
        ]


@pytest.mark.parametrize(
    ("text", "cut"), [("0,1\n1,x", True), ("0,1\n1", True), ("0,1\n1,x\n", False), ("0,x\n1,2", False)]
)
def test_a_last_line_without_its_end_may_have_been_cut(tmp_path, text, cut):
    with pytest.raises(InputError) as caught:
        read(tmp_path, f"t,q1\n{text}")
    assert ("may have been cut" in (caught.value.problems[0].hint or "")) == cut


def test_a_comma_in_quotation_marks_divides_nothing_and_is_not_lost(tmp_path):
    assert flaws(tmp_path, 't,q1\n0,"1,5"\n')[0][1] == "q1 is '1,5', expected a finite number"
    assert read(tmp_path, 't;q1\n0;"1,5"\n').columns.tolist() == [[0, 1.5]]


HEADS = [  # lines before the rows, the names, the line of the first row
    ("# made by hand\n# t,q1\n", ("t", "q1"), 3),
    ("% t q1\n", ("t", "q1"), 2),
    ("# made by hand\nt,q1\n", ("t", "q1"), 3),
    ("# t,q1\n\n", ("t", "q1"), 3),
    ("t,q1,\n", ("t", "q1"), 2),
    ("t;q1;;\n", ("t", "q1"), 2),
    ("t, of the clock;q1\n", ("t, of the clock", "q1"), 2),
]


@pytest.mark.parametrize(("head", "names", "line"), HEADS)
def test_names_are_found_behind_comments_and_before_ends_without_any(tmp_path, head, names, line):
    cells = ";" if ";" in head else ","
    assert read(tmp_path, f"{head}0{cells}1.5\n").names == names
    assert flaws(tmp_path, f"{head}0{cells}x\n") == [
        (f"in.csv:{line}:3", "q1 is 'x', expected a finite number")
    ]


@pytest.mark.parametrize("name", ["1", "-1.5e3", ".5", "1,5"])
def test_a_number_is_no_name(tmp_path, name):
    text = f"t;{name};q1\n0;1;2\n"
    assert flaws(tmp_path, text) == [("in.csv:1:3", f"{name} stands where a column's name should be")]


@pytest.mark.parametrize("byte", [1, 8, 0x80, 0x9F])
def test_bytes_of_no_letter_are_no_text(tmp_path, byte):
    (said,) = flaws(tmp_path, b"t,q\xe9" + bytes([byte]) + b"\n0,1\n")
    assert said.endswith("is not text")
    assert read(tmp_path, b"t,q\xe9\n0,1\n").names == ("t", "q\xe9")


@pytest.mark.parametrize("head", ["t,q1,q2", "t;q1;q2", "t q1 q2", "t\tq1\tq2"])
@pytest.mark.parametrize(
    "row", ["0,1.5,2", "0;1.5;2", "0;1,5;2", "0 1.5 2", "0\t1.5\t2", "0 \t1.5\t 2", "0;1.5;2;"]
)
def test_rows_may_be_separated_otherwise_than_names(tmp_path, head, row):
    assert read(tmp_path, f"{head}\n{row}\n{row}\n").columns.tolist() == [[0, 1.5, 2]] * 2


@pytest.mark.parametrize("row", ["0,1,2,3", "0;1;2;3", "0,1", "0,1,2,3,"])
def test_a_number_too_many_is_not_left_out(tmp_path, row):
    (flaw,) = flaws(tmp_path, f"t,q1,q2\n{row}\n")
    assert flaw[0] == "in.csv:2:1"
    assert "expected 3 as in line 1" in flaw[1]


@pytest.mark.parametrize("chunk", [1 << 20, 24])
def test_decimals_in_quotation_marks_are_the_most_of_all_rows(tmp_path, monkeypatch, chunk):
    monkeypatch.setattr(table, "_CHUNK", chunk)
    rows = ['"0","1.25"', '"1.5","2.5"', '"2","3"', '"3","4"', '"4","5.125"', '"5","6"', '"6","7"']
    found = read(tmp_path, '"t","q1"\n' + "\n".join(rows) + "\n")
    assert found.decimals.tolist() == [1, 3]
    assert found.columns[:, 1].tolist() == [1.25, 2.5, 3, 4, 5.125, 6, 7]

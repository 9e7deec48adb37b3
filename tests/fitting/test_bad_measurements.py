"""Measurements that are none: what is wrong with its file and line, exit code 3, nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest

from dse.cli.main import run
from dse.fitting.measurements import joined_rows

HEAD = "size_bytes,min_us,max_us\n"
GOOD = HEAD + "1,2,3\n2,3,4\n"
BAD = {
    "empty": ("", "m.csv:1: the file is empty"),
    "only remarks": ("# nothing\n\n", "m.csv:1: the file is empty"),
    "only a header": (HEAD, "m.csv:1: there is no row below the header"),
    "cut off": (HEAD + "1,2,3\n2,3", "m.csv:3: 2 cells, but the header has 3 columns (is the file cut off?)"),
    "cut off in quotes": (HEAD + '1,2,3\n"2,3,4\n5,6,7\n', "m.csv:3: the table cannot be read: unexpected end of data"),
    "decimal comma": (
        HEAD + "1,2,5,3\n",
        "m.csv:2: 4 cells, but the header has 3 columns (decimals are written with a",
    ),
    "no unit": (
        "size_bytes,min,max\n1,2,3\n",
        "m.csv:2: min: expected a duration with its unit, got '2' (name the column",
    ),
    "no unit of size": ("size,min_us,max_us\n1,2,3\n", "m.csv:2: size: expected a size with its unit, got '1'"),
    "other unit": ("size_bytes,min [kg],max_us\n1,2,3\n", "m.csv:1: 'min [kg]': 'kg' is no unit of the min"),
    "unit of another kind": ("size_bytes,min,max_us\n1,2 m,3\n", "m.csv:2: min: expected a duration, got '2 m'"),
    "text": (HEAD + "1,fast,3\n", "m.csv:2: min_us: expected a duration, got 'fast'"),
    "nan": (HEAD + "1,nan,3\n", "m.csv:2: min_us: expected a duration, got 'nan'"),
    "infinite": (HEAD + "1,2,inf\n", "m.csv:2: max_us: expected a duration, got 'inf'"),
    "negative": (HEAD + "1,-2,3\n", "m.csv:2: min_us: expected a duration, got '-2'"),
    "huge": (HEAD + "1,2,1e999999999\n", "m.csv:2: max_us: expected a duration, got '1e999999999'"),
    "missing cell": (HEAD + "1,,3\n", "m.csv:2: min_us: expected a duration, got nothing"),
    "minimum above maximum": (HEAD + "1,4,3\n", "m.csv:2: the minimum is above the maximum"),
    "mean outside": ("bytes,min_us,max_us,mean_ms\n1,2,3,2.5\n", "m.csv:2: the mean is not between the minimum and"),
    "deviation too large": ("bytes,min_us,max_us,std_ms\n1,2,3,2\n", "m.csv:2: the deviation is larger than the range"),
    "no name": ("thread,duration_us\n,3\n", "m.csv:2: thread: expected a name, got nothing"),
    "no count": ("thread,min_us,max_us,n\na,1,2,-4\n", "m.csv:2: n: expected the number of samples, got '-4'"),
    "a count of many digits": (f"thread,min_us,max_us,n\na,1,2,{'9' * 5000}\n", "m.csv:2: n: expected the number of"),
    "twice": (HEAD + "1,2,3\n1,2,3\n", "m.csv:3: 1 B is stated twice: here and at "),
    "no durations": ("size_bytes,colour\n1,2\n", "m.csv:1: no column holds durations (such as delay_us"),
    "of nothing": ("min_us,max_us\n1,2\n", "m.csv:1: no column says of what the durations are: a size, or a thread"),
    "two columns of a role": ("bytes,size_kb,delay_us\n1,1,2\n", "m.csv:1: 'bytes' and 'size_kb' may both be the size"),
    "samples and figures": ("bytes,delay_us,min_us,max_us\n1,1,2,3\n", "m.csv:1: 'delay_us' and 'm"),
    "one size": (HEAD + "1,2,3\n", "m: a line needs at least two sizes of messages, there is 1"),
}


def fit(path: Path, capsys: pytest.CaptureFixture[str], *options: str) -> tuple[int, str]:
    """Exit code and message; nothing is written whatever happens."""
    out = path.parent / "out.yaml"
    code = run(["fit", str(path), "-o", str(out), *options])
    assert out.exists() is (code == 0)
    return code, capsys.readouterr().err


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_told_with_its_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, message = BAD[name]
    path = tmp_path / "m.csv"
    path.write_text(text, encoding="utf-8")
    code, said = fit(path, capsys)
    assert code == 3 and message in said, said


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (GOOD.encode("utf-16"), "m.csv:1: the file is not UTF-8 text (it looks like UTF-16)"),
        (b"size_bytes,min_us,max_us\n1,2,3\n2,\xb5,4\n", "m.csv:3: the file is not UTF-8 text (save it as UTF-8)"),
        (b"\x00" * 100, "m.csv:1: no column holds durations"),
    ],
)
def test_other_encodings(data: bytes, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.csv"
    path.write_bytes(data)
    code, said = fit(path, capsys)
    assert code == 3 and message in said, said


def test_an_open_quote_costs_no_more_than_its_rows() -> None:
    rows = list(
        joined_rows(
            iter([(1, 'a,"'), *((number, "2,3") for number in range(2, 400_000)), (400_000, '"'), (400_001, "4")])
        )
    )
    assert [number for number, _ in rows] == [1, 400_001]
    assert rows[0][1].count("\n") == 399_999


def test_a_file_of_measurements_keeps_the_limit_of_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.csv"
    path.write_text(HEAD + "".join(f"{number},2,3\n" for number in range(5000)), encoding="utf-8")
    code, said = fit(path, capsys, "--time-limit", "0.001s")
    assert code == 5 and "the time limit came" in said


def test_gigabytes_are_refused_unread(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.csv"
    with path.open("wb") as stream:
        stream.truncate(3 * 10**9)
    code, said = fit(path, capsys)
    assert code == 3 and "m.csv: the file is larger than 64 MB" in said


def test_a_thousand_columns_are_read_and_named_in_short(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.csv"
    more = ",".join(f"x{number}" for number in range(1000))
    path.write_text(f"size_bytes,min_us,max_us,{more}\n1,2,3,{more}\n9,3,4,{more}\n", encoding="utf-8")
    assert run(["fit", str(path)]) == 0
    assert "and 992 more" in capsys.readouterr().out
    path.write_text(f"{more}\n{more}\n", encoding="utf-8")
    code, said = fit(path, capsys)
    assert code == 3 and "(1000 in all)" in said and len(said) < 400


def test_many_mistakes_are_cut_short(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.csv"
    path.write_text(HEAD + "1,4,3\n" * 500, encoding="utf-8")
    code, said = fit(path, capsys)
    assert code == 3 and said.count("the minimum is above") == 20


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--method", "quantile"], "--method quantile: needs samples"),
        (["--sizes", "3 KB"], "--sizes 3 KB: expected LOW .. HIGH"),
        (["--sizes", "9 B .. 3 B"], "--sizes 9 B .. 3 B: the lower size comes first"),
        (["--without", "1 s .. 2 s"], "--without 1 s .. 2 s: expected a data size"),
        (["--method", "quantile", "--quantiles", "9 .. 10 %"], "--quantiles 9 .. 10 %"),
        (["--method", "quantile", "--quantiles", "90 % .. 10 %"], "--quantiles 90 % .. 10 %: expected shares"),
    ],
)
def test_options_that_do_not_go_with_it(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "m.csv"
    path.write_text(GOOD, encoding="utf-8")
    code, said = fit(path, capsys, *options)
    assert code == 2 and message in said, said


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--column", "size=bytes"], "there is no column 'bytes' in "),
        (["--column", "colour=min_us"], "no column has the role 'colour' in "),
        (["--name", "a\nb"], "--name 'a\\nb': expected a name without line breaks"),
        (["--name", "none"], 'the name "none" is reserved'),
        (["--platform", "nope=RT101"], "no row is of the platform 'nope' (no column names platforms)"),
        (["--extremes", "1000"], "--extremes: needs samples"),
        (["--quantiles", "5 % .. 95 %"], "is for --method quantile, not ols"),
        (["--unit", "min=furlong"], "--unit min=furlong: 'min_us': 'furlong' is no unit of the min in "),
    ],
)
def test_options_that_do_not_go_with_the_file(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "m.csv"
    path.write_text(GOOD, encoding="utf-8")
    code, said = fit(path, capsys, *options)
    assert code == 2 and message in said, said


def test_measurements_are_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.csv"
    path.write_text(GOOD, encoding="utf-8")
    assert run(["fit", str(path), "-o", str(path)]) == 2
    assert path.read_text(encoding="utf-8") == GOOD


def test_units_of_columns_that_are_not_there_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "delays.csv"
    path.write_text("size,delay_us\n1,2\n2,3\n3,4\n", encoding="utf-8")
    assert run(["fit", str(path), "--unit", "sise=B"]) == 2
    assert '--unit sise=B: no column has this role or name (did you mean "size"?)' in capsys.readouterr().err
    assert run(["fit", str(path), "--unit", "size=B", "--name", "ipc"]) == 0

"""Tables and patches, the benchmarks' small tools."""

from types import SimpleNamespace

import pytest

from benchmarks.patching import replaced
from benchmarks.tables import figure, markdown, merged


def test_a_table_has_a_line_for_every_row_and_as_many_cells_in_each():
    lines = markdown(("a", "b"), [("1", "2"), ("3", "4")]).splitlines()
    assert len(lines) == 4
    assert len({line.count("|") for line in lines}) == 1


def test_rows_with_the_same_key_are_replaced_where_they_were(tmp_path):
    path = tmp_path / "results" / "rows.json"
    merged(path, [{"name": "one", "psnr": 1.0}, {"name": "two", "psnr": 2.0}], lambda row: row["name"])
    rows = merged(path, [{"name": "one", "psnr": 9.0}, {"name": "three", "psnr": 3.0}], lambda row: row["name"])
    assert [(row["name"], row["psnr"]) for row in rows] == [("one", 9.0), ("two", 2.0), ("three", 3.0)]


def test_what_was_not_measured_is_not_a_number():
    assert figure(None, ".1f", missing="none") == "none"
    assert figure(1.25, "+.1f") == "+1.2"


class Made:
    @classmethod
    def make(cls) -> str:
        return "as before"


def test_a_replaced_name_is_back_afterwards_even_after_an_error():
    owner, seen = SimpleNamespace(rate=1.0), []

    def fail() -> None:
        with replaced(owner, "rate", 2.0):
            seen.append(owner.rate)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert seen == [2.0]
    assert owner.rate == 1.0


def test_a_replaced_classmethod_is_a_classmethod_again():
    with replaced(Made, "make", classmethod(lambda cls: "otherwise")):
        assert Made.make() == "otherwise"
    assert Made.make() == "as before"


def test_a_name_that_is_gone_is_noticed():
    with pytest.raises(AttributeError), replaced(SimpleNamespace(), "rate", 2.0):
        pass

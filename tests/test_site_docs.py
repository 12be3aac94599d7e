"""What the fields of files declare is complete, and the reference says it."""

from __future__ import annotations

import inspect

import msgspec
import pytest

from rigdda.barriers import KINDS
from rigdda.fields import described
from rigdda.sites import document

TABLES = [*(table for _, table in document.TABLES), *KINDS.values()]


def test_the_reference_is_up_to_date():
    """If not: python -m rigdda.sites.document."""
    assert document.PATH.read_text(encoding="utf-8") == document.document()


@pytest.mark.parametrize("table", TABLES)
def test_every_field_is_documented_with_its_unit(table):
    text = inspect.getdoc(table)
    for field in described(table):
        assert field.text.endswith(".")
        assert field.unit or "float" not in field.kind or field.kind.startswith("table")
        assert f"\n{field.name} : {field.kind}" in text
    assert text.count("\nParameters\n----------\n") == 1


def test_every_table_of_a_site_is_documented():
    tables = [table for _, table in document.TABLES]
    structs = msgspec.json.schema_components([document.SiteTables])[1]
    assert sorted(table.__name__ for table in tables) == sorted(structs)

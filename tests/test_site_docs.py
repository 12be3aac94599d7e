"""The reference of site files says what the code does."""

from __future__ import annotations

import msgspec
import pytest

from rigdda.sites import document


def test_the_reference_is_up_to_date():
    """If not: python -m rigdda.sites.document."""
    assert document.PATH.read_text(encoding="utf-8") == document.document()


@pytest.mark.parametrize("table", [table for _, table in document.TABLES])
def test_every_field_is_documented_and_no_other(table):
    fields = [field.name for field in msgspec.structs.fields(table)]
    said = document.meanings(table)
    assert list(said) == fields
    assert all(kind and meaning.endswith(".") for kind, meaning in said.values())


def test_every_table_of_a_site_is_documented():
    known = {table for _, table in document.TABLES}
    for _, table in document.TABLES:
        for field in msgspec.structs.fields(table):
            kinds = [field.type, *getattr(field.type, "__args__", ())]
            tables = {k for k in kinds if isinstance(k, type) and issubclass(k, msgspec.Struct)}
            assert tables <= known

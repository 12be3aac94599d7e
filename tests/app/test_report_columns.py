"""Columns of the tables of reports."""

from rigdda.app.reports.html_blocks import mixed


def test_a_column_of_texts_and_numbers_rounds_the_numbers():
    column = mixed("value", "v")
    given = ("18847.119252323566", "1.2742413687805711", "136.0", "upper, 2-8 m3", "", "nan")
    shown = [column.cell({"v": one}, "design_sheet.csv").text for one in given]
    assert shown == ["18,847", "1.27", "136", "upper, 2-8 m3", "", "nan"]

"""A catch bench below a mine face: retained share against width."""

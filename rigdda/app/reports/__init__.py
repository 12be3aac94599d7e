"""Reports of designs: tables, findings in words and pictures."""

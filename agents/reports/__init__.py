"""Reports of designs: tables, findings in words, pictures."""

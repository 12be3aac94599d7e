"""Scripts that make the figures and studies, one each; their records are in `results`."""

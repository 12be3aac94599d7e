"""Scripts for figures and studies, one each; their recorded results are in `results`."""

"""Fixtures: a cheap site, `quick` without its mass, and a problem on it whose answer is known."""

from valley import few_blocks, problem, site, valley

__all__ = ["few_blocks", "problem", "site", "valley"]

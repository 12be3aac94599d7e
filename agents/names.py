"""Names of the designers, known without importing one."""

DEFAULT = "race"
"""The designer that is used if none is named."""

DESIGNERS = ("cma", "constant", "convex", "pareto", "ppo", "race", "random", "rule", "tpe")

"""Names of the designers, known without importing one."""

DESIGNERS = ("cma", "convex", "pareto", "random", "rule", "tpe")

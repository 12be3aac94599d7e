"""Names of the designers, known without importing one."""

DESIGNERS = ("cma", "convex", "random", "rule")

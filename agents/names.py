"""Names of the designers, known without importing one."""

DESIGNERS = ("cma", "convex", "pareto", "policy", "ppo", "random", "rule", "tpe")

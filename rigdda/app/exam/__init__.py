"""The exam: a fixed set of sites and corridors on which optimisers and policies are compared.

An entry is a function that receives a `Task` and returns a layout. It runs in a process of its own
and simulates only through `Task.evaluate`. The scorer counts the releases, verifies the layouts on
releases whose seeds follow from the submitted layouts, and compares them with recorded references.
"""

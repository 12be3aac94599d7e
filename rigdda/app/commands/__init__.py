"""Commands of `rigdda`, with one module for each command.

Each command imports what it computes with when it runs, so that `--help` is fast. `COMMANDS` in
`rigdda.app.cli` lists all commands.
"""

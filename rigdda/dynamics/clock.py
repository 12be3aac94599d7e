"""The cycle counter of the processor: how long each phase of a step takes."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from rigdda.kernel import kernel


@intrinsic
def cycles(typing_context: Any) -> Any:
    """Return the cycles that the processor has counted."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        whole = ir.FunctionType(ir.IntType(64), ())
        return builder.call(
            builder.module.declare_intrinsic("llvm.readcyclecounter", (), whole), ()
        )

    return types.int64(), generate


@kernel
def lap(counters: NDArray, phase: int, since: int, timing: bool) -> int:
    """Add the cycles since `since`, if it is not 0, to a phase; returns the cycles now."""
    if not timing:
        return 0
    now = cycles()
    if since > 0:
        counters[phase] += now - since
    return now

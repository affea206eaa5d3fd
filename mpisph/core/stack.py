"""The stack of a compiled function, aligned to cache lines.

The pair loop holds more values than a processor has vector registers, and keeps the
others on the stack. LLVM decides on the stack's alignment before it knows of them:
unless a variable asks for more, that is 16 bytes, and as a process happens to start,
each of these values may lie across two cache lines, which costs the loop a twentieth.
"""

from typing import Any

from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic

CACHE_LINE = 64


@intrinsic  # type: ignore[untyped-decorator]
def _align_stack(typingctx: Any) -> Any:
    """Align the stack of the function that this is called in, or inlined into."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        with builder.goto_entry_block():
            line = builder.alloca(ir.ArrayType(ir.IntType(8), CACHE_LINE))
            line.align = CACHE_LINE
        # No instruction, but as it takes the address, the variable is kept.
        kind = ir.FunctionType(ir.VoidType(), [line.type])
        builder.asm(kind, "", "r,~{memory}", [line], True)
        return context.get_dummy_value()

    return types.void(), codegen


align_stack = (lambda: None) if config.DISABLE_JIT else _align_stack
"""The same, for interpreted code too, which has no such stack."""

"""A whole run: started, resumed, stopped; what it writes and when.

The package itself can be called: ``mpisph.run(case, comm, folder)`` is
`mpisph.run.session.run`.
"""

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpisph.io.result import Result


class _CallablePackage(ModuleType):
    """The package ``mpisph.run``, which is also the public function of that name."""

    def __call__(self, *arguments: Any, **options: Any) -> "Result":
        """Run a case; see `mpisph.run.session.run`."""
        from mpisph.run.session import run

        return run(*arguments, **options)


sys.modules[__name__].__class__ = _CallablePackage

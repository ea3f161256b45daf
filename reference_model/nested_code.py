"""How numba compiles what other kernels alone call: as far as it goes into its callers, and no further.

numba makes machine code of each function together with all that it calls, and stores it, before its caller
does so again with the same code: a fifth of a first run. That it optimizes it first has to stay: without, the
integrator's own code is 3 % slower.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class _Library(JITCodeLibrary):  # type: ignore[misc] # numba is not typed
    """Code of which no machine code is made."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class _Lowering(NativeLowering):  # type: ignore[misc]
    _name = "lowering_of_nested_code"

    def run_pass(self, state: Any) -> bool:
        state.library = _Library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        # numba finds the code by what could be called from Python, and that has to be a built-in function.
        nobody_calls = list[Any]().append
        state.targetctx.insert_user_function(nobody_calls, state.cr.fndesc, [state.library])
        state.reload_init.extend(state.library._reload_init)
        state.cr = state.cr._replace(cfunc=nobody_calls)
        return True


register_pass(mutates_CFG=True, analysis_only=False)(_Lowering)


class NestedCompiler(CompilerBase):  # type: ignore[misc]
    """numba's compiler for such functions."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes, the last of them replaced."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [(_Lowering if one is NativeLowering else one, text) for one, text in passes.passes]
        passes.finalize()
        return [passes]

"""The operations and the types of their results, as the compiled module has them. The build prints their stub."""

from . import _fathom
from ._calls import readable

_functions = {name: readable(function) for name, function in _fathom._operations.items()}
__all__ = [*_fathom._results, *_functions]
globals().update(_fathom._results, **_functions)

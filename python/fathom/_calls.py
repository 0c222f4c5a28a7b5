"""Functions of the compiled module as those of Python are: with a signature, and messages that name the argument."""

from __future__ import annotations

import difflib
import inspect
import numbers
import os
import re
import reprlib
from typing import Any

from ._fathom import Camera, _built_in  # type: ignore[attr-defined]  # the stubs name what is public

# What an annotation stands for. Operations say themselves what their options must be.
_TYPES: dict[str, tuple[type, str]] = {
    "float": (numbers.Real, "a number"),
    "int": (numbers.Integral, "a whole number of 32 bits"),
    "bool": (bool, "True or False"),
    "str": (str, "a str"),
    "os.PathLike": (os.PathLike, "os.PathLike"),
    "Camera": (Camera, "a fathom.Camera"),
}


def _unfit(annotation: str, value: Any) -> str | None:
    """What an argument must be, if it is not."""
    kinds = annotation.split(" | ")
    optional = kinds.pop() if kinds[-1] == "None" else None
    if not all(kind in _TYPES for kind in kinds) or (optional and value is None):
        return None
    fits = isinstance(value, tuple(_TYPES[kind][0] for kind in kinds))
    if fits and kinds == ["int"]:
        fits = -(2**31) <= value < 2**31
    return None if fits else " or ".join(_TYPES[kind][1] for kind in kinds)


def _problem(signature: inspect.Signature, args: tuple[Any, ...], kwargs: dict[str, Any]) -> str | None:
    """Why these arguments do not fit."""
    names = list(signature.parameters)
    if not any(each.kind is each.VAR_KEYWORD for each in signature.parameters.values()):
        for name in kwargs:
            if name not in names:
                nearest = difflib.get_close_matches(name, names, 1)
                return f" has no argument {name!r}" + (f"; the nearest is {nearest[0]!r}" if nearest else "")
    try:
        bound = signature.bind(*args, **kwargs)
    except TypeError as error:
        return f": {error}"
    for name, value in bound.arguments.items():
        wanted = _unfit(signature.parameters[name].annotation, value)
        if wanted:
            cure = ""
            if name == "camera" and isinstance(value, dict):
                cure = "; fathom.Camera(**keys) makes one"
            elif name == "camera" and "color" in names:
                cure = "; depth and camera come first, then color"
            return f": {name} must be {wanted}, not {' '.join(reprlib.repr(value).split())}{cure}"
    return None


def readable(function: Any) -> Any:
    """The same as a built-in function with a signature, whose TypeErrors say which argument is wrong."""
    name = function.__name__
    text, doc, *defaults = function.__nb_signature__[0]
    scope: dict[str, Any] = {"defaults": defaults[0] if defaults else None}
    exec("from __future__ import annotations\n" + re.sub(r"\\(\d+)", r"defaults[\1]", text) + ": ...", scope)
    signature = inspect.signature(scope[name])
    plain = [each.replace(annotation=inspect.Parameter.empty) for each in signature.parameters.values()]

    def explain(error: TypeError, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
        if str(error).startswith(f"{name}(): incompatible function arguments"):
            problem = _problem(signature, args, kwargs)
            if problem:
                raise TypeError(f"{name}(){problem}")

    return _built_in(name, str(inspect.Signature(plain)), doc, function, explain)

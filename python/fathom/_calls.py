"""Functions of the compiled module as those of Python are: with a signature, and messages that name the argument."""

from __future__ import annotations

import difflib
import inspect
import math
import operator
import os
import re
import reprlib
from typing import Any, Callable

from ._fathom import Camera, _built_in  # type: ignore[attr-defined]  # the stubs name what is public

# How many numbers an argument takes whose annotation leaves it open.
_LENGTHS = {"origin": 3, "region": 4, "focus_at": 2, "circle": 2, "fog_color": 3, "up": 3}


def _is_number(value: Any) -> bool:
    math.fabs(value)  # raises for anything else
    return True


def _is_whole(value: Any) -> bool:
    return -(2**31) <= operator.index(value) < 2**31


# By what an annotation is: the test, which may raise, and what the argument must be.
_KINDS: dict[str, tuple[Callable[[Any], object], str]] = {
    "float": (_is_number, "a number"),
    "int": (_is_whole, "a whole number of 32 bits"),
    "bool": (lambda value: isinstance(value, bool), "True or False"),
    "str": (lambda value: isinstance(value, str), "a str"),
    "str | os.PathLike": (lambda value: isinstance(value, (str, os.PathLike)), "a str or os.PathLike"),
    "collections.abc.Sequence[float]": (lambda values: all(map(_is_number, values)), "numbers"),
    "collections.abc.Sequence[int]": (lambda values: all(map(_is_whole, values)), "whole numbers"),
    "tuple[int, int, float]": (
        lambda value: len(value) == 3 and _is_whole(value[0]) and _is_whole(value[1]) and _is_number(value[2]),
        "2 whole numbers and a number",
    ),
    "Camera": (lambda value: isinstance(value, Camera), "a fathom.Camera"),
}


def _unfit(name: str, annotation: str, value: Any) -> str | None:
    """What an argument must be, if it is not."""
    kind = annotation.replace(" | None", "")
    if kind not in _KINDS or (value is None and kind != annotation):
        return None
    fits, wanted = _KINDS[kind]
    length = _LENGTHS.get(name)
    try:
        if fits(value) and (length is None or len(value) == length):
            return None
    except (TypeError, ValueError, OverflowError):
        pass
    return wanted if length is None else f"{length} {wanted}"


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
        wanted = _unfit(name, signature.parameters[name].annotation, value)
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

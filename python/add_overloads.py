"""Gives the operations of a stub the types of their results. usage: add_overloads.py RAW.pyi STUB.pyi

nanobind knows that they return an object. A type checker is told which: what `out` is, an Image for an Image, and an
array for any other depth.
"""

import re
import sys

OPERATIONS = ("linearize", "unproject", "normals", "ssao", "dof_masks", "dof", "fog", "fill_invalid")
HEAD = """
import typing

import numpy

from ._results import Array, DofMasks, Occlusion

__version__: str
Out = typing.TypeVar("Out", bound=typing.Union[Array, "Image"])

class CameraWarning(UserWarning): ...
"""


def overloads(match):
    name, arguments, doc = match.groups()

    def one(result, **types):
        changed = arguments
        for argument, type_of in types.items():
            changed, count = re.subn(
                rf"\b{argument}: [^=]*?(?: = None)?(?=, \w+:|, \*|$)", f"{argument}: {type_of}", changed
            )
            assert count == 1, (name, argument)
        return f"@typing.overload\ndef {name}({changed}) -> {result}: ...\n"

    flags = ("bent_normal", "confidence") if name == "ssao" else ()  # with one of them there are several results
    one_result = dict.fromkeys(flags, "typing.Literal[False] | None = None")
    several = "tuple | None = None"
    made = [] if name == "dof_masks" else [one("Out", out="Out", **one_result)]
    for depth, pixels in (("Image", "Image"), ("Array", "numpy.ndarray")):
        made += [
            one(f"Occlusion[{pixels}]", depth=depth, out=several, **{flag: "typing.Literal[True]"}) for flag in flags
        ]
        if name == "dof_masks":
            made.append(one(f"DofMasks[{pixels}]", depth=depth, out=several))
        else:
            made.append(one(pixels, depth=depth, out="None = None", **one_result))
    return "".join(made[:-1]) + made[-1].replace(": ...\n", f":\n{doc}")


raw, stub = sys.argv[1:]
with open(raw) as file:
    text = file.read()
text, count = re.subn(
    r'^def (\w+)\((.*)\) -> object:\n(    """(?:[^"]|"(?!""))*"""\n)', overloads, text, flags=re.MULTILINE
)
assert count == len(OPERATIONS), count
before, first, after = text.partition("\n\nclass ")
with open(stub, "w") as file:
    file.write(before + HEAD + first + after)

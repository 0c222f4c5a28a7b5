"""Writes fathom/_operations.py and its stub from what the library says of its operations: generate.py FOLDER"""

import json
import pathlib
import sys

import _fathom

COMMON = """
ignore: an image of the depth's size, of any dtype: pixels that are not 0 there do not count, as if they were invalid.
edges: with sharpen each pixel where depth ramps from one surface to the next gets the depth of one of the two, by `color` if there is
one; exact depth stays as it is (keep or sharpen; default: keep, and sharpen for relative depth).
storage: how elements hold depth, if their dtype and the camera's packing do not say it. out: where the result goes; its rows
may be any distance apart, its columns not. device: a fathom.Device, or "cpu", "gpu", one of devices(), its index, or a
part of a name. If depth is a fathom.Image, the result is one, too, and nothing is waited for.

Raises ValueError for bad arguments, fathom.Error for a camera of another size and from the device; NoDevice without one."""

LENS = """What is missing of the lens comes from the camera. Relative depth needs blur_px, and focus_at or focus_range; its camera
is None.
"""

STUB = """from typing import Any, Generic, Literal, NamedTuple, Sequence, TypeVar, Union, overload

import numpy

from ._arrays import Array, Storage
from ._camera import Camera
from ._fathom import BackDepth, Device, DeviceInfo, Image

Pixels = TypeVar("Pixels")
Out = TypeVar("Out", bound=Union[Array, Image])
"""

CODE = """# The operations, as their descriptions have them: python/generate.py has written this file.

from typing import Any, NamedTuple

from ._fathom import _run


def _fields(kind, made):
    return kind(*made) if isinstance(made, list) else made
"""

PIXELS = "Array | Image"
MORE = {"ignore": PIXELS, "edges": "Literal['keep', 'sharpen']", "storage": "Storage", "out": f"{PIXELS} | tuple", "device": "Device | DeviceInfo | str | int"}


def type_of(option):
    kind = option["kind"]
    if kind == "number":
        return "int" if option.get("whole") or "values" in option else "float"
    if kind in ("flag", "result"):
        return "bool"
    if kind == "choice":
        return f"Literal[{', '.join(map(repr, option['choices']))}]"
    if kind == "depth" and not option["needs"]:
        return "BackDepth"
    if kind in ("picture", "directions", "lengths", "depth"):
        return PIXELS
    of = {"ray": "tuple[int, int, float]", "pixel": "int", "region": "int"}.get(kind, "float")
    return of if kind == "ray" else f"Sequence[{of}] | numpy.ndarray"


def has_lens(operation):
    return any(option["name"] == "relative" for option in operation["options"])


def is_sized_by_picture(operation):
    """Does it take a picture of which nothing is computed but the size of the results?"""
    return operation["name"] == "dof_masks"


def said_of(operation, result):
    channels = f", {result['channels']}" if result["channels"] > 1 else ""
    like = "color" if any(option["name"] == "color" for option in operation["options"]) else "depth"
    shape = f"({result['size']}{channels}) float32" if result["channels"] else f"an array of the shape and dtype of {like}"
    return f"{shape}: {result['words']}"


def parameters(operation):
    """Those that need no name, and the others: name, type, and whether it may be left out."""
    types, optional, asked = {}, {}, set()
    for option in operation["options"]:
        name = option["name"]
        types[name] = f"{types[name]} | {type_of(option)}" if name in types else type_of(option)
        optional[name] = not option["required"]
        if option["kind"] == "result":
            asked.add(name)
    first = {name: types.pop(name) for name in list(types) if name in operation["arguments"]}
    if is_sized_by_picture(operation):
        types["color"] = PIXELS
    if operation["averaged"]:
        types["supersampled"] = "int"
    camera = "Camera | None" if has_lens(operation) else "Camera"
    return {"depth": PIXELS, "camera": camera} | first, types | MORE, {"depth": False, "camera": False} | optional, asked


def words_of(operation):
    lines, before = [operation["summary"], ""], None
    for option in operation["options"]:
        default = "" if option["kind"] == "result" or option["required"] else option["default_words"]
        limits = [option["accepted"]] * (option["kind"] not in ("flag", "result") and "image" not in option["accepted"])
        limits += [f"default: {default}"] * (default not in ("", "none"))
        said = f" ({'; '.join(limits)})" if limits else ""
        name = f"    or {option['accepted']}" if option["name"] == before else option["name"]
        lines.append(f"{name}: {option['words']}{said}.")
        before = option["name"]
    text = "\n".join(lines) + "\n" + (LENS if has_lens(operation) else "")
    if is_sized_by_picture(operation):
        text += "color: a picture in linear light, whose size and edges the results are to have.\n"
    if operation["averaged"]:
        text += "supersampled: depth and images are so many times as large as the camera's image; a result's pixels are means (1 to 4).\n"
    results = operation["results"]
    if not operation["several"]:
        return f"{text}\nReturns {said_of(operation, results[0])}.\n{COMMON}"
    text += f"\nReturns {said_of(operation, results[0])}. If another is asked for, a" if operation["first_alone"] else "\nReturns a"
    text += f" named tuple {operation['several']}, with None for what was not asked for. `out` is such a tuple then.\n"
    return text + "".join(f"{each['name']}: {said_of(operation, each)}\n" for each in results) + COMMON


def code_of(operation):
    first, rest, optional, _ = parameters(operation)
    text = ", ".join(
        [*(name + "=None" * optional[name] for name in first), "*"]
        + [name + "=None" * optional.get(name, True) for name in rest]
    )
    run = f'_run("{operation["name"]}", locals())'
    body = f"_fields({operation['several']}, {run})" if operation["several"] else run
    made = ""
    if operation["several"]:
        made = f'\n\nclass {operation["several"]}(NamedTuple):\n'
        made += f'    """Results of `{operation["name"]}`; None for what was not asked for."""\n\n'
        made += "".join(f"    {each['name']}: Any\n" for each in operation["results"]) + "\n"
        for each in operation["results"]:
            made += f"\n{operation['several']}.{each['name']}.__doc__ = {said_of(operation, each)!r}"
    return f'{made}\n\ndef {operation["name"]}({text}):\n    """{words_of(operation)}"""\n    return {body}\n'


def stub_of(operation):
    """What depth and `out` are, and which results are asked for, decides what is given back."""
    first, rest, optional, asked = parameters(operation)
    several, alone = operation["several"], not operation["several"] or operation["first_alone"]

    def overload(depth, out, out_is_optional, wanted, result):
        words = []
        for name, kind in [*first.items(), ("*", None), *rest.items()]:
            may_miss = optional.get(name, True)
            if name == "depth":
                kind = depth
            elif name == "out":
                kind, may_miss = out, out_is_optional
            elif name in asked and alone and wanted is None:
                kind = "Literal[False]"
            elif name == wanted:
                kind, may_miss = "Literal[True]", False
            words.append(name if kind is None else f"{name}: {kind}{' | None = None' if may_miss else ''}")
        return f"@overload\ndef {operation['name']}({', '.join(words)}) -> {result}: ...\n"

    text = overload(PIXELS, "Out", False, None, "Out") if alone else ""
    for depth, made in (("Image", "Image"), ("Array", "numpy.ndarray")):
        fields = f"{several}[{made}]"
        if alone:
            text += "".join(overload(depth, "tuple", True, each, fields) for each in sorted(asked))
            text += overload(depth, "None", True, None, made)
        if alone and several:  # a bool that nobody knows decides
            text += overload(depth, "Any", True, "", f"{fields} | {made}")
        if not alone:
            text += overload(depth, "tuple", True, None, fields)
    made = ""
    if several:
        made = f"\nclass {several}(NamedTuple, Generic[Pixels]):\n"
        made += "".join(f"    {each['name']}: Pixels{'' if each['always'] else ' | Any'}\n" for each in operation["results"])
    return f"{made}\n{text}"


KEYS = "arguments", "several", "first_alone", "averaged"
operations = [json.loads(text) | dict(zip(KEYS, more)) for text, *more in _fathom._described()]
names = [name for each in operations for name in (each["several"], each["name"]) if name]
for file, texts in (("_operations.py", [CODE, *map(code_of, operations)]), ("_operations.pyi", [STUB, *map(stub_of, operations)])):
    pathlib.Path(sys.argv[1], file).write_text("".join(texts) + f"\n\n__all__ = {names!r}\n", encoding="utf-8")

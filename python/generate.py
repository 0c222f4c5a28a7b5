"""Writes fathom/_operations.py and its stub from what the library says of its operations: generate.py FOLDER"""

import pathlib
import sys

import _fathom

COMMON = """
ignore: an image of the depth's size, of any dtype: pixels that are not 0 there do not count, as if they were invalid.
storage: how elements hold depth, if their dtype and the camera's packing do not say it. out: where the result goes; its rows
may be any distance apart, its columns not. device: a fathom.Device, or "cpu", "gpu", one of devices(), its index, or a
part of a name. If depth is a fathom.Image, the result is one, too, and nothing is waited for.

Raises ValueError for bad arguments, fathom.Error for a camera of another size and from the device; NoDevice without one."""

LENS = """What is missing of the lens comes from the camera. Relative depth needs blur_px, and focus_at or focus_range; its camera
is None.
"""

CHECK = """What is probably wrong with the camera for this depth: a sentence each, with the cure.

If nothing is, and a radius of ssao or a lens of dof is given, what is probably wrong with that: it reaches nothing or
everything that the image shows, or counts in another unit. What a lens lacks the camera gives, as for dof.

depth, storage, and what concerns lengths: as for the operations. All pixels count: about 50 ms for 1920 x 1080. Only
focus_at needs a device. The first call of an operation with a camera looks at a sample of its depth, in at most a
millisecond, and warns (CameraWarning) of the same.

Returns a list of str, empty if nothing looks wrong. Raises ValueError and fathom.Error as linearize does."""

STUB = '''from typing import Any, Generic, Literal, NamedTuple, Protocol, Sequence, TypeVar, Union, overload

import numpy
from typing_extensions import Buffer

from ._fathom import BackDepth, Camera, Device, DeviceInfo, Image

class SupportsDlpack(Protocol):
    def __dlpack__(self, *args: Any, **options: Any) -> Any: ...

NumpyArray = numpy.ndarray

# What pixels are read from and written to. Lists are not among them.
Array = Union[numpy.ndarray, SupportsDlpack, Buffer]
Pixels = TypeVar("Pixels")
Out = TypeVar("Out", bound=Union[Array, Image])
'''

CODE = '''"""The operations, as their descriptions have them: python/generate.py has written this file."""

from typing import Any, NamedTuple

from ._fathom import _check, _moved, _run


def _fields(kind, made):
    return kind(*made) if isinstance(made, list) else made
'''

FILL = """Stored depth without holes, as a blur needs it where a sensor measured nothing.

An invalid pixel takes the value of the nearest valid pixel to its left or to its right, the farther one of the two; in a row
without valid pixels that above or below."""

GROW = """Stored depth whose near surfaces are larger by some pixels, for a blur where depth is soft or lies beside its picture's edges.

Each pixel takes the value of the nearest surface that is at most so many pixels away. One is best for the depth of
neural networks. Invalid pixels stay invalid."""

PIXELS = "Array | Image"
STORAGE = f"Literal[{', '.join(map(repr, _fathom._storages()))}]"
MORE = {"ignore": PIXELS, "storage": STORAGE, "out": f"{PIXELS} | tuple", "device": "Device | DeviceInfo | str | int"}


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
    if operation["sized_by_picture"]:
        types["color"] = PIXELS
    camera = "Camera | None" if operation["has_lens"] else "Camera"
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
    text = "\n".join(lines) + "\n" + (LENS if operation["has_lens"] else "")
    if operation["sized_by_picture"]:
        text += "color: a picture in linear light, whose size and edges the results are to have.\n"
    results = operation["shown_results"]
    if not operation["several"]:
        return f"{text}\nReturns {results[0][1]}.\n{COMMON}"
    text += f"\nReturns {results[0][1]}. If another is asked for, a" if operation["first_alone"] else "\nReturns a"
    text += f" named tuple {operation['several']}, with None for what was not asked for. `out` is such a tuple then.\n"
    return text + "".join(f"{name}: {words}\n" for name, words, _ in results) + COMMON


def code_of(operation):
    first, rest, optional, _ = parameters(operation)
    text = ", ".join(
        [*(name + "=None" * optional[name] for name in first), "*"]
        + [name + "=None" * optional.get(name, True) for name in rest]
    )
    run = operation.get("run", f'_run("{operation["name"]}", locals())')
    body = f"_fields({operation['several']}, {run})" if operation["several"] else run
    made = ""
    if operation["several"]:
        made = f'\n\nclass {operation["several"]}(NamedTuple):\n'
        made += f'    """Results of `{operation["name"]}`; None for what was not asked for."""\n\n'
        made += "".join(f"    {name}: Any\n" for name, _, _ in operation["shown_results"]) + "\n"
        made += "".join(
            f"\n{operation['several']}.{name}.__doc__ = {words!r}" for name, words, _ in operation["shown_results"]
        )
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
        made += "".join(f"    {name}: Pixels{'' if always else ' | Any'}\n" for name, _, always in operation["shown_results"])
    return f"{made}\n{text}"


def depth_from(name, summary, run, options=()):
    """A function that makes depth of depth."""
    return {
        "name": name,
        "summary": summary,
        "options": options,
        "arguments": [option["name"] for option in options],
        "run": run,
        "shown_results": [("", "an array of the shape and dtype of depth", True)],
    } | dict.fromkeys(("several", "first_alone", "has_lens", "sized_by_picture"))


operations, lengths, grown = _fathom._descriptions()
operations.append(depth_from("fill_invalid", FILL, "_moved(locals(), 0)"))
operations.append(depth_from("grow_foreground", GROW, "_moved(locals(), pixels)", [grown]))
folder = pathlib.Path(sys.argv[1])
names = [name for each in operations for name in (each["several"], each["name"]) if name]
check = {option["name"]: type_of(option) for option in lengths}
code = CODE + "".join(map(code_of, operations))
code += f'\n\ndef check(depth, camera, *, storage=None, {", ".join(f"{name}=None" for name in check)}):\n'
code += f'    """{CHECK}"""\n    return _check(locals())\n\n\n__all__ = {[*names, "check"]!r}\n'
stub = STUB + "".join(map(stub_of, operations))
stub += f"\ndef check(depth: {PIXELS}, camera: Camera, *, storage: {STORAGE} | None = None, "
stub += ", ".join(f"{name}: {kind} | None = None" for name, kind in check.items()) + ") -> list[str]: ...\n"
folder.joinpath("_operations.py").write_text(code, encoding="utf-8")
folder.joinpath("_operations.pyi").write_text(stub + f"\n__all__ = {[*names, 'check']!r}\n", encoding="utf-8")

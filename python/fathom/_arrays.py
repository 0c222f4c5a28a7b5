"""Arrays that kernels cannot read as they lie: what is made of them, and what is wrong with them. python/src calls this."""

from __future__ import annotations

import reprlib
from typing import TYPE_CHECKING, Any, Literal, NoReturn, Protocol, Union, get_args

import numpy

if TYPE_CHECKING:
    from typing_extensions import Buffer

    class SupportsDlpack(Protocol):
        def __dlpack__(self, *args: Any, **options: Any) -> Any: ...

    NumpyArray = numpy.ndarray  # for the stub of _fathom, which does not import numpy
    # What pixels are read from and written to. Lists are not among them.
    Array = Union[numpy.ndarray, SupportsDlpack, Buffer]

Storage = Literal["float32", "float16", "uint8", "uint16", "uint24", "uint24-high",
                  "rgb8-red-low", "rgb8-red-high", "bgr8-red-low", "bgr8-red-high"]  # in the order of fathom::Storage
DTYPES = {"depth": "float32, float16, uint32, uint16 or uint8", "numbers": "float32"}
DTYPES["picture"] = DTYPES["relative"] = "float32, float16, uint16 or uint8"
MOST = 1 << 30  # of a side


def in_short(value: Any) -> str:
    return " ".join(reprlib.repr(value).split())


def check_kind(given: Any, argument: str) -> None:
    """Refuses what its memory alone does not say, and what lies in another memory than the CPU's before it is asked for."""
    if hasattr(given, "mask") and hasattr(given, "filled"):
        cure = ".filled(numpy.nan), of integers by .filled(CODE) with the camera's missing=CODE"
        raise ValueError(f"{argument}: a masked array's mask would be lost; make invalid pixels of it by {cure}")
    if hasattr(given, "__dlpack_device__") and given.__dlpack_device__()[0] not in (1, 3):  # the CPU's, and pinned for CUDA
        raise ValueError(f"{argument}: lies on another device; copy it to the CPU, as with .cpu()")


def as_numpy(given: Any, argument: str) -> numpy.ndarray:
    check_kind(given, argument)
    try:
        return given if isinstance(given, numpy.ndarray) else numpy.asarray(memoryview(given))
    except TypeError:
        pass
    if hasattr(given, "__array_interface__") and not hasattr(given, "__dlpack__"):
        return numpy.asarray(given)
    try:
        return numpy.from_dlpack(given)
    except Exception as error:
        what = "does not give its memory by the buffer protocol or DLPack, as NumPy's arrays do"
        raise ValueError(f"{argument}: {type(given).__name__} {what}: {error}") from error


def readable(given: Any, holds: str, argument: str) -> numpy.ndarray:
    """Elements of one of the dtypes, whose columns and channels lie side by side: the array's own if they do."""
    array = as_numpy(given, argument)
    if array.dtype == "int16" and holds in ("depth", "relative") and array.size:  # codes, or floats where some are below 0
        array = array.astype("float32" if array.min() < 0 else "uint16")
    is_dtype = array.dtype.name in DTYPES[holds].replace(" or", ",").split(", ")
    if not is_dtype or array.ndim not in (2, 3) or not all(0 < side <= MOST for side in array.shape):
        wanted = f"(height, width) or (height, width, channels), from 1 to {MOST}, of {DTYPES[holds]}, as .astype() makes it"
        raise ValueError(f"{argument}: it has the shape {array.shape} and the dtype {array.dtype}; it must be {wanted}")
    row = array.strides[0] if len(array) > 1 else array[0].nbytes
    if array[0].flags.c_contiguous and row >= array[0].nbytes and array.dtype.isnative and array.flags.aligned:
        return array
    return numpy.array(array, array.dtype.newbyteorder("="), order="C")


def refuse_target(given: Any, argument: str, dtype: str, shape: tuple[int, ...]) -> NoReturn:
    if isinstance(given, tuple):
        raise ValueError(f"{argument}: a tuple is given, but this call has one result; give one array")
    array = as_numpy(given, argument)
    its = f"has the shape {array.shape}, the dtype {array.dtype.str}, the strides {array.strides}"
    wanted = f"{shape} of {dtype} in this machine's byte order, with gaps between rows only, and rows that go forwards"
    raise ValueError(f"{argument}: {its}{' and is read-only' * (not array.flags.writeable)}; it must be writable, and {wanted}")


def storage_index(name: object) -> int:
    if name in (names := get_args(Storage)):
        return names.index(name)
    raise ValueError(f"storage = {name!r} is unknown; it is {', '.join(names)}")


def mask(ignore: Any, shape: tuple[int, int]) -> numpy.ndarray:
    """Pixels that do not count: anything that NumPy compares with 0."""
    given = numpy.asarray(ignore)
    if given.shape != shape:
        raise ValueError(f"ignore: its shape is {given.shape}; it must be that of the depth, {shape}")
    return numpy.ascontiguousarray(given != 0)


def floats(given: Any, holds: str, argument: str) -> tuple[numpy.ndarray, int]:
    """A new array of float32, and the bits of an element. Codes are not scaled."""
    array = readable(given, holds, argument)
    return numpy.array(array, "float32", order="C"), 32 if array.dtype.kind == "f" else 8 * array.itemsize


def relative(depth: Any, picture: Any, ignore: Any) -> tuple[numpy.ndarray, int, numpy.ndarray | None]:
    """Depth without a unit, its bits, and the light of the picture that it belongs to."""
    values, bits = floats(depth, "relative", "depth")
    if ignore is not None:
        values[mask(ignore, values.shape[:2])] = numpy.nan
    if picture is None:
        return values, bits, None
    light, bits_of_light = floats(picture, "picture", "color")
    return values, bits, light if bits_of_light == 32 else light / numpy.float32(2**bits_of_light - 1)

from typing import Any, Generic, NamedTuple, Protocol, TypeVar, Union

import numpy
from typing_extensions import Buffer

from ._fathom import Image

class SupportsDlpack(Protocol):
    def __dlpack__(self, *args: Any, **options: Any) -> Any: ...

NumpyArray = numpy.ndarray

# What pixels are read from and written to. Lists are not among them.
Array = Union[numpy.ndarray, SupportsDlpack, Buffer]
Pixels = TypeVar("Pixels")

# `Pixels | Any`: None where it was not asked for.
class Occlusion(NamedTuple, Generic[Pixels]):
    visibility: Pixels
    bent_normal: Pixels | Any
    confidence: Pixels | Any

class DofMasks(NamedTuple, Generic[Pixels]):
    coc: Pixels
    near_weight: Pixels | Any
    focus_weight: Pixels | Any
    far_weight: Pixels | Any
    max_near_coc: Pixels | Any
    near_alpha: Pixels | Any
    disocclusion: Pixels | Any
    mixed_pixels: Pixels | Any
    tile_min_coc: Pixels | Any
    tile_max_coc: Pixels | Any

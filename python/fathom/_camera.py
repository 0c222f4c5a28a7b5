"""fathom.Camera: the keys of the camera file as keyword arguments, and the importers."""

from __future__ import annotations

import importlib
import json
import math
import os
import pathlib
import re
import warnings
from typing import Any

import numpy
import numpy.typing

from . import _fathom
from ._arrays import storage_index


class CameraWarning(UserWarning):
    """A camera that can be used, but that hardly anybody means, by itself or for its depth. Each camera is told once."""


_OTHERS = """; this build of the package reads camera files, glTF and transforms.json: convert others with fathom camera, or build \
from source (docs/python.md)"""


def in_python(said: str) -> str:
    """A message of the importers, whose options are the program's, with Python's arguments."""
    said = re.sub(r" \(--(camera|channel)\)", "", said.replace("--undistorted", "undistorted=True"))
    said = re.sub(r"--preset ([^ ;,)]+(?:,[^ ;,)]+)*)", r'preset="\1"', said)
    return re.sub(r"--(image|node|preset)", r"\1=", said)


def warn(said: list[str], name: str) -> None:
    """In the name of whoever called the function that calls this."""
    for each in said:
        warnings.warn(f"{name}: {in_python(each)}", CameraWarning, 3)


def map_of_rays(file: pathlib.Path) -> numpy.ndarray:
    """A map of rays, as NumPy writes it."""
    if file.suffix != ".npy":
        raise ValueError("is a map of rays, which the Python package reads from .npy: numpy.save(file, rays)")
    rays = numpy.load(file)
    if rays.dtype.kind != "f" or rays.ndim != 3 or rays.shape[2] != 3:
        raise ValueError("is no map of rays, which has rows, columns and three floats a pixel")
    return numpy.ascontiguousarray(rays, "float32")


def _plain(value: Any, key: str) -> Any:
    """What JSON has for it. 1280 / 2 is meant as a whole number."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(name): _plain(each, f"{key}.{name}") for name, each in value.items() if each is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(each, key) for each in value]
    if isinstance(value, (str, int)):
        return value
    number = float(value) if hasattr(value, "__float__") else math.nan
    if math.isnan(number) or number == -math.inf:
        raise ValueError(f'Camera: "{key}": {value!r} is no number, text, list or dict of a camera file')
    return "infinity" if number == math.inf else int(number) if number.is_integer() and 0 < abs(number) <= 2**53 else number


def _keys(given: dict[str, Any]) -> dict[str, Any]:
    """The camera file's keys. Those of `perspective`, `intrinsics` and `orthographic` may stand alone."""
    keys = {key: _plain(value, key) for key, value in given.items() if value is not None}
    for key in [key for key in keys if _fathom._object_of(key)]:
        whole = keys.setdefault(_fathom._object_of(key), {})
        if not isinstance(whole, dict) or key in whole:
            raise ValueError(f'Camera: "{key}" is given twice, alone and by "{_fathom._object_of(key)}"; keep one')
        whole[key] = keys.pop(key)
    return keys


def _of_text(text: str, source: str | os.PathLike[str] = "Camera", for_view_depth: bool = False) -> Camera:
    made = Camera.__new__(Camera)
    _fathom._Camera.__init__(made, text, source)
    return made.for_view_depth() if for_view_depth else made


class Camera(_fathom._Camera):
    """What stored depth means: projection, size, encoding, pose.

    Camera(**keys) takes the keys of the camera file (docs/camera.md) as keyword arguments:

        Camera(width=640, height=480, intrinsics={"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5},
               encoding="view-z", scale=0.001, missing=0)

    Numbers, text, lists, dicts and NumPy arrays will do; None leaves a key out. The keys of `perspective`, `intrinsics` and
    `orthographic` may stand alone: Camera(fov_y_deg=60, near=0.1, far=50). Without width and height the camera fits an array
    of any size. `preset` names what writes the depth, one of fathom.presets():

        Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)

    Principal points are counted from the corner of the first pixel, unless pixel_origin="centre".

    Two cameras are equal if their keys are.

    Raises ValueError naming the key, its value and what would be right. Warns (CameraWarning) of keys that are probably wrong.
    """

    def __init__(self, **keys: Any) -> None:
        super().__init__(json.dumps(_keys(keys)), "Camera")
        warn(self._doubts(), "Camera")

    @staticmethod
    def load(
        path: str | os.PathLike[str],
        *,
        image: str = "",
        node: str = "",
        preset: str = "",
        undistorted: bool = False,
        storage: str | None = None,
        depth: str | os.PathLike[str] = "",
    ) -> Camera:
        """Reads a camera file (JSON), glTF or transforms.json; with the importers of fathom_io also the header of an
        OpenEXR image, calibrations of OpenCV and ROS, and COLMAP (docs/cameras.md).

        image: of COLMAP or transforms.json, whose camera is meant. node: of glTF, its name or index. preset: what the values of
        the depth mean, as in "carla" or "encoding=view-z". undistorted: the depth has been undistorted. storage: of the depth;
        ROS counts integers in millimetres and floats in metres. depth: the depth's file, whose name chooses among images.

        Raises fathom.Error, one line with the file's name.
        """
        file, stored = os.fspath(path), -1 if storage is None else storage_index(storage)
        arguments = (file, image, node, preset, undistorted, stored, os.fspath(depth))
        try:
            text, said = _fathom._camera_file(*arguments)
        except _fathom.Error as error:
            text, said = _of_other_importers(arguments, error)
        camera = _of_text(text, file)
        warn(said + camera._doubts(), file)
        return camera

    @staticmethod
    def from_json(text: str) -> Camera:
        """The camera of a camera file's text."""
        camera = _of_text(text)
        warn(camera._doubts(), "Camera")
        return camera

    def for_view_depth(self) -> Camera:
        """The same camera for view depth, as `linearize` makes it: normals(linearize(depth, c), c.for_view_depth())."""
        made = Camera.__new__(Camera)
        _fathom._Camera.__init__(made, self)
        return made

    def ray_of(self, pixels: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """Unit rays of pixel positions (x, y), (..., 2) to (..., 3), in the axes of view space. Positions count from the corner
        of the first stored pixel, so that centres lie at + 0.5. NaN where no ray meets a pixel: beyond a lens's fold, or outside
        a fisheye's circle."""
        return self._of_each(self._write_rays, pixels, "pixels", 2, 3)

    def pixel_of(self, directions: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """The pixel positions that see these directions of view space, (..., 3) to (..., 2): the inverse of ray_of. NaN where
        the camera sees nothing."""
        return self._of_each(self._write_pixels, directions, "directions", 3, 2)

    def _of_each(self, write: Any, given: numpy.typing.ArrayLike, name: str, columns: int, made: int) -> numpy.ndarray:
        vectors = numpy.array(given, "float64", order="C")
        if vectors.ndim == 0 or vectors.shape[-1] != columns:
            raise ValueError(f"{name} must have {columns} numbers along its last axis")
        if self.width is None or self.height is None:
            raise ValueError("the camera fits an image of any size, and its rays depend on the size; give width and height")
        found = numpy.full((*vectors.shape[:-1], made), numpy.nan)
        write(vectors.reshape(-1, columns), found.reshape(-1, made))
        return found

    def to_dict(self) -> dict[str, Any]:
        """The keys of the camera file: Camera(**camera.to_dict()) is the same camera. A camera for view depth has none."""
        if self._is_for_view_depth:
            raise ValueError("a camera for view depth has no camera file; keep the camera that for_view_depth() was called of")
        return json.loads(self._text)

    def __repr__(self) -> str:
        keys = ", ".join(f"{key}={value!r}" for key, value in json.loads(self._text).items())
        return f"fathom.Camera({keys}){'.for_view_depth()' * self._is_for_view_depth}"

    def __eq__(self, other: object, /) -> bool:
        is_same = isinstance(other, Camera) and self._is_for_view_depth == other._is_for_view_depth
        return is_same and json.loads(self._text) == json.loads(other._text)  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash((self.width, self.height))

    def __reduce__(self) -> Any:
        return _of_text, (self._text, "Camera", self._is_for_view_depth)


def _of_other_importers(arguments: Any, refusal: Exception) -> tuple[str, list[str]]:
    """What needs OpenCV, OpenEXR and a YAML parser to be read: a module of its own, which is loaded when it is needed."""
    try:
        return importlib.import_module("fathom._importers").camera_file(*arguments)
    except ImportError:
        others = "" if str(arguments[0]).endswith(".json") or not os.path.exists(arguments[0]) else _OTHERS
        raise _fathom.Error(in_python(str(refusal)) + others) from None
    except RuntimeError as error:
        raise _fathom.Error(in_python(str(error))) from None


def preset_camera(text: str, width: int, height: int) -> Camera:
    """The camera of a source of depth, from the text that the program's --preset takes.

        preset_camera("kinect:fx=525,fy=525,cx=319.5,cy=239.5", 640, 480)

    Raises ValueError naming what is missing.
    """
    camera = _of_text(_fathom._keys_of_preset(text, width, height))
    warn(camera._doubts(), "Camera")
    return camera

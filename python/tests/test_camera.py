"""Cameras: keys as keyword arguments, presets, files."""

import json
import os
import pickle
import sys
import warnings

import numpy
import pytest

import fathom
from conftest import HEIGHT, WIDTH, same_bits


def test_keys_are_those_of_the_camera_file(tmp_path, keys, millimetres):
    (tmp_path / "camera.json").write_text(json.dumps({**keys, "scale": 0.001}))
    os.rename(tmp_path / "camera.json", odd := os.fsencode(tmp_path) + b"/\xff.json")  # no UTF-8
    loaded = fathom.Camera.load(os.fsdecode(odd))
    made = fathom.Camera(**keys, scale=0.001)
    assert loaded == made and hash(loaded) == hash(made) and loaded != fathom.Camera(**keys, scale=0.002)
    assert (made.width, made.height) == (WIDTH, HEIGHT)
    assert made.to_dict() == {**keys, "scale": 0.001}
    assert eval(repr(made)) == made == fathom.Camera.from_json(json.dumps(made.to_dict()))
    assert same_bits(fathom.unproject(millimetres, loaded), fathom.unproject(millimetres, made))


def test_numbers_of_numpy_and_none_will_do(keys):
    view = numpy.array(keys["view"], numpy.float32)
    intrinsics = {key: numpy.float64(value) for key, value in keys["intrinsics"].items()}
    more = {
        **keys,
        "view": view,
        "intrinsics": intrinsics,
        "width": numpy.int64(WIDTH),
        "height": HEIGHT * 2 / 2,
        "near": None,
    }
    assert fathom.Camera(**more) == fathom.Camera(**keys)
    with pytest.raises(ValueError, match='"width": 9.5 must be a whole number'):
        fathom.Camera(**{**keys, "width": 9.5})


def test_keys_of_a_projection_may_stand_alone():
    whole = fathom.Camera(perspective={"fov_y_deg": 60}, near=0.1, far=float("inf"))
    assert fathom.Camera(fov_y_deg=60, near=0.1, far=float("inf")) == whole
    assert whole.to_dict()["far"] == "infinity" and whole.width is None


def test_presets(millimetres):
    kinect = fathom.Camera(preset="kinect", fx=90, fy=90, cx=47.5, cy=31.5)
    assert kinect.to_dict()["preset"] == "kinect"
    assert abs(fathom.linearize(millimetres, kinect)[30, 40] - 2.0) < 0.001
    assert numpy.isnan(fathom.linearize(millimetres, kinect)[0, 0])


MISTAKES = {
    "nan": ({"scale": float("nan")}, 'Camera: "scale": nan is no number'),
    "nan within": (
        {"intrinsics": {"fx": float("nan"), "fy": 1, "cx": 1, "cy": 1}},
        '"intrinsics.fx": nan is no number',
    ),
    "nan in a matrix": ({"view": [[float("nan")] * 4] * 4}, '"view": nan is no number'),
    "an object": ({"scale": object()}, '"scale": <object object at .* is no number'),
    "minus infinity": ({"far": float("-inf")}, '"far": -inf is no number'),
    "twice": ({"fx": 3}, '"fx" is given twice'),
    "twice within": ({"fx": 3, "intrinsics": {"fx": 3}}, '"fx" is given twice'),
    "no dict": ({"intrinsics": 3, "fx": 3}, '"fx" is given twice, alone and by "intrinsics"'),
}


@pytest.mark.parametrize("kind", MISTAKES)
def test_mistakes_are_value_errors(keys, kind):
    more, message = MISTAKES[kind]
    with pytest.raises(ValueError, match=message):
        fathom.Camera(**{**keys, **more})


def test_mistakes_of_presets():
    with pytest.raises(ValueError, match='"preset": "kinekt" is unknown; the nearest is "kinect"'):
        fathom.Camera(preset="kinekt")
    with pytest.raises(ValueError, match="needs a projection: fx, fy, cx and cy"):
        fathom.Camera(preset="kinect")


def test_the_camera_of_view_depth(millimetres, kinect):
    z = fathom.linearize(millimetres, kinect)
    of_z = kinect.for_view_depth()
    assert same_bits(fathom.linearize(z, of_z), z)
    for space in ("view", "world"):
        difference = fathom.unproject(z, of_z, space=space) - fathom.unproject(millimetres, kinect, space=space)
        assert numpy.nanmax(numpy.abs(difference)) <= 8 * 5 * 2**-24  # z's rounding and the positions', at 5 m
    with pytest.raises(ValueError, match="has no camera file"):
        of_z.to_dict()


def test_cameras_are_pickled(kinect, millimetres):
    for camera in (kinect, kinect.for_view_depth()):
        assert pickle.loads(pickle.dumps(camera)) == camera


def test_gltf(tmp_path):
    node = {"name": "eye", "camera": 0, "translation": [1, 2, 3]}
    lens = {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1, "zfar": 50, "aspectRatio": 1.5}}
    scene = {"asset": {"version": "2.0"}, "nodes": [node, {**node, "name": "other"}], "cameras": [lens]}
    (tmp_path / "scene.gltf").write_text(json.dumps(scene))
    with pytest.raises(fathom.Error, match="has 2 .*; say which with node=: eye, other"):
        fathom.Camera.load(tmp_path / "scene.gltf")
    camera = fathom.Camera.load(tmp_path / "scene.gltf", node="eye", preset="encoding=view-z")
    points = fathom.unproject(numpy.full((HEIGHT, WIDTH), 5, numpy.float32), camera, space="world")
    assert numpy.allclose(points.mean(axis=(0, 1)), [1, 2, -2], atol=1e-5)


def test_colmap_needs_the_importers(tmp_path):
    pytest.importorskip("fathom._importers")
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 96 64 90 88 48 32\n")
    camera = fathom.Camera.load(tmp_path / "cameras.txt", preset="colmap")
    assert camera.width == 96 and camera.to_dict()["intrinsics"]["fx"] == 90


EYE = numpy.eye(4).tolist()
ROS = "image_width: 96\nimage_height: 64\ndistortion_model: plumb_bob\n" + "".join(
    f"{name}:\n  rows: {rows}\n  cols: {cols}\n  data: {data}\n"
    for name, rows, cols, data in (
        ("camera_matrix", 3, 3, [90, 0, 48, 0, 88, 32, 0, 0, 1]),
        ("distortion_coefficients", 1, 5, [0.1, 0, 0, 0, 0]),
        ("rectification_matrix", 3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1]),
        ("projection_matrix", 3, 4, [90, 0, 48, 0, 0, 88, 32, 0, 0, 0, 1, 0]),
    )
)
SAID = {
    "the image of a shot": (
        "transforms.json",
        json.dumps({"camera_angle_x": 1, "frames": [{"file_path": f"{i}.png", "transform_matrix": EYE} for i in (1, 2)]}),
        {},
        "say which with image=: 1.png, 2.png",
    ),
    "what the values mean": (
        "transforms.json",
        json.dumps({"camera_angle_x": 1, "frames": [{"file_path": "1.png", "transform_matrix": EYE}]}),
        {},
        'name its source or give the keys: preset="tum", or preset="encoding=view-z,scale=0.001"',
    ),
    "no calibration": (
        "camera.json",
        '{"fov_y_deg": 60}',
        {"undistorted": True},
        "which undistorted=True is for; leave it out",
    ),
    "a topic": ("camera.yaml", ROS, {"undistorted": True}, 'preset="kinect" for 16UC1 (millimetres), preset="encoding=view-z"'),
}


@pytest.mark.parametrize("kind", SAID)
def test_messages_name_arguments_of_python(tmp_path, kind):
    name, text, arguments, said = SAID[kind]
    if name.endswith(".yaml"):
        pytest.importorskip("fathom._importers")
    (tmp_path / name).write_text(text)
    with pytest.raises(fathom.Error) as caught:
        fathom.Camera.load(tmp_path / name, **arguments)
    assert said in str(caught.value)
    assert "--" not in str(caught.value)


@pytest.mark.parametrize("turned", [False, True])
def test_keys_join_those_of_their_dict(keys, turned):
    inner = {key: keys["intrinsics"][key] for key in ("fx", "fy", "cy")}
    given = {"cx": keys["intrinsics"]["cx"], "intrinsics": inner}
    given = dict(reversed(given.items())) if turned else given
    outer = {key: value for key, value in keys.items() if key != "intrinsics"}
    assert fathom.Camera(**outer, **given) == fathom.Camera(**keys)


def test_a_preset_camera_is_that_of_its_keys():
    got = fathom.preset_camera("kinect:fx=525,fy=525,cx=319.5,cy=239.5", 640, 480)
    assert got == fathom.Camera(preset="kinect", width=640, height=480, fx=525, fy=525, cx=319.5, cy=239.5)
    assert (got.width, got.height) == (640, 480)


def test_a_camera_has_the_depth_of_a_pixel(millimetres, kinect):
    z = fathom.linearize(millimetres, kinect)
    assert fathom.depth_at(millimetres, kinect, 40, 30) == z[30, 40]
    assert fathom.depth_at(fathom.Image(millimetres), kinect, 40, 30) == z[30, 40]


def test_presets_are_listed():
    known = fathom.presets()
    assert list(known) == sorted(known) and all(isinstance(text, str) and text for text in known.values())
    assert {"kinect", "carla", "pybullet"} <= known.keys()
    with pytest.raises(ValueError, match="is unknown"):
        fathom.Camera(preset="no such")
    assert fathom.Camera(preset="tum", fx=525, fy=525, cx=319.5, cy=239.5).to_dict()["preset"] in known


def test_doubtful_keys_warn_once(keys, millimetres):
    with pytest.warns(
        fathom.CameraWarning, match='Camera: "perspective.fov_y_deg": 1.047.*if these are radians, write 60'
    ):
        fathom.Camera(width=96, height=64, fov_y_deg=1.047, encoding="view-z")
    middle = {"fx": 90, "fy": 90, "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        of_any_size = fathom.Camera(**middle, encoding="view-z", scale=0.001)  # no size, no doubt
        fathom.Camera(**keys)
    with pytest.warns(fathom.CameraWarning, match='say "pixel_origin": "centre"'):
        fathom.linearize(millimetres, of_any_size)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fathom.linearize(millimetres, of_any_size)
        fathom.linearize(numpy.vstack([millimetres, millimetres]), of_any_size)
        pickle.loads(pickle.dumps(of_any_size))
    assert issubclass(fathom.CameraWarning, UserWarning)


def test_a_damaged_camera_file_is_told_as_it_is(tmp_path, monkeypatch):
    """Without the importers, too, which a build may leave out."""
    monkeypatch.setitem(sys.modules, "fathom._importers", None)
    with pytest.raises(fathom.Error, match="none.json: there is no such file; check the path$"):
        fathom.Camera.load(tmp_path / "none.json")
    (tmp_path / "camera.json").write_text('{"widht": 3}')
    with pytest.raises(fathom.Error, match='unknown key "widht"; the nearest known one is "width"$'):
        fathom.Camera.load(tmp_path / "camera.json")
    (tmp_path / "broken.json").write_text('{"width": 3,')
    with pytest.raises(fathom.Error, match="is no JSON: (?!.*this build)"):
        fathom.Camera.load(tmp_path / "broken.json")
    (tmp_path / "camera.yaml").write_text("%YAML:1.0\n")
    with pytest.raises(fathom.Error, match="camera.yaml: .*; this build of the package reads camera files, glTF and transforms.json"):
        fathom.Camera.load(tmp_path / "camera.yaml")


def test_rays_of_pixels_and_pixels_of_rays(keys):
    """Of a pinhole by its definition, and there and back."""
    camera = fathom.Camera(**keys)
    pixels = numpy.stack(numpy.meshgrid(numpy.arange(WIDTH) + 0.5, numpy.arange(HEIGHT) + 0.5), axis=-1)
    rays = camera.ray_of(pixels)
    assert rays.shape == (HEIGHT, WIDTH, 3) and rays.dtype == numpy.float64
    points = fathom.unproject(numpy.full((HEIGHT, WIDTH), 2, numpy.float32), camera)
    assert numpy.allclose(rays, points / numpy.linalg.norm(points, axis=-1, keepdims=True), atol=1e-6)
    assert numpy.abs(camera.pixel_of(rays) - pixels).max() < 1e-9
    assert camera.ray_of(numpy.empty((0, 2))).shape == (0, 3)
    assert camera.ray_of([numpy.nan, 1]).shape == (3,) and numpy.isnan(camera.pixel_of([0, 0, 0])).all()


def test_a_map_of_rays_holds_floats(tmp_path):
    """Bytes are no directions."""
    camera = fathom.Camera(width=64, height=48, fx=40, fy=40, cx=32, cy=24, view_axes="opencv", encoding="view-z")
    pixels = numpy.stack(numpy.meshgrid(numpy.arange(64) + 0.5, numpy.arange(48) + 0.5), axis=-1)
    rays = camera.ray_of(pixels)
    size = {"width": 64, "height": 48, "view_axes": "opencv", "encoding": "view-z"}
    for kind in (numpy.float16, numpy.float32, numpy.float64):
        numpy.save(tmp_path / "rays.npy", rays.astype(kind))
        mapped = fathom.Camera(**size, lens={"rays": str(tmp_path / "rays.npy")})
        assert numpy.abs(mapped.ray_of(pixels) - rays).max() < numpy.finfo(kind).eps + 1e-7
        assert numpy.abs(mapped.pixel_of(mapped.ray_of(pixels)) - pixels).max() < 1e-9
    for wrong in (numpy.uint8(127 * (rays + 1)), numpy.int32(rays), rays[..., :2], rays[0]):
        numpy.save(tmp_path / "rays.npy", wrong)
        with pytest.raises(ValueError, match="rays.npy: is no map of rays, .* three floats a pixel"):
            fathom.Camera(**size, lens={"rays": str(tmp_path / "rays.npy")})


def test_rays_need_a_size_and_pairs(keys):
    with pytest.raises(ValueError, match="fits an image of any size"):
        fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5).ray_of([1, 2])
    with pytest.raises(ValueError, match="pixels must have 2 numbers along its last axis"):
        fathom.Camera(**keys).ray_of([1, 2, 3])
    with pytest.raises(ValueError, match="directions must have 3 numbers"):
        fathom.Camera(**keys).pixel_of(5)

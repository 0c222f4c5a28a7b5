"""usage: blender -b --factory-startup --python compare_passes.py -- FATHOM EXPORT_CAMERA.py FOLDER

Renders scenes in Cycles, exports their cameras, and compares what Fathom makes of the Z pass with Blender's own passes.
Opens the results as pictures, and in the compositor.
"""
import json
import math
import os
import re
import subprocess
import sys

import bpy
import numpy as np

FATHOM, EXPORT, FOLDER = sys.argv[sys.argv.index("--") + 1:]
sys.dont_write_bytecode = True  # The examples stay as they are.
sys.path.insert(0, os.path.dirname(EXPORT))
import export_camera

# A position may be off by this much of the distance to the camera: rounding, and a ray that misses the pixel's centre.
POSITION_ERROR = 1e-5
POSITION_FRACTION = 0.999
# The others may be anywhere in their pixel: as far as half its diagonal, at their depth.
FOOTPRINT = 0.5
# A direction may be off by this: the width of the filter in which Cycles puts its ray.
LENS_PIXELS = 0.01
# Blender's roundings of a hit, as in test_real_inputs.cpp.
ROUNDINGS = 16
# Cycles hits the lamp some 10 000 times. Their variance then has a standard deviation of 1 %, its root half of that.
CIRCLE_ERROR = 0.02

SIZE = 640, 400  # of the frames of perspective()

failures = []


def read_exr(path):
    """The channels of an uncompressed EXR of one part with scan lines of floats, by name."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:4] == b"\x76\x2f\x31\x01", "no EXR file"
    attributes, at = {}, 8
    while data[at]:
        name, kind, rest = data[at:at + 512].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size = int.from_bytes(data[at:at + 4], "little")
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    assert attributes[b"compression"] == b"\0", "compressed"
    left, top, right, bottom = np.frombuffer(attributes[b"dataWindow"], "<i4")
    width, height = right - left + 1, bottom - top + 1
    names, channels = [], attributes[b"channels"]
    while channels[0]:
        name, channels = channels.split(b"\0", 1)
        assert channels[:4] == b"\2\0\0\0", "not float32"
        names.append(name.decode())
        channels = channels[16:]
    offsets = np.frombuffer(data, "<u8", height, at + 1)
    rows = [np.frombuffer(data, "<f4", width * len(names), int(offset) + 8) for offset in offsets]
    return dict(zip(names, np.stack(rows).reshape(height, len(names), width).swapaxes(0, 1)))


def read_pfm(path):
    with open(path, "rb") as file:
        kind, size, scale = (file.readline().split() for _ in range(3))
        assert float(scale[0]) < 0, "big-endian"
        values = np.frombuffer(file.read(), "<f4")
    width, height = map(int, size)
    return values.reshape(height, width, 3 if kind == [b"PF"] else 1)[::-1].astype(float).squeeze()


def fathom(command, exr, camera, *options, strict=True):
    output = f"{exr}.{command}.pfm"
    subprocess.run([FATHOM, command, exr, "--camera", camera, "-o", output, *["--strict"][:strict], "--quiet", *options],
                   check=True)
    return read_pfm(output)


def build_world():
    """Flat faces at many angles before an empty sky."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=30, rotation=(0.05, -0.03, 0.2))
    bpy.ops.mesh.primitive_plane_add(size=3, location=(-2, 3, 1.5), rotation=(1.1, 0.4, 0.3))
    for i in range(7):
        angle, radius = 2.4 * i, 1 + 0.4 * i
        bpy.ops.mesh.primitive_cube_add(size=0.6 + 0.1 * i, rotation=(0.5 * i, 0.3 + 0.7 * i, angle),
                                        location=(radius * math.cos(angle), radius * math.sin(angle), 0.7))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, radius=0.8, location=(0, 0, 1.2))

    scene = bpy.context.scene
    scene.frame_end = 1
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene, camera


def hang(camera, scale, turn):
    """Gives the camera a parent, whose scale the renderer ignores in the camera's axes but not in its place."""
    parent = bpy.data.objects.new("Crane", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale, parent.rotation_euler = scale, (0, 0, turn)
    camera.parent = parent


def pose(camera, location, tilt, turn, frame=None):
    camera.location = location
    camera.rotation_euler = (tilt, 0.1, turn)
    if frame is not None:
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_euler", frame=frame)


def perspective():
    """Animated, off-centre, with pixels that are not square."""
    scene, camera = build_world()
    scene.frame_end = 2
    hang(camera, (2, 2, 2), 0.4)
    pose(camera, (0.5, -5, 1.9), 1.25, 0.1, frame=1)
    pose(camera, (2.5, -4, 2.4), 1.1, 0.5, frame=2)
    for frame, lens in ((1, 32), (2, 45)):
        camera.data.lens = lens
        camera.data.keyframe_insert("lens", frame=frame)
    camera.data.shift_x, camera.data.shift_y = 0.12, -0.07
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1, 1.25
    return scene


def orthographic():
    """Higher than wide, half an odd size, on a sensor that fits the height."""
    scene, camera = build_world()
    pose(camera, (3, -7, 6), 0.95, 0.4)
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 7
    camera.data.sensor_fit = "VERTICAL"
    camera.data.shift_y = 0.1
    camera.scale = (0.5, 0.5, 0.5)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 601, 801, 50
    return scene


def region():
    """A part of a frame that is cut out, through a camera that its parent shears."""
    scene, camera = build_world()
    hang(camera, (1.15, 1, 0.9), 0)
    pose(camera, (-3, -6, 3.5), 1.2, -0.45)
    camera.data.sensor_fit = "VERTICAL"
    camera.data.sensor_height = 20
    camera.data.lens = 40
    scene.render.resolution_x, scene.render.resolution_y = 807, 503
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.213, 0.871
    scene.render.border_min_y, scene.render.border_max_y = 0.117, 0.905
    return scene


def render(scene, stem, samples=1):
    """Renders the frames as multilayer EXRs, through the narrowest filter of Cycles, and saves the scene before."""
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.max_bounces = 0
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"  # BOX is a pixel wide, whatever the width says.
    scene.cycles.filter_width = 0.01
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_position = layer.use_pass_normal = True
    image = scene.render.image_settings
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    scene.render.filepath = f"{stem}.####"
    bpy.ops.wm.save_as_mainfile(filepath=f"{stem}.blend")
    bpy.ops.render.render(animation=True)


def export(stem, *options):
    """Exports the cameras as a user does."""
    return subprocess.run([bpy.app.binary_path, "-b", "--factory-startup", f"{stem}.blend", "--python", EXPORT, "--",
                           "--output", f"{stem}.%04d.json", *options], capture_output=True, text=True)


def check(good, text):
    print(("" if good else "FAILED: ") + text, flush=True)
    if not good:
        failures.append(text)


class Frame:
    """A rendered frame with its camera and Blender's own passes."""

    def __init__(self, exr, camera):
        self.exr, self.camera = exr, camera
        layers = {name.split(".", 1)[1]: values.astype(float) for name, values in read_exr(exr).items()}
        self.depth = layers["Depth.Z"]
        self.sky = self.depth >= 1e10
        self.positions = np.stack([layers[f"Position.{axis}"] for axis in "XYZ"], -1)
        self.normals = np.stack([layers[f"Normal.{axis}"] for axis in "XYZ"], -1)
        with open(camera, encoding="utf-8") as file:
            keys = json.load(file)
        projection = np.array(keys["projection"])
        place = np.linalg.inv(np.array(keys["view"]))[:3, 3]
        self.distance = np.linalg.norm(self.positions - place, axis=-1)
        # Blender computes in float32, from the camera's place on.
        self.rounding = ROUNDINGS * 2.0 ** -24 * (self.distance + np.linalg.norm(place))
        height, width = self.depth.shape
        w = self.depth if projection[3, 2] else np.ones_like(self.depth)
        self.pixel_width, self.pixel_height = (2 * w / (projection[i, i] * n) for i, n in ((0, width), (1, height)))

    def position_errors(self):
        ours = fathom("unproject", self.exr, self.camera, "--space", "world")
        assert np.array_equal(np.isfinite(ours).all(-1), ~self.sky), "other pixels have a position"
        return np.linalg.norm(ours - self.positions, axis=-1)

    def flat(self):
        """Pixels amid 5 × 5 of the same normal, which are on one plane here."""
        flat = ~self.sky
        for dy in range(-2, 3):
            for dx in range(-2, 3):
                off = np.abs(np.roll(self.normals, (dy, dx), (0, 1)) - self.normals).max(-1)
                flat &= (off < 1e-5) & ~np.roll(self.sky, (dy, dx), (0, 1))
        flat[:2] = flat[-2:] = flat[:, :2] = flat[:, -2:] = False
        return flat


def compare(stem, number):
    frame = Frame(f"{stem}.{number:04d}.exr", f"{stem}.{number:04d}.json")
    name, seen = os.path.basename(frame.exr), ~frame.sky
    z = fathom("linearize", frame.exr, frame.camera)
    check(np.array_equal(z, np.where(seen, frame.depth, np.inf)),
          f"{name}: {z.shape[1]} x {z.shape[0]}, {frame.sky.mean():.1%} sky, linearize gives the Depth pass")

    error = frame.position_errors()[seen]
    relative = error / frame.distance[seen]
    within = (relative <= POSITION_ERROR).mean()
    pixels = (error / np.hypot(frame.pixel_width, frame.pixel_height)[seen] * 2).max() / 2
    check(within >= POSITION_FRACTION and pixels <= FOOTPRINT,
          f"{name}: positions, {within:.4%} within {POSITION_ERROR:g} of the distance, 99.9 % within "
          f"{np.quantile(relative, 0.999):.1e}, worst {relative.max():.1e} or {pixels:.4f} of a pixel's diagonal")

    ours, flat = fathom("normals", frame.exr, frame.camera, "--space", "world"), frame.flat()
    sine, cosine = np.linalg.norm(np.cross(ours, frame.normals), axis=-1), (ours * frame.normals).sum(-1)
    angle = np.degrees(np.arctan2(sine, cosine))
    # Two depths a pixel apart are each off by a rounding.
    bound = np.degrees(2 * frame.rounding / np.minimum(frame.pixel_width, frame.pixel_height))
    check(flat.mean() > 0.5 and (angle[flat] <= bound[flat]).all(),
          f"{name}: normals on {flat.mean():.0%} of the pixels, worst {angle[flat].max():.4f} degrees or "
          f"{(angle / bound)[flat].max():.2f} of the bound")


def compare_scene(make):
    scene = make()
    stem = os.path.join(FOLDER, make.__name__)
    numbers = range(scene.frame_start, scene.frame_end + 1)
    render(scene, stem)
    done = export(stem)
    check(done.returncode == 0 and not done.stderr, f"{make.__name__}: exported, {done.stderr or 'no complaint'}")
    for number in numbers:
        compare(stem, number)
    if len(numbers) > 1:  # The bar tells one camera from another.
        wrong = Frame(f"{stem}.0001.exr", f"{stem}.0002.json")
        within = (wrong.position_errors() <= POSITION_ERROR * wrong.distance)[~wrong.sky].mean()
        check(within < 0.01, f"with the camera of another frame {within:.4%} are within {POSITION_ERROR:g}")


def check_backs():
    """Where cubes end, against a ray through each of them in doubles; planes end nowhere."""
    scene = perspective()
    scene.frame_set(1)
    cubes = [np.array(each.matrix_world) @ np.diag([*np.array(each.dimensions) / 2, 1])
             for each in scene.objects if each.name.startswith("Cube")]
    stem = os.path.join(FOLDER, "perspective")
    done = export(stem, "--backs", f"{stem}.backs.%04d.exr")
    check(done.returncode == 0 and not done.stderr, f"backs: rendered, {done.stderr or 'no complaint'}")
    for number in (1, 2):
        frame = Frame(f"{stem}.{number:04d}.exr", f"{stem}.{number:04d}.json")
        back = fathom("linearize", f"{stem}.backs.{number:04d}.exr", frame.camera, strict=False)
        with open(frame.camera, encoding="utf-8") as file:
            place = np.linalg.inv(np.array(json.load(file)["view"]))[:3, 3]
        ray = frame.positions - place  # as long as the distance to what is seen
        cube, end = np.zeros_like(frame.sky), np.full(frame.sky.shape, np.nan)
        for matrix in cubes:
            inverse = np.linalg.inv(matrix)
            with np.errstate(divide="ignore", invalid="ignore"):
                sides = ((np.array([[-1], [1]]) - (inverse[:3, :3] @ place + inverse[:3, 3]))
                         / (ray @ inverse[:3, :3].T)[..., None, :])
            enter, leave = sides.min(-2).max(-1), sides.max(-2).min(-1)
            seen = ~frame.sky & (enter < leave) & (np.abs(enter - 1) <= POSITION_ERROR)
            cube, end = cube | seen, np.where(seen, leave * frame.depth, end)
        here = cube & np.isfinite(back)
        error = np.quantile(np.abs(back[here] / end[here] - 1), POSITION_FRACTION)
        flat = ~cube & frame.flat()
        check(cube.mean() > 0.05 and here.sum() > 0.8 * cube.sum() and error <= POSITION_ERROR
              and np.isnan(back[flat & (np.abs(frame.normals[..., 2]) > 0.99)]).all(),
              f"backs: frame {number}, {here.sum()} of {cube.sum()} pixels of cubes end, 99.9 % within {error:.1e}")


def check_panoramas():
    """Depth of a panoramic camera counts along rays, and those are the lens's, whatever part of the frame is written."""
    for kind, (width, height), cropped in (
            ("EQUIRECTANGULAR", (640, 320), False), ("EQUIRECTANGULAR", (640, 300), True),
            ("FISHEYE_EQUIDISTANT", (400, 400), False), ("FISHEYE_EQUIDISTANT", (480, 400), True),
            ("FISHEYE_EQUISOLID", (480, 320), False), ("FISHEYE_EQUISOLID", (320, 480), True),
            ("FISHEYE_LENS_POLYNOMIAL", (480, 320), False), ("FISHEYE_LENS_POLYNOMIAL", (320, 480), True)):
        scene, camera = build_world()
        pose(camera, (0.5, -3, 1.9), 1.25, 0.3)
        scene.render.resolution_x, scene.render.resolution_y = width, height
        camera.data.type, camera.data.cycles.panorama_type = "PANO", kind
        camera.data.cycles.fisheye_fov = math.radians(200)
        if kind == "FISHEYE_LENS_POLYNOMIAL":
            camera.data.cycles.fisheye_polynomial_k0 = 0  # a lens that has a ray on its axis
        if cropped:
            camera.data.cycles.longitude_min, camera.data.cycles.latitude_max = -2, 1.1
            camera.data.sensor_fit = "VERTICAL"
            camera.data.sensor_height = 30
            camera.data.shift_x, camera.data.shift_y = 0.12, -0.07
            scene.render.pixel_aspect_y = 1.25
            scene.render.use_border = scene.render.use_crop_to_border = True
            scene.render.border_min_x, scene.render.border_max_x = 0.213, 0.871
            scene.render.border_min_y, scene.render.border_max_y = 0.117, 0.905
        stem = os.path.join(FOLDER, kind.lower() + ".part" * cropped)
        render(scene, stem)
        bpy.context.view_layer.update()
        [keys] = export_camera.export(scene, f"{stem}.json", [1])
        layers = {name.split(".", 1)[1]: values.astype(float) for name, values in read_exr(f"{stem}.0001.exr").items()}
        theirs = np.stack([layers[f"Position.{axis}"] for axis in "XYZ"], -1)
        ours = fathom("unproject", f"{stem}.0001.exr", keys, "--space", "world")
        place = np.array(camera.matrix_world.translation)
        distance, way = np.linalg.norm(theirs - place, axis=-1), ours - place
        # Cycles draws nothing outside the circle of a fisheye, and the angle that it ends at.
        seen = (layers["Depth.Z"] < 1e10) & (distance > 0) & (layers["Depth.Z"] > 0)
        length = np.linalg.norm(way, axis=-1)
        off = np.abs(length / distance - 1)[seen] / (1 + np.linalg.norm(place) / distance[seen])
        angle = np.linalg.norm(way / length[..., None] - (theirs - place) / distance[..., None], axis=-1)
        apart = np.linalg.norm(np.diff(way / length[..., None], axis=1), axis=-1)
        pixels = angle[seen] / np.median(apart[np.isfinite(apart)])
        check(seen.mean() > 0.3 and np.isfinite(length[seen]).all() and off.max() <= ROUNDINGS * 2.0 ** -24
              and np.quantile(pixels, POSITION_FRACTION) <= LENS_PIXELS,
              f"{kind}{' in part' * cropped}: {seen.mean():.0%} of the pixels, distances within {off.max() * 2.0 ** 24:.1f} roundings, 99.9 % of the "
              f"directions within {np.quantile(pixels, POSITION_FRACTION):.4f} of a pixel, all within {pixels.max():.4f}")


def refused(text, *arguments):
    """Does the export raise this, and leave nothing behind?"""
    output = os.path.join(FOLDER, "refused.%04d.json")
    try:
        export_camera.export(bpy.context.scene, *(arguments or (output, [1])))
        message = "was not refused"
    except ValueError as error:
        message = str(error)
    check(text in message and not os.path.exists(output % 1), f"refused: {message}")


def check_refusals():
    scene, camera = build_world()
    refused("no place for the number", os.path.join(FOLDER, "one.json"), [1, 2])
    refused("no camera 'Nobody' at frame 1; it has: Camera", os.path.join(FOLDER, "refused.%04d.json"), [1], "Nobody")
    camera.data.type = "PANO"
    refused("is of type panorama in BLENDER_EEVEE")
    scene.render.engine = "CYCLES"
    for kind, text in (("MIRRORBALL", "is of type MIRRORBALL"), ("FISHEYE_LENS_POLYNOMIAL", "set the polynomial's k0 to 0")):
        camera.data.cycles.panorama_type = kind
        camera.data.update_tag()
        refused(text)
    camera.data.type = "PERSP"
    scene.render.use_multiview = True
    refused("turn Stereoscopy off")
    scene.render.use_multiview = False
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.5, 0.5001
    refused("the render region holds no pixel")
    scene.render.use_border = False
    camera.scale = (1, 0, 1)
    refused("is scaled to nothing")
    camera.scale = (1, 1, 1)
    scene.camera = None
    refused("no active camera at frame 1")

    stem = os.path.join(FOLDER, "perspective")
    for options, text in ((("--camera", "Nobody"), "no camera 'Nobody'"),
                          (("--frames", "3-1"), "'3-1' is no list of frames"),
                          (("--frames",), "expected one argument")):
        done = export(stem, *options)
        check(done.returncode == 1 and done.stderr.startswith("export_camera: ") and done.stderr.count("\n") == 1
              and text in done.stderr, f"exit code {done.returncode}: {done.stderr.strip()}")


def keys_at(scene, frame):
    scene.frame_set(frame)
    return export_camera.camera_file(scene, scene.camera, bpy.context.evaluated_depsgraph_get())


def check_lens():
    scene, camera = build_world()
    pose(camera, (1, -4, 2), 1.2, 0.3)
    camera.scale = (3, 3, 3)
    focus = camera.data.dof
    focus.focus_distance = 7
    check(keys_at(scene, 1)["focus_distance"] == 7, "focus at a distance")

    bpy.ops.object.armature_add(location=(0.5, 1, 0.2))
    rig = bpy.context.object
    rig.pose.bones[0].location = (0.1, 0.4, -0.2)
    focus.focus_object = rig
    bpy.context.view_layer.update()
    for target, place in (("", rig.matrix_world), ("Bone", rig.matrix_world @ rig.pose.bones[0].matrix)):
        focus.focus_subtarget = target
        keys = keys_at(scene, 1)
        z = -np.array(keys["view"])[2] @ [*place.translation, 1]
        check(abs(keys["focus_distance"] / z - 1) < ROUNDINGS * 2.0 ** -24, f"focus on an object {target}: {z:.4f}")

    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    scene.collection.objects.link(other)
    other.data.lens = 85
    for frame, each in ((1, camera), (5, other)):
        scene.timeline_markers.new(each.name, frame=frame).camera = each
    lenses = [keys_at(scene, frame)["lens_mm"] for frame in (1, 4, 5)]
    check(lenses == [50, 50, 85], f"markers switch the camera: {lenses}")


def check_sky():
    scene, _ = build_world()
    for engine, sky in (("CYCLES", 1e10), ("BLENDER_EEVEE", 65504)):
        scene.render.engine = engine
        check(keys_at(scene, 1)["background_from"] == sky, f"the sky of {engine} is {sky}")


def add_lamp(radius, z):
    """A disc that shines and faces the camera."""
    bpy.ops.mesh.primitive_circle_add(vertices=64, radius=radius, fill_type="NGON", location=(0, 0, z))
    material = bpy.data.materials.new("Shining")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    material.node_tree.links.new(nodes.new("ShaderNodeEmission").outputs[0],
                                 nodes.new("ShaderNodeOutputMaterial").inputs[0])
    bpy.context.object.data.materials.append(material)


def blurred_width(exr, lamp):
    """Diameter in pixels of the circle that blurred a disc of this diameter: variances add, and a disc's is d²/16."""
    [light] = [values.astype(float) for name, values in read_exr(exr).items() if name.endswith("Combined.R")]
    variances = []
    for axis in (0, 1):
        along = light.sum(axis) / light.sum()
        at = np.arange(len(along))
        variances.append(along @ (at - along @ at) ** 2)
    return math.sqrt(16 * np.mean(variances) - lamp ** 2)


def check_blur(kind):
    """The circle of confusion from the camera file against the one that Cycles draws, for a long lens focused near."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    radius, z, size = 0.01, 2, 160
    add_lamp(radius, -z)
    scene = bpy.context.scene
    scene.frame_end = 1
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x = scene.render.resolution_y = size
    camera = scene.camera.data
    camera.type, camera.lens, camera.ortho_scale = kind, 200, 0.5
    camera.clip_start = 0.001  # Through an orthographic camera Cycles counts the focus from here, not from the camera.
    camera.dof.focus_distance = 1
    camera.dof.aperture_fstop = 2 if kind == "PERSP" else 8

    sharp, blurred = (os.path.join(FOLDER, f"{name}_{kind}") for name in ("sharp", "blurred"))
    render(scene, sharp)
    [keys] = export_camera.export(scene, f"{sharp}.json", [1])
    ours = fathom("dof-masks", f"{sharp}.0001.exr", keys, "--mask", "coc")[size // 2, size // 2]
    camera.dof.use_dof = True
    render(scene, blurred, samples=256)
    with open(keys, encoding="utf-8") as file:
        pixels_per_unit = json.load(file)["projection"][0][0] * size / 2 / (z if kind == "PERSP" else 1)
    theirs = blurred_width(f"{blurred}.0001.exr", 2 * radius * pixels_per_unit)
    check(abs(theirs / ours - 1) <= CIRCLE_ERROR,
          f"{kind}: Cycles blurs a point by {theirs:.2f} pixels, the camera file says {ours:.2f}")


def shown(image, layer=""):
    """The layers and passes of an image in the compositor, and what it gives out for those of one layer."""
    scene = bpy.context.scene
    scene.use_nodes = True
    tree, layers = scene.node_tree, {}
    tree.nodes.clear()
    source, file = (tree.nodes.new(f"CompositorNode{kind}") for kind in ("Image", "OutputFile"))
    source.image = image
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *SIZE, 100
    scene.render.use_border = False
    file.base_path = FOLDER
    file.format.file_format, file.format.color_depth, file.format.exr_codec = "OPEN_EXR", "32", "NONE"
    file.format.color_mode = "RGB"
    file.file_slots[0].path = "shown"
    try:
        source.layer = ""  # The refusal lists what there is.
        names = [""]
    except TypeError as refusal:
        names = re.findall("'([^']*)'", str(refusal).split("not found in")[1]) or [""]
    for name in names:
        if name:
            source.layer = name
        for socket in [socket for socket in source.outputs if socket.enabled]:
            layers[name, socket.name] = None
            if name != layer:
                continue
            tree.links.new(socket, file.inputs[0])
            bpy.ops.render.render()
            written = read_exr(os.path.join(FOLDER, f"shown{scene.frame_current:04d}.exr"))
            layers[name, socket.name] = np.stack([written[letter] for letter in "RGB"], -1)
    return layers


def check_opens(exr, camera):
    """Every kind of result opens: alone, and as passes of the layer Fathom beside those of the render."""
    grey = lambda name: [name] * 3
    kinds = (
        (["linearize"], {"linear": grey("Z")}),
        (["ssao", "--radius", "1"], {"AO": grey("AO")}),
        (["normals"], {"N": ["N.X", "N.Y", "N.Z"]}),
        (["unproject"], {"P": ["P.X", "P.Y", "P.Z"]}),
        (["dof-masks", "--circle", "9,99"], {name: grey(name) for name in ("coc", "near", "focus", "far")}),
        (["dof", "--color", exr, "--circle", "9,99"], {"dof": ["R", "G", "B"]}),
        (["fog", "--color", exr, "--density", "0.1"], {"fog": ["R", "G", "B"]}))
    before = shown(bpy.data.images.load(exr)).keys()
    for command, passes in kinds:
        name, alone, appended = command[0], f"{exr}.alone.exr", f"{exr}.appended.exr"
        for output, more in ((alone, ["--compression", "none"]), (appended, ["--append"])):
            subprocess.run([FATHOM, command[0], exr, "--camera", camera, *command[1:], "-o", output, "--quiet", *more],
                           check=True)
        channels = read_exr(alone)
        values = {each: np.stack([channels[c] for c in names], -1) for each, names in passes.items()}
        image = bpy.data.images.load(alone)
        first = next(iter(values.values()))
        if len(image.pixels):
            seen = np.array(image.pixels[:], "f4").reshape(*SIZE[::-1], image.channels)[::-1, :, :3]
        else:
            seen = next(iter(shown(image).values()))
        check(np.array_equal(seen, first, equal_nan=True), f"{name}: opens, {np.nanmin(first):.3g} to {np.nanmax(first):.3g}")
        layers = shown(bpy.data.images.load(appended), "Fathom")
        listed = {each: layers.get(("Fathom", each)) for each in passes}
        check(all(seen is not None and np.array_equal(seen, values[each], equal_nan=True)
                  for each, seen in listed.items()) and before <= layers.keys(),
              f"{name}: appended, Blender lists {', '.join(each for layer, each in layers if layer == 'Fathom')}")
        for path in (alone, appended):
            bpy.data.images.remove(bpy.data.images[os.path.basename(path)])


for scene_of in (perspective, orthographic, region):
    compare_scene(scene_of)
check_backs()
check_panoramas()
check_opens(*(os.path.join(FOLDER, f"perspective.0001.{end}") for end in ("exr", "json")))
check_refusals()
check_lens()
check_sky()
check_blur("PERSP")
check_blur("ORTHO")
print(f"{len(failures)} checks failed" if failures else "all checks passed")
sys.exit(bool(failures))

"""Writes one Fathom camera file per frame of a Blender scene, for its Z pass (Depth).

From a shell:

    blender -b scene.blend --python export_camera.py -- --output camera.%04d.json [--frames 1-10] [--camera NAME]
        [--backs backs.%04d.exr]

From Blender's Text Editor, the same for all frames, beside the saved .blend file. From Python:

    import export_camera
    export_camera.export(bpy.context.scene, "camera.%04d.json", range(1, 11))

With --backs it also renders where solids end, for `fathom ssao --back-depth`.

Positions that Fathom computes with --space world are those of Blender's Position pass. The file counts lengths in
scene units. Cycles takes a unit for a metre when it blurs, whatever the scene's Unit Scale says, and so does Fathom.
To blur as a real lens does at another Unit Scale, give `fathom dof` --mm-per-unit with 1000 times that scale.
"""
import argparse
import contextlib
import ctypes
import json
import math
import os
import re
import sys

import bpy


def rendered_pixels(render):
    """Width and height of the whole frame, and left, bottom, right and top of the part of it that is written."""
    width = render.resolution_x * render.resolution_percentage // 100
    height = render.resolution_y * render.resolution_percentage // 100
    if not (render.use_border and render.use_crop_to_border):
        return width, height, (0, 0, width, height)

    def pixel(fraction, size):
        return int(ctypes.c_float(fraction * size).value)  # Blender multiplies in float32 and cuts off the fraction.

    region = (pixel(render.border_min_x, width), pixel(render.border_min_y, height),
              pixel(render.border_max_x, width), pixel(render.border_max_y, height))
    if region[0] >= region[2] or region[1] >= region[3]:
        raise ValueError("the render region holds no pixel; draw another one, or turn it off")
    return width, height, region


def lens(scene, camera):
    """Where the rays of a panoramic camera of Cycles run, for the part of the frame that is written."""
    render, data = scene.render, camera.data
    width, height, region = rendered_pixels(render)
    left, bottom, right, top = (x + shift for x, shift in zip(region, 2 * (data.shift_x * width, data.shift_y * height)))
    of = data if hasattr(data, "panorama_type") else data.cycles  # before Blender 5
    kind = of.panorama_type if render.engine == "CYCLES" else f"panorama in {render.engine}"

    def intrinsics(fx, fy):
        return {"fx": fx, "fy": fy, "cx": width / 2 - left, "cy": top - height / 2}

    def part(low, high, first, last):
        return [math.degrees(low + (high - low) * share) for share in (first, last)]

    if kind == "EQUIRECTANGULAR":
        return {"lens": {"model": "equirectangular",
                         "longitude_deg": part(of.longitude_min, of.longitude_max, left / width, right / width),
                         "latitude_deg": part(of.latitude_min, of.latitude_max, bottom / height, top / height)}}
    if kind == "FISHEYE_EQUIDISTANT":  # the circle fills the frame
        return {"lens": {"model": "equidistant"},
                "intrinsics": intrinsics(width / of.fisheye_fov, height / of.fisheye_fov)}
    sides = width * render.pixel_aspect_x, height * render.pixel_aspect_y
    fit = data.sensor_fit if data.sensor_fit != "AUTO" else "HORIZONTAL" if sides[0] > sides[1] else "VERTICAL"
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    pixels_per_mm = [sides[fit == "VERTICAL"] / sensor / aspect
                     for aspect in (render.pixel_aspect_x, render.pixel_aspect_y)]
    if kind == "FISHEYE_EQUISOLID":
        return {"lens": {"model": "equisolid"},
                "intrinsics": intrinsics(*(of.fisheye_lens * each for each in pixels_per_mm))}
    if kind != "FISHEYE_LENS_POLYNOMIAL":
        raise ValueError(f"the camera {camera.name!r} is of type {kind}, which is no lens that Fathom knows; render an "
                         "equirectangular one or a fisheye in Cycles")
    if of.fisheye_polynomial_k0 != 0:
        raise ValueError(f"the camera {camera.name!r} has no ray along its axis; set the polynomial's k0 to 0")
    return {"lens": {"model": "blender-polynomial", "k": [getattr(of, f"fisheye_polynomial_k{i}") for i in range(5)]},
            "intrinsics": intrinsics(*pixels_per_mm)}


def projection(scene, camera, depsgraph):
    """The matrix from view space to the part of the frame that is written."""
    width, height, (left, bottom, right, top) = rendered_pixels(scene.render)
    matrix = camera.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=scene.render.pixel_aspect_x,
                                       scale_y=scene.render.pixel_aspect_y)
    rows = [list(row) for row in matrix]
    # The clip coordinates of the region: x' = (x - centre w) · width/(right - left).
    for row, size, low, high in ((0, width, left, right), (1, height, bottom, top)):
        centre = (low + high) / size - 1
        rows[row] = [(x - centre * w) * size / (high - low) for x, w in zip(rows[row], rows[3])]
    return rows


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def axes_and_place(camera):
    """The camera's x, y and z axis and its place in the world. Renderers ignore its scale."""
    columns = [column[:3] for column in camera.matrix_world.col]
    axes = [[x / (math.sqrt(dot(column, column)) or math.nan) for x in column] for column in columns[:3]]
    return axes, columns[3]


def view(camera):
    """World to view space: the inverse in doubles, which Blender's own matrices are not."""
    (x, y, z), place = axes_and_place(camera)
    volume = dot(x, cross(y, z))
    if not abs(volume) > 0:
        raise ValueError(f"the camera {camera.name!r} is scaled to nothing along an axis; apply its scale")
    rows = [[element / volume for element in row] for row in (cross(y, z), cross(z, x), cross(x, y))]
    return [row + [-dot(row, place)] for row in rows] + [[0.0, 0.0, 0.0, 1.0]]


def focus_distance(camera, depsgraph):
    """Distance of the focus along the view axis."""
    focus = camera.data.dof
    if focus.focus_object is None:
        return focus.focus_distance
    target = focus.focus_object.evaluated_get(depsgraph)
    matrix = target.matrix_world
    if target.type == "ARMATURE" and focus.focus_subtarget in target.pose.bones:
        matrix = matrix @ target.pose.bones[focus.focus_subtarget].matrix
    axes, place = axes_and_place(camera)
    return abs(dot(axes[2], [a - b for a, b in zip(matrix.translation, place)]))


def camera_file(scene, camera, depsgraph):
    """The keys of the camera file for the frame that the dependency graph is at (docs/camera.md of Fathom)."""
    camera = camera.evaluated_get(depsgraph)
    if not camera.is_evaluated:
        raise ValueError(f"the camera {camera.name!r} is in no collection of the view layer; include its collection")
    if scene.render.use_multiview:
        raise ValueError("the scene renders several views; turn Stereoscopy off and export each camera with --camera")
    _, _, (left, bottom, right, top) = rendered_pixels(scene.render)
    is_panorama = camera.data.type == "PANO"
    return {
        "width": right - left,
        "height": top - bottom,
        **(lens(scene, camera) if is_panorama else {"projection": projection(scene, camera, depsgraph)}),
        "view": view(camera),
        "encoding": "ray-distance" if is_panorama else "view-z",
        # Cycles has 1e10 for the sky. Eevee of Blender 3.4 keeps its depth in half floats, which end at 65504.
        "background_from": 1e10 if scene.render.engine == "CYCLES" else 65504,
        # No "sensor_mm": with both, Fathom's lens moves to focus and changes the picture's size. Blender's does not.
        # Through an orthographic camera the aperture of Cycles is one unit over the f-number.
        "lens_mm": 1000 if camera.data.type == "ORTHO" else camera.data.lens,
        "f_stop": camera.data.dof.aperture_fstop,
        "focus_distance": focus_distance(camera, depsgraph),
    }


def as_text(keys):
    """JSON with a line for each key, and for each row of a matrix."""
    def value(item):
        if isinstance(item, list):
            return "[\n    " + ",\n    ".join(json.dumps(row, allow_nan=False) for row in item) + "\n  ]"
        return json.dumps(item, allow_nan=False)

    return "{\n" + ",\n".join(f"  {json.dumps(key)}: {value(item)}" for key, item in keys.items()) + "\n}\n"


def write_whole(path, text):
    """Writes a file, or leaves none behind."""
    part = path + ".part"
    try:
        with open(part, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(part, path)
    except OSError:
        if os.path.exists(part):
            os.remove(part)
        raise


def paths_of(output, frames):
    """One path for each frame."""
    output = bpy.path.abspath(output)
    try:
        paths = [output % frame for frame in frames]
    except (TypeError, ValueError):
        paths = [output] if len(frames) == 1 and "%" not in output else []
    if len(set(paths)) != len(frames) or not frames:
        raise ValueError(f"{output!r} has no place for the number of each frame; write one as in camera.%04d.json")
    return paths


def camera_files(scene, frames, camera_name=None):
    """Goes to each frame and yields its number, the keys of its camera file, and what is wrong with its render, or None.

    Raises ValueError with the reason where the scene has no camera that a camera file can describe.
    """
    before = scene.frame_current
    try:
        for frame in frames:
            scene.frame_set(frame)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            # Markers may switch the scene's camera, so it is asked for at each frame.
            camera = scene.objects.get(camera_name) if camera_name else scene.camera
            if camera is None or camera.type != "CAMERA":
                cameras = ", ".join(each.name for each in scene.objects if each.type == "CAMERA") or "none"
                wanted = f"no camera {camera_name!r}" if camera_name else "no active camera"
                raise ValueError(f"the scene {scene.name!r} has {wanted} at frame {frame}; it has: {cameras}")
            blurs = [name for name, on in (("Depth of Field", camera.data.dof.use_dof),
                                           ("Motion Blur", scene.render.use_motion_blur)) if on]
            yield frame, camera_file(scene, camera, depsgraph), (
                f"frame {frame} has {' and '.join(blurs)}, also in its passes; turn that off, and render again"
                if blurs else None)
    finally:
        scene.frame_set(before)


def export(scene, output, frames, camera_name=None):
    """Writes the camera files and returns their paths. `output` holds a place for the frame's number: camera.%04d.json

    Raises ValueError with the reason where the scene has no camera that a camera file can describe.
    """
    frames = list(frames)
    paths = paths_of(output, frames)
    with contextlib.closing(camera_files(scene, frames, camera_name)) as cameras:
        for path, (_, keys, blurred) in zip(paths, cameras):
            text = as_text(keys)
            os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
            write_whole(path, text)
            if blurred:
                print(f"export_camera: warning: {blurred}", file=sys.stderr)
    return paths


def only_backs():
    """A material that shows the back faces alone."""
    material = bpy.data.materials.new("Fathom backs")
    material.use_nodes = True
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    nodes.clear()
    mix = nodes.new("ShaderNodeMixShader")
    link(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], mix.inputs[0])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeEmission").outputs[0], mix.inputs[2])
    link(mix.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs[0])
    return material


def layer_of(scene, material=None):
    """A copy of the scene that renders its first layer in a moment: depth, and which object a pixel shows."""
    copy = scene.copy()
    used = next((layer for layer in copy.view_layers if layer.use), copy.view_layers[0])
    for layer in copy.view_layers:
        layer.use = layer == used
    used.use_pass_z = used.use_pass_object_index = True
    used.material_override = material or used.material_override
    copy.render.engine = "CYCLES"
    copy.render.use_motion_blur = copy.render.use_sequencer = copy.cycles.use_denoising = False
    copy.cycles.samples = 1
    copy.cycles.transparent_max_bounces = 1024  # a front face is one
    return copy


def export_backs(scene, output, frames, camera_name=None):
    """Renders the depth where the solid that a pixel shows ends, and returns the files' paths.

    That is the nearest back face along the pixel's ray, if it belongs to the same object. A pixel of an open mesh has 0.
    """
    frames = list(frames)
    paths = paths_of(output, frames)
    before, objects = scene.frame_current, {each: each.pass_index for each in scene.objects}
    material = only_backs()
    fronts, backs = layer_of(scene), layer_of(scene, material)
    fronts.use_nodes = fronts.render.use_compositing = True
    nodes, link = fronts.node_tree.nodes, fronts.node_tree.links.new
    nodes.clear()

    def rendered(of):
        node = nodes.new("CompositorNodeRLayers")
        node.scene, node.layer = of, next(layer.name for layer in of.view_layers if layer.use)
        return node.outputs

    def math_of(operation, *inputs):
        node = nodes.new("CompositorNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, inputs):
            if isinstance(value, float):
                socket.default_value = value
            else:
                link(value, socket)
        return node.outputs[0]

    front, back = rendered(fronts), rendered(backs)
    same = math_of("COMPARE", front["IndexOB"], back["IndexOB"], 0.5)
    farther = math_of("GREATER_THAN", back["Depth"], math_of("MULTIPLY", front["Depth"], 1 + 2.0 ** -16))
    file = nodes.new("CompositorNodeOutputFile")
    file.format.file_format, file.format.color_depth = "OPEN_EXR_MULTILAYER", "32"
    file.layer_slots.clear()
    link(math_of("MULTIPLY", back["Depth"], math_of("MULTIPLY", same, farther)), file.layer_slots.new("ZBack"))
    try:
        for number, each in enumerate(objects):
            each.pass_index = number + 1
        for frame, path in zip(frames, paths):
            if camera_name:
                fronts.camera = backs.camera = scene.objects[camera_name]
            for each in (scene, fronts, backs):
                each.frame_set(frame)
            os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
            file.base_path = f"{os.path.abspath(path)}.part.#"
            bpy.ops.render.render(scene=fronts.name)
            os.replace(f"{path}.part.{frame}.exr", path)
    finally:
        scene.frame_set(before)
        for each, number in objects.items():
            each.pass_index = number
        for copy in (fronts, backs):
            bpy.data.scenes.remove(copy)
        bpy.data.materials.remove(material)
    return paths


def frame_numbers(text):
    """The frames of a list such as 1-10,15."""
    frames = []
    for part in text.split(","):
        found = re.fullmatch(r"(-?\d+)(?:-(-?\d+))?", part.strip())
        if not found or int(found[2] or found[1]) < int(found[1]):
            raise argparse.ArgumentTypeError(f"{text!r} is no list of frames; write one as in 1-10,15")
        frames += range(int(found[1]), int(found[2] or found[1]) + 1)
    return frames


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise ValueError(message)


def main():
    parser = Parser(prog="export_camera", description=__doc__.split("\n")[0])
    parser.add_argument("--output", required=bpy.app.background, default="//camera.%04d.json",
                        help="file to write, with a place for the frame's number: camera.%%04d.json")
    parser.add_argument("--frames", type=frame_numbers, help="frames as in 1-10,15 (default: those of the scene)")
    parser.add_argument("--camera", help="name of the camera (default: the one that renders)")
    parser.add_argument("--backs", help="depth where solids end, to render for ssao --back-depth: backs.%%04d.exr")
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    asked = parser.parse_args(arguments)
    scene = bpy.context.scene
    if not bpy.data.filepath:
        raise ValueError("no scene is open: check the name of the .blend file, or save it")
    frames = asked.frames or range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
    for paths in (export(scene, asked.output, frames, asked.camera),
                  export_backs(scene, asked.backs, frames, asked.camera) if asked.backs else []):
        if paths:
            print(f"wrote {paths[0]}" if len(paths) == 1 else f"wrote {len(paths)} files, from {paths[0]} to {paths[-1]}")


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError) as error:
        if not bpy.app.background:  # Leaving would close the editor.
            raise
        sys.exit(f"export_camera: {error}")

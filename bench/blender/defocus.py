"""usage: blender -b --factory-startup --python-exit-code 1 --python defocus.py -- FOLDER

Blurs a picture with the compositor's Defocus node and times it. FOLDER holds request.json, and color.raw and depth.raw:
four floats a pixel, the bottom row first. Writes seconds.json: what compositing took with the node and without it, in so many
rounds as are asked for: on the wall, or of all threads. Without rounds it writes result.raw, laid out like the others.
"""
import array
import json
import os
import sys
import time

import bpy

FOLDER = sys.argv[sys.argv.index("--") + 1]


def image_node(tree, name, width, height):
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=True)
    values = array.array("f")
    with open(os.path.join(FOLDER, name + ".raw"), "rb") as file:
        values.frombytes(file.read())
    image.pixels.foreach_set(values)
    image.update()
    node = tree.nodes.new("CompositorNodeImage")
    node.image = image
    return node


def composited(clock, still=False):
    begin = clock()
    bpy.ops.render.render(write_still=still)
    return clock() - begin


def main():
    with open(os.path.join(FOLDER, "request.json")) as file:
        request = json.load(file)
    clock = time.process_time if request["processor_time"] else time.perf_counter
    scene, render = bpy.context.scene, bpy.context.scene.render
    render.resolution_x, render.resolution_y = request["width"], request["height"]
    render.resolution_percentage = 100
    camera = scene.camera.data
    camera.sensor_width, camera.lens = request["sensor"], request["lens"]
    camera.dof.focus_distance = request["focus"]

    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()  # the node of the render layers too, so that nothing is rendered
    color, depth = (image_node(tree, name, request["width"], request["height"]) for name in ("color", "depth"))
    channel = tree.nodes.new("CompositorNodeSeparateColor")
    defocus = tree.nodes.new("CompositorNodeDefocus")
    defocus.use_zbuffer, defocus.use_preview, defocus.scene = True, False, scene
    defocus.threshold = 0  # of all it has the least error against a path tracer
    defocus.f_stop, defocus.blur_max = request["f_stop"], request["largest_radius_px"]
    output = tree.nodes.new("CompositorNodeComposite")
    tree.links.new(depth.outputs["Image"], channel.inputs["Image"])
    tree.links.new(color.outputs["Image"], defocus.inputs["Image"])
    tree.links.new(channel.outputs["Red"], defocus.inputs["Z"])

    seconds = {"with": [], "without": []}
    for _ in range(request["rounds"]):
        for name, node in (("without", color), ("with", defocus)):
            tree.links.new(node.outputs["Image"], output.inputs["Image"])
            seconds[name].append(composited(clock))

    with open(os.path.join(FOLDER, "seconds.json"), "w") as file:
        json.dump(seconds, file)
    if request["rounds"]:
        return

    settings = render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    settings.exr_codec = "NONE"
    render.filepath = os.path.join(FOLDER, "result.exr")
    tree.links.new(defocus.outputs["Image"], output.inputs["Image"])
    composited(clock, still=True)
    result = bpy.data.images.load(render.filepath)
    result.colorspace_settings.name = "Non-Color"
    values = array.array("f", bytes(4 * len(result.pixels)))
    result.pixels.foreach_get(values)
    with open(os.path.join(FOLDER, "result.raw"), "wb") as file:
        values.tofile(file)


main()

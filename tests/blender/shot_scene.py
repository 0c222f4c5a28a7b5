"""Saves scene.blend, as docs/blender.md says: 240 frames of 96 x 54 pixels, in which a camera passes a row of cubes."""
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(__file__))
from cubes import row_of_cubes

bpy.ops.wm.read_factory_settings(use_empty=True)
scene, camera = row_of_cubes((1, 240))
camera.data.lens = 200  # A long lens blurs by more than a pixel even here.

scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.use_denoising = 1, 0, False
scene.render.resolution_x, scene.render.resolution_y = 96, 54
scene.render.use_persistent_data = True
scene.view_layers[0].use_pass_z = True
image = scene.render.image_settings
image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath("scene.blend"))

"""Saves scene.blend, as docs/blender.md says: 240 frames of 96 x 54 pixels, in which a camera passes a row of cubes."""
import os

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_plane_add(size=40)
for i in range(6):
    bpy.ops.mesh.primitive_cube_add(size=1, location=(1.2 * i - 3, 2 * i, 0.5), rotation=(0, 0, 0.4 * i))
bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.3, 0))

scene = bpy.context.scene
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(camera)
scene.camera = camera
camera.rotation_euler = (1.45, 0, 0)
camera.data.lens = 200  # A long lens blurs by more than a pixel even here.
scene.frame_start, scene.frame_end = 1, 240
for frame, x in ((scene.frame_start, -2), (scene.frame_end, 2)):
    camera.location = (x, -7, 2.2)
    camera.keyframe_insert("location", frame=frame)

scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.use_denoising = 1, 0, False
scene.render.resolution_x, scene.render.resolution_y = 96, 54
scene.render.use_persistent_data = True
scene.view_layers[0].use_pass_z = True
image = scene.render.image_settings
image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath("scene.blend"))

"""The scene of both tests."""
import bpy


def row_of_cubes(frames):
    """Cubes in a row on a plane under a sun, which a camera passes over the frames. Gives the scene and its camera."""
    bpy.ops.mesh.primitive_plane_add(size=40)
    for i in range(6):
        bpy.ops.mesh.primitive_cube_add(size=1, location=(1.2 * i - 3, 2 * i, 0.5), rotation=(0, 0, 0.4 * i))
    bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.3, 0))
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.rotation_euler = (1.45, 0, 0)
    scene.frame_start, scene.frame_end = frames[0], frames[-1]
    for frame, x in ((frames[0], -2), (frames[-1], 2)):
        camera.location = (x, -7, 2.2)
        camera.keyframe_insert("location", frame=frame)
    scene.render.engine = "CYCLES"
    return scene, camera

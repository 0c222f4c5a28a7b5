"""A depth buffer as PyBullet's getCameraImage gives it, to points of the world.

With PyBullet: depth = numpy.array(p.getCameraImage(...)[3], numpy.float32).reshape(height, width), and `view` is its
viewMatrix, a list of columns: numpy.array(viewMatrix).reshape(4, 4).T
"""

import fathom
import numpy

WIDTH, HEIGHT, NEAR, FAR = 320, 240, 0.01, 100.0

# What the renderer would give for a wall 2 m away.
depth = numpy.full((HEIGHT, WIDTH), (1 / NEAR - 1 / 2) / (1 / NEAR - 1 / FAR), numpy.float32)
view = numpy.eye(4)
view[2, 3] = -1  # the camera stands at (0, 0, 1) and looks along -z

camera = fathom.Camera(preset="pybullet", width=WIDTH, height=HEIGHT, near=NEAR, far=FAR, fov_y_deg=60, view=view)
points = fathom.unproject(depth, camera, space="world")  # (H, W, 3), NaN where there is nothing
z = fathom.linearize(depth, camera)
numpy.save("points.npy", points)
print(f"the middle is {z[HEIGHT // 2, WIDTH // 2]:.4f} m away, at {points[HEIGHT // 2, WIDTH // 2]} in the world")

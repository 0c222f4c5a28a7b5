"""A picture of occlusion and of a lens's blur, with matplotlib. usage: occlusion_and_bokeh.py WRITTEN.png"""

import sys

import fathom
import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot

# A floor with three spheres, seen from 1.2 m above it: distances along the view axis in metres.
HEIGHT, WIDTH = 360, 480
camera = fathom.Camera(width=WIDTH, height=HEIGHT, fov_y_deg=50, encoding="view-z")
rays = fathom.unproject(numpy.ones((HEIGHT, WIDTH), numpy.float32), camera).astype(float)
with numpy.errstate(divide="ignore"):
    z = numpy.where(rays[..., 1] < 0, 1.2 / -rays[..., 1], numpy.inf)
light = numpy.where(numpy.isfinite(z), 0.35, 0.8)
for x, ahead, radius in ((-0.9, 3.0, 0.5), (0.2, 4.5, 0.7), (1.6, 7.0, 0.9)):
    centre = numpy.array([x, radius - 1.2, -ahead])
    a, b = (rays**2).sum(-1), rays @ centre
    root = b**2 - a * (centre @ centre - radius**2)
    hit = numpy.where(root > 0, (b - numpy.sqrt(numpy.maximum(root, 0))) / a, numpy.inf)
    light = numpy.where(hit < z, 0.6, light)
    z = numpy.minimum(z, hit)
z = z.astype(numpy.float32)
color = numpy.repeat(light[..., None], 3, axis=-1).astype(numpy.float32)
color[::24, ::24] = 20  # lamps, which a lens turns into discs

visibility = fathom.ssao(z, camera, radius=0.6)
shaded = color * visibility[..., None]
blurred = fathom.dof(z, camera, shaded, focus=4.0, f_stop=1.4, focal_length_mm=50, sensor_mm=36, blades=6)

figure, axes = pyplot.subplots(1, 3, figsize=(12, 3.2), layout="constrained")
for axis, title, image in zip(axes, ("distance", "occlusion", "bokeh"), (z, visibility, blurred)):
    shown = image if image.ndim == 2 else numpy.clip(image, 0, 1) ** (1 / 2.2)
    axis.imshow(shown, cmap="viridis" if title == "distance" else "gray", vmax=12 if title == "distance" else 1)
    axis.set_title(title)
    axis.axis("off")
figure.savefig(sys.argv[1])

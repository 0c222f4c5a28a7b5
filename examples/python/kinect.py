"""A Kinect's 16-bit PNG to points and normals. usage: kinect.py DEPTH.png"""

import sys

import fathom
import numpy
from PIL import Image

millimetres = numpy.asarray(Image.open(sys.argv[1])).astype(numpy.uint16)  # 0 where nothing was measured
camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)

points = fathom.unproject(millimetres, camera)  # metres; x right, y down, z ahead; NaN where nothing was measured
normals = fathom.normals(millimetres, camera)
y, x = millimetres.shape[0] // 2, millimetres.shape[1] // 2
print(f"the middle lies at {points[y, x]} m, its normal is {normals[y, x]}")

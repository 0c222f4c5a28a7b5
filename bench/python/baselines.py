"""usage: baselines.py FOLDER | --check

What people write in Python in place of linearize, unproject and normals. FOLDER holds request.json with the frames, and of each
frame NAME.stored and NAME.z: floats, row by row, as stored and as distances. For each frame and method a file of floats is
written, and answer.json, which names them and says how long the runs took. Exits with 77 where a package is missing; --check
does nothing else.

As in OpenCV's bench, unproject and normals start from distances, with 0 for none where Open3D reads them. Results go to arrays
that are there already, where a package can write to them. NumPy computes in floats, Numba in doubles, on all cores.
"""
import json
import os
import random
import statistics
import sys
import time
import warnings

os.environ["OMP_WAIT_POLICY"] = "PASSIVE"  # or threads of one package keep the cores from those of the next for 7 ms
warnings.filterwarnings("ignore", message="The TBB threading layer")  # Numba takes another
try:
    import numba
    import numpy
    import open3d
except ImportError as error:
    print(f"skipped: {error}; pip install numpy numba open3d-cpu")
    sys.exit(77)

NEIGHBOURS = 30  # of estimate_normals: Open3D's own default
AS_IT_IS = {"depth_scale": 1.0, "depth_trunc": 1e30}  # Open3D takes depth for millimetres of at most a kilometre
LONGEST_RUN = 2.5  # seconds; what takes longer runs once


class Frame:
    """Depth of a pinhole in OpenCV's axes, and arrays for results."""

    def __init__(self, camera, stored, z):
        self.near, self.far, self.focal = camera["near"], camera["far"], camera["focal"]
        self.height, self.width = stored.shape
        self.cx, self.cy = self.width / 2 - 0.5, self.height / 2 - 0.5  # of pixels whose centres are whole numbers
        self.stored, self.z = stored.copy(), z.copy()
        self.one = numpy.full(z.shape, 0, numpy.float32)
        self.three = numpy.full((*z.shape, 3), 0, numpy.float32)
        self.normals = numpy.full((*z.shape, 3), 0, numpy.float32)
        self.x = ((numpy.arange(self.width) - self.cx) / self.focal).astype(numpy.float32)[None, :]
        self.y = ((numpy.arange(self.height) - self.cy) / self.focal).astype(numpy.float32)[:, None]
        seen = numpy.where(numpy.isfinite(z), z, numpy.float32(0))
        self.image = open3d.geometry.Image(seen)
        self.tensor = open3d.t.geometry.Image(open3d.core.Tensor(seen))
        self.pinhole = open3d.camera.PinholeCameraIntrinsic(self.width, self.height, self.focal, self.focal, self.cx, self.cy)
        self.matrix = open3d.core.Tensor(self.pinhole.intrinsic_matrix)


def numpy_linearize(f):
    numpy.multiply(f.stored, f.far - f.near, out=f.one)
    numpy.subtract(f.far, f.one, out=f.one)
    return numpy.divide(f.near * f.far, f.one, out=f.one)


def numpy_unproject(f):
    numpy.multiply(f.z, f.x, out=f.three[..., 0])
    numpy.multiply(f.z, f.y, out=f.three[..., 1])
    f.three[..., 2] = f.z
    return f.three


def numpy_normals(f):
    points = numpy_unproject(f)
    with numpy.errstate(invalid="ignore", divide="ignore"):  # beside the sky
        down, right = numpy.gradient(points, axis=(0, 1))
        normals = numpy.cross(down, right)
        normals /= numpy.linalg.norm(normals, axis=2, keepdims=True)
    return normals


@numba.njit(parallel=True, error_model="numpy")
def linearized(stored, near, far, out):
    for y in numba.prange(stored.shape[0]):
        for x in range(stored.shape[1]):
            out[y, x] = near * far / (far - (far - near) * stored[y, x])


@numba.njit(parallel=True, error_model="numpy")
def unprojected(z, focal, cx, cy, out):
    for y in numba.prange(z.shape[0]):
        for x in range(z.shape[1]):
            out[y, x, 0] = (x - cx) / focal * z[y, x]
            out[y, x, 1] = (y - cy) / focal * z[y, x]
            out[y, x, 2] = z[y, x]


@numba.njit(parallel=True, error_model="numpy")
def crossed(z, focal, cx, cy, out):
    height, width = z.shape
    for y in numba.prange(height):
        above, below = max(y - 1, 0), min(y + 1, height - 1)
        for x in range(width):
            left, right = max(x - 1, 0), min(x + 1, width - 1)
            a, b, c, d = float(z[y, left]), float(z[y, right]), float(z[above, x]), float(z[below, x])
            ux, uy, uz = (right - cx) * b - (left - cx) * a, (y - cy) * (b - a), focal * (b - a)
            vx, vy, vz = (x - cx) * (d - c), (below - cy) * d - (above - cy) * c, focal * (d - c)
            nx, ny, nz = vy * uz - vz * uy, vz * ux - vx * uz, vx * uy - vy * ux
            length = (nx * nx + ny * ny + nz * nz) ** 0.5
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = nx / length, ny / length, nz / length


def numba_linearize(f):
    linearized(f.stored, f.near, f.far, f.one)
    return f.one


def numba_unproject(f):
    unprojected(f.z, f.focal, f.cx, f.cy, f.three)
    return f.three


def numba_normals(f):
    crossed(f.z, f.focal, f.cx, f.cy, f.normals)
    return f.normals


def open3d_unproject(f):
    return f.tensor.create_vertex_map(f.matrix, float("nan"))


def open3d_normal_map(f):
    return open3d_unproject(f).create_normal_map(float("nan"))


def open3d_points(f):
    return open3d.geometry.PointCloud.create_from_depth_image(f.image, f.pinhole, **AS_IT_IS, project_valid_depth_only=False)


def open3d_normals(f):
    """Points in the image's order, without those of the sky."""
    cloud = open3d.geometry.PointCloud.create_from_depth_image(f.image, f.pinhole, **AS_IT_IS)
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    cloud.orient_normals_towards_camera_location(numpy.zeros(3))
    return cloud


METHODS = [
    ("linearize", "NumPy", numpy_linearize),
    ("linearize", "Numba", numba_linearize),
    ("unproject", "NumPy", numpy_unproject),
    ("unproject", "Numba", numba_unproject),
    ("unproject", "Open3D, create_from_depth_image", open3d_points),
    ("unproject", "Open3D, create_vertex_map", open3d_unproject),
    ("normals", "NumPy", numpy_normals),
    ("normals", "Numba", numba_normals),
    ("normals", "Open3D, create_normal_map", open3d_normal_map),
    ("normals", f"Open3D, estimate_normals of {NEIGHBOURS}", open3d_normals),
]


def array_of(frame, result):
    """As float32 pixel by pixel, whatever the package calls it."""
    if isinstance(result, open3d.t.geometry.Image):
        return result.as_tensor().numpy()
    if isinstance(result, open3d.geometry.PointCloud):
        if not result.has_normals():
            return numpy.asarray(result.points, numpy.float32).reshape(frame.three.shape)
        pixels = numpy.full(frame.three.shape, numpy.nan, numpy.float32)
        pixels[numpy.asarray(frame.image) > 0] = numpy.asarray(result.normals)
        return pixels
    return result


def timed(frames, request, slow):
    """Seconds of the runs of each method: in rounds, in random order, each on the next of the frames."""
    clock = time.process_time if request["processor_time"] else time.perf_counter
    seconds, every, order = [[] for _ in METHODS], [], list(range(len(METHODS)))
    turn = 0

    def run(number):
        nonlocal turn
        turn = (turn + 1) % len(frames)
        begin = clock()
        METHODS[number][2](frames[turn])
        return clock() - begin

    for number in order:
        once = run(number)
        if once <= LONGEST_RUN and number not in slow:
            once = run(number)
        if once > LONGEST_RUN or number in slow:
            slow.add(number)
            seconds[number].append(once)
        runs = min(max(int(request["seconds"] / max(once, 1e-9)), min(3, request["rounds"])), request["rounds"])
        every.append(-(-request["rounds"] // runs))
    shuffled = random.Random(7)
    for number_of_round in range(request["rounds"]):
        shuffled.shuffle(order)
        for number in order:
            if number not in slow and number_of_round % every[number] == 0:
                seconds[number].append(run(number))
    return seconds


def main(folder):
    with open(os.path.join(folder, "request.json")) as file:
        request = json.load(file)
    answer, slow = [], set()
    few = numpy.full((9, 16), 1, numpy.float32)
    for _, _, method in METHODS:  # compiled once for all
        method(Frame(request["frames"][0], 0.5 * few, few))
    for camera in request["frames"]:
        shape = camera["height"], camera["width"]
        stored, z = (numpy.fromfile(os.path.join(folder, f"{camera['name']}.{what}"), numpy.float32).reshape(shape)
                     for what in ("stored", "z"))
        copies = min(max(int(0.5e9 / (8 * z.size)) + 1, 2), 16) if camera["timed"] else 1
        frames = [Frame(camera, stored, z) for _ in range(copies)]
        seconds = timed(frames, request, slow) if camera["timed"] else [[] for _ in METHODS]
        for number, (operation, name, method) in enumerate(METHODS):
            row = {"frame": camera["name"], "operation": operation, "method": name, "seconds": seconds[number]}
            if not camera["timed"]:
                row["file"] = f"{camera['name']}.{number}"
                array_of(frames[0], method(frames[0])).tofile(os.path.join(folder, row["file"]))
            else:
                print(f"{operation} {name}, {camera['width']} x {camera['height']}: "
                      f"{1e3 * statistics.median(row['seconds']):.3f} ms, {len(row['seconds'])} runs", flush=True)
            answer.append(row)
    with open(os.path.join(folder, "answer.json"), "w") as file:
        json.dump(answer, file)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if sys.argv[1] != "--check":
        main(sys.argv[1])

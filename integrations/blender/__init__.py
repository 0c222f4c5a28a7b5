# SPDX-License-Identifier: GPL-3.0-or-later
"""Fathom in Blender: lens blur, occlusion and fog from the Z pass of rendered frames.

The settings are those that fathom.options() describes, and the camera is that of export_camera.py.
"""
import os
import warnings

import bpy
import fathom
import numpy

from . import export_camera

LABELS = {"dof": "Lens Blur", "ssao": "Occlusion", "fog": "Fog"}
DESCRIBED = {each["name"]: each for each in fathom.options() if each["name"] in LABELS}
CURE = "switch on Passes for Fathom in the Output properties, and render again"
FLOAT_MAX = float(numpy.finfo(numpy.float32).max)
KNOWN = "alpha", "normals_space"  # An EXR's alpha is multiplied in, and Blender's normals are in world space.


def property_of(option):
    """The property that holds an option's value, or None for images, pixels and what else Blender has no field for."""
    words = {"name": option["name"].replace("_", " ").capitalize(), "description": option["words"]}
    kind, default, values = option["kind"], option["default"], option.get("values") or option["choices"]
    if option["name"] in KNOWN:
        return None
    if values:
        items = [(str(each), str(each).capitalize(), "") for each in values]
        return bpy.props.EnumProperty(items=items, default=default or items[0][0], **words)
    if kind == "number":
        make, top = (bpy.props.IntProperty, 2**31 - 1) if option["whole"] else (bpy.props.FloatProperty, FLOAT_MAX)
        words.update({} if option["whole"] else {"precision": 4})
        least = max(min(option["least"], option.get("beside", option["least"])), -top)
        return make(default=max(least, 0) if default is None else default, min=least, max=min(option["most"], top), **words)
    if kind in ("flag", "directions"):
        return bpy.props.BoolProperty(**words)
    return bpy.props.FloatVectorProperty(subtype="COLOR", default=default, **words) if kind == "color" else None


def settings_of(name):
    """A group with the properties of an operation, and the option that each of them sets."""
    properties, options = {}, {}
    for option in DESCRIBED[name]["options"]:
        made = property_of(option)
        if made is None:
            continue
        key = option["name"] if option["name"] not in options else f"{option['name']}_{option['kind']}"
        options[key], properties[key] = option, made
        if option["default"] is None and not option["required"] and option["kind"] in ("number", "choice"):
            properties["use_" + key] = bpy.props.BoolProperty(
                name=made.keywords["name"], description=f"if this is off: {option['default_words']}")
    return type(f"FATHOM_PG_{name}", (bpy.types.PropertyGroup,), {"__annotations__": properties}), options


GROUPS = {name: settings_of(name) for name in LABELS}


def arguments_of(name, settings):
    """The arguments of a call: the settings that are in use and not at their defaults."""
    arguments = {}
    for key, option in GROUPS[name][1].items():
        value, prop = getattr(settings, key), settings.bl_rna.properties[key]
        if option["kind"] != "color" and not getattr(settings, "use_" + key, value != prop.default):
            continue
        if option["name"] in arguments:
            raise ValueError(f"{option['name']} is set in two ways; switch one of them off")
        if prop.type == "FLOAT":  # A property holds 1.4 as 1.39999998.
            value = [float(f"{each:.7g}") for each in numpy.atleast_1d(value)]
            value = value if prop.is_array else value[0]
        arguments[option["name"]] = int(value) if option.get("values") else value
    if "height_falloff" in arguments:
        arguments["up"] = 0, 0, 1  # The world of export_camera.py is Blender's.
    return arguments


def reader_of(path):
    """A function that reads passes of a rendered frame, from the first layer that has a depth."""
    import OpenImageIO

    if not os.path.exists(path):
        raise ValueError(f"{path} is not there; render it first: Render, Render Animation")
    file = OpenImageIO.ImageInput.open(path)
    if not file:
        raise ValueError(f"{path}: {OpenImageIO.geterror()}; {CURE}")
    part, layers = 0, {}
    while file.seek_subimage(part, 0):
        for number, (front, _, channel) in enumerate(name.rpartition(".") for name in file.spec().channelnames):
            layer, _, name = front.rpartition(".")
            layers.setdefault(layer, {}).setdefault(name, {})[channel] = part, number
        part += 1
    passes = next((each for each in layers.values() if "Depth" in each), {})

    def read(name, channels):
        """Those of these channels that the pass has, as floats."""
        if name not in passes:
            raise ValueError(f"{path} has no {name} pass; {CURE}")
        found = [passes[name][each] for each in channels if each in passes[name]]
        planes = [file.read_image(part, 0, number, number + 1, "float") for part, number in found]
        if any(each is None for each in planes):
            raise ValueError(f"{path}: {file.geterror()}; render it again")
        return numpy.concatenate(planes, -1)

    return read


def write(path, pixels):
    """Writes an image, or leaves none behind."""
    import OpenImageIO

    part = f"{path}.part.exr"
    file = OpenImageIO.ImageOutput.create(part)
    try:
        spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
        if not (file.open(part, spec) and file.write_image(pixels) and file.close()):
            raise OSError(f"{path}: {file.geterror()}")
        os.replace(part, path)
    finally:
        if os.path.exists(part):
            os.remove(part)


def process(scene, name, frames, warn):
    """Writes the result of an operation for each frame, and yields its path."""
    for number, keys, blurred in export_camera.camera_files(scene, frames):
        if blurred and scene.camera.data.dof.use_dof:
            raise ValueError(blurred)
        path = scene.render.frame_path(frame=number)
        read, arguments = reader_of(path), arguments_of(name, getattr(scene.fathom, name))
        if arguments.pop("normals", False):
            arguments.update(normals=read("Normal", "XYZ"), normals_space="world")
        if any(option["name"] == "color" for option in DESCRIBED[name]["options"]):
            arguments["color"] = read("Combined", "RGBA")
        with warnings.catch_warnings(record=True) as doubts:
            result = getattr(fathom, name)(read("Depth", "ZV")[..., 0], fathom.Camera(**keys), **arguments)
        for each in [blurred] * bool(blurred) + [str(doubt.message) for doubt in doubts]:
            warn(each)
        path = os.path.join(os.path.dirname(path), f"{name}.{os.path.basename(path)}")
        write(path, result if isinstance(result, numpy.ndarray) else result[0][..., None])
        yield path


class Operation:
    """What the operators share: a frame at a time, until Escape is pressed."""

    frames: bpy.props.EnumProperty(name="Frames", items=[
        ("FRAME", "This Frame", "The current frame"), ("RANGE", "All Frames", "The frames of the scene")])

    def step(self, scene):
        """Does a frame. Says what to do next, as Blender wants to know it."""
        if not hasattr(self, "work"):
            frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
            self.work, self.written = process(scene, self.operation, frames if self.frames == "RANGE" else [
                scene.frame_current], lambda text: self.report({"WARNING"}, text)), []
        try:
            self.written.append(next(self.work))
            return {"RUNNING_MODAL"}
        except StopIteration:
            if self.frames == "FRAME":  # for the Image Editor
                bpy.data.images.load(self.written[0], check_existing=True).reload()
            self.report({"INFO"}, " to ".join(["wrote " + self.written[0], *self.written[1:][-1:]]))
            return {"FINISHED"}
        except (fathom.Error, ImportError, OSError, TypeError, ValueError) as error:
            self.report({"ERROR"}, " ".join(str(error).split()))
            return {"CANCELLED"}

    def execute(self, context):
        while (state := self.step(context.scene)) == {"RUNNING_MODAL"}:
            pass
        return state

    def invoke(self, context, _):
        self.timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        state = {"CANCELLED"} if event.type == "ESC" else {"RUNNING_MODAL"}
        if event.type == "TIMER":
            state = self.step(context.scene)
            context.workspace.status_text_set(f"{self.bl_label}: {len(self.written)} frames done, Escape ends")
        if state != {"RUNNING_MODAL"}:
            context.window_manager.event_timer_remove(self.timer)
            context.workspace.status_text_set(None)
        return state


class Panel:
    """The panel, and within it one for each operation."""

    bl_space_type, bl_region_type, bl_context, bl_options = "PROPERTIES", "WINDOW", "output", {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, settings = self.layout, context.scene.fathom
        layout.use_property_split = True
        if not self.operation:
            return layout.prop(settings, "passes")
        settings = getattr(settings, self.operation)
        for key in GROUPS[self.operation][1]:
            if not hasattr(settings, "use_" + key):
                layout.prop(settings, key)
                continue
            row = layout.row(heading=settings.bl_rna.properties[key].name)
            row.prop(settings, "use_" + key, text="")
            row = row.row()
            row.active = getattr(settings, "use_" + key)
            row.prop(settings, key, text="")
        row = layout.row()
        for frames, text in (("FRAME", "This Frame"), ("RANGE", "All Frames")):
            row.operator("fathom." + self.operation, text=text).frames = frames


def has_passes(settings):
    """Whether the render keeps what Fathom reads."""
    image, layers = settings.id_data.render.image_settings, settings.id_data.view_layers
    return (image.file_format, image.color_depth) == ("OPEN_EXR_MULTILAYER", "32") and all(
        layer.use_pass_z for layer in layers)


def set_passes(settings, on):
    image = settings.id_data.render.image_settings
    for layer in settings.id_data.view_layers:
        layer.use_pass_z = on
    if on:
        if hasattr(image, "media_type"):  # Blender 5
            image.media_type = "MULTI_LAYER_IMAGE"
        image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"


def menu(self, _):
    self.layout.separator()
    for name in LABELS:
        self.layout.operator_menu_enum("fathom." + name, "frames", text="Fathom: " + LABELS[name])


def class_of(kind, name, bases, **has):
    return type(f"FATHOM_{kind}_{name}", bases, has)


SCENE = class_of("PG", "scene", (bpy.types.PropertyGroup,), __annotations__={
    "passes": bpy.props.BoolProperty(
        name="Passes for Fathom", get=has_passes, set=set_passes,
        description="Render into OpenEXR MultiLayer files of full floats, with the Z pass of each view layer"),
    **{name: bpy.props.PointerProperty(type=group) for name, (group, _) in GROUPS.items()}})
CLASSES = [group for group, _ in GROUPS.values()] + [
    SCENE, class_of("PT", "panel", (Panel, bpy.types.Panel), bl_label="Fathom", operation=None)]
for _name, _label in LABELS.items():
    CLASSES += [
        class_of("OT", _name, (Operation, bpy.types.Operator), bl_idname="fathom." + _name, bl_label=_label,
                 bl_description=DESCRIBED[_name]["summary"].rstrip("."), operation=_name),
        class_of("PT", _name, (Panel, bpy.types.Panel), bl_label=_label, bl_parent_id="FATHOM_PT_panel", operation=_name)]


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.fathom = bpy.props.PointerProperty(type=SCENE)
    bpy.types.TOPBAR_MT_render.append(menu)


def unregister():
    bpy.types.TOPBAR_MT_render.remove(menu)
    del bpy.types.Scene.fathom
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)

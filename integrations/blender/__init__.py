# SPDX-License-Identifier: GPL-3.0-or-later
"""Lens blur, occlusion and fog for rendered frames, with the settings that fathom.options() describes."""
import os
import warnings

import bpy
import fathom
import OpenImageIO
from . import export_camera

LABELS = {"dof": "Lens Blur", "ssao": "Occlusion", "fog": "Fog"}
DESCRIBED = {each["name"]: each for each in fathom.options() if each["name"] in LABELS}
FRAMES = ("FRAME", "This Frame", "The current frame"), ("RANGE", "All Frames", "The frames of the scene")
FORMAT = {"media_type": "MULTI_LAYER_IMAGE", "file_format": "OPEN_EXR_MULTILAYER", "color_depth": "32"}


def property_of(option):
    """The property that holds an option's value, or None for images, pixels and what else Blender has no field for."""
    words = {"name": option["name"].replace("_", " ").capitalize(), "description": option["words"]}
    kind, default, values = option["kind"], option["default"], option.get("values") or option["choices"]
    if values:
        items = [(str(each), str(each).capitalize(), "") for each in values]
        return bpy.props.EnumProperty(items=items, default=default or items[0][0], **words)
    if kind == "number":
        number, top = (int, 2**31 - 1) if option["whole"] else (float, 3.4e38)
        least = max(min(float(option["least"]), option.get("beside", top)), -top)
        words.update(default=number(max(least, 0) if default is None else default), min=number(least),
                     max=number(min(float(option["most"]), top)))
        return bpy.props.IntProperty(**words) if option["whole"] else bpy.props.FloatProperty(precision=4, **words)
    if kind in ("flag", "directions"):
        return bpy.props.BoolProperty(**words)
    return bpy.props.FloatVectorProperty(subtype="COLOR", default=default, **words) if kind == "color" else None


def settings_of(name):
    """A group with the properties of an operation, and the option that each of them sets."""
    properties, options = {}, {}
    for option in DESCRIBED[name]["options"]:
        key, made = option["name"], property_of(option)
        if made is None or {key, *option["needs"]} & {"alpha", "normals_space", "relative"}:  # which Blender's files answer
            continue
        key += f"_{option['kind']}" if key in options else ""
        options[key], properties[key] = option, made
        if option["default"] is None and not option["required"] and option["kind"] in ("number", "choice"):
            properties["use_" + key] = bpy.props.BoolProperty(description=f"if this is off: {option['default_words']}")
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
            value = [float(f"{each:.7g}") for each in value] if prop.is_array else float(f"{value:.7g}")
        arguments[option["name"]] = int(value) if option.get("values") else value
    for key, option in GROUPS[name][1].items():
        if option["required"] and option["name"] not in arguments:
            raise ValueError(f"{settings.bl_rna.properties[key].name} is not set; give one in Output Properties, Fathom")
    return arguments | ({"up": (0, 0, 1)} if "height_falloff" in arguments else {})  # as in the world of Blender


def passes_of(path, wanted):
    """These passes of a rendered frame, from the first layer that has a depth."""
    file, part, layers = OpenImageIO.ImageInput.open(path), 0, {}
    if not file:
        raise ValueError(f"{path}: {OpenImageIO.geterror()}; render it first: Render, Render Animation")
    while file.seek_subimage(part, 0):
        for number, channel in enumerate(file.spec().channelnames):  # such as ViewLayer.Combined.R
            layer, name, _ = (".." + channel).rsplit(".", 2)
            layers.setdefault(layer, {}).setdefault(name, []).append((part, number))
        part += 1
    passes = next((each for each in layers.values() if "Depth" in each), None)
    if passes is None:
        raise ValueError(f"{path} has no Z pass; switch on Passes for Fathom in Output Properties, and render again")
    for name in wanted:
        if name not in passes:
            raise ValueError(f"{path} has no {name} pass; switch it on in View Layer Properties, and render again")
        (part, first), (_, last) = passes[name][0], passes[name][-1]
        pixels = file.read_image(part, 0, first, last + 1, "float")
        if pixels is None:
            raise ValueError(f"{path}: {file.geterror()}; render it again")
        yield pixels


def write(path, pixels):
    """Writes an image, or leaves none behind."""
    part, spec = f"{path}.part.exr", OpenImageIO.ImageSpec(*pixels.shape[1::-1], pixels.shape[2], "float")
    file = OpenImageIO.ImageOutput.create(part)
    try:
        if not (file.open(part, spec) and file.write_image(pixels) and file.close()):
            raise OSError(f"{path}: {file.geterror()}")
        os.replace(part, path)
    finally:
        if os.path.exists(part):
            os.remove(part)


def process(scene, name, operator):
    """Writes the result of an operation for each frame, and yields its path."""
    if scene.render.is_movie_format:
        raise ValueError("the output is a video, which holds no depth; switch on Passes for Fathom, and render again")
    if scene.render.use_multiview:
        raise ValueError("the frames are stereo; switch off Stereoscopy in Output Properties, and render each eye's camera")
    frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
    frames = frames if operator.frames == "RANGE" else [scene.frame_current]
    for number, keys, blurred in export_camera.camera_files(scene, frames):
        if blurred and scene.camera.data.dof.use_dof:
            raise ValueError(blurred)
        path = scene.render.frame_path(frame=number)
        given, images = arguments_of(name, getattr(scene.fathom, name)), {"color": "Combined"} if name != "ssao" else {}
        if "normals" in given:
            images["normals"], given["normals_space"] = "Normal", "world"
        depth, *found = passes_of(path, ["Depth", *images.values()])
        given.update(zip(images, found))
        with warnings.catch_warnings(record=True) as doubts:
            result = getattr(fathom, name)(depth[..., 0], fathom.Camera(**keys), **given)
        for text in [blurred] * bool(blurred) + [str(doubt.message) for doubt in doubts]:
            operator.report({"WARNING"}, text)
        path = os.path.join(os.path.dirname(path), f"{name}.{os.path.basename(path)}")
        write(path, result.reshape(*result.shape[:2], -1))
        operator.report({"INFO"}, f"wrote {path}")
        if len(frames) == 1:  # for the Image Editor
            bpy.data.images.load(path, check_existing=True).reload()
        yield path


class Operation:
    """What the operators share: a frame at a time, until Escape is pressed."""
    frames: bpy.props.EnumProperty(name="Frames", items=FRAMES)

    def step(self, scene):
        try:
            self.work = getattr(self, "work", None) or process(scene, self.operation, self)
            return {"RUNNING_MODAL"} if next(self.work, None) else {"FINISHED"}
        except (fathom.Error, OSError, TypeError, ValueError) as error:
            self.report({"ERROR"}, " ".join(str(error).split()))
            return {"CANCELLED"}

    def execute(self, context):
        return next(state for state in iter(lambda: self.step(context.scene), None) if state != {"RUNNING_MODAL"})

    def invoke(self, context, _):
        self.timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        state = {"CANCELLED" if event.type == "ESC" else "RUNNING_MODAL"}
        state = self.step(context.scene) if event.type == "TIMER" else state
        if state != {"RUNNING_MODAL"}:
            context.window_manager.event_timer_remove(self.timer)
        return state


class FATHOM_PT_panel(bpy.types.Panel):
    bl_label, bl_options = "Fathom", {"DEFAULT_CLOSED"}
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "output"

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.prop(context.scene.fathom, "passes")
        for name, label in LABELS.items():
            settings, (header, body) = getattr(context.scene.fathom, name), self.layout.panel(name, default_closed=True)
            header.label(text=label)
            for frames, text, _ in FRAMES:
                header.operator("fathom." + name, text=text).frames = frames
            for key in GROUPS[name][1] if body else ():
                if not hasattr(settings, "use_" + key):
                    body.prop(settings, key)
                    continue
                row = body.row(heading=settings.bl_rna.properties[key].name)
                row.prop(settings, "use_" + key, text="")
                if getattr(settings, "use_" + key):
                    row.prop(settings, key, text="")


def has_passes(settings):
    image = settings.id_data.render.image_settings
    return all([getattr(image, key, FORMAT[key]) == FORMAT[key] for key in FORMAT]
               + [layer.use_pass_z for layer in settings.id_data.view_layers])


def set_passes(settings, on):
    for layer in settings.id_data.view_layers:
        layer.use_pass_z = on
    image = settings.id_data.render.image_settings
    for key in [key for key in FORMAT if on and hasattr(image, key)]:  # Blender 5 has media_type
        setattr(image, key, FORMAT[key])


class FATHOM_PG_scene(bpy.types.PropertyGroup):
    __annotations__ = {name: bpy.props.PointerProperty(type=group) for name, (group, _) in GROUPS.items()}
    passes: bpy.props.BoolProperty(
        name="Passes for Fathom", get=has_passes, set=set_passes,
        description="Render into OpenEXR MultiLayer files of full floats, with the Z pass of each view layer")


def menu(self, _):
    for name in LABELS:
        self.layout.operator_menu_enum("fathom." + name, "frames", text="Fathom: " + LABELS[name])


CLASSES = [*(group for group, _ in GROUPS.values()), FATHOM_PG_scene, FATHOM_PT_panel]
CLASSES += [type(f"FATHOM_OT_{name}", (Operation, bpy.types.Operator), {
    "bl_idname": "fathom." + name, "bl_label": LABELS[name], "operation": name,
    "bl_description": DESCRIBED[name]["summary"].rstrip(".")}) for name in LABELS]
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register():
    register_classes()
    bpy.types.Scene.fathom = bpy.props.PointerProperty(type=FATHOM_PG_scene)
    bpy.types.TOPBAR_MT_render.append(menu)


def unregister():
    bpy.types.TOPBAR_MT_render.remove(menu)
    del bpy.types.Scene.fathom
    unregister_classes()

"""Camera blur, occlusion, fog and normals, with the settings that fathom.options() describes."""
import json

import fathom
import torch
from comfy.utils import ProgressBar

DESCRIBED = {each["name"]: each["options"] for each in fathom.options()}
LABELS = {"Camera Blur": "dof", "Metric Camera Blur": "dof", "Fog": "fog", "Occlusion": "ssao", "Normals": "normals"}
# What a node shows first, and where it begins if not at its default. ComfyUI folds the others away.
SHOWN = {"relative": "high-is-near", "blur_px": 24.0, "focus_at": None, "focus": None, "f_stop": 2.8, "sensor_mm": 36.0,
         "quality": None, "radius": 0.5, "density": 0.1, "fog_color": None, "method": None}
LEFT_OUT = {"alpha", "channels", "color", "region", "seed"}  # Images have them, and ComfyUI draws seeds itself.
CAMERA = {
    "fov_x_deg": ("FLOAT", {"default": 55.0, "min": 0.01, "max": 179.0, "step": 0.01, "tooltip": "horizontal field of view, degrees"}),
    "scale": ("FLOAT", {"default": 1.0, "min": 0.001, "max": 1e9, "step": 0.001, "tooltip": "metres that a depth of 1 stands for"}),
    "camera": ("STRING", {"default": "", "advanced": True, "tooltip": "the text of a camera file, instead of both"})}


def input_of(option):
    """The type and the properties of an option's input, and the value there that stands for none."""
    name, kind, begin, none, without = option["name"], option["kind"], option["default"], None, option["default_words"]
    words = {"tooltip": option["words"], "advanced": name not in SHOWN}
    values = option.get("values") or option["choices"] or ["true", "false"] * (kind == "flag")
    if values:
        none = without if begin is None and name not in SHOWN else None
        kind = [none] * bool(none) + [str(each) for each in values]
        begin = begin or kind[0]
    elif kind == "number":
        kind, number, step = ("INT", int, 1) if option["whole"] else ("FLOAT", float, 0.001)
        least = number(max(float(option["least"]), -1e30))
        if begin is None and (option["least_excluded"] or name not in SHOWN):
            none = begin = least = least - (not option["least_excluded"])
        least, most = min(least, option.get("beside", least)), number(min(float(option["most"]), 1e30))
        words |= {"min": least, "max": most, "step": step, "round": False}
    elif "numbers" in option["accepted"]:  # such as 620,410
        kind, none, begin = "STRING", "", ",".join(f"{each:g}" for each in begin or ())
        without = "the middle of the image, unless another focus is given" if name == "focus_at" else without
    else:
        return ("IMAGE" if kind in ("picture", "depth") else None), words, None
    words["tooltip"] += f" ({'empty' if none == '' else none}: {without})" if none not in (None, without) else ""
    return kind, {"default": begin if SHOWN.get(name) is None else SHOWN[name], **words}, none


def value_of(given):
    try:
        numbers = [float(each) if "." in each else json.loads(each) for each in str(given).split(",")]
        return numbers[0] if len(numbers) == 1 else numbers
    except ValueError:
        return given


def curve(values, end, slope, offset, factor, power, made=None):
    """The curves of sRGB: a line up to an end, and then a power. Parts of the image stay in a cache."""
    made, room, shift = torch.empty_like(values) if made is None else made, torch.empty_like(values[:128]), torch.tensor(offset * factor)
    at_end = torch.add(shift, torch.tensor([end]), alpha=factor).log2_().mul_(power).exp2_()
    for part, of in zip(made.split(128), values.split(128)):
        beyond = torch.add(shift, torch.clamp(of, min=end, out=room[:len(of)]), alpha=factor, out=room[:len(of)])
        torch.add(beyond.log2_().mul_(power).exp2_().sub_(at_end), torch.clamp(of, max=end, out=part), alpha=slope, out=part)
    return made


def light_of(image):
    light, alpha = curve(image[..., :3], 0.04045, 1 / 12.92, 0.055, 1 / 1.055, 2.4), image[..., 3:]
    return torch.cat((light * alpha, alpha), -1) if alpha.numel() else light  # as a blur needs it


def codes_of(image, light, made):  # in the memory of the light
    if all(torch.equal(each.nan_to_num(), other.nan_to_num()) for each, other in ((light[::49], made[::49]), (light, made))):
        return image
    alpha = made[..., 3:]
    codes = curve(made / alpha.clamp(min=1e-30) if alpha.numel() else made, 0.0031308, 12.92, 0, 1.055**2.4, 1 / 2.4, light)
    return torch.cat((codes[..., :3], alpha), -1) if alpha.numel() else codes


def relative_depth(depth, given):
    """Depth as its file has it: of 8 bits ComfyUI makes floats. Floats of a batch have one range, as those of a shot."""
    if "relative_range" not in given and all(
            torch.equal((each * 255).round().clamp(0, 255) / 255, each) for each in (depth[:, ::8, ::8, :1], depth[..., :1])):
        return (depth[..., :1] * 255).round().to(torch.uint8)
    known = depth[depth.isfinite()] if len(depth) > 1 else depth[:0]
    if len(known) and known.min() < known.max():
        given.setdefault("relative_range", (known.min().item(), known.max().item()))
    return depth


class Node:
    CATEGORY, FUNCTION, INPUT_TYPES = "image/fathom", "run", classmethod(lambda node: node.inputs)

    def run(self, fov_x_deg=None, scale=1, camera="", **given):
        try:
            images = {key: each.cpu().float() for key, each in given.items() if isinstance(each, torch.Tensor)}
            values = {name: value_of(given[key]) for key, (name, none) in self.settings.items()
                      if key in given and key not in images and given[key] != none}
            if images["depth"][:, ::8, ::8, :3].nan_to_num().diff().any():
                raise ValueError("depth: has colours, in which its order is lost; give the grey depth")
            if "relative" in values:
                camera, images["depth"] = None, relative_depth(images["depth"], values)
            else:
                camera = fathom.Camera.from_json(camera) if camera else fathom.Camera(
                    encoding="view-z", fov_x_deg=fov_x_deg, scale=scale, background_from="largest-half")
            count, made = max(1, *map(len, images.values())), []
            for key, each in images.items():
                if len(each) not in (1, count):
                    raise ValueError(f"{key}: {len(each)} images, but another input has {count}; give as many, or one for all")
                images[key] = each if key == "image" else (each[..., 0].contiguous() if "depth" in key else light_of(each)).numpy()
            progress = ProgressBar(count)
            for i in range(count):
                made.append(self.of_frame(camera, **{key: each[i % len(each)] for key, each in images.items()}, **values))
                progress.update(1)
            return tuple(each[0][None] if count == 1 else torch.stack(each) for each in zip(*made))
        except (fathom.Error, TypeError, ValueError) as error:
            raise RuntimeError(" ".join(str(error).split())) from None

    def of_frame(self, camera, depth, image=None, **given):
        if self.operation == "normals":
            made = torch.from_numpy(fathom.normals(depth, camera, **given))
            return torch.where((made == 0).all(-1, keepdim=True), 0, made / 2 + 0.5),
        light = light_of(image)
        if self.operation == "ssao":
            mask = fathom.ssao(depth, camera, **given)
            mask = mask if mask.shape == light.shape[:2] else fathom.upsample_along_edges(mask, light.numpy())
            mask = torch.from_numpy(mask).nan_to_num(1)  # no depth, no occlusion
            return codes_of(image, light, torch.cat((light[..., :3] * mask[..., None], light[..., 3:]), -1)), mask
        known = " ".join([*given, *(camera.to_dict() if camera else ())])
        if self.operation == "dof" and "focus" not in known and "circle" not in known:
            given["focus_at"] = image.shape[1] // 2, image.shape[0] // 2
        made = getattr(fathom, self.operation)(depth, camera, light.numpy(), **given)
        return codes_of(image, light, torch.from_numpy(made)),


def node(label):
    """The class of a node, with the options that its kind of depth has as inputs."""
    options, relative, settings = DESCRIBED[LABELS[label]], label == "Camera Blur", {}
    left = LEFT_OUT.union(next(each["excludes"] for each in options if each["name"] == "relative") if relative else ["relative"])
    inputs = {key: ("IMAGE", {}) for key in ["image"] * (label != "Normals") + ["depth"]} | ({} if relative else CAMERA)
    for option in options:
        name, taken, (kind, words, none) = option["name"], option["name"] in settings, input_of(option)
        if not taken and (name in left or left & set(option["needs"]) or not kind):
            left.add(name)
        elif not taken or isinstance(kind, list):
            key = name + f"_{option['kind']}" * taken
            inputs[key], settings[key] = (kind, words), (name, none)
    first = {key: inputs.pop(key) for key, (_, words) in list(inputs.items()) if not words.get("advanced")}
    return type(label, (Node,), {"operation": LABELS[label], "settings": settings, "inputs": {"required": first, "optional": inputs},
                                 "RETURN_TYPES": ("IMAGE", "MASK")[:1 + (label == "Occlusion")]})


NODE_CLASS_MAPPINGS = {"Fathom" + label.replace(" ", ""): node(label) for label in LABELS}
NODE_DISPLAY_NAME_MAPPINGS = {"Fathom" + label.replace(" ", ""): "Fathom " + label for label in LABELS}

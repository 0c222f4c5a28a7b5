"""Every option that is described, as `fathom options --json` says: Python's keywords accept the same values as the program."""

import inspect
import json
import keyword
import math

import numpy

import fathom

from conftest import HEIGHT, WIDTH

LENS = {"focus": 5, "f_stop": 2, "focal_length_mm": 0.01, "sensor_mm": 36}


def python_name(name):
    return name + "_" * keyword.iskeyword(name)


def required(operation, picture):
    """What a call needs, whatever its options."""
    made = {"radius": 0.3} if operation["name"] == "ssao" else {}  # which other cameras have
    for option in operation["options"]:
        if option["required"]:
            made[option["name"]] = picture if option["kind"] == "picture" else 0.25
    return made | (LENS if operation["name"].startswith("dof") else {})


def beside(operation, option, given):
    """What a call needs with this option, without what the option excludes."""
    made = {name: value for name, value in required(operation, given["picture"]).items() if name not in option["excludes"]}
    for need in option["needs"][:1]:
        name, _, value = need.partition("=")
        other = next(each for each in operation["options"] if each["name"] == name)
        if name == "relative":  # instead of a lens
            made = {each: own for each, own in made.items() if each not in LENS}
        made[name] = value or given.get(other["kind"], (other["choices"] or [0.1])[0])
    return made


def values(option):
    """Pairs of a value and whether it will do."""
    if option["kind"] == "choice":
        return [(choice, True) for choice in option["choices"]] + [("no such word", False)]
    if option["kind"] in ("flag", "result"):
        return [(True, True), (False, True)]
    if option["kind"] in ("three numbers", "color", "direction"):
        bad = [(math.nan, 0, 0), (0, math.inf, 0)] + ([(0, 0, 0)] if option["kind"] == "direction" else [])
        return [((0.25, 0.5, 0.75), True)] + [(value, False) for value in bad]
    if option["kind"] == "fractions":
        bad = [(0.5, 0.25), (-0.5, 0.5), (0.5, 1.5), (math.nan, 1)]
        return [((0.25, 0.5), True), ((0, 1), True), ((0.5, 0.5), True)] + [(value, False) for value in bad]
    if option["kind"] == "ends":
        bad = [(0.5, 0.25), (1, 1), (-math.inf, 1), (0, math.nan)]
        return [((0.25, 2), True), ((-3, 0), True)] + [(value, False) for value in bad]
    if option["kind"] == "lens":
        return [((40, 180), True), ((0, 0), True), ((-1, 180), False), ((40, -1), False), ((math.inf, 1), False)]
    if option["kind"] == "pixel":
        return [((2, 1), True)]
    if option["kind"] == "ray":
        return [((2, 1, 5.0), True), ((2, 1, math.inf), True), ((2, 1, 0.0), False), ((2, 1, math.nan), False)]
    if option["kind"] == "region":
        good = [(1, 1, 4, 3), (1.0, 1, 4, 3), (0, 0, WIDTH, HEIGHT)]
        return [(value, True) for value in good] + [((0, 0, 0, 2), False), ((0, 0, 2, -1), False)]
    if "values" in option:
        between = [value + 1 for value in option["values"]]
        return [(value, True) for value in option["values"]] + [
            (value, value in option["values"]) for value in [min(option["values"]) - 1, *between]
        ]
    if option["kind"] == "number":
        least, most = option["least"], option["most"]  # a word where there is none
        step = 1 if option["whole"] else 0.25
        made = [] if option["whole"] else [(math.nan, False), (math.inf, option["infinite"]), (-math.inf, False)]
        if not isinstance(least, (int, float)):
            made += [(1.5, True)]
        else:
            made += [(least - step, least - step == option.get("beside")), (least, not option["least_excluded"])]
            made += [(least + step, True)]
        if isinstance(most, (int, float)):
            made += [(most + step, False), (most, not option["most_excluded"])]
        return made + ([(option["beside"], True)] if "beside" in option else [])
    return []


def refusal(operation, depth, camera, given):
    try:
        getattr(fathom, operation["name"])(depth, camera, **given)
    except ValueError as error:
        return str(error)
    return ""


def test_values_within_their_ranges_and_beyond(program, metres, keys):
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    images = {"picture": numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32), "depth": depth, "result": True}
    images["directions"] = numpy.full((HEIGHT, WIDTH, 3), 3**-0.5, numpy.float32)
    checked = 0
    for operation in json.loads(program("options", "--json").stdout)["operations"]:
        for option in operation["options"]:
            for value, fits in values(option):
                name = python_name(option["name"])
                said = refusal(operation, depth, camera, beside(operation, option, images) | {name: value})
                own = said.startswith(f"{name} = ") and (" must " in said or " is unknown" in said)
                assert own == (not fits), (operation["name"], option["name"], value, said)
                checked += 1
    assert checked > 150
    print(f"{checked} values")


def test_what_excludes_another_option_is_refused_beside_it(metres, keys):
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    images = {"picture": numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32), "depth": depth, "result": True}

    def good(option):
        fitting = (value for value, fits in values(option) if fits and value != option["default"])  # which says nothing
        return next(fitting, images.get(option["kind"]))

    tried = 0
    for operation in fathom.options():
        by_name = {option["name"]: option for option in operation["options"]}
        for option in operation["options"]:
            for other in set(option["excludes"]) - {option["name"]}:
                given = {option["name"]: good(option), other: good(by_name[other])}
                said = refusal(operation, depth, camera, required(operation, images["picture"]) | given)
                assert " exclude each other: give one of the two" in said, (operation["name"], given)
                tried += 1
    assert tried > 30


def test_options_are_those_of_the_program(program):
    described = json.loads(program("options", "--json").stdout)["operations"]
    for operation in described:
        for option in operation["options"]:
            del option["program"], option["program_takes"]
            option["name"] = python_name(option["name"])
    assert fathom.options() == described
    kinds = {"number": (int, float, str), "choice": str, "flag": bool, "result": bool}  # a str is infinity
    for option in (option for operation in described for option in operation["options"]):
        default = option["default"]
        assert default is None or (isinstance(default, kinds.get(option["kind"], list)) and not option["required"])
        assert option["required"] or option["default_words"]


def test_what_needs_another_option_is_refused_without_it(metres, keys):
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    images = {"picture": numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32), "depth": depth}
    tried = 0
    for operation in fathom.options():
        for option in operation["options"]:
            if option["needs"]:
                good = [value for value, fits in values(option) if fits and value != option["default"]]
                value = good[0] if good else images.get(option["kind"])
                given = required(operation, images["picture"]) | {option["name"]: value}
                said = refusal(operation, depth, camera, given)
                assert said == f"{option['name']}: is of no use without {' or '.join(option['needs'])}"
                tried += 1
    assert tried >= 7


def test_an_option_that_is_described_is_a_keyword_and_no_other(program):
    common = {"depth", "camera", "ignore", "storage", "out", "device"}
    for operation in fathom.options():
        described = {option["name"] for option in operation["options"]}
        hook = {"color"} if operation["name"] == "dof_masks" else set()  # which gives the results their size
        assert set(inspect.signature(getattr(fathom, operation["name"])).parameters) == described | common | hook


def test_a_call_with_all_defaults_is_one_without_them(metres, keys):
    """As the panel of another program makes it."""
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    picture = numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32)
    for operation in fathom.options():
        defaults = {option["name"]: option["default"] for option in operation["options"] if option["default"] is not None}
        call, needed = getattr(fathom, operation["name"]), required(operation, picture)
        if infinite := [name for name, value in defaults.items() if value == "inf" and name != "background"]:
            defaults |= dict.fromkeys(infinite, math.inf)
        for given in (defaults, dict(reversed(defaults.items()))):
            made, plain = call(depth, camera, **needed, **given), call(depth, camera, **needed)
            for one, other in zip(made, plain):
                numpy.testing.assert_array_equal(one, other)


def test_an_option_at_its_default_stands_beside_anything(metres, keys):
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    picture = numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32)
    numpy.testing.assert_array_equal(
        fathom.dof(depth, camera, picture, circle=(3, 1), blades=0, ratio=2),
        fathom.dof(depth, camera, picture, circle=(3, 1), ratio=2),
    )
    for given in ({"max_error": 0.1, "quality": "balanced"}, {"quality": "balanced", "max_error": 0.1}):
        numpy.testing.assert_array_equal(
            fathom.ssao(depth, camera, 0.3, **given), fathom.ssao(depth, camera, 0.3, max_error=0.1)
        )
    with_flag = {"operation": "dof_masks", "tile_px": 8, "tile_min_coc": False}
    for name, given in (("fog", {"density": 0.1, "up": (0, 0, 1), "height_falloff": 0}), (with_flag.pop("operation"), with_flag)):
        its = next(each for each in fathom.options() if each["name"] == name)
        assert "is of no use without" in refusal(its, depth, camera, required(its, picture) | given), name

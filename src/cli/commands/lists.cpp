// fathom devices, fathom options and fathom presets: what there is.
#include "cli/options.hpp"
#include "description/as_json.hpp"

#include <fathom/presets.hpp>
#include <fathom/probe.hpp>

#include <fmt/format.h>

#include <algorithm>

namespace fathom::cli {
namespace {

// What a kernel found, or why none ran.
struct Probed {
    std::optional<DeviceArithmetic> arithmetic;
    std::string words;
};

Probed probed(const DeviceInfo& device) {
    try {
        const DeviceArithmetic found = probe_arithmetic(Device::open(std::to_string(device.index)));
        return {found, to_string(found)};
    } catch (const std::exception& error) {
        const std::string said = error.what();
        return {{}, said.substr(0, said.find('\n'))};
    }
}

ordered_json as_json(const Probed& probed) {
    if (!probed.arithmetic)
        return {{"error", probed.words}};
    const DeviceArithmetic& found = *probed.arithmetic;
    ordered_json line{{"exact", found.exact()},
                      {"division_ulp", found.division_ulp},
                      {"sqrt_ulp", found.sqrt_ulp},
                      {"fma_ulp", found.fma_ulp},
                      {"separate_products", found.separate_products},
                      {"denormals", found.denormals},
                      {"signed_zeros", found.signed_zeros}};
    if (found.fp64)
        line["fp64"] = *found.fp64;
    return line;
}

ordered_json as_json(const DeviceInfo& device, int default_index) {
    return {{"index", device.index},
            {"name", device.name},
            {"platform", device.platform},
            {"version", device.version},
            {"type", device.cpu ? "cpu" : "gpu"},
            {"fp64", device.fp64},
            {"compute_units", device.compute_units},
            {"memory_bytes", device.memory_bytes},
            {"denormals", device.denormals},
            {"correct_rounding", device.correct_rounding},
            {"fma", device.fma},
            {"native_vector_width", device.native_vector_width},
            {"arithmetic", as_json(probed(device))},
            {"default", device.index == default_index}};
}

void print_table(const std::vector<DeviceInfo>& devices, int default_index) {
    std::size_t width = 0;
    for (const DeviceInfo& device : devices)
        width = std::max(width, device.name.size());
    for (const DeviceInfo& device : devices)
        fmt::print("{} {}  {}  {:<{}}  {} units, {:.1f} GiB, {}  ({})\n        arithmetic: {}\n",
                   device.index == default_index ? '*' : ' ', device.index, device.cpu ? "cpu" : "gpu", device.name,
                   width, device.compute_units, static_cast<double>(device.memory_bytes) / (1 << 30),
                   device.fp64 ? "fp64" : "no fp64", device.version, probed(device).words);
    fmt::print("* is taken when --device is not given\n");
}

int list(bool json) {
    DeviceOption().prepare();
    const int standard = Device::open().info().index;
    const std::vector<DeviceInfo> devices = list_devices();
    if (json) {
        ordered_json all = ordered_json::array();
        for (const DeviceInfo& device : devices)
            all.push_back(as_json(device, standard));
        print_json(all);
    } else {
        print_table(devices, standard);
    }
    return done;
}

std::function<int()> configure_devices(CLI::App& app) {
    const auto json = std::make_shared<bool>(false);
    add_flag(app, "Report", "--json", *json, "print a JSON array");
    return [json] { return list(*json); };
}

void print_operations(bool in_json) {
    ordered_json json = ordered_json::array();
    const auto program = [](const description::Option& option) {
        const std::string value = value_spelled(option);
        return spelled(option) + (value.empty() ? "" : " " + value);
    };
    for (const description::Operation& operation : description::operations()) {
        json.push_back(as_json(operation, program));
        if (in_json)
            continue;
        fmt::print("{}: {}\n", operation.name, operation.summary);
        for (const std::vector<description::Option>* listed : operation.listed())
            for (const description::Option& option : *listed)
                fmt::print("    {:<18} {:<20} {}; {}; {}\n", option.name, program(option), option.words,
                           option.accepted(), option.required ? "required" : "default: " + option.default_in_words());
    }
    if (in_json)
        print_json({{"version", FATHOM_VERSION}, {"operations", json}});
}

std::function<int()> configure_options(CLI::App& app) {
    const auto json = std::make_shared<bool>(false);
    app.add_flag("--json", *json, "print one line of JSON, from which other programs can make their own panels");
    return [json] {
        print_operations(*json);
        return done;
    };
}

struct PresetsArguments {
    std::string name;
    bool json = false;
};

// What the source leaves open: near, far, fov_x_deg (usually 90).
std::string needs_of(const Preset& preset) {
    std::string needs;
    for (const auto& [key, meaning] : preset.needs)
        needs += key + ", ";
    needs += preset.projection == "fx" ? "fx, fy, cx, cy" : preset.projection.empty() ? "nothing" : preset.projection;
    return preset.usual.empty() ? needs : fmt::format("{} (usually {})", needs, preset.usual);
}

ordered_json as_json(const Preset& preset) {
    ordered_json needs = ordered_json::object();
    for (const auto& [key, meaning] : preset.needs)
        needs[key] = meaning;
    return {{"name", preset.name},
            {"source", preset.source},
            {"formula", preset.formula},
            {"keys", ordered_json::parse(preset.keys)},
            {"needs", needs},
            {"projection", preset.projection},
            {"usual", preset.usual.empty() ? ordered_json() : ordered_json(preset.usual)}};
}

void print_list() {
    std::size_t width = 0;
    for (const Preset& preset : presets())
        width = std::max(width, preset.name.size());
    for (const Preset& preset : presets()) {
        fmt::print("{:<{}}  {}\n", preset.name, width, preset.source);
        fmt::print("{:<{}}  {}; needs {}\n", "", width, preset.formula, needs_of(preset));
    }
}

// The camera file to start from. A question mark is no number: a file that still has one is refused.
std::string camera_file(const Preset& preset) {
    ordered_json file{{"preset", preset.name}};
    for (const auto& [key, meaning] : preset.needs)
        file[key] = "?";
    if (preset.projection == "fx")
        file["intrinsics"] = {{"fx", "?"}, {"fy", "?"}, {"cx", "?"}, {"cy", "?"}};
    else if (!preset.projection.empty())
        file["perspective"] = {
            {preset.projection, preset.usual.empty() ? ordered_json("?") : ordered_json::parse(preset.usual)}};
    return file.dump(2);
}

void print_one(const Preset& preset) {
    fmt::print("{}: {}\n{}\n\nIt stands for {}\nIt needs {}\n", preset.name, preset.source, preset.formula, preset.keys,
               needs_of(preset));
    for (const auto& [key, meaning] : preset.needs)
        fmt::print("  {}: {}\n", key, meaning);
    fmt::print("\nA camera file to start from:\n{}\n", camera_file(preset));
}

int list(const PresetsArguments& options) {
    std::vector<std::string> names;
    const Preset* asked = nullptr;
    for (const Preset& preset : presets()) {
        names.push_back(preset.name);
        if (preset.name == options.name)
            asked = &preset;
    }
    if (!options.name.empty() && !asked)
        throw UsageError(options.name + ": unknown preset; " +
                         did_you_mean(options.name, names, "fathom presets lists them"));
    if (options.json) {
        ordered_json all = ordered_json::array();
        for (const Preset& preset : presets())
            if (!asked || &preset == asked)
                all.push_back(as_json(preset));
        print_json(all);
    } else if (asked) {
        print_one(*asked);
    } else {
        print_list();
    }
    return done;
}

std::function<int()> configure_presets(CLI::App& app) {
    const auto options = std::make_shared<PresetsArguments>();
    add_option(app, "Input", "NAME", "NAME", options->name, "show this one, and a camera file to start from");
    add_flag(app, "Report", "--json", options->json, "print a JSON array");
    return [options] { return list(*options); };
}

} // namespace

extern const Command devices_command{
    .name = "devices",
    .summary = "Lists the OpenCL devices and marks the default one.",
    .notes =
        R"(A kernel tries how each device rounds quotients, square roots, fused products and very small numbers. Devices whose
arithmetic is "exact" give the same bits. "exact, without double" is the same for devices that have no double.

Example:
  fathom devices)",
    .configure = configure_devices,
};

extern const Command options_command{
    .name = "options",
    .summary = "Lists the options of each operation: what they accept, and what they are by default.",
    .notes =
        R"(Each option is shown as C++ and Python name it, then as the program spells it, unless a file says it there.
With --json a default is a number, a word, yes or no, or a list; default_words has it in words. An option is of no use
without one of those that it needs (space=world is one with this value), and refused beside one that it excludes: one
that excludes its own name takes values of several kinds, of which you give one. program_takes is what the program
accepts, where a file may bring the depth that belongs to a picture.

Example:
  fathom options --json)",
    .configure = configure_options,
};

extern const Command presets_command{
    .name = "presets",
    .summary = "Lists the sources of depth that Fathom knows by name.",
    .notes =
        R"(A preset says what the stored values of a source mean: z is the distance along the view axis, v a stored value. It
does not know the angle of view, which you add. Names stand in camera files ("preset": "carla") and in --preset.

Example:
  fathom presets carla
  fathom linearize depth.png --preset carla:fov_x_deg=90 -o z.exr)",
    .configure = configure_presets,
};

} // namespace fathom::cli

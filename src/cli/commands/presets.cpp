// fathom presets
#include "cli/command.hpp"
#include "terminal/messages.hpp"

#include <fathom/presets.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace fathom::cli {
namespace {

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

nlohmann::ordered_json as_json(const Preset& preset) {
    nlohmann::ordered_json needs = nlohmann::ordered_json::object();
    for (const auto& [key, meaning] : preset.needs)
        needs[key] = meaning;
    return {{"name", preset.name},
            {"source", preset.source},
            {"formula", preset.formula},
            {"keys", nlohmann::ordered_json::parse(preset.keys)},
            {"needs", needs},
            {"projection", preset.projection},
            {"usual", preset.usual.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(preset.usual)}};
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
    nlohmann::ordered_json file{{"preset", preset.name}};
    for (const auto& [key, meaning] : preset.needs)
        file[key] = "?";
    if (preset.projection == "fx")
        file["intrinsics"] = {{"fx", "?"}, {"fy", "?"}, {"cx", "?"}, {"cy", "?"}};
    else if (!preset.projection.empty())
        file["perspective"] = {{preset.projection, preset.usual.empty() ? nlohmann::ordered_json("?")
                                                                        : nlohmann::ordered_json::parse(preset.usual)}};
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
    if (!options.name.empty() && !asked) {
        const std::string meant = nearest(options.name, names);
        throw UsageError(options.name + ": unknown preset; " +
                         (meant.empty() ? "fathom presets lists them" : "did you mean " + meant + "?"));
    }
    if (options.json) {
        nlohmann::ordered_json all = nlohmann::ordered_json::array();
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
    app.add_option("NAME", options->name, "show this one, and a camera file to start from")
        ->type_name("NAME")
        ->group("Input");
    app.add_flag("--json", options->json, "print a JSON array")->group("Report");
    return [options] { return list(*options); };
}

} // namespace

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

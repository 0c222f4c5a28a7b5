// fathom inspect
#include "cli/options.hpp"
#include "doubts/look.hpp"
#include "io/cameras/camera_formats.hpp"
#include "io/floats_on_host.hpp"

#include <fathom/doubts.hpp>
#include <fathom/error.hpp>
#include <fathom/findings.hpp>
#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>
#include <fathom/ranking.hpp>

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace fathom::cli {
namespace {

struct InspectArguments {
    std::string file;
    std::vector<Input> inputs; // the file
    CameraOption camera;
    std::string channel;
    DeviceOption device;
    bool json = false;
};

struct Findings {
    std::string why_no_camera; ///< although the header has one
    DepthFile depth;
    std::vector<Channel> channels;
    StoredStatistics statistics;
    std::optional<CameraFindings> camera; ///< what the camera makes of the values
    std::vector<Finding> doubts;          ///< what is probably wrong with it
    Ranking ranking;                      ///< what they could be where there is no camera
    std::optional<Packing> packing;       ///< one that was found and not said
};

// What linearize makes of the image, through a lens distances along the ray; nothing without a device, unless one was asked for.
cv::Mat decoded(const DepthFile& depth, const Camera& camera, const DeviceOption& device) {
    device.prepare();
    try {
        const Device opened = device.open();
        return at_any_width(opened, [&] {
            return to_mat(linearize({to_device(opened, depth.values), camera, depth.storage},
                                    {.as = camera.lens ? Along::ray : Along::axis})
                              .image);
        });
    } catch (const runtime::CompilerCrashed&) {
        throw;
    } catch (const NoDevice&) {
        if (!device.wanted.empty())
            throw;
        return {};
    }
}

// Depth in several channels of 8 bits whose packing nobody said: that of the packings which makes planes of planes.
// None where several do, or none.
std::optional<Packing> found_packing(const std::string& file) {
    std::optional<Packing> found;
    for (const Packing packing :
         {Packing::rgb_red_low, Packing::rgb_red_high, Packing::rgba_red_low, Packing::rgba_red_high}) {
        const auto depth = io::if_any([&] { return read_depth(file, {.packing = packing}); });
        if (!depth || !rank_encodings(io::on_host(depth->values, depth->storage)).family)
            continue; // the image has no such channels, or no such values
        if (found)
            return std::nullopt;
        found = packing;
    }
    return found;
}

DepthFile read_without_camera(const InspectArguments& options, std::optional<Packing>& packing) {
    if (auto depth = io::if_any([&] { return read_depth(options.file, {.channel = options.channel}); }))
        return *depth;
    packing = options.channel.empty() ? found_packing(options.file) : std::nullopt;
    return read_depth(options.file, {.channel = options.channel, .packing = packing});
}

// The camera that was given, or that of the header. One that leaves the values open or cannot be used describes nothing.
std::optional<ImportedCamera> camera_for(const InspectArguments& options, std::string& why_not) {
    if (!options.camera.given() && !io::exr_has_camera(options.file))
        return std::nullopt;
    try {
        return options.camera.read();
    } catch (const io::UnansweredRead&) {
        throw;
    } catch (const Error& error) {
        if (options.camera.given())
            throw;
        why_not = error.what();
        return std::nullopt;
    }
}

Findings inspected(const InspectArguments& options) {
    Findings found;
    const std::optional<ImportedCamera> described = camera_for(options, found.why_no_camera);
    found.depth =
        described ? read_depth(options.file,
                               {.channel = options.channel, .packing = described->packing, .gamma = described->gamma})
                  : read_without_camera(options, found.packing);
    found.channels = list_channels(options.file);
    const HostDepth stored = io::on_host(found.depth.values, found.depth.storage);
    const cv::Mat& values = found.depth.values;
    found.statistics = stored_statistics(stored);
    if (!described) {
        found.ranking = rank_encodings(stored);
        return found;
    }
    try {
        const ImportedCamera imported = options.camera.read_for(options.inputs.front(), found.depth.storage);
        for (const std::string& warning : imported.warnings)
            complain(fmt::format("warning: {}: {}", options.camera.name(), warning));
        const Camera camera = fathom::camera_for(imported, values.cols, values.rows);
        found.doubts = doubts(Subject(camera, stored, Closely::most));
        for (const std::string& doubt : key_doubts(imported.text, camera.width, camera.height))
            found.doubts.push_back({Fault::lens, doubt});
        if (const auto doubt = io::ray_channel_doubt(found.depth.channel, camera))
            found.doubts.push_back({Fault::planes, *doubt});
        if (const auto doubt = near_and_far_doubt(camera, found.depth.near_and_far))
            found.doubts.push_back(*doubt);
        const cv::Mat z = decoded(found.depth, camera, options.device);
        found.camera = camera_findings(camera, stored, {reinterpret_cast<const float*>(z.data), z.total()});
    } catch (const std::invalid_argument& error) { // a field of the camera
        throw Error(about(options.camera.name(), error.what(), {options.file}));
    }
    return found;
}

const char* name_of(DepthBits bits) {
    return bits == DepthBits::d16 ? "16-bit integer" : bits == DepthBits::d24 ? "24-bit integer" : "32-bit float";
}

// Degrees across and down between the rays at the middles of opposite edges; none under an orthographic camera.
std::optional<std::array<double, 2>> field_of_view(const CameraFindings& found) {
    if (!found.form.perspective || found.lens)
        return std::nullopt;
    const Rays rays = camera_rays(found.camera);
    const double right = found.camera.width, bottom = found.camera.height;
    const auto angle = [&](double x0, double y0, double x1, double y1) {
        using Vector = Eigen::Matrix<long double, 3, 1>;
        const Vector a = rays.direction * Vector(x0, y0, 1), b = rays.direction * Vector(x1, y1, 1);
        return static_cast<double>(std::atan2(a.cross(b).norm(), a.dot(b))) * 180 / std::numbers::pi;
    };
    return std::array{angle(0, bottom / 2, right, bottom / 2), angle(right / 2, 0, right / 2, bottom)};
}

ordered_json as_json(const Camera& camera, const LensFindings& found) {
    ordered_json fold;
    if (found.fold)
        fold = {{"angle_deg", found.fold->angle * 180 / std::numbers::pi},
                {"radius", found.fold->radius},
                {"coefficient", found.fold->coefficient}};
    return {
        {"model", to_string(camera.lens->law)}, {"no_ray", found.no_ray}, {"too_steep", found.steep}, {"fold", fold}};
}

ordered_json as_json(const CameraFindings& found) {
    const auto view = field_of_view(found);
    ordered_json range, surfaces;
    const auto add = [](ordered_json& points, const auto& point, ordered_json place) {
        if (point.spacing)
            place.update({{"spacing", json_number(*point.spacing)}, {"error_bound", json_number(*point.error_bound)}});
        points[point.name] = std::move(place);
    };
    for (const RangePoint& point : found.range)
        add(range, point, {{"stored", json_number(point.stored)}, {"z", json_number(point.z)}});
    for (const SurfacePoint& surface : found.surfaces)
        add(surfaces, surface, {{"z", json_number(surface.z)}, {"x", surface.x}, {"y", surface.y}});
    return {{"encoding", to_string(found.camera.encoding)},
            {"form", to_string(found.form.form)},
            {"reason", found.form.reason},
            {"perspective", found.form.perspective},
            {"field_of_view_deg", view ? ordered_json(*view) : ordered_json()},
            {"precision_of", found.bits ? ordered_json(name_of(*found.bits)) : ordered_json()},
            {"background", found.background},
            {"invalid", found.invalid ? ordered_json(*found.invalid) : ordered_json()},
            {"missing", found.missing},
            {"lens", found.lens ? as_json(found.camera, *found.lens) : ordered_json()},
            {"range", range},
            {"surfaces", surfaces}};
}

// A camera file with the packing that was found, if any.
ordered_json camera_file_of(const Guess& guess, std::optional<Packing> packing) {
    auto file = ordered_json::parse(guess.camera_file);
    if (packing)
        file["packing"] = to_string(*packing);
    return file;
}

ordered_json as_json(const Ranking& ranking, std::optional<Packing> packing) {
    auto guesses = ordered_json::array();
    for (const Guess& guess : ranking.guesses)
        guesses.push_back({{"family", to_string(guess.family)},
                           {"meaning", guess.meaning},
                           {"fits", guess.fits},
                           {"camera_file", camera_file_of(guess, packing)},
                           {"assumed", guess.assumed}});
    return {{"family", ranking.family ? ordered_json(to_string(*ranking.family)) : ordered_json()},
            {"evidence", ranking.evidence},
            {"guesses", guesses}};
}

// A sentence, and its cures as members of a camera file.
ordered_json as_json(const Finding& finding) {
    auto cures = ordered_json::array();
    for (const Cure& cure : finding.cures)
        cures.push_back(ordered_json::parse("{" + in_words(cure.keys) + "}"));
    return {{"fault", to_string(finding.fault)}, {"words", in_words(finding)}, {"cures", cures}};
}

ordered_json as_json(const InspectArguments& options, const Findings& found) {
    ordered_json channels = ordered_json::array(), percentiles, doubts = ordered_json::array();
    for (const Finding& finding : found.doubts)
        doubts.push_back(as_json(finding));
    for (const Channel& channel : found.channels)
        channels.push_back({{"name", channel.name}, {"type", channel.type}});
    const StoredStatistics& s = found.statistics;
    for (std::size_t i = 0; i < stored_percents.size(); ++i)
        percentiles[std::to_string(stored_percents[i])] = json_number(s.percentiles[i]);
    return {{"file", options.file},
            {"width", found.depth.values.cols},
            {"height", found.depth.values.rows},
            {"storage", to_string(found.depth.storage)},
            {"channel", found.depth.channel},
            {"channels", channels},
            {"stored", {{"min", json_number(s.min)}, {"max", json_number(s.max)}, {"percentiles", percentiles}}},
            {"pixels", s.pixels},
            {"nan", s.nan},
            {"inf", s.inf},
            {"minus_inf", s.minus_inf},
            {"at_zero", s.at_zero},
            {"at_largest", s.at_largest},
            {"camera", found.camera ? as_json(*found.camera) : ordered_json()},
            {"doubts", doubts},
            {"could_be", found.camera ? ordered_json() : as_json(found.ranking, found.packing)}};
}

void print_row(const std::string& term, const std::string& meaning) {
    fmt::print("  {:<13} {}\n", term, meaning);
}

std::string steps(const std::optional<double>& spacing, const std::optional<double>& error_bound) {
    if (!spacing || !error_bound)
        return {};
    if (std::isinf(*spacing))
        return "beyond the last step";
    return fmt::format("steps of {:.3g}, error at most {:.3g}", *spacing, *error_bound);
}

void print_range(const CameraFindings& found) {
    fmt::print("\nrange: depth that can be stored at the centre, scene units\n");
    if (found.range.empty())
        print_row("no end", "the stored values are distances (or their inverse) themselves");
    for (const RangePoint& point : found.range)
        print_row(point.name, fmt::format("{:<14}{:<44}stored {:.9g}", number(point.z),
                                          steps(point.spacing, point.error_bound), point.stored));
    if (found.bits && !found.range.empty())
        print_row("", fmt::format("of a {} buffer; middle is the stored value half way", name_of(*found.bits)));
}

void print_lens(const Camera& camera, const LensFindings& found) {
    print_row("lens", to_string(camera.lens->law));
    print_row("no ray", fmt::format("{} pixels", found.no_ray));
    if (found.steep)
        print_row("too steep",
                  fmt::format("{} pixels: more than 89° from the axis, along which depth counts", found.steep));
    if (found.fold)
        print_row("fold",
                  fmt::format("{:.4g}° from the axis, at a radius of {:.4g}; {} bends it most",
                              found.fold->angle * 180 / std::numbers::pi, found.fold->radius, found.fold->coefficient));
}

void print_camera(const InspectArguments& options, const CameraFindings& found) {
    fmt::print("\ncamera: {}\n", options.camera.name());
    print_row("encoding", to_string(found.camera.encoding));
    print_row("form", fmt::format("{}: {}", to_string(found.form.form), found.form.reason));
    if (const auto view = field_of_view(found))
        print_row("field of view", fmt::format("{:.4g}° × {:.4g}°", (*view)[0], (*view)[1]));
    if (found.lens)
        print_lens(found.camera, *found.lens);
    print_row("background", fmt::format("{} pixels", found.background));
    if (found.form.missing)
        print_row("not measured", fmt::format("{} pixels", found.missing));

    print_range(found);

    fmt::print("\nsurfaces: distance along the {}, scene units\n", found.lens ? "ray" : "view axis");
    if (found.surfaces.empty())
        print_row("none", found.invalid ? "no pixel is a surface" : "no OpenCL device to decode them");
    for (const SurfacePoint& surface : found.surfaces)
        print_row(surface.name, fmt::format("{:<14}at pixel {:.0f}, {:.0f}  {}", number(surface.z), surface.x - 0.5,
                                            surface.y - 0.5, steps(surface.spacing, surface.error_bound)));
    if (found.invalid)
        print_row("invalid", fmt::format("{} pixels", *found.invalid));
}

void print_ranking(const Findings& found) {
    const Ranking& ranking = found.ranking;
    fmt::print("\nwhat the values could be: {}\n", ranking.family ? to_string(*ranking.family) : "cannot tell");
    for (const std::string& sentence : ranking.evidence)
        print_row(&sentence == &ranking.evidence.front() ? "evidence" : "", sentence);
    if (found.packing)
        print_row("packing", fmt::format("{}: no other one makes smooth surfaces", to_string(*found.packing)));
    for (const Guess& guess : ranking.guesses)
        print_row(to_string(guess.family), guess.meaning);
    if (ranking.guesses.empty())
        return;
    const Guess& first = ranking.guesses.front();
    fmt::print("\na camera file to start from: {}\nassumed in it, for you to replace: {}\n",
               camera_file_of(first, found.packing).dump(), first.assumed);
}

void print_findings(const InspectArguments& options, const Findings& found) {
    const StoredStatistics& s = found.statistics;
    const std::string channel = io::printable(found.depth.channel);
    fmt::print("file: {}\n", options.file);
    print_row("size", fmt::format("{} × {}", found.depth.values.cols, found.depth.values.rows));
    print_row("type", to_string(found.depth.storage) + (channel.empty() ? "" : ", channel " + channel));
    for (const Channel& each : found.channels)
        print_row(&each == &found.channels.front() ? "channels" : "",
                  fmt::format("{} ({})", io::printable(each.name), each.type));

    fmt::print("\nstored values: as they lie in the file, finite ones only\n");
    print_row("min", number(s.min));
    for (std::size_t i = 0; i < stored_percents.size(); ++i)
        print_row(fmt::format("{:>2} %", stored_percents[i]), number(s.percentiles[i]));
    print_row("max", number(s.max));

    fmt::print("\npixels: {}\n", s.pixels);
    print_row("NaN", std::to_string(s.nan));
    print_row("+Inf", std::to_string(s.inf));
    print_row("-Inf", std::to_string(s.minus_inf));
    print_row("at 0", std::to_string(s.at_zero));
    print_row("at " + number(storage_max(found.depth.storage)), std::to_string(s.at_largest));
    if (found.camera)
        print_camera(options, *found.camera);
    if (!found.doubts.empty())
        fmt::print("\nprobably wrong:\n");
    for (const Finding& doubt : found.doubts)
        fmt::print("  {}\n", in_words(doubt));
    if (!found.camera) {
        print_row("background", "unknown without --camera or --preset");
        if (!found.why_no_camera.empty())
            fmt::print("\nthe camera in the header says too little: {}\n", found.why_no_camera);
        print_ranking(found);
    }
}

int inspect(const InspectArguments& options) {
    const Findings found = inspected(options);
    if (options.json)
        print_json(as_json(options, found));
    else
        print_findings(options, found);
    return done;
}

std::function<int()> configure_inspect(CLI::App& app) {
    const auto options = std::make_shared<InspectArguments>();
    add_option(app, "Input", "DEPTH", "DEPTH", options->file, "depth image: EXR, 16-bit PNG, TIFF, PFM or NPY")
        ->required();
    add_camera_options(app, options->camera, "also show what this camera file makes of the values");
    add_channel_option(app, options->channel);
    add_flag(app, "Report", "--json", options->json, "print one JSON object");
    add_device_options(app, options->device);
    return [options] {
        options->inputs = {{options->file, frame_of(options->file)}};
        options->camera.inputs = [&inputs = options->inputs]() -> const std::vector<Input>& { return inputs; };
        return inspect(*options);
    };
}

} // namespace

extern const Command inspect_command{
    .name = "inspect",
    .summary = "Shows what a depth image holds, and what its values mean or could mean.",
    .notes =
        R"(Run this first. Percentiles are values of the image (nearest rank). With a camera, range shows the nearest and the
farthest depth that stored values can mean, and their precision. Without one, what the values could be is ranked by
what is affine in the pixel over the image's flat patches, by their range and by silhouettes. In JSON, NaN and
infinities are the strings "nan", "inf" and "-inf". Values that are unknown or were not asked for are null.

Example:
  fathom inspect frame.exr
  fathom inspect frame.exr --camera camera.json)",
    .configure = configure_inspect,
};

} // namespace fathom::cli

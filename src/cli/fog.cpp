// fathom fog
#include "command.hpp"
#include "each_depth.hpp"
#include "picture.hpp"

#include <fathom/fog.hpp>
#include <fathom/opencv.hpp>

#include <cmath>
#include <utility>

namespace fathom::cli {
namespace {

struct FogArguments : DepthOptions {
    FogOptions fog{.density = 0}; // --density is required
    PictureOptions picture;
};

// Three finite numbers "A,B,C"; nothing otherwise.
std::optional<std::array<double, 3>> three_numbers(const std::string& text) {
    const std::vector<std::string> parts = CLI::detail::split(text, ',');
    std::array<double, 3> numbers;
    bool good = parts.size() == 3;
    for (std::size_t i = 0; good && i < 3; ++i)
        good = CLI::detail::lexical_cast(parts[i], numbers[i]) && std::isfinite(numbers[i]);
    return good ? std::optional(numbers) : std::nullopt;
}

CLI::Option* add_three(CLI::App& app, const char* name, const char* form,
                       const std::function<void(const std::array<double, 3>&)>& take, const char* description) {
    return app
        .add_option_function<std::string>(
            name, [take](const std::string& text) { take(*three_numbers(text)); }, description)
        ->type_name(form)
        ->check(CLI::Validator(
            [](std::string& text) {
                return three_numbers(text) ? "" : "'" + text + "' will not do; it is three numbers between commas";
            },
            ""))
        ->group("Fog");
}

void add_fog_options(CLI::App& app, FogOptions& fog) {
    const auto from_0 = is_a_number("number from 0", [](double v) { return v >= 0; });
    const auto add = [&](const char* name, const char* value, const CLI::Validator& check, double& target,
                         const char* description) {
        return app.add_option(name, target, description)->type_name(value)->check(check)->group("Fog");
    };
    add("--density", "D", from_0, fog.density.value, "fraction of the light lost per scene unit, over a short way")
        ->required();
    add_three(
        app, "--fog-color", "R,G,B", [&fog](const auto& rgb) { fog.fog_color = rgb; },
        "colour of the fog, linear light\n(default: 0.5,0.6,0.7)");
    add("--start", "S", from_0, fog.start, "distance along the ray at which the fog begins, scene units\n(default: 0)");
    add("--max-opacity", "F", is_a_number("number from 0 to 1", [](double v) { return v >= 0 && v <= 1; }),
        fog.max_opacity, "no pixel is fogged more than this, 0 to 1 (default: 1)");
    CLI::Option* falloff = add(
        "--height-falloff", "K", from_0, fog.height_falloff,
        "height fog: the density falls by exp(-K h) over a height h;\nneeds \"view\" in the camera file (default: 0)");
    add("--reference-height", "H", is_a_number("number", [](double) { return true; }), fog.reference_height,
        "height in the world where the density is --density (default: 0)")
        ->needs(falloff);
    add_three(
        app, "--up", "X,Y,Z",
        [&fog](const auto& up) {
            fog.up = {up[0], up[1], up[2]};
        },
        "the world's up axis (default: 0,1,0)")
        ->needs(falloff)
        ->check(CLI::Validator(
            [](std::string& text) {
                const auto up = three_numbers(text);
                return up == std::array<double, 3>{} ? "'" + text + "' will not do; one of the three is not 0" : "";
            },
            ""));
    add_enum_option(app, "--sky", fog.sky, {{"fog", FogSky::fog}, {"keep", FogSky::keep}},
                    "the background: infinitely far away (default), or left alone")
        ->group("Fog");
}

Picture fogged(const FogArguments& options, const StoredDepth& stored, const Loaded& frame) {
    Picture picture = frame.images.get().picture;
    FogOptions asked = options.fog;
    std::swap(asked.fog_color[0], asked.fog_color[2]); // a matrix is B, G, R
    const cv::Mat color = picture.color;               // read by the device until the result is there
    picture.color = to_mat(fog(stored, to_device(stored.image.device(), color), asked));
    return picture;
}

std::function<int()> configure_fog(CLI::App& app) {
    const Product product = picture_product("fog");
    const auto options = std::make_shared<FogArguments>();
    add_depth_options(app, *options, product);
    add_picture_options(app, options->picture, "the clear picture");
    add_fog_options(app, options->fog);
    return [=] {
        More more{.halo = 0};
        more.companions.push_back({"--color", options->picture.color});
        more.picture = 0;
        more.color_layer = options->picture.color_layer;
        more.read = [options](const Job& job) {
            return Images{.picture = picture_of(job.companions.front(), options->picture, job)};
        };
        more.picture_rows = [options](const Job& job) {
            return picture_rows_of(job.companions.front(), options->picture, job);
        };
        more.doubts = [options](const Job& job) { return picture_doubts(options->picture, job); };
        return each_depth(*options, product, more, [&](const StoredDepth& stored, const Loaded& frame) {
            return std::vector<Result>{fogged(*options, stored, frame)};
        });
    };
}

} // namespace

extern const Command fog_command{
    .name = "fog",
    .summary = "Lays fog over a picture: uniform, or thinner with the height.",
    .notes = R"(Each pixel becomes color (1 - f) + fog color f with f = 1 - exp(-density distance). The distance is that
along the ray, in scene units. Under --height-falloff the density is integrated along the ray in closed form.

Fog covers light, not codes: see --color-space. An alpha stays as it is. A pixel with an invalid depth keeps its
colour. With several inputs, IMAGE and OUT are folders. The picture and the result of an input have its name there.

Example:
  fathom fog frame.exr --color frame.exr --camera camera.json -o foggy.exr --density 0.02
  fathom fog frame.exr --color frame.png --camera camera.json -o foggy.png --density 0.1 --height-falloff 0.5 \
      --up 0,0,1 --fog-color 0.7,0.7,0.75)",
    .configure = configure_fog,
};

} // namespace fathom::cli

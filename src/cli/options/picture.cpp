#include "picture.hpp"

#include "depth_options.hpp"

#include "io/formats.hpp"
#include "shot/results.hpp"

#include <fathom/io.hpp>

#include <fmt/format.h>

namespace fathom::cli {
namespace {

// The windows that the picture is to have: none where it has another size than the depth.
std::optional<Windows> windows_for(const std::filesystem::path& file, const PictureOptions& options, const Job& job) {
    if (!is_exr(file) || has_overscan(job.windows))
        return job.windows;
    const Windows held = io::exr_windows(file, color_channels(file, options.color_layer).front());
    return held.display == job.windows.display ? std::optional(job.windows) : std::nullopt;
}

// What is probably wrong with how the picture is said to count light.
std::vector<std::string> picture_doubts(const PictureOptions& options, const Job& job) {
    const std::filesystem::path& file = job.companions.front();
    if (options.encoding != ColorEncoding::linear)
        return {};
    const ReadPictureOptions as_said{.layer = options.color_layer, .windows = windows_for(file, options, job)};
    const PictureFormat format = read_picture(file, as_said).format;
    if (format.bits != 8 || format.encoding == ColorEncoding::linear)
        return {};
    return {fmt::format("--color-space linear: {} holds 8 bits, which are sRGB where the file does not say otherwise; "
                        "leave the option out",
                        file.native())};
}

} // namespace

Product picture_product(const std::string& layer) {
    return {.extensions = {".exr", ".tif", ".pfm", ".npy", ".png", ".jpg", ".hdr"},
            .channels = {"R", "G", "B", "A"},
            .png_scale = 1,
            .kind = ImageKind::color,
            .layer = layer};
}

void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what) {
    add_option(app, "Picture", "--color", "IMAGE", options.color,
               what + ": EXR, JPEG, PNG, TIFF, HDR or PFM.\nIt shows what the depth shows, which may have another size")
        ->required();
    add_option(app, "Picture", "--color-layer", "NAME", options.color_layer,
               "EXR layer that holds the picture\n(default: R, G, B, or *.Combined, *.beauty, or the only one)");
    add_raw_format_option(app, "--color-format", options.pixels, 3, "of a picture in a pipe");
    add_option(
        app, "Picture", "--color-space", "auto|linear|srgb",
        [&options](const std::string& text) {
            if (text != "auto")
                options.encoding = text == "srgb" ? ColorEncoding::srgb : ColorEncoding::linear;
        },
        "how the picture counts light. auto (default): JPEG and integers\n"
        "are sRGB unless the file says linear, floats are linear")
        ->check(is_one_of({"auto", "linear", "srgb"}));
}

void use_picture(More& more, const PictureOptions& options) {
    more.companions.push_back({"--color", options.color, options.pixels});
    more.picture = 0;
    more.color_layer = options.color_layer;
    more.read = [&](const Job& job) { return Images{.picture = picture_of(job.companions.front(), options, job)}; };
    more.doubts = [&](const Job& job) { return picture_doubts(options, job); };
}

Picture picture_of(const std::filesystem::path& file, const PictureOptions& options, const Job& job) {
    Picture picture = read_picture(
        file, {.layer = options.color_layer, .encoding = options.encoding, .windows = windows_for(file, options, job)});
    check_same_view(file, picture.color.size(), job);
    return picture;
}

} // namespace fathom::cli

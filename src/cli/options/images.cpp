// The images beside a depth image.
#include "images.hpp"

#include "depth_options.hpp"

#include "io/formats.hpp"

#include <fathom/error.hpp>
#include <fathom/io.hpp>

#include <fmt/format.h>

namespace fathom::cli {
namespace {

// The windows that the picture is to have: none where it has another size than the depth.
std::optional<Windows> windows_for(const std::filesystem::path& file, const PictureOptions& options, const Job& job) {
    if (!is_exr(file) || has_overscan(job.windows))
        return job.windows;
    const Windows held = io::exr_windows(file, color_channels(file, options.layer).front());
    return held.display == job.windows.display ? std::optional(job.windows) : std::nullopt;
}

} // namespace

void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what) {
    add_option(app, "Picture", "--color", "IMAGE", options.source,
               what + ": EXR, JPEG, PNG, TIFF, HDR or PFM.\nIt shows what the depth shows, which may have another size")
        ->required();
    add_option(app, "Picture", "--color-layer", "NAME", options.layer,
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

Picture picture_of(const std::filesystem::path& file, const PictureOptions& options, const Job& job) {
    Picture picture = read_picture(
        file, {.layer = options.layer, .encoding = options.encoding, .windows = windows_for(file, options, job)});
    check_same_view(file, picture.color.size(), job);
    return picture;
}

std::vector<std::string> picture_doubts(const PictureOptions& options, const Job& job) {
    const std::filesystem::path& file = job.companions.front();
    if (options.encoding != ColorEncoding::linear)
        return {};
    const ReadPictureOptions as_said{.layer = options.layer, .windows = windows_for(file, options, job)};
    const PictureFormat format = read_picture(file, as_said).format;
    if (format.bits != 8 || format.encoding == ColorEncoding::linear)
        return {};
    return {fmt::format("--color-space linear: {} holds 8 bits, which are sRGB where the file does not say otherwise; "
                        "leave the option out",
                        file.native())};
}

void check_same_channels(const std::filesystem::path& file, const Picture& other, const Picture& picture,
                         const Job& job) {
    if (other.color.size() != picture.color.size())
        check_same_size(file, other.color.size(), job);
    if (other.color.channels() != picture.color.channels())
        throw Error(fmt::format("{}: has {} channels, but {} has {}; both must have an alpha, or none", file.native(),
                                other.color.channels(), job.companions.front().native(), picture.color.channels()));
}

cv::Mat read_lengths(const std::filesystem::path& file, const Job& job) {
    const DepthFile read = read_depth(file, {.overscan = has_overscan(job.windows)});
    check_same_pixels(file, read, job);
    if (read.storage != Storage::float32 && read.storage != Storage::float16)
        throw Error(file.native() + ": holds integers, but a thickness is a float in scene units; save it as float");
    cv::Mat lengths;
    read.values.convertTo(lengths, CV_32F);
    return lengths;
}

} // namespace fathom::cli

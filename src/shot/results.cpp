// What is written of an input: its images, their files and what those cannot hold.
#include "work.hpp"

#include "camera/photograph.hpp"
#include "text.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <algorithm>
#include <limits>

namespace fathom::shot {
std::vector<std::string> known_names(std::vector<std::string> channels, bool append) {
    const std::vector<std::string> own = channels;
    const std::size_t end = own.front().rfind('.') + 1;
    if (append && own.front().size() == end + 1)
        for (const std::string& name : own)
            channels.push_back("Fathom." + name);
    else if (append)
        for (const char* color : {".R", ".G", ".B"})
            for (const std::string& name : own)
                channels.push_back("Fathom." + name.substr(end) + color);
    else if (end == 0 && own.front() != "R")
        channels.emplace_back("Y");
    return channels;
}

std::vector<std::string> channels_of(const Product& product, const cv::Mat& image) {
    const auto there = std::min(product.channels.size(), static_cast<std::size_t>(image.channels()));
    return {product.channels.begin(), product.channels.begin() + static_cast<std::ptrdiff_t>(there)};
}

bool is_exr(const std::filesystem::path& file) {
    return io::is_file(file) && !list_channels(file).empty();
}

void find_source(const DepthOptions& options, Work& work) {
    const Job& job = work.frame;
    work.windows = job.windows;
    if (!work.depth.channel.empty())
        work.source = ExrSource{job.input, work.depth.channel, work.depth.windows};
    if (!options.made_of || !is_exr(job.companions[*options.made_of]))
        return;
    const std::filesystem::path& file = job.companions[*options.made_of];
    const std::string channel = color_channels(file, options.picture.layer).front();
    work.source = ExrSource{file, channel, job.windows};
    const Windows picture = io::exr_windows(file, channel);
    const cv::Rect both = job.windows.data & picture.data;
    if (picture.display != job.windows.display)
        return;
    if (both.empty())
        io::refuse(file, "has no pixel within the data window of the depth, " + job.input.string() +
                             "; give a picture of the same view");
    work.windows = {both, picture.display};
}

namespace {

// A file that has no windows gets the pixels of the display window. So it does not depend on where a renderer had pixels.
void fit(cv::Mat& image, const Windows& windows, const std::filesystem::path& file, ImageKind kind) {
    const std::string extension = extension_of(file);
    if (extension == ".exr" || extension == ".ply" || image.size() != windows.data.size())
        return;
    cv::Mat whole(windows.display, image.type());
    whole.setTo(cv::Scalar::all(kind == ImageKind::color ? 0 : std::numeric_limits<double>::quiet_NaN()));
    if (const cv::Rect seen = windows.data & cv::Rect({0, 0}, windows.display); !seen.empty())
        image(seen - windows.data.tl()).copyTo(whole(seen));
    image = whole;
}

// The files of a job's results, in the order of the outputs.
// Throws: Error for a result of another size that is to be appended.
std::vector<ImageFile> files_of(const DepthOptions& options, const Job& job, const std::vector<Made>& results,
                                const std::optional<ExrSource>& source) {
    std::vector<ImageFile> images;
    for (std::size_t i = 0; i < options.outputs.size(); ++i) {
        const Product& product = options.outputs[i].product;
        const cv::Mat& image = results[i].image;
        WriteOptions how{.channels = channels_of(product, image),
                         .png_scale = product.png_scale ? product.png_scale : options.png_scale,
                         .png_offset = product.png_offset,
                         .source = source,
                         .half = options.half,
                         .compression = options.compression,
                         .normals = results[i].normals,
                         .colors = results[i].colors};
        if (source && results[i].part)
            how.source->windows.data = *results[i].part + source->windows.data.tl();
        else if (source && results[i].size != source->windows.data.size()) // not one value a pixel
            how.source.reset();
        if (i == 0 && options.append) {
            if (!how.source)
                throw Error(job.outputs[i].native() +
                            ": has another size than its input, which --append cannot add to");
            how.source->append = true;
            for (std::string& channel : how.channels) // such as "linear" in front of Z, which a depth image has already
                channel.insert(0, product.layer.empty() ? "" : product.layer + ".");
        }
        how.channels = known_names(how.channels, i == 0 && options.append);
        images.push_back({job.outputs[i], image, how, product.kind, results[i].format});
    }
    return images;
}

// A --png-scale that cuts values off, or leaves only a few codes to them.
std::vector<std::string> png_doubts(const DepthOptions& options, const Job& job, const std::vector<Made>& results) {
    constexpr double many_cut = 0.01, few_codes = 64;
    std::vector<std::string> said;
    for (std::size_t i = 0; i < options.outputs.size() && options.png_scale; ++i) {
        if (options.outputs[i].product.png_scale.value_or(*options.png_scale) != *options.png_scale ||
            extension_of(job.outputs[i]) != ".png" || results[i].format)
            continue;
        const cv::Mat image = results[i].image.reshape(1);
        const cv::Mat finite = cv::abs(image) < std::numeric_limits<double>::infinity();
        const cv::Mat beyond = finite & (image > 1 / *options.png_scale);
        double largest = 0;
        cv::minMaxIdx(image, nullptr, &largest, nullptr, nullptr, finite);
        const auto values = static_cast<std::size_t>(cv::countNonZero(finite)),
                   cut = static_cast<std::size_t>(cv::countNonZero(beyond));
        const double codes = largest * *options.png_scale * 65535;
        const std::string cure = fmt::format("--png-scale {:.2g} holds all up to {:.4g}", 0.99 / largest, largest);
        if (static_cast<double>(cut) > many_cut * static_cast<double>(values))
            said.push_back(fmt::format("--png-scale {} cuts {} of the values off; {}", number(*options.png_scale),
                                       percent(cut, values), cure));
        else if (largest > 0 && codes < few_codes)
            said.push_back(fmt::format("--png-scale {} leaves {:.0f} codes of 65535 to the values; {}",
                                       number(*options.png_scale), codes, cure));
    }
    return said;
}

// A result that cannot hold what goes with the picture it is made of.
std::vector<std::string> metadata_doubts(const std::filesystem::path& file, const Made& result) {
    if (!result.format)
        return {};
    std::vector<std::string> said;
    if (result.format->incomplete)
        said.emplace_back(
            "does not hold the picture's Exif data or its grey profile, which are not read; copy them with exiftool");
    else if (loses_metadata(file, *result.format))
        said.emplace_back("does not hold the colour profile or the camera's data of the picture; write the picture's "
                          "own type to keep them");
    const std::string extension = extension_of(file);
    if (!result.format->primaries.empty() && (extension == ".jpg" || extension == ".png"))
        said.push_back(fmt::format("counts as sRGB, but the header of the picture says {}, so that its colours look "
                                   "dull; convert the picture to linear sRGB first, or write an .exr",
                                   result.format->primaries));
    return said;
}

} // namespace

void warn(const DepthOptions& options, Work& work, const std::filesystem::path& subject,
          const std::vector<std::string>& said) {
    for (const std::string& doubt : said) {
        const std::string line = fmt::format("{}: {}", subject.native(), doubt);
        if (options.strict)
            throw Error(line);
        work.frame.said.push_back("warning: " + line);
    }
}

void write_results(const DepthOptions& options, const Records* records, Work& work) {
    const Job& frame = work.frame;
    const bool is_cut = work.windows != frame.windows;
    for (std::size_t i = 0; i < options.outputs.size() && (is_cut || has_overscan(work.windows)); ++i) {
        Made& result = work.results[i];
        if (is_cut) {
            result.part = work.windows.data - frame.windows.data.tl();
            result.image = result.image(*result.part).clone();
        }
        fit(result.image, work.windows, frame.outputs[i], options.outputs[i].product.kind);
        result.size = result.image.size();
    }
    if (!work.doubtful_values)
        warn(options, work, frame.input, png_doubts(options, frame, work.results));
    for (std::size_t i = 0; i < options.outputs.size(); ++i)
        warn(options, work, frame.outputs[i], metadata_doubts(frame.outputs[i], work.results[i]));
    prepare_folders(options, frame);
    std::vector<ImageFile> files = files_of(options, frame, work.results, work.source);
    if (options.output == standard_stream) {
        work.raw = io::raw_bytes(files.front(), result_format(options));
        files.erase(files.begin());
    }
    io::write_images_and(files, records ? records->file_of(work.record, frame) : io::LastFile{});
}

} // namespace fathom::shot

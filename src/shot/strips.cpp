// Images that are done some rows after the others.
#include "results.hpp"
#include "steps.hpp"
#include "strip_limits.hpp"

#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

#include <algorithm>

namespace fathom::cli {

// Results with a record, and those that are appended, are made of all their bytes.
bool Steps::goes_by_strips(const Job& job, const io::DepthRows& rows) const {
    const std::filesystem::path& output = job.outputs.front();
    const bool is_exr_file = extension_of(output) == ".exr", overscan = has_overscan(rows.about().windows);
    const auto [width, height] = rows.size();
    const bool too_many = static_cast<long long>(width) * height > strip_limits.whole_pixels;
    const bool too_large =
        options_.memory > 0 && row_bytes(width, false) * static_cast<std::size_t>(height) > options_.memory;
    return more_.halo && outputs_.size() == 1 && !records_ && !options_.append && io::takes_rows(output) &&
           (is_exr_file || !overscan) && (too_many || too_large);
}

// What a row of the images takes: depth, two copies of it, the result and its file, and a picture.
std::size_t Steps::row_bytes(int width, bool picture) const {
    const std::size_t channels = outputs_.front().product.channels.size();
    return (3 + 2 * channels + (picture ? 2 * channels : 0)) * sizeof(float) * static_cast<std::size_t>(width);
}

std::size_t Steps::strip_bytes() const {
    constexpr std::size_t least = std::size_t{1} << 20;
    return options_.memory > 0 ? std::min(strip_limits.strip_bytes, std::max(options_.memory, least))
                               : strip_limits.strip_bytes;
}

int Steps::strip_rows(const Work& work) const {
    const std::size_t row = row_bytes(work.rows->size().width, work.picture != nullptr);
    const int rows = static_cast<int>(std::min<std::size_t>(strip_bytes() / row, 1 << 16));
    constexpr int block = 32; // of most compressions: more than one strip would unpack those that it cuts
    return std::max({rows - (rows > block ? rows % block : 0), *more_.halo + 1, 1});
}

void Steps::write_strip(Work& work, Result& result, const cv::Range& rows) const {
    const Stopwatch watch(work.times.write);
    const cv::Mat image = result.image.rowRange(rows);
    if (!work.file) {
        result.image = cv::Mat(1, 1, image.type());
        result.size = work.rows->size();
        work.results = {result};
        prepare_folders(options_, outputs_, work.frame);
        const ImageFile file = files_of(options_, outputs_, work.frame, work.results, work.source).front();
        work.file = std::make_unique<io::ResultRows>(file, result.size);
    }
    work.file->write(image);
}

// Reads, looks at, computes and writes some rows after the others. What they say together is found at the end.
void Steps::stream(Work& work) {
    Loaded& frame = work.frame;
    const int height = work.rows->size().height, halo = *more_.halo, most = strip_rows(work);
    Subject& subject = work.subject;
    subject.stored = {.image = {}, .camera = work.seen, .storage = work.depth.storage};
    Places places(work.rows->size(), work.depth.storage);
    cv::Mat values, picture; // from `first` on
    Loaded strip = frame;
    for (int first = 0, made = 0, read = 0; made < height;) {
        const int rows = std::min(most, height - read), end = read + rows == height ? height : read + rows - halo;
        {
            const Stopwatch watch(work.times.read);
            const auto join = [&](cv::Mat& kept, const cv::Mat& next) {
                if (kept.empty())
                    kept = next;
                else
                    cv::vconcat(kept, next, kept);
            };
            const cv::Mat next = work.rows->read(rows).values;
            const cv::Mat z = decoded(work, next, read);
            add(subject.look, z);
            places.add(next, z);
            join(values, next);
            if (work.picture)
                join(picture, work.picture->read(rows).color);
        }
        read += rows;
        const auto compute = [&] {
            const Stopwatch watch(work.times.compute);
            if (work.picture)
                strip.images = later([&] { return Images{.picture = {picture, work.picture->format()}}; });
            else if (more_.picture)
                strip.images = later([&] {
                    const Picture& whole = frame.images.get().picture;
                    return Images{.picture = {whole.color.rowRange(first, read), whole.format}};
                });
            StoredDepth stored = subject.stored;
            stored.image = to_device(device_, values);
            stored.y = first;
            return operation_(stored, strip);
        };
        try {
            if (!work.failure) {
                std::vector<Result> results = compute();
                write_strip(work, results.front(), {made - first, end - first});
                if (made == 0)
                    work.explained = std::move(strip.said);
            }
        } catch (...) {
            work.failure = std::current_exception(); // the other rows may say what is wrong with the image
        }
        made = end;
        const int kept = read == height ? height : std::max(made - halo, first);
        const auto keep = [&](cv::Mat& image) {
            image = kept < read ? image.rowRange(kept - first, image.rows).clone() : cv::Mat();
        };
        keep(values);
        if (work.picture)
            keep(picture);
        first = kept;
    }
    subject.places = [places] { return places; };
    subject.each = [this, &work, most](const auto& visit) {
        const auto again = io::depth_rows(work.frame.input, read_options(work));
        for (int y = 0; y < again->size().height; y += most) {
            const cv::Mat rows = again->read(std::min(most, again->size().height - y)).values;
            visit(rows, decoded(work, rows, y));
        }
    };
    find_doubts(work);
}

} // namespace fathom::cli

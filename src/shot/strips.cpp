// Images that are done some rows after the others.
#include "results.hpp"
#include "steps.hpp"
#include "strip_limits.hpp"

#include "io/floats_on_host.hpp"

#include <fathom/error.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <algorithm>

namespace fathom::cli {

// Results with a record, and those that are appended, are made of all their bytes.
bool Steps::goes_by_strips(const Job& job, const io::DepthRows& rows) const {
    const bool overscan = has_overscan(rows.about().windows);
    const auto held = std::ranges::find_if_not(job.outputs, [&](const std::filesystem::path& output) {
        return io::takes_rows(output) && (!overscan || extension_of(output) == ".exr");
    });
    const bool takes_rows = held == job.outputs.end();
    const auto [width, height] = rows.size();
    const bool too_many =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height) > strip_limits.whole_pixels * strip_scale();
    const std::size_t bytes = row_bytes(width, false) * static_cast<std::size_t>(height);
    const bool too_large = options_.memory > 0 && bytes > options_.memory;
    const std::string whole = options_.append ? "--append" : records_ ? "--resume" : more_.whole;
    const std::string beside = whole.empty() && more_.whole_for ? more_.whole_for(job) : "";
    if (!whole.empty())
        check_fits(job, whole, "leave it out", bytes);
    else if (!beside.empty())
        check_fits(job, beside, "say --normals none", bytes);
    else if (!takes_rows)
        check_fits(job, "the file " + held->native(), overscan ? "write .exr" : "write .exr or .tif", bytes);
    return more_.reach && takes_rows && whole.empty() && beside.empty() && (too_many || too_large);
}

// Refuses an image that an option needs whole, and for which --memory leaves no room. Small ones are taken whatever it says.
void Steps::check_fits(const Job& job, const std::string& option, const char* cure, std::size_t bytes) const {
    constexpr std::size_t mib = std::size_t{1} << 20, small = 64 * mib;
    if (options_.memory > 0 && bytes > std::max(options_.memory, small))
        throw Error(fmt::format("{}: {} needs the whole image, which takes {} bytes, more than --memory allows; {}, or "
                                "say --memory {}M",
                                job.input.native(), option, bytes, cure, (bytes + mib - 1) / mib));
}

// What a row of the images takes: depth, two copies of it, the results and their files, and a picture.
std::size_t Steps::row_bytes(int width, bool picture) const {
    std::size_t values = 3 + (picture ? 2 * outputs_.front().product.channels.size() : 0);
    for (const Output& output : outputs_)
        values += 2 * output.product.channels.size();
    return values * sizeof(float) * static_cast<std::size_t>(width);
}

// Strips are that much larger where many rows around them are read and computed with both of their neighbours.
std::size_t Steps::strip_scale() const {
    return more_.looks_first ? 8 : 1;
}

std::size_t Steps::strip_bytes() const {
    constexpr std::size_t least = std::size_t{1} << 20;
    const std::size_t most = strip_limits.strip_bytes * strip_scale();
    return options_.memory > 0 ? std::min(most, std::max(options_.memory, least)) : most;
}

// Strips are whole blocks of most compressions, where these fit: more than one strip would unpack those that it cuts.
std::vector<Band> Steps::strips(const Work& work, int halo) const {
    const int height = work.rows->size().height;
    const std::size_t row = row_bytes(work.rows->size().width, work.picture != nullptr);
    constexpr int block = 32;
    const int unit = static_cast<std::size_t>(block + 2 * halo) * row <= strip_bytes() ? block : 1;
    const auto units = [=](int rows) { return (rows + unit - 1) / unit; };
    const auto bytes = [=](int read, int) { return row * static_cast<std::size_t>(read * unit); };
    std::vector<Band> all = bands({.begin = 0,
                                   .end = units(height),
                                   .height = units(height),
                                   .reaches = {units(halo)},
                                   .bytes = bytes,
                                   .least = std::max(units(halo), 1)},
                                  strip_bytes());
    for (Band& band : all)
        for (int* edge : {&band.begin, &band.end, &band.first, &band.last})
            *edge = std::min(*edge * unit, height);
    return all;
}

void Steps::write_strip(Work& work, std::vector<Result>& results, const cv::Range& rows, int first) const {
    const Stopwatch watch(work.times.write);
    // What the picture has of the depth's pixels, and of these rows. A file without windows is empty beyond.
    const cv::Rect part = work.windows.data - work.frame.windows.data.tl();
    const cv::Rect here = (part - cv::Point(0, first)) & cv::Rect(0, rows.start, work.rows->size().width, rows.size());
    std::vector<cv::Mat> images;
    for (std::size_t i = 0; i < results.size(); ++i) {
        Result& result = results[i];
        result.size = work.rows->size();
        if (work.windows == work.frame.windows) {
            images.push_back(result.image.rowRange(rows));
        } else if (extension_of(work.frame.outputs[i]) == ".exr") {
            images.push_back(result.image(here));
            result.part = part;
            result.size = part.size();
        } else {
            images.emplace_back(cv::Mat::zeros(rows.size(), result.image.cols, result.image.type()));
            if (!here.empty())
                result.image(here).copyTo(images.back()(here - cv::Point(0, rows.start)));
        }
        result.image = cv::Mat(1, 1, result.image.type());
    }
    if (work.files.empty()) {
        work.results = results;
        prepare_folders(options_, outputs_, work.frame);
        for (const ImageFile& file : files_of(options_, outputs_, work.frame, work.results, work.source))
            work.files.push_back(std::make_unique<io::ResultRows>(file, work.results[work.files.size()].size));
    }
    for (std::size_t i = 0; i < images.size(); ++i)
        if (!images[i].empty())
            work.files[i]->write(images[i]);
}

// Reads, looks at, computes and writes some rows after the others. What they say together is found once all were looked at.
void Steps::stream(Work& work) {
    Loaded& frame = work.frame;
    const cv::Size size = work.rows->size();
    const Storage storage = work.depth.storage;
    if (work.seen.background_from_largest_half && storage == Storage::float32) {
        const auto first = io::depth_rows(frame.input, read_options(work));
        for (const Band& band : strips(work, 0))
            settle_sky(work.seen, first->read(band.end - band.begin).values);
    }
    Subject& subject = work.subject;
    find_invalid_value(work);
    subject = Subject(work.seen, storage);
    work.stored = {.image = {}, .camera = work.seen, .storage = storage};
    // The next rows, in which pixels that do not count are invalid, and what they decode to, if that is asked for.
    const auto next_of = [this, &work](io::DepthRows& rows, io::IgnoredRows* mask, int count, int first, bool decodes) {
        std::pair<cv::Mat, cv::Mat> next{rows.read(count).values, {}};
        ignore(work, next.first, mask);
        if (decodes || options_.valid)
            next.second = decoded(work, next.first, first);
        keep_valid(work, next.first, next.second);
        return next;
    };
    subject.each = [this, &work, storage, next_of](const auto& visit) {
        const auto again = io::depth_rows(work.frame.input, read_options(work));
        const auto mask = ignored_rows(work);
        for (const Band& band : strips(work, 0)) {
            const auto [rows, z] = next_of(*again, mask.get(), band.end - band.begin, band.begin, true);
            visit(on_host(rows, storage), on_host(z));
        }
    };
    const auto mask = ignored_rows(work);
    if (more_.looks_first) {
        const Stopwatch watch(work.times.read);
        subject.each([&](const HostDepth& values, const HostFloats& z) { subject.add(values, z); });
        find_doubts(work);
    }
    const auto attempt = [&](const auto& step) {
        try {
            if (!work.failure)
                step();
        } catch (...) {
            work.failure = std::current_exception(); // the other rows may say what is wrong with the image
        }
    };
    int halo = 0;
    attempt([&] {
        halo = more_.reach({work.seen, storage, {0, 0, size.width, size.height}}, subject.look, frame).rows;
    });
    cv::Mat values, picture; // from row `first` on
    int first = 0, read = 0;
    Loaded strip = frame;
    for (const Band& band : strips(work, halo)) {
        {
            const Stopwatch watch(work.times.read);
            const int more = band.last - read;
            const auto go_on = [&](cv::Mat& kept, const auto& next) {
                kept = band.first < read ? kept.rowRange(band.first - first, read - first).clone() : cv::Mat();
                if (more > 0 && kept.empty())
                    kept = next();
                else if (more > 0)
                    cv::vconcat(kept, next(), kept);
            };
            go_on(values, [&] {
                const auto [next, z] = next_of(*work.rows, mask.get(), more, read, !more_.looks_first);
                if (!more_.looks_first)
                    subject.add(on_host(next, storage), on_host(z));
                return next;
            });
            if (work.picture)
                go_on(picture, [&] { return work.picture->read(more).color; });
        }
        first = band.first;
        read = band.last;
        const auto compute = [&] {
            const Stopwatch watch(work.times.compute);
            if (work.picture)
                strip.images = later([&] { return Images{.picture = {picture, work.picture->format()}}; });
            else if (more_.picture)
                strip.images = later([&] {
                    const Picture& whole = frame.images.get().picture;
                    return Images{.picture = {whole.color.rowRange(first, read), whole.format}};
                });
            StoredDepth stored = work.stored;
            stored.image = to_device(device_, values);
            stored.y = first;
            return at_any_width(device_, [&] { return operation_(stored, strip); });
        };
        attempt([&] {
            std::vector<Result> results = compute();
            write_strip(work, results, {band.begin - first, band.end - first}, first);
            if (band.begin == 0)
                work.explained = std::move(strip.said);
        });
    }
    if (!more_.looks_first)
        find_doubts(work);
}

} // namespace fathom::cli

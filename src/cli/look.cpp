// Looks at decoded depth: a description that does not fit its image is told, because every result of it would be wrong.
#include "look.hpp"

#include "flat_surfaces.hpp"
#include "photograph.hpp"

#include "camera/statistics_of_parts.hpp"
#include "camera/stored_values.hpp"
#include "io/floats_on_host.hpp"
#include "terminal/messages.hpp"
#include "text.hpp"

#include <fathom/error.hpp>
#include <fathom/findings.hpp>
#include <fathom/linearize.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

namespace fathom::cli {

namespace {

constexpr double many_invalid = 0.25; // a fraction of the pixels that is probably no accident
constexpr float many_units = 100;     // no scene in metres begins so far away and is stored in whole metres
constexpr double crowded = 1.2;       // no scene lies in the first fifth behind its near plane
constexpr float few_units = 0.25f;    // no scene in metres ends so near
constexpr double mostly_far = 0.8;    // what most values of a depth buffer exceed
constexpr double past_a_plane = 0.1;  // of its distance; nothing that is rightly described lies so far beyond it
constexpr double many_far = 0.001;    // the same for one value that is farther than all others

// What floats are, and the ends of those that are finite.
struct Values {
    std::size_t nan = 0, infinite = 0; // +infinity only
    float least = std::numeric_limits<float>::infinity(), greatest = -least;
};

// In lanes, which compilers work on at once: they do not reorder a minimum of floats themselves.
Values values_of(const cv::Mat& floats) {
    constexpr std::size_t lanes = 16;
    constexpr float infinity = std::numeric_limits<float>::infinity();
    std::array<float, lanes> least{}, greatest{};
    least.fill(infinity);
    greatest.fill(-infinity);
    Values all;
    for (int y = 0; y < floats.rows; ++y) {
        std::array<std::int32_t, lanes> nan{}, infinite{};
        const auto count = [&](float value, std::size_t lane) {
            nan[lane] += value != value;
            infinite[lane] += value == infinity;
            const float low = value > -infinity ? value : infinity, high = value < infinity ? value : -infinity;
            least[lane] = low < least[lane] ? low : least[lane];
            greatest[lane] = high > greatest[lane] ? high : greatest[lane];
        };
        const std::span<const float> row(floats.ptr<float>(y), static_cast<std::size_t>(floats.cols));
        std::size_t x = 0;
        for (; x + lanes <= row.size(); x += lanes)
            for (std::size_t lane = 0; lane < lanes; ++lane)
                count(row[x + lane], lane);
        for (; x < row.size(); ++x)
            count(row[x], 0);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            all.nan += static_cast<std::size_t>(nan[lane]);
            all.infinite += static_cast<std::size_t>(infinite[lane]);
        }
    }
    all.least = *std::ranges::min_element(least);
    all.greatest = *std::ranges::max_element(greatest);
    return all;
}

// The largest value of floats or halves that is finite; 0 where none is above.
double largest_finite(const Subject& subject) {
    float largest = 0;
    subject.each([&](const cv::Mat& values, const cv::Mat&) {
        cv::Mat floats = values;
        if (values.depth() != CV_32F)
            values.convertTo(floats, CV_32F);
        largest = std::max(largest, values_of(floats).greatest);
    });
    return static_cast<double>(largest);
}

StoredStatistics statistics_of(const Subject& subject) {
    return statistics_of_parts(subject.stored.storage, [&](const auto& visit) {
        subject.each([&](const cv::Mat& values, const cv::Mat&) { visit(on_host(values, subject.stored.storage)); });
    });
}

// How many stored values are of a kind.
std::size_t count_of(StoredKind kind, const Camera& camera, const Subject& subject) {
    const DepthForm form = depth_form(camera, subject.stored.storage);
    std::size_t count = 0;
    subject.each([&](const cv::Mat& values, const cv::Mat&) {
        visit_values(on_host(values, subject.stored.storage),
                     [&](float value, std::uint32_t bits) { count += kind_of(form, value, bits) == kind; });
    });
    return count;
}

// Another program's projection · view has the rotation in its fourth row, and rows that are at right angles to it.
std::optional<std::string> projection_doubt(const Projection& projection) {
    const Projection::Matrix& m = projection.matrix;
    using Row = Eigen::Matrix<long double, 1, 3>;
    const Row ahead = m.block<1, 3>(3, 0), right = m.block<1, 3>(0, 0), up = m.block<1, 3>(1, 0);
    constexpr long double rounding = 1e-5L; // of matrices in floats
    const bool turned = std::hypot(ahead[0], ahead[1]) > 0.01L && std::abs(ahead.norm() - 1) < rounding &&
                        std::abs(ahead.dot(right)) < rounding * right.norm() &&
                        std::abs(ahead.dot(up)) < rounding * up.norm() &&
                        std::abs(right.dot(up)) < rounding * right.norm() * up.norm();
    if (!turned)
        return std::nullopt;
    return fmt::format(
        "the fourth row of \"projection\" looks along ({:.3g}, {:.3g}, {:.3g}): it holds the view as well; "
        "give the projection alone, and the rest as \"view\"",
        static_cast<double>(ahead[0]), static_cast<double>(ahead[1]), static_cast<double>(ahead[2]));
}

// The nearest depth that a depth buffer can hold in the middle of the image. None for other depth.
std::optional<double> near_end_of(const StoredDepth& stored) {
    const Camera& camera = stored.camera;
    if (camera.encoding != Encoding::window || !camera.projection.is_perspective())
        return std::nullopt;
    const DepthForm form = depth_form(camera, stored.storage);
    std::optional<double> nearest;
    for (const float end : {form.lowest, form.highest}) {
        const auto z = static_cast<double>(
            view_depth(camera, stored.storage, camera.width / 2.0, camera.height / 2.0, static_cast<double>(end)));
        if (std::isfinite(z) && z > 0 && (!nearest || z < *nearest))
            nearest = z;
    }
    return nearest;
}

// The distances between which a projection shows anything. None where that was never said, or changes across the image.
std::optional<std::pair<double, double>> clip_distances(const Camera& camera) {
    if (camera.projection.known_third_row && !(camera.near_plane && camera.far_plane))
        return std::nullopt; // a camera made of angles or a calibration, which has any planes
    if (!camera.projection.is_perspective() && camera.near_plane == 0 && camera.far_plane == 1)
        return std::nullopt; // what a camera says that has none
    const Projection::Matrix m = camera.projection.matrix_in_opengl_axes();
    const auto distance = [&](long double clip_value) {
        const Projection::Row end = m.row(2) - clip_value * m.row(3);
        return end[0] == 0 && end[1] == 0 ? static_cast<double>(end[3] / end[2]) : std::nan("");
    };
    const double near_plane = distance(camera.projection.clip_near());
    double far_plane = distance(camera.projection.clip_far());
    if (camera.projection.is_perspective() && !(far_plane > 0)) // infinite, but for rounding
        far_plane = std::numeric_limits<double>::infinity();
    if (!std::isfinite(near_plane) || !(far_plane > near_plane))
        return std::nullopt;
    return std::pair{near_plane, far_plane};
}

// Distances of which many lie where the projection shows nothing.
std::optional<std::string> clipped_doubt(const Subject& subject) {
    const Look& look = subject.look;
    const Camera& camera = subject.stored.camera;
    const auto clip = clip_distances(camera);
    if (!clip || !is_metric(camera.encoding))
        return std::nullopt;
    const auto [near_plane, far_plane] = *clip;
    // The planes of a matrix of floats are rounded.
    const auto low = static_cast<float>(near_plane - past_a_plane * std::abs(near_plane)),
               high = static_cast<float>(far_plane + past_a_plane * std::abs(far_plane));
    if (look.nearest >= low && look.farthest <= high)
        return std::nullopt;
    std::size_t before = 0, behind = 0;
    subject.each([&](const cv::Mat&, const cv::Mat& z) {
        for (int y = 0; y < z.rows; ++y) {
            const auto* row = z.ptr<float>(y);
            for (int x = 0; x < z.cols; ++x) {
                before += row[x] < low;
                behind += row[x] > high && row[x] < std::numeric_limits<float>::infinity();
            }
        }
    });
    const double surfaces = static_cast<double>(look.surfaces());
    if (!(static_cast<double>(before + behind) > many_invalid * surfaces))
        return std::nullopt;
    const bool nearer = before > behind;
    const bool from_0_to_1 = camera.scale == 1 && look.nearest >= 0 && look.farthest <= 1;
    return fmt::format(
        "{} of the surfaces lie {} plane of the projection, {:.4g}, which cuts them off; {}",
        percent(nearer ? before : behind, look.surfaces()), nearer ? "before the near" : "behind the far",
        nearer ? near_plane : far_plane,
        from_0_to_1 ? "are the values from 0 to 1 no distances (\"encoding\": \"window\", \"linear\" or another)?"
                    : "are they in the units of the projection (\"scale\")?");
}

// All of it background though the values differ, or all of it close behind the near plane.
std::optional<std::string> range_doubt(const Subject& subject) {
    const Look& look = subject.look;
    if (look.background == look.pixels) {
        const StoredStatistics found = statistics_of(subject);
        if (found.min < found.max)
            return fmt::format(
                "every pixel is background, though the values run from {} to {}; does the scale fit, or what "
                "the camera says of the background?",
                number(found.min), number(found.max));
    }
    const auto near_end = near_end_of(subject.stored);
    if (near_end && look.surfaces() > 0 && static_cast<double>(look.farthest) < *near_end * crowded)
        return fmt::format("everything lies within {:.2g} % of the near plane, {:.4g}; are the values distances "
                           "(\"encoding\": \"view-z\"), or is \"reversed\" the wrong way round?",
                           100 * (static_cast<double>(look.farthest) / *near_end - 1), *near_end);
    return std::nullopt;
}

// Why no value, or few of them, has a depth.
std::string reason(const Subject& subject, const StoredStatistics& found) {
    const StoredDepth& stored = subject.stored;
    const Camera& camera = stored.camera;
    const DepthForm form = depth_form(camera, stored.storage);
    const std::string values = found.min == found.max
                                   ? fmt::format("the values are {}", number(found.min))
                                   : fmt::format("the values run from {} to {}", number(found.min), number(found.max));
    if (found.nan == found.pixels)
        return "all of its values are NaN; is it the right file, or the right --channel?";
    if (std::isnan(found.min))
        return "none of its values is finite; is it the right file, or the right --channel?";
    const auto missing = count_of(StoredKind::missing, camera, subject);
    if (missing == found.pixels)
        return fmt::format("all of its values are {}, which the camera says was not measured", number(found.min));
    const bool is_float = stored.storage == Storage::float32 || stored.storage == Storage::float16;
    if (!is_metric(camera.encoding) && is_float && found.percentiles[3] > static_cast<double>(form.highest))
        return fmt::format("{}, and \"{}\" depth lies in {} to {}; are these distances (\"encoding\": \"view-z\")?",
                           values, to_string(camera.encoding), number(static_cast<double>(form.lowest)),
                           number(static_cast<double>(form.highest)));
    if (2 * found.at_zero > found.pixels - found.nan && is_metric(camera.encoding))
        return fmt::format("{} of the values are 0; if that was not measured, say \"missing\": 0; if nothing is there, "
                           "\"background\": 0, which is Nuke's sky, whose values are 1/z (\"encoding\": \"inverse\")",
                           percent(found.at_zero, found.pixels));
    if (camera.encoding == Encoding::window)
        return values + "; do clip_z, reversed and depth_range fit the program that wrote them?";
    return values + "; fathom inspect shows what the camera makes of them";
}

} // namespace

HostDepth on_host(const cv::Mat& values, Storage storage) {
    return {values.data, values.cols, values.rows, values.step, storage};
}

Look look_at(const StoredDepth& stored) {
    Look look{.z = floats_on_host(stored.image, 1, [&](const Image& z) { linearize(stored, z); })};
    add(look, look.z);
    return look;
}

void add(Look& look, const cv::Mat& z) {
    const bool is_first = look.surfaces() == 0;
    const Values values = values_of(z);
    look.pixels += z.total();
    look.invalid += values.nan;
    look.background += values.infinite;
    if (values.nan + values.infinite == z.total())
        return;
    look.nearest = is_first ? values.least : std::min(look.nearest, values.least);
    look.farthest = is_first ? values.greatest : std::max(look.farthest, values.greatest);
}

std::vector<std::string> doubts(const Subject& subject) {
    std::vector<std::string> said;
    const Look& look = subject.look;
    const Camera& camera = subject.stored.camera;
    const Storage storage = subject.stored.storage;
    const auto part = [&](std::size_t count) { return static_cast<double>(count) / static_cast<double>(look.pixels); };
    if (look.invalid == look.pixels)
        throw Error("no pixel has a depth: " + reason(subject, statistics_of(subject)));
    if (part(look.invalid) > many_invalid) {
        const std::size_t missing = count_of(StoredKind::missing, camera, subject);
        const StoredStatistics found = statistics_of(subject);
        if (part(look.invalid - std::min(look.invalid, missing + found.nan)) > many_invalid)
            said.push_back(fmt::format("{} of the pixels are invalid: {}", percent(look.invalid, look.pixels),
                                       reason(subject, found)));
    }
    const bool distances = camera.encoding == Encoding::view_z || camera.encoding == Encoding::ray_distance;
    const bool is_float = storage == Storage::float32 || storage == Storage::float16;
    if (distances && look.surfaces() > 0 && !is_float && camera.scale == 1 && look.nearest >= many_units)
        said.push_back(
            fmt::format("its integers count as scene units, so that depths run from {:.4g} to {:.4g}; if they are "
                        "millimetres and a unit is a metre, say \"scale\": 0.001",
                        look.nearest, look.farthest));
    if (distances && look.surfaces() > 0 && is_float && camera.scale < 0.1 && look.farthest < few_units)
        said.push_back(fmt::format("its floats times the scale of {} are {:.4g} at most; floats are mostly scene units "
                                   "already, which is \"scale\": 1",
                                   number(camera.scale), look.farthest));
    if (camera.encoding == Encoding::inverse && camera.scale == 1 && look.surfaces() > 0 && look.farthest < few_units)
        said.push_back(
            fmt::format("depths run from {:.2g} to {:.2g}: 1 over the values, which looks like disparity without its "
                        "\"scale\"; that is the baseline times the focal length in pixels",
                        look.nearest, look.farthest));
    bool told = false; // that these are values of a depth buffer
    if (distances && is_float && camera.scale == 1 && look.surfaces() > 0 && look.farthest == 1 && look.nearest > 0) {
        const StoredStatistics found = statistics_of(subject);
        told = found.percentiles[1] > mostly_far;
        if (told)
            said.push_back(
                fmt::format("the values run from {} to 1, and 95 % are above {}, as in a depth buffer; if it is one, "
                            "say \"encoding\": \"window\" with near and far",
                            number(found.min), number(found.percentiles[1])));
    }
    if (distances && !camera.background_from && is_float) {
        const bool known = camera.encoding == Encoding::view_z && storage == Storage::float32 && camera.scale == 1;
        const double largest = known ? static_cast<double>(look.farthest) : largest_finite(subject);
        if ((largest == 65504 || largest >= 1e9) && camera.background != largest) {
            Camera counted = camera;
            counted.background_from = largest;
            const std::size_t far_away = count_of(StoredKind::background, counted, subject);
            if (part(far_away) > many_far)
                said.push_back(
                    fmt::format("{} of the pixels hold {}, which renderers write where nothing is, and which counts "
                                "as a surface here; if so, say \"background_from\": {}",
                                percent(far_away, look.pixels), number(largest), number(largest)));
        }
    }
    for (const std::optional<std::string>& doubt : {told ? std::nullopt : flat_surfaces_doubt(subject),
                                                    photograph_doubt(subject), projection_doubt(camera.projection)})
        if (doubt)
            said.push_back(*doubt);
    if (said.empty())
        for (const std::optional<std::string>& doubt : {range_doubt(subject), clipped_doubt(subject)})
            if (doubt)
                said.push_back(*doubt);
    return said;
}

std::string in_words(const Look& look) {
    std::string text =
        look.surfaces() == 0 ? "no surface" : fmt::format("z {:.4g} to {:.4g}", look.nearest, look.farthest);
    if (look.background > 0)
        text += fmt::format(", {} background", percent(look.background, look.pixels));
    return text + ", " + invalid_in_words(look.invalid, look.pixels);
}

std::string invalid_in_words(std::size_t invalid, std::size_t pixels) {
    return fmt::format("{} of {} pixels invalid", invalid, pixels) +
           (invalid > 0 ? fmt::format(" ({})", percent(invalid, pixels)) : "");
}

} // namespace fathom::cli

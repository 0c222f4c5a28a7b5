// Over a flat surface 1/z is affine in the pixel under a perspective, and z is under an orthographic camera. Few surfaces
// that are bent look flat under a wrong encoding, so that the encoding under which many are flat is the right one.
//
// `rank_encodings` asks the same without a camera. It searches the angle of view, near and far, which takes as long as a whole
// command does. Here the camera says them, so that five values in a row and in a column are enough.
#include "flat_surfaces.hpp"

#include <fathom/findings.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace fathom::cli {
namespace {

constexpr double flatter = 0.1;        // a description under which a place is bent so much less wins this place
constexpr double flat = 0.25;          // if it is bent no more than so much of its rise; noise is bent more
constexpr std::size_t few_places = 24; // may win by chance
constexpr std::size_t to_one = 9; // so many places have to speak for the other description where one speaks against it
constexpr double many_steps = 16; // of the storage, over which a place has to rise

/// A quantity that is affine in the pixel over flat surfaces if a description is right.
struct Description {
    std::function<double(int x, int y)> value;
    std::string meaning;            ///< of the stored values
    std::size_t flat = 0, bent = 0; ///< places where this one is much flatter than the camera's own, or much less flat
};

/// A quantity around a pixel.
struct Course {
    double bend; ///< over the rise; NaN where it does not rise, or is unknown
    double rise, here;
};

template <typename Value>
Course course(const Value& value, int x, int y, int step) {
    double bent = 0, rise = 0;
    for (const auto& [dx, dy] : {std::pair{step, 0}, std::pair{0, step}}) {
        std::array<double, 5> q{};
        for (int i = -2; i <= 2; ++i)
            q[static_cast<std::size_t>(i + 2)] = value(x + i * dx, y + i * dy);
        bent += std::abs(q[0] - 2 * q[2] + q[4]) + std::abs(q[0] - 2 * q[1] + 2 * q[3] - q[4]);
        rise += std::abs(q[4] - q[0]);
    }
    return {bent / rise, rise, value(x, y)};
}

// What the stored values could be instead of what the camera says.
std::vector<Description> alternatives(const StoredDepth& stored, bool perspective,
                                      const std::function<double(int, int)>& value) {
    const Camera& camera = stored.camera;
    const auto inverse = [=](int x, int y) { return 1 / value(x, y); };
    const bool distance = camera.encoding == Encoding::view_z;
    if (!perspective)
        return {{inverse, "distances of a perspective camera; is this its projection"}};
    std::vector<Description> result;
    const bool along_ray = camera.along == Along::ray;
    if (along_ray || (camera.encoding != Encoding::window && camera.encoding != Encoding::inverse &&
                      camera.encoding != Encoding::inverse_range))
        result.push_back({value,
                          "depth-buffer values or 1/z (\"encoding\": \"window\" or \"inverse\"), or come from an "
                          "orthographic camera; are they"});
    if (!distance)
        result.push_back({inverse, "distances along the view axis (\"encoding\": \"view-z\"); are they"});
    if (camera.encoding != Encoding::ray_distance) {
        const Rays rays = camera_rays(camera);
        result.push_back({[=](int x, int y) {
                              const Eigen::Matrix<long double, 3, 1> pixel(x + 0.5L, y + 0.5L, 1);
                              const long double ahead = std::abs(rays.depth.dot(pixel));
                              return static_cast<double>((rays.direction * pixel).norm() / ahead) / value(x, y);
                          },
                          "distances along the rays (\"encoding\": \"ray-distance\"); are they"});
    }
    if (camera.encoding != Encoding::linear && camera.near_plane && camera.far_plane &&
        std::isfinite(*camera.far_plane)) {
        const double near_plane = *camera.near_plane, span = *camera.far_plane - near_plane;
        const double largest = storage_max(stored.storage);
        result.push_back({[=](int x, int y) { return 1 / (near_plane + span * value(x, y) / largest); },
                          "linear from near to far (\"encoding\": \"linear\"); are they"});
    }
    return result;
}

} // namespace

std::optional<std::string> flat_surfaces_doubt(const Subject& subject) {
    const StoredDepth& stored = subject.stored;
    const Camera& camera = stored.camera;
    if (camera.encoding == Encoding::pseudo_linear) // which is bent inside triangles
        return std::nullopt;
    if (channels_of(stored.storage) > 1 || stored.storage == Storage::uint24_high) // whose elements are no numbers
        return std::nullopt;
    const DepthForm form = depth_form(camera, stored.storage);
    const bool of_pixel =
        form.numerator[1] != 0 || form.numerator[2] != 0 || form.denominator[1] != 0 || form.denominator[2] != 0;
    if (of_pixel) // the values themselves change across the image, and z has more rounding than they have
        return std::nullopt;
    const Places pixels = subject.places();
    const bool perspective = form.perspective;
    const auto value = [&](int x, int y) { return pixels.value(x, y); };
    const auto own = [&](int x, int y) { return perspective ? 1 / pixels.z(x, y) : pixels.z(x, y); };
    const int width = pixels.size().width, height = pixels.size().height;
    const int step = Places::distance(pixels.size());
    std::vector<Description> others = alternatives(stored, perspective, value);
    const float quantum = pixels.step();
    std::size_t places = 0;
    const auto look_at_places = [&](int apart, bool count_bent) {
        places = 0;
        for (Description& other : others)
            other.flat = other.bent = 0;
        for (int y = 2 * step; y < height - 2 * step; y += apart * Places::apart(height))
            for (int x = 2 * step; x < width - 2 * step; x += apart * Places::apart(width)) {
                const Course stored_here = course(value, x, y, step), here = course(own, x, y, step);
                const double rounding = std::max(static_cast<double>(quantum), 0x1p-23 * std::abs(stored_here.here));
                if (!std::isfinite(here.bend) || !(stored_here.rise >= many_steps * rounding))
                    continue;
                const double noise = 4 * rounding / stored_here.rise + 0x1p-21 * std::abs(here.here) / here.rise;
                ++places;
                const bool is_bent = here.bend > noise;
                if (!is_bent && !count_bent)
                    continue;
                for (Description& other : others) {
                    const double there = course(other.value, x, y, step).bend;
                    other.flat += is_bent && there < std::min(flat, flatter * here.bend);
                    other.bent += here.bend < flatter * there;
                }
            }
        return std::ranges::max_element(others, {}, &Description::flat);
    };
    // Every fourth place tells of most images that nothing is wrong: not half of what has to speak against the camera does.
    const auto rough = look_at_places(2, false);
    if (rough == others.end() || 8 * rough->flat < few_places || 100 * rough->flat < places)
        return std::nullopt;
    const auto best = look_at_places(1, true);
    if (best->flat < few_places || 50 * best->flat < places || best->flat <= to_one * best->bent)
        return std::nullopt;
    return fmt::format(
        "flat surfaces are bent as \"{}\" has it, and flat if the values are {}? fathom inspect shows more",
        to_string(camera.encoding), best->meaning);
}

Places::Places(const DepthFile& depth, const cv::Mat& z)
    : size_(depth.values.size()), storage_(depth.storage), values_(depth.values), z_(z) {
    if (depth.values.depth() != CV_32F)
        depth.values.convertTo(values_, CV_32F);
    add_to_step(values_, 0);
}

Places::Places(cv::Size size, Storage storage) : size_(size), storage_(storage) {
    const int around = distance(size_);
    const auto choose = [&](int length, std::vector<int>& place) {
        std::vector<int> kept;
        place.assign(static_cast<std::size_t>(length), -1);
        for (int i = 2 * around; i < length - 2 * around; i += apart(length))
            for (int j = -2; j <= 2; ++j)
                place[static_cast<std::size_t>(i + j * around)] = 0;
        for (int i = 0; i < length; ++i)
            if (int& here = place[static_cast<std::size_t>(i)]; here == 0) {
                here = static_cast<int>(kept.size());
                kept.push_back(i);
            }
        return kept;
    };
    const auto rows = static_cast<int>(choose(size_.height, rows_).size());
    kept_columns_ = choose(size_.width, columns_);
    values_.create(rows, static_cast<int>(kept_columns_.size()), CV_32FC1);
    z_.create(values_.size(), CV_32FC1);
}

void Places::add(const cv::Mat& values, const cv::Mat& z) {
    const int first = next_row_;
    next_row_ += values.rows;
    if (values.channels() > 1)
        return;
    cv::Mat floats = values;
    if (values.depth() != CV_32F)
        values.convertTo(floats, CV_32F);
    add_to_step(floats, first);
    for (int y = 0; y < floats.rows; ++y)
        if (const int row = rows_[static_cast<std::size_t>(first + y)]; row >= 0)
            for (int i = 0; i < values_.cols; ++i) {
                const int x = kept_columns_[static_cast<std::size_t>(i)];
                values_.at<float>(row, i) = floats.at<float>(y, x);
                z_.at<float>(row, i) = z.at<float>(y, x);
            }
}

// A second difference is no smaller than a step, unless it is 0.
void Places::add_to_step(const cv::Mat& values, int first_row) {
    const int rows_apart = apart(size_.height);
    for (int y = (rows_apart - first_row % rows_apart) % rows_apart; y < values.rows; y += rows_apart) {
        const auto* row = values.ptr<float>(y);
        for (int x = 1; x + 1 < values.cols; ++x)
            if (const float second = std::abs(row[x - 1] - 2 * row[x] + row[x + 1]); second > 0)
                least_second_ = std::min(least_second_, second);
    }
    if (storage_ == Storage::float16)
        for (const float value : cv::Mat_<float>(values))
            highest_ = std::isfinite(value) ? std::max(highest_, value) : highest_;
}

float Places::step() const {
    const float least = storage_ == Storage::float16 ? std::max(least_second_, highest_ * 0x1p-11f) : least_second_;
    return least < std::numeric_limits<float>::infinity() ? least : 0;
}

} // namespace fathom::cli

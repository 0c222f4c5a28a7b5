// ssao in a room: presets, two radii, two cameras; the same kernels a pixel at a time; and the same samples in a loop per
// pixel.

#include "room_depth.hpp"
#include "scalar_ssao.hpp"
#include "subjects.hpp"

#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace fathom::bench {
namespace {

constexpr double fov_y = 1.0;
constexpr DepthSpan room_span{0.1, 100};

// What the scalar loop may differ from the library by where all pixels look alike, so that the library does not filter: in
// the mean, and root mean square over the pixels. The library rounds slopes and does without those of thin things.
constexpr double mean_tolerance = 0.001, pixel_tolerance = 0.02;

double median_depth(const Camera& camera, std::vector<float> stored) {
    const auto middle = stored.begin() + static_cast<std::ptrdiff_t>(stored.size() / 2);
    std::ranges::nth_element(stored, middle);
    return static_cast<double>(view_depth(camera, Storage::float32, 0.5, 0.5, *middle));
}

// The room through one camera.
struct View {
    StoredDepth depth;
    double width; // of the image at the median depth, scene units
};

// The room through both cameras and what is computed from it, each made when it is first asked for.
class Room {
public:
    Room(const Device& device, int width, int height) : device_(device), width_(width), height_(height) {}

    const View& perspective_view() {
        if (!perspective_)
            perspective_ = view(perspective(fov_y, 1.0 * width_ / height_, room_span));
        return *perspective_;
    }

    const View& orthographic_view() {
        const double half_width = std::min(3.9, 1.45 * width_ / height_), half_height = half_width * height_ / width_;
        if (!orthographic_)
            orthographic_ = view(orthographic({-half_width, half_width, -half_height, half_height}, room_span));
        return *orthographic_;
    }

    /// The perspective view on a device that is the same but for its vector width.
    const View& one_lane_view() {
        if (!one_lane_) {
            const View& usual = perspective_view();
            DeviceOptions one = device_.options();
            one.vector_width = 1;
            const cl::CommandQueue& queue = device_.queue();
            const Device device(device_.context(), queue.getInfo<CL_QUEUE_DEVICE>(), queue, one);
            const Image image(device, usual.depth.image.buffer(), Element::f32, {width_, height_});
            one_lane_ = {{image, usual.depth.camera}, usual.width};
        }
        return *one_lane_;
    }

    /// For rays of this share of the image's width.
    ScalarSsao& scalar(double share, ScalarSsao::Patterns patterns) {
        const View& view = perspective_view();
        const double radius = share * view.width;
        std::optional<ScalarSsao>& made = patterns == ScalarSsao::Patterns::alike ? scalar_alike_ : scalar_;
        if (!made)
            made.emplace(view.depth.image, fov_y, room_span, radius, radius / 4, patterns);
        return *made;
    }

    const Image& visibility() {
        if (!visibility_)
            visibility_ = Image(device_, Element::f32, {width_, height_});
        return visibility_;
    }

private:
    View view(Projection projection) const {
        Camera camera;
        camera.projection = std::move(projection);
        camera.width = width_;
        camera.height = height_;
        const std::vector<float> stored = room_depth(camera);
        const double scale = static_cast<double>(camera.projection.matrix(0, 0));
        const double depth = camera.projection.matrix(3, 2) == 0 ? 1 : median_depth(camera, stored);
        return {{uploaded(device_, {width_, height_}, stored), camera}, 2 * depth / scale};
    }

    Device device_;
    int width_, height_;
    std::optional<View> perspective_, orthographic_, one_lane_;
    std::optional<ScalarSsao> scalar_, scalar_alike_;
    Image visibility_;
};

// `share`: radius in image widths at the median depth.
SsaoOptions options(const View& view, Quality quality, double share) {
    SsaoOptions options;
    options.radius = share * view.width;
    options.quality = quality;
    return options;
}

std::vector<float> pixels(const Image& image) {
    std::vector<float> values(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()));
    image.download(values.data());
    return values;
}

double mean(const std::vector<float>& values) {
    double sum = 0;
    for (const float value : values)
        sum += static_cast<double>(value);
    return sum / static_cast<double>(values.size());
}

double rms_difference(const std::vector<float>& a, const std::vector<float>& b) {
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double off = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        squares += off * off;
    }
    return std::sqrt(squares / static_cast<double>(a.size()));
}

Comparison compare_scalar(Room& room, double share) {
    const View& view = room.perspective_view();
    const SsaoOptions balanced = options(view, Quality::balanced, share);
    SsaoOptions counted = balanced;
    counted.slices = ScalarSsao::slices;
    counted.samples = ScalarSsao::steps;
    counted.jitter = 16;
    if (pixels(ssao(view.depth, counted).visibility) != pixels(ssao(view.depth, balanced).visibility))
        return {false, text("balanced is no longer ", ScalarSsao::slices, " slices of ", ScalarSsao::steps, " steps")};

    counted.jitter = 1;
    const std::vector<float> library = pixels(ssao(view.depth, counted).visibility);
    room.scalar(share, ScalarSsao::Patterns::alike).run(room.visibility());
    const std::vector<float> scalar = pixels(room.visibility());
    const double difference = rms_difference(scalar, library);
    const bool same = std::abs(mean(scalar) - mean(library)) <= mean_tolerance && difference <= pixel_tolerance;
    return {same, text("with one pattern mean visibility ", mean(scalar), ", the library's ", mean(library),
                       " (to differ by no more than ", mean_tolerance, "); RMSE ", difference, " (no more than ",
                       pixel_tolerance, ")")};
}

} // namespace

std::vector<Subject> ssao_subjects(const Device& device, int width, int height) {
    constexpr double usual = 0.05, large = 0.4; // radius in image widths at the median depth
    constexpr int seldom = 16;                  // seconds each
    const auto room = std::make_shared<Room>(device, width, height);
    std::vector<Subject> list;
    const auto add = [&](std::string name, std::function<void()> run) -> Subject& {
        return list.emplace_back(Subject{.name = std::move(name), .floor = "copy", .run = std::move(run), .every = 4});
    };
    const auto library = [&](std::string name, const View& (Room::*camera)(), Quality quality,
                             double share) -> Subject& {
        return add(std::move(name), [=] {
            const View& view = ((*room).*camera)();
            ssao(view.depth, options(view, quality, share));
        });
    };
    library("ssao fast, 5 %", &Room::perspective_view, Quality::fast, usual);
    library("ssao balanced, 5 %", &Room::perspective_view, Quality::balanced, usual);
    library("ssao accurate, 5 %", &Room::perspective_view, Quality::accurate, usual);
    library("ssao fast, 40 %", &Room::perspective_view, Quality::fast, large);
    library("ssao balanced, 40 %", &Room::perspective_view, Quality::balanced, large);
    library("ssao accurate, 40 %", &Room::perspective_view, Quality::accurate, large).every = seldom;
    library("ssao balanced, 5 %, ortho.", &Room::orthographic_view, Quality::balanced, usual);
    if (device.options().vector_width > 1) {
        Subject& one_lane = library("ssao balanced, 5 %, one lane", &Room::one_lane_view, Quality::balanced, usual);
        one_lane.rival = "ssao balanced, 5 %";
        one_lane.every = seldom;
    }
    Subject& scalar = add("ssao balanced, 5 %, scalar loop",
                          [=] { room->scalar(usual, ScalarSsao::Patterns::sixteen).run(room->visibility()); });
    scalar.rival = "ssao balanced, 5 %";
    scalar.every = seldom;
    scalar.comparison = [=] { return compare_scalar(*room, usual); };
    return list;
}

} // namespace fathom::bench

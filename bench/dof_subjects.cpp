// dof_masks on the frames, from window depth under several cameras and from view depth, and after linearize; dof in a room,
// at its own size.

#include "methods.hpp"
#include "room_depth.hpp"
#include "subjects.hpp"

#include "text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

namespace fathom::bench {
namespace {

constexpr DepthSpan span{bench_near, bench_far};

// What dof_masks writes, for a few frames in turn.
class MaskFrames {
public:
    explicit MaskFrames(Frames& frames) : frames_(frames) {}

    const DofMasks& current() {
        allocate();
        return sets_[frames_.current() % sets_.size()];
    }

    /// Four floats a pixel in one image.
    const Image& together() {
        allocate();
        return together_[frames_.current() % together_.size()];
    }

private:
    void allocate() {
        const auto image = [&](int channels) { // its pages touched before anything is timed
            const Layout layout{frames_.width(), frames_.height(), channels};
            const Image made(frames_.device(), Element::f32, layout);
            frames_.device().queue().enqueueFillBuffer(made.buffer(), 0.0f, 0, Image::allocation(Element::f32, layout));
            return made;
        };
        while (sets_.size() < std::min<std::size_t>(frames_.count(), 4)) {
            DofMasks set;
            for (Image* each : {&set.circle, &set.near, &set.focus, &set.far, &set.mixed_pixels})
                *each = image(1);
            sets_.push_back(set);
            together_.push_back(image(4));
        }
    }

    Frames& frames_;
    std::vector<DofMasks> sets_;
    std::vector<Image> together_;
};

std::vector<float> pixels(const Image& image) {
    std::vector<float> values(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
                              static_cast<std::size_t>(image.channels()));
    image.download(values.data());
    return values;
}

bool same_bits(const Image& a, const Image& b) {
    const std::vector<float> first = pixels(a), second = pixels(b);
    return std::memcmp(first.data(), second.data(), first.size() * sizeof(float)) == 0;
}

Comparison compare_masks(const StoredDepth& stored, const DofMasksOptions& options, const DofMasks& results) {
    dof_masks(stored, results, options);
    const DofMasks public_results = dof_masks(stored, options);
    const bool same = same_bits(results.circle, public_results.circle) &&
                      same_bits(results.near, public_results.near) && same_bits(results.focus, public_results.focus) &&
                      same_bits(results.far, public_results.far);
    return {same, same ? "the bits of new images" : "other bits than in new images"};
}

// A lens focused at 7: circles to 20 pixels behind, to ever more before.
constexpr CircleOfConfusion lens{20, 140};

void add_masks(std::vector<Subject>& list, Frames& frames, Baselines& plain, Baselines& streaming) {
    const auto masks = std::make_shared<MaskFrames>(frames);
    const auto camera = [&](Projection projection) {
        Camera c;
        c.projection = std::move(projection);
        c.width = frames.width();
        c.height = frames.height();
        return c;
    };
    const double aspect = 16.0 / 9;
    const DofMasksOptions options{.circle = lens};
    const auto fan_out = [&](std::string name, Baselines& kernels) {
        list.push_back({.name = std::move(name), .floor = "fan out", .run = [&frames, &kernels, masks] {
                            kernels.launch("fan_out", frames.stored(), masks->together());
                        }});
    };
    fan_out("fan out", plain);
    fan_out("fan out (control)", plain);
    fan_out("fan out, streaming stores", streaming);
    list.push_back({.name = "fan out, four images", .floor = "fan out", .run = [&frames, &plain, masks] {
                        const DofMasks& to = masks->current();
                        plain.start("fan_out_apart", plain.vectors(frames.width()), frames.height(),
                                    frames.stored().buffer(), to.circle.buffer(), to.near.buffer(), to.focus.buffer(),
                                    to.far.buffer(), Baselines::grid(frames.stored(), to.circle));
                    }});
    const auto add = [&](std::string name, const Camera& c) -> Subject& {
        Subject& subject =
            list.emplace_back(Subject{.name = std::move(name), .floor = "fan out", .run = [&frames, masks, c, options] {
                                          dof_masks({frames.stored(), c}, masks->current(), options);
                                      }});
        subject.comparison = [&frames, masks, c, options] {
            return compare_masks({frames.stored(), c}, options, masks->current());
        };
        return subject;
    };
    const Camera standard = camera(perspective(1.0, aspect, span));
    Camera view_z = standard;
    view_z.encoding = Encoding::view_z;
    const DepthSpan infinite{bench_near, std::numeric_limits<double>::infinity(), DepthOrder::reversed};
    add("dof_masks standard", standard);
    add("dof_masks reversed infinite", camera(perspective(1.0, aspect, infinite, Convention::direct3d())));
    add("dof_masks oblique", camera(with_oblique_near_plane(perspective(1.0, aspect, span), {0.1, 0.2, -1, -2})));
    add("dof_masks view-z", view_z);
    DofMasksOptions and_mixed = options;
    and_mixed.mixed_pixels = true;
    list.push_back(
        {.name = "dof_masks and mixed pixels", .floor = "fan out", .run = [&frames, masks, standard, and_mixed] {
             dof_masks({frames.stored(), standard}, masks->current(), and_mixed);
         }});
    list.push_back({.name = "dof_masks standard, new images", .floor = "fan out", .run = [&frames, standard, options] {
                        dof_masks({frames.stored(), standard}, options);
                    }});
    list.push_back({.name = "linearize, then dof_masks",
                    .floor = "fan out",
                    .run =
                        [&frames, masks, standard, options] {
                            const StoredDepth stored{frames.stored(), standard};
                            linearize(stored, frames.result(), {Background::decode});
                            dof_masks(ViewDepth{frames.result(), standard}.stored(), masks->current(), options);
                        },
                    .rival = "dof_masks standard"});
}

// The size that the blur's times are stated for.
constexpr int blur_width = 1920, blur_height = 1080;
constexpr double fov_y = 1.0, focus = 4.5;

const Layout moved_layout{7 * blur_width / 2, blur_height};

// What a gather with the centre's circle may differ from the library by, root mean square: it knows nothing of edges.
constexpr double gather_tolerance = 0.05;

// The room in focus at the table, with patches of colour, and what is computed from it; made when it is first looked at.
class BlurRoom {
public:
    explicit BlurRoom(const Device& device) : device_(device) {}

    const StoredDepth& depth() {
        if (!depth_)
            make();
        return *depth_;
    }
    const Image& color() {
        depth();
        return color_;
    }
    const Image& result() {
        depth();
        return result_;
    }

    /// A lens whose max CoC in this image is so many pixels across.
    DofOptions options(double largest, BlurQuality quality) {
        depth();
        const double k = largest / std::max(focus / nearest_ - 1, 1 - focus / farthest_);
        return {.circle = {k, k * focus}, .quality = quality};
    }

    /// The back wall all over, in the picture's colours.
    const CleanPlate& clean_plate() {
        if (!clean_plate_) {
            const StoredDepth& of = depth();
            std::vector<float> stored = pixels(of.image);
            std::ranges::fill(stored, *std::ranges::max_element(stored));
            clean_plate_ = {color(), {uploaded(device_, {blur_width, blur_height}, stored), of.camera}};
        }
        return *clean_plate_;
    }

    /// For the gather, which is not charged for them.
    const Image& circles(double largest) {
        if (!circles_)
            circles_ = dof_masks(depth(), {.circle = options(largest, {}).circle, .weights = false}).circle;
        return circles_;
    }

    /// 3.5 floats a pixel to copy: what dof moves at least, reading depth and colour and writing colour.
    const std::array<Image, 2>& moved() {
        if (!moved_[0])
            for (Image& image : moved_)
                image =
                    uploaded(device_, moved_layout, std::vector<float>(moved_layout.width * std::size_t{blur_height}));
        return moved_;
    }

private:
    void make() {
        Camera camera;
        camera.projection = perspective(fov_y, 1.0 * blur_width / blur_height, {0.1, 100});
        camera.width = blur_width;
        camera.height = blur_height;
        const std::vector<float> stored = room_depth(camera);
        depth_ = {uploaded(device_, {blur_width, blur_height}, stored), camera};
        const std::vector<float> z = pixels(linearize(*depth_).image);
        nearest_ = static_cast<double>(*std::ranges::min_element(z));
        farthest_ = static_cast<double>(*std::ranges::max_element(z));
        std::vector<float> color;
        for (int y = 0; y < blur_height; ++y) {
            for (int x = 0; x < blur_width; ++x) {
                const auto patch = static_cast<unsigned>((y / 12) * 7919 + (x / 16) * 104729);
                for (const unsigned factor : {2654435761u, 2246822519u, 3266489917u})
                    color.push_back(static_cast<float>((patch * factor) >> 8) * 0x1p-24f);
            }
        }
        color_ = uploaded(device_, {blur_width, blur_height, 3}, color);
        result_ = uploaded(device_, {blur_width, blur_height, 3}, color);
    }

    Device device_;
    std::optional<StoredDepth> depth_;
    double nearest_ = 0, farthest_ = 0;
    Image color_, result_, circles_;
    std::optional<CleanPlate> clean_plate_;
    std::array<Image, 2> moved_;
};

Comparison compare_gather(BlurRoom& room, const std::function<void()>& gather, double largest) {
    gather();
    const std::vector<float> found = pixels(room.result());
    const std::vector<float> library =
        pixels(dof(room.depth(), room.color(), room.options(largest, BlurQuality::standard)));
    double squares = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double off = static_cast<double>(found[i]) - static_cast<double>(library[i]);
        squares += off * off;
    }
    const double difference = std::sqrt(squares / static_cast<double>(found.size()));
    return {difference <= gather_tolerance,
            text("RMSE ", difference, " from the library's (no more than ", gather_tolerance, ")")};
}

void add_blur(std::vector<Subject>& list, const Device& device, Baselines& plain) {
    const auto room = std::make_shared<BlurRoom>(device);
    const char* const floor = "copy, 1080p depth and RGB";
    const auto add = [&](std::string name, std::function<void()> run, int every) -> Subject& {
        return list.emplace_back(Subject{.name = std::move(name),
                                         .floor = floor,
                                         .run = std::move(run),
                                         .every = every,
                                         .pixels = 1.0 * blur_width * blur_height});
    };
    for (const char* suffix : {"", " (control)"}) {
        add(
            std::string(floor) + suffix,
            [room, &plain] {
                const auto& [from, to] = room->moved();
                plain.launch("copy", from, to);
            },
            1);
    }
    const auto blur = [&](std::string name, double largest, BlurQuality quality, int every = 4,
                          Aperture aperture = {}) {
        add(
            std::move(name),
            [=] {
                DofOptions options = room->options(largest, quality);
                options.aperture = aperture;
                dof(room->depth(), room->color(), room->result(), options);
            },
            every);
    };
    constexpr double usual = 64;
    blur("dof default, 64 px", usual, BlurQuality::standard);
    blur("dof fast, 64 px", usual, BlurQuality::fast);
    blur("dof accurate, 64 px", usual, BlurQuality::accurate, 16);
    blur("dof default, 64 px, six blades", usual, BlurQuality::standard, 4, {.blades = 6});
    blur("dof default, 64 px, 2 : 1", usual, BlurQuality::standard, 4, {.ratio = 2});
    add(
        "dof default, 64 px, with a clean plate",
        [=] {
            DofOptions options = room->options(usual, BlurQuality::standard);
            options.clean_plate = room->clean_plate();
            dof(room->depth(), room->color(), room->result(), options);
        },
        4);
    blur("dof default, 16 px", 16, BlurQuality::standard);
    blur("dof default, 256 px", 256, BlurQuality::standard);
    blur("dof default, all in focus", 1, BlurQuality::standard);
    const std::function<void()> gather = [room, &plain] {
        plain.start("centre_gather", blur_width, blur_height, room->circles(usual).buffer(), room->color().buffer(),
                    room->result().buffer(), cl_int{blur_width}, cl_int{blur_height});
    };
    Subject& centre = add("dof, gather by the centre's", gather, 16);
    centre.rival = "dof default, 64 px";
    centre.comparison = [=] { return compare_gather(*room, gather, usual); };
}

} // namespace

std::vector<Subject> dof_subjects(Frames& frames, Baselines& plain, Baselines& streaming) {
    std::vector<Subject> list;
    add_masks(list, frames, plain, streaming);
    add_blur(list, frames.device(), plain);
    return list;
}

} // namespace fathom::bench

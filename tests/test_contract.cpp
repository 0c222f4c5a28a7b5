// What every operation promises, whatever its options: the same bits for any vector width, group size, stride, tile, memory
// budget and number of threads; nothing is read beyond its reach or written beside its results. Operations and options are those
// that are described.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "lenses.hpp"
#include "rounds.hpp"
#include "test_device.hpp"

#include "runtime/state.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using images::floats;
using rounds::most_coc;

namespace {

constexpr double nearest = 4, radius = 0.3;
constexpr CircleOfConfusion lens{40, 192}, wide_lens{300, 1390};

// Pixels are higher than wide.
Camera metric_camera(int width, int height) {
    Camera camera{.projection = perspective(1.0, 1.2 * width / height, {0.5, 100}),
                  .width = width,
                  .height = height,
                  .encoding = Encoding::view_z};
    camera.view.emplace(Eigen::Matrix4d::Identity());
    camera.view->topLeftCorner<3, 3>() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
    return camera;
}

/// A part of larger memory that is full of a NaN that no kernel makes: its rows do not follow each other.
class Part {
public:
    Part(const Device& device, int width, int height, int channels, const std::vector<float>& content = {})
        : width_(width), height_(height), channels_(channels),
          memory_(static_cast<std::size_t>((width + 13) * (height + 9) * channels), std::bit_cast<float>(guard)) {
        for (std::size_t y = 0; !content.empty() && y < static_cast<std::size_t>(height); ++y)
            std::copy_n(content.begin() + static_cast<std::ptrdiff_t>(y * row()), row(), memory_.begin() + first(y));
        around_ = Image::onto_host(device, Element::f32, memory_.data(), {width + 13, height + 9, channels});
        image = around_.region(5, 3, width, height);
    }
    Part(Part&&) = default;

    Image image;

    bool guards_hold() const {
        std::vector<float> now = floats(around_);
        for (std::size_t y = 0; y < static_cast<std::size_t>(height_); ++y)
            std::fill_n(now.begin() + first(y), row(), std::bit_cast<float>(guard));
        return std::ranges::all_of(now, [](float value) { return std::bit_cast<std::uint32_t>(value) == guard; });
    }

private:
    static constexpr std::uint32_t guard = 0x7fa5a5a5;

    std::size_t row() const { return static_cast<std::size_t>(width_ * channels_); }
    std::ptrdiff_t first(std::size_t y) const {
        return (static_cast<std::ptrdiff_t>(y + 3) * (width_ + 13) + 5) * channels_;
    }

    int width_, height_, channels_;
    std::vector<float> memory_;
    Image around_;
};

/// What an operation reads.
struct Inputs {
    StoredDepth stored, behind;
    Image color, plate, normals;

    Inputs region(int x, int y, int width, int height) const {
        const auto part = [&](const auto& of) { return of.region(x, y, width, height); };
        return {part(stored), part(behind), part(color), part(plate), part(normals)};
    }
};

/// Hills with steps and thin posts above a smooth half, as blocks at half resolution need it, and pictures.
struct Scene {
    Camera camera;
    std::vector<float> depth, behind, color, plate, normals;

    Scene(int width, int height, bool damaged = false) : camera(metric_camera(width, height)) {
        constexpr float infinity = std::numeric_limits<float>::infinity(),
                        none = std::numeric_limits<float>::quiet_NaN();
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const bool smooth = y % 300 >= 128;
                const double hills = nearest + 0.5 + (smooth ? 0.01 : 0.2) * std::sin(0.11 * x) * std::cos(0.07 * y);
                const double step = smooth ? 0 : x % 60 == 20 ? -0.3 : x % 60 < 40 ? 0 : 2;
                depth.push_back(static_cast<float>(hills + step));
                behind.push_back(static_cast<float>(hills + 0.3 + 0.05 * (x / 20 % 5)));
                for (int channel = 0; channel < 3; ++channel) {
                    color.push_back(static_cast<float>((7 * x + 5 * y + 3 * channel) % 32) / 32);
                    plate.push_back(static_cast<float>((3 * x + 11 * y + 5 * channel) % 16) / 16);
                    normals.push_back(channel == 2 ? 1.0f : 0.0f);
                }
            }
        for (std::size_t i = 3, n = 0; damaged && i < depth.size(); i += 41, ++n) {
            depth[i] = std::array{none, infinity, -infinity, -0.0f, -1.0f}[n % 5];
            color[3 * i] = std::array{none, infinity, 1e4f}[n % 3];
        }
    }

    Inputs on(const Device& device) const {
        const auto image = [&](const std::vector<float>& values, int channels) {
            return Image::from_host(device, Element::f32, values.data(), {camera.width, camera.height, channels});
        };
        return {
            {image(depth, 1), camera}, {image(behind, 1), camera}, image(color, 3), image(plate, 3), image(normals, 3)};
    }
};

/// A call of an operation with some options, and how far its pixels look.
struct Call {
    std::string name;
    std::function<Reach(const StoredDepth&)> reach;
    std::function<std::vector<Image>(const Inputs&)> make;
    std::function<void(const Inputs&, const std::vector<Image>&)> into;
    bool reads_color = false;
    std::function<std::size_t(const Tile&)> bytes = {}; ///< that it says it takes
};

template <typename Options>
Options in_round(Options options, std::size_t round) {
    rounds::set(
        description::options_of(options), round,
        [&](const description::Option& option, const description::Value& value) { option.set(options, value); });
    return options;
}

/// A call of any operation that is described. Its reach does not depend on what the depth shows.
Call described_call(const description::Operation& operation, std::size_t round) {
    using description::Option;
    const std::shared_ptr<void> options = operation.make(nullptr);
    rounds::set(operation.options, round, [&](const Option& option, const description::Value& value) {
        operation.set(options.get(), option, value);
    });
    const auto run = [&operation, round](const Inputs& in, const std::vector<Image>* given) {
        const std::shared_ptr<void> call = rounds::call_of(operation, round, in.color, lens, radius);
        std::vector<Image> images;
        rounds::with_images(operation, call.get(), in.stored, [&](const description::Shape& shape) {
            images.push_back(given ? given->at(images.size())
                                   : Image(in.stored.image.device(), shape.element, shape.layout));
            return images.back();
        });
        operation.run(call.get(), in.stored, {});
        return images;
    };
    REQUIRE(operation.reach); // whatever the depth shows
    return Call{text(operation.name, ", round ", round),
                [&operation, options](const StoredDepth& stored) { return operation.reach(options.get(), stored); },
                [=](const Inputs& in) { return run(in, nullptr); },
                [=](const Inputs& in, const std::vector<Image>& given) { run(in, &given); },
                std::ranges::any_of(operation.options,
                                    [](const Option& option) { return option.name == std::string_view("color"); })};
}

/// A call from its two forms: `run(inputs)`, which makes the results, and `run(inputs, results)`.
template <typename Run>
Call call(std::string name, std::function<Reach(const StoredDepth&)> reach, Run run, bool reads_color = false) {
    if constexpr (std::is_same_v<decltype(run(Inputs())), Image>) {
        return {std::move(name), std::move(reach), [=](const Inputs& in) { return std::vector{run(in)}; },
                [=](const Inputs& in, const std::vector<Image>& given) { run(in, given.front()); }, reads_color};
    } else {
        const auto members = std::array{&Occlusion::visibility, &Occlusion::bent_normal, &Occlusion::confidence};
        return {std::move(name), std::move(reach),
                [=](const Inputs& in) {
                    const Occlusion results = run(in);
                    std::vector<Image> all;
                    for (const auto member : members)
                        if (results.*member)
                            all.push_back(results.*member);
                    return all;
                },
                [=](const Inputs& in, const std::vector<Image>& given) {
                    Occlusion results = run(in);
                    std::size_t next = 0;
                    for (const auto member : members)
                        if (results.*member)
                            results.*member = given.at(next++);
                    run(in, results);
                },
                reads_color};
    }
}

Call ssao_call(const std::string& name, SsaoOptions options, std::function<void(SsaoOptions&, const Inputs&)> give = {},
               double length = radius) {
    const auto reach_of = [=](const StoredDepth& stored) {
        const Reach found = reach(stored, length, options), most = reach(Tile(stored), length, options, nearest),
                    least = reach(Tile(stored), length, options, nearest + 1);
        CHECK((found.columns <= most.columns && found.rows <= most.rows));
        CHECK((found.columns >= least.columns && found.rows >= least.rows));
        return found;
    };
    Call made = call("ssao" + name, reach_of, [=](const Inputs& in, auto... results) {
        SsaoOptions given = options;
        if (give)
            give(given, in);
        return ssao(in.stored, results..., length, given);
    });
    made.bytes = [=](const Tile& tile) { return bytes(tile, options); };
    return made;
}

Call dof_call(const std::string& name, const DofOptions& options, bool plated = false,
              const CircleOfConfusion& circles = lens) {
    const auto run = [=](const Inputs& in, auto... result) {
        DofOptions given = options;
        if (plated)
            given.clean_plate = CleanPlate{in.plate, in.behind};
        return dof(in.stored, in.color, result..., circles, given);
    };
    DofOptions asked = options;
    if (plated)
        asked.clean_plate.emplace();
    Call made = call(
        "dof" + name, [=](const StoredDepth& stored) { return reach(stored, asked); }, run, true);
    made.bytes = [=](const Tile& tile) { return bytes(tile, 3, asked); };
    return made;
}

/// The calls of an operation in its four rounds.
std::vector<Call> calls_of(const std::string& name) {
    const auto operation = std::ranges::find(description::operations(), name, &description::Operation::name);
    std::vector<Call> all;
    for (std::size_t round = 0; round < 4; ++round)
        all.push_back(name == "ssao" ? ssao_call(text(", round ", round), in_round(SsaoOptions{}, round))
                                     : described_call(*operation, round));
    return all;
}

/// Every operation that is described, and the images that they take as options.
const std::vector<Call>& calls() {
    static const std::vector<Call> made = [] {
        std::vector<Call> all;
        for (const description::Operation& operation : description::operations()) {
            const std::vector<Call> its = calls_of(operation.name);
            all.insert(all.end(), its.begin(), its.end());
        }
        const Sampling fast{.quality = Quality::fast}, every_pixel{.quality = Quality::fast, .half_resolution = false};
        all.push_back(ssao_call(" whose radius covers many pixels", {.sampling = fast}, {}, 0.9));
        all.push_back(ssao_call(" with a second layer and normals", {.sampling = every_pixel},
                                [](SsaoOptions& o, const Inputs& in) {
                                    o.thickness = in.behind;
                                    o.normals = in.normals;
                                }));
        all.push_back(ssao_call(" with a map of thicknesses", {.sampling = every_pixel},
                                [](SsaoOptions& o, const Inputs& in) { o.thickness = in.behind.image; }));
        all.push_back(ssao_call(" with a constant thickness", {.sampling = every_pixel, .thickness = 0.1}));
        all.push_back(ssao_call(" with an error", {.sampling = MaxError{0.2}}));
        for (const Quality quality : {Quality::fast, Quality::balanced, Quality::accurate})
            all.push_back(dof_call(text(" with a clean plate, quality ", static_cast<int>(quality)),
                                   {.quality = quality, .max_coc_px = most_coc}, true));
        for (const Quality quality : {Quality::fast, Quality::balanced}) // large circles are summed over cells
            all.push_back(dof_call(text(" of large circles, quality ", static_cast<int>(quality)),
                                   {.quality = quality, .max_coc_px = 100}, false, wide_lens));
        return all;
    }();
    return made;
}

/// Results: nobody promises a NaN's sign and payload, and on SSE2 they depend on the vector width.
bool same(const std::vector<float>& a, const std::vector<float>& b) {
    return std::ranges::equal(
        a, b, [](float x, float y) { return images::same_bits(x, y) || (std::isnan(x) && std::isnan(y)); });
}

std::vector<std::vector<float>> results(const Call& call, const Inputs& inputs) {
    std::vector<std::vector<float>> all;
    for (const Image& image : call.make(inputs))
        all.push_back(floats(image));
    return all;
}

/// All of them differ from what a device takes by itself, and kernels are built for each.
constexpr std::pair<int, int> widths_and_groups[] = {{1, 7}, {4, 256}, {8, 1}, {16, 7}};

const Device& device(int vector_width = 0, int group_size = 0) {
    static std::map<std::pair<int, int>, Device> opened;
    const auto found = opened.find({vector_width, group_size});
    if (found != opened.end())
        return found->second;
    return opened[{vector_width, group_size}] = test_device({.vector_width = vector_width, .group_size = group_size});
}

/// Are results the same from and in parts of larger memory, on a device of another vector width and group size?
void check_same_bits(const Call& call, const Scene& scene, std::pair<int, int> width_and_group) {
    const int width = scene.camera.width, height = scene.camera.height;
    const Device& other = device(width_and_group.first, width_and_group.second);
    const auto expected = results(call, scene.on(device()));
    const Part depth(other, width, height, 1, scene.depth), color(other, width, height, 3, scene.color);
    Inputs inputs = scene.on(other);
    inputs.stored.image = depth.image;
    inputs.color = color.image;
    std::vector<Part> parts;
    std::vector<Image> given;
    for (const Image& image : call.make(inputs)) {
        parts.emplace_back(other, image.width(), image.height(), image.channels());
        given.push_back(parts.back().image);
    }
    call.into(inputs, given);
    INFO(call.name << ", " << width << " x " << height << ", vector width " << width_and_group.first << ", groups of "
                   << width_and_group.second);
    for (std::size_t i = 0; i < given.size(); ++i) {
        CHECK(same(floats(given[i]), expected[i]));
        CHECK(parts[i].guards_hold());
    }
    CHECK(depth.guards_hold());
    CHECK(same(floats(depth.image), scene.depth));
    if (call.name.starts_with("linearize")) { // may be its own result
        call.into(inputs, {depth.image});
        CHECK(same(floats(depth.image), expected.front()));
        CHECK(depth.guards_hold());
    }
}

/// Does a tile, with what its pixels see around it, have the bits of the whole?
void check_tiles(const Call& call, const Inputs& whole) {
    const int width = whole.stored.image.width(), height = whole.stored.image.height();
    const std::vector<Image> expected = call.make(whole);
    const auto [columns, rows] = call.reach(whole.stored);
    for (const Region& tile : {Region{0, 0, width / 3, height / 3},
                               Region{20, 20, 46, 60}, // a post lies just within reach of its last column
                               Region{width / 3 - 5, height / 4 + 1, width / 2, height / 3},
                               Region{2 * width / 3, height / 2, width - 2 * width / 3, height - height / 2}}) {
        const int left = std::max(tile.x - columns, 0), top = std::max(tile.y - rows, 0),
                  right = std::min(tile.x + tile.width + columns, width),
                  bottom = std::min(tile.y + tile.height + rows, height);
        const std::vector<Image> got = call.make(whole.region(left, top, right - left, bottom - top));
        for (std::size_t i = 0; i < got.size(); ++i) {
            if (expected[i].width() != width || expected[i].height() != height)
                continue; // the tiles' extremes
            INFO(call.name << ", result " << i << ", the tile at " << tile.x << ", " << tile.y);
            const auto its = floats(got[i].region(tile.x - left, tile.y - top, tile.width, tile.height)),
                       wholes = floats(expected[i].region(tile.x, tile.y, tile.width, tile.height));
            CHECK(same(its, wholes));
        }
    }
}

/// Where values that are no numbers are put: alone, in a pair, and in a corner of the image.
constexpr std::array<std::array<int, 2>, 5> places{{{154, 150}, {155, 150}, {130, 155}, {170, 70}, {0, 0}}};

/// Do NaN and infinity touch nothing but what can see them?
void check_reach(const Call& call, const Scene& scene) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const auto before = results(call, scene.on(device()));
    const Reach reach = call.reach(scene.on(device()).stored);
    const auto width = static_cast<std::size_t>(scene.camera.width), pixels = scene.depth.size();
    for (const float special : {std::nanf(""), infinity, -infinity})
        for (const bool of_depth : {true, false}) {
            if (!of_depth && !call.reads_color)
                continue;
            Scene damaged = scene;
            for (const auto& [x, y] : places) {
                const std::size_t at = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
                (of_depth ? damaged.depth[at] : damaged.color[3 * at + at % 3]) = special;
            }
            const auto after = results(call, damaged.on(device()));
            long changed = 0, beyond = 0;
            for (std::size_t i = 0; i < before.size(); ++i)
                for (std::size_t at = 0; before[i].size() >= pixels && at < before[i].size(); ++at) {
                    if (images::same_bits(before[i][at], after[i][at]))
                        continue;
                    ++changed;
                    const std::size_t pixel = at / (before[i].size() / pixels);
                    const int x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
                    beyond += std::ranges::none_of(places, [&](const auto& place) {
                        return std::abs(x - place[0]) <= reach.columns && std::abs(y - place[1]) <= reach.rows;
                    });
                }
            INFO(call.name << ", " << special << " in " << (of_depth ? "depth" : "color"));
            CHECK(changed > 0);
            CHECK(beyond == 0);
        }
}

/// A small scene that is made to break ranges: surfaces with hair and noise before them, two values, lamps, alpha of any kind, and
/// pixels without a depth.
Scene random_scene(std::mt19937& random, int channels) {
    const auto whole = [&](int least, int most) { return std::uniform_int_distribution(least, most)(random); };
    const auto real = [&](double least, double most) {
        return static_cast<float>(std::uniform_real_distribution(least, most)(random));
    };
    Scene scene(whole(1, 40), whole(1, 24));
    scene.color.clear();
    const int lights = whole(0, 4), depths = whole(0, 3), every = whole(2, 60);
    const float lamp = std::array{0.5f, 400.0f, 65504.0f, 0.0f, 1.0f}[static_cast<std::size_t>(lights)];
    for (std::size_t i = 0; i < scene.depth.size(); ++i) {
        if (depths == 0)
            scene.depth[i] = real(nearest, 3 * nearest);
        else if (depths == 1 && whole(0, 5) == 0)
            scene.depth[i] = real(nearest, 20 * nearest);
        else if (depths == 2 && i % static_cast<std::size_t>(every) == 0)
            scene.depth[i] = static_cast<float>(nearest);
        if (whole(0, 30) == 0)
            scene.depth[i] = std::array{std::nanf(""), std::numeric_limits<float>::infinity(), -1.0f, 0.0f, 1e30f,
                                        1e-30f}[static_cast<std::size_t>(whole(0, 5))];
        const float alpha = channels == 3 || lights == 4 ? 1 : whole(0, 2) == 0 ? real(0, 1) : 1.0f * (whole(0, 3) > 0);
        for (int channel = 0; channel < 3; ++channel)
            scene.color.push_back(alpha * (whole(1, every) == 1 ? lamp : lights == 0 ? 0.45f : real(0, 1)));
        if (channels == 4)
            scene.color.push_back(alpha);
    }
    return scene;
}

constexpr double unit_length_error = 1e-5; // of a vector of floats, squared
constexpr double rounding = 0x1p-18;       // of the largest number that a mean is made of

/// How many numbers of a result leave the range that is described, and what the call says besides.
long outside(const description::Result& result, const std::vector<float>& values, const Scene& scene, int channels,
             const description::Operation& operation, const void* call) {
    using Of = description::Content::Of;
    const int of_pixel = result.shape.layout.channels;
    long count = 0;
    std::array<double, 4> least_color, greatest_color;
    least_color.fill(INFINITY);
    greatest_color.fill(-INFINITY);
    for (std::size_t i = 0; i < scene.color.size(); ++i) {
        double &low = least_color[i % static_cast<std::size_t>(channels)],
               &high = greatest_color[i % static_cast<std::size_t>(channels)];
        low = std::min(low, 1.0 * scene.color[i]);
        high = std::max(high, 1.0 * scene.color[i]);
    }
    for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(of_pixel)) {
        double square = 0;
        bool none = true, all = true;
        for (int channel = 0; channel < of_pixel; ++channel) {
            const std::size_t at = i + static_cast<std::size_t>(channel);
            const double value = values[at];
            if (channel < 3) {
                square += value * value;
                none = none && value == 0;
                all = all && !std::isnan(value);
            }
            if (result.content.of != Of::light) {
                // A vector of length 1 may have a component that is 1 but for rounding.
                const double exact = result.content.of == Of::directions && std::abs(value) <= 1 + 0x1p-22
                                         ? std::clamp(value, -1.0, 1.0)
                                         : value;
                const bool holds = std::isnan(exact) || result.content.range.holds(exact);
                if (!holds && count == 0)
                    std::printf("      %.9g\n", value);
                count += !holds;
                continue;
            }
            double least = least_color[static_cast<std::size_t>(channel)],
                   most = greatest_color[static_cast<std::size_t>(channel)];
            if (operation.name == std::string("fog")) {
                const FogOptions& fog = static_cast<const description::FogCall*>(call)->options;
                const int reach = fog.whole_pixels ? 0 : fog_reach, pixel = static_cast<int>(i) / of_pixel,
                          x = pixel % scene.camera.width, y = pixel / scene.camera.width;
                least = INFINITY;
                most = -INFINITY;
                for (int row = std::max(y - reach, 0); row <= std::min(y + reach, scene.camera.height - 1); ++row)
                    for (int column = std::max(x - reach, 0); column <= std::min(x + reach, scene.camera.width - 1);
                         ++column) {
                        const auto first = static_cast<std::size_t>(channels * (row * scene.camera.width + column));
                        const double own = scene.color[first + static_cast<std::size_t>(channel)],
                                     alpha = channels == 4 && fog.alpha == FogAlpha::premultiplied
                                                 ? 1.0 * scene.color[first + 3]
                                                 : 1,
                                     of_fog =
                                         channel == 3 ? own : fog.fog_color[static_cast<std::size_t>(channel)] * alpha;
                        least = std::min({least, own, of_fog});
                        most = std::max({most, own, of_fog});
                    }
            }
            const double slack = rounding * std::max(std::abs(least), std::abs(most));
            count += !(value >= least - slack && value <= most + slack) ||
                     (channel == 3 && !(value >= 0 && value <= 1)); // alpha, which counts exactly
        }
        if (result.content.of == Of::directions)
            if (const bool off = all && !none && std::abs(square - 1) > unit_length_error; off) {
                std::printf("      of length %.9g\n", std::sqrt(square));
                ++count;
            }
    }
    return count;
}

/// How many numbers of all its results leave their ranges, for a random scene.
long outside(const description::Operation& operation, std::size_t round, std::mt19937& random, const Device& device) {
    const int channels = random() % 2 != 0 ? 3 : 4;
    const Scene scene = random_scene(random, channels);
    const auto image = [&](const std::vector<float>& values, int count) {
        return Image::from_host(device, Element::f32, values.data(), {scene.camera.width, scene.camera.height, count});
    };
    const StoredDepth stored{image(scene.depth, 1), scene.camera};
    const std::shared_ptr<void> call = rounds::call_of(operation, round, image(scene.color, channels), lens, radius);
    const auto wanted = rounds::with_images(operation, call.get(), stored, [&](const description::Shape& shape) {
        return Image(device, shape.element, shape.layout);
    });
    operation.run(call.get(), stored, {});
    long count = 0;
    std::map<std::string, std::vector<float>> weights;
    for (const description::Result& result : wanted) {
        const std::vector<float> values = floats(*result.image);
        const long its = outside(result, values, scene, channels, operation, call.get());
        if (its > 0)
            std::printf("    %s, round %zu, %s of %d x %d pixels: %ld outside\n", operation.name, round, result.name,
                        scene.camera.width, scene.camera.height, its);
        count += its;
        if (contains(std::string(result.name), "_weight"))
            weights[result.name] = values;
    }
    if (weights.size() == 3)
        for (std::size_t i = 0; i < scene.depth.size(); ++i) {
            const float near = weights["near_weight"][i], focus = weights["focus_weight"][i],
                        far = weights["far_weight"][i];
            count += (near + focus) + far != 1 && !(near == 0 && focus == 0 && far == 0);
        }
    return count;
}

constexpr std::size_t mebibyte = std::size_t{1} << 20;

/// The budget that a call says it needs, in bytes; 0 if it has enough.
std::size_t needed(const Call& call, const Scene& scene, std::size_t budget) {
    try {
        call.make(scene.on(test_device({.memory_budget = budget})));
    } catch (const Error& error) {
        const std::string message = error.what(), before = "needs a memory budget of ";
        REQUIRE(contains(message, before));
        return std::stoul(message.substr(message.find(before) + before.size())) * mebibyte;
    }
    return 0;
}

void check_budget(const Call& call, const Scene& scene) {
    const Device free = test_device();
    const auto expected = results(call, scene.on(free));
    const std::size_t taken = free.state().most_scratch_bytes, least = needed(call, scene, 1);
    INFO(call.name << " takes " << taken << " bytes, and says it needs " << least);
    CHECK((least == 0) == (taken == 0));
    CHECK(least < taken + mebibyte);
    if (call.reach(scene.on(free).stored).rows == 0)
        CHECK(taken == 0);
    if (least > mebibyte)
        CHECK(needed(call, scene, least - mebibyte) == least);
    std::vector<std::size_t> budgets{std::max<std::size_t>(least, 1), least + least / 4, (least + 2 * taken) / 2};
    if (call.bytes) {
        budgets.push_back(call.bytes(scene.on(free).stored));
        CHECK(taken <= budgets.back());
    }
    for (const std::size_t budget : budgets) {
        const Device device = test_device({.memory_budget = std::max<std::size_t>(budget, 1)});
        const auto got = results(call, scene.on(device));
        INFO("a budget of " << budget);
        for (std::size_t i = 0; i < got.size(); ++i)
            CHECK(images::same_bits(got[i], expected[i]));
        CHECK(device.state().most_scratch_bytes <= budget);
        CHECK(device.state().scratch_bytes <= budget);
    }
    std::printf("  %s: %.1f MiB of scratch memory, with a budget at least %.0f MiB\n", call.name.c_str(),
                static_cast<double>(taken) / mebibyte, static_cast<double>(least) / mebibyte);
}

/// Cameras of every encoding and every form that the decoder has, in rays of every kind, and through lenses.
std::vector<std::pair<std::string, Camera>> cameras(int width, int height) {
    std::vector<std::pair<std::string, Camera>> all;
    const auto add = [&](const std::string& name, const Projection& projection, Encoding encoding = Encoding::window) {
        Camera camera = metric_camera(width, height);
        camera.projection = projection;
        camera.encoding = encoding;
        camera.near_plane = 0.5;
        camera.far_plane = 100;
        camera.median = 5;
        all.emplace_back(name, camera);
        return &all.back().second;
    };
    const Projection plain = metric_camera(width, height).projection,
                     parallel = orthographic({-5, 7, -4, 3}, {-3, 100});
    add("window", plain);
    add("an oblique near plane", with_oblique_near_plane(plain, {0.3, 0.2, -1, -0.2}));
    add("orthographic", orthographic({-2, 2, -2, 2}, {0.5, 100}));
    add("orthographic, an oblique near plane", with_oblique_near_plane(parallel, {0.3, -0.2, -1, -2}));
    add("a tilted matrix", from_matrix(oracle::tilted(oracle::perspective_matrix(0.7, 0.5, 0.1, 100), 0.2, -0.1)));
    add("ray distance", plain, Encoding::ray_distance);
    add("linear", plain, Encoding::linear);
    add("logarithmic", plain, Encoding::logarithmic);
    add("exponential", plain, Encoding::exponential);
    add("median", plain, Encoding::median);
    add("inverse range", plain, Encoding::inverse_range);
    add("inverse", plain, Encoding::inverse);
    Camera* inverse_along_rays = add("inverse along rays", plain, Encoding::inverse);
    inverse_along_rays->along = Along::ray;
    inverse_along_rays->missing = -1;
    inverse_along_rays->background_from = 1e-6;
    for (const std::size_t which : {0u, 2u, 9u, 11u}) { // brown, brown with a fold, double sphere, a panorama
        const LensSubject subject = lens_subjects().at(which);
        all.emplace_back(subject.name, subject.camera);
        all.back().second.view = metric_camera(width, height).view;
    }
    return all;
}

/// Circles of confusion alone: what a lens has of the masks.
Call circles_call() {
    return call("dof_masks, circles", {}, [](const Inputs& in, const auto&... result) {
        DofMasks masks{
            .coc = Image(in.stored.image.device(), Element::f32, {in.stored.image.width(), in.stored.image.height()})};
        ((masks.coc = result), ...);
        dof_masks(in.stored, masks, lens);
        return masks.coc;
    });
}

/// A scene of the camera's size whose every value is a depth of its encoding.
Scene seen_by(const Camera& camera) {
    Scene scene(camera.width, camera.height);
    scene.camera = camera;
    if (camera.encoding != Encoding::ray_distance)
        for (float& value : scene.depth)
            value /= 16;
    return scene;
}

/// Through a lens.
Scene part_of_panorama() {
    Camera camera = cropped(lens_subjects().at(11).camera, 190, 90, 131, 77);
    camera.view = metric_camera(1, 1).view;
    return seen_by(camera);
}

} // namespace

TEST_CASE("contract: the same bits for another vector width, group size and stride, of any size", "[contract]") {
    // An operation meets one of the four, so that its calls share kernels.
    for (const Call& call : calls()) {
        const std::string name = call.name.substr(0, call.name.find_first_of(", "));
        const auto operation = std::ranges::find(description::operations(), name, &description::Operation::name);
        const std::ptrdiff_t number = operation - description::operations().begin();
        for (const auto& [width, height] : {std::pair{131, 45}, {37, 1}})
            check_same_bits(call, Scene(width, height, true), widths_and_groups[number % 4]);
    }
    for (const description::Operation& operation : description::operations()) // narrow ones need kernels of their own
        for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {7, 3}})
            check_same_bits(calls_of(operation.name).front(), Scene(width, height), {0, 0});
}

TEST_CASE("contract: the same bits for every vector width", "[contract][exhaustive]") {
    const Scene damaged(131, 45, true), large(307, 300);
    for (const Call& call : calls())
        for (const std::pair<int, int>& width_and_group : widths_and_groups) {
            check_same_bits(call, damaged, width_and_group);
            check_same_bits(call, large, width_and_group);
        }
    for (const auto& [name, camera] : cameras(203, 157)) {
        INFO(name);
        for (const std::pair<int, int>& width_and_group : widths_and_groups)
            check_same_bits(calls_of("linearize").front(), seen_by(camera), width_and_group);
    }
}

TEST_CASE("contract: a tile has the bits of the whole", "[contract]") {
    const Scene scene(307, 300), damaged(307, 300, true);
    for (const Call& call : calls()) {
        check_tiles(call, scene.on(device()));
        check_tiles(call, damaged.on(device()));
    }
}

TEST_CASE("contract: a region of ssao is the crop of the whole", "[contract]") {
    const Scene straight(131, 45, true);
    const Scene around = part_of_panorama();
    for (std::size_t round = 0; round < 5; ++round) {
        const Inputs inputs = (round < 4 ? straight : around).on(device());
        const SsaoOptions options = in_round(SsaoOptions{}, round % 4);
        const std::vector<Image> whole = ssao_call("", options).make(inputs);
        for (const Region& part : {Region{0, 0, 1, 1}, {37, 25, 17, 19}, {3, 1, 128, 2}, {130, 0, 1, 45}}) {
            SsaoOptions of_part = options;
            of_part.region = part;
            const std::vector<Image> got = ssao_call("", of_part).make(inputs);
            INFO("round " << round << ", " << part.width << " x " << part.height << " at " << part.x << ", " << part.y);
            for (std::size_t i = 0; i < got.size(); ++i)
                CHECK(same(floats(got[i]), floats(whole[i].region(part.x, part.y, part.width, part.height))));
        }
    }
}

TEST_CASE("contract: a radius of many pixels has blocks at full and at half resolution", "[contract]") {
    const Scene scene(307, 300);
    const auto of = [&](std::optional<bool> half) {
        const Sampling sampling{.quality = Quality::fast, .half_resolution = half};
        return results(ssao_call("", {.sampling = sampling}, {}, 0.9), scene.on(device()));
    };
    const auto chosen = of({}), half = of(true), full = of(false);
    CHECK(chosen != half);
    CHECK(chosen != full);
}

// Results above 16 MiB are written past the cache where their rows allow it: through other instructions.
TEST_CASE("contract: large results have the same bits for every vector width", "[contract][slow]") {
    const Scene scene(2048, 2049);
    for (const char* operation : {"linearize", "unproject", "dof_masks"}) {
        const Call call = calls_of(operation).front();
        const auto expected = results(call, scene.on(device()));
        for (const int vector_width : {1, 4, 8, 16})
            CHECK(results(call, scene.on(device(vector_width, 64))) == expected);
    }
}

TEST_CASE("contract: NaN and infinity touch nothing but what can see them", "[contract]") {
    const Scene scene(307, 300);
    for (const Call& call : calls())
        check_reach(call, scene);
}

TEST_CASE("contract: no result leaves the range that is described", "[contract][slow]") {
    constexpr unsigned images = 5000;
    const Device device = test_device();
    for (const description::Operation& operation : description::operations()) {
        std::mt19937 random(1);
        long count = 0;
        for (unsigned i = 0; i < images; ++i)
            count += outside(operation, i % 4, random, device);
        std::printf("  %s: %u images, %ld numbers outside\n", operation.name, images, count);
        CHECK(count == 0);
    }
}

TEST_CASE("contract: a memory budget is kept, and keeps the bits", "[contract][slow]") {
    const Scene scene(301, 1803);
    for (const Call& call : calls())
        check_budget(call, scene);
}

TEST_CASE("contract: two threads on one device get the bits of one", "[contract]") {
    const Scene scene(131, 45);
    const Device& shared = device();
    std::vector<std::vector<std::vector<float>>> expected;
    for (const Call& call : calls())
        expected.push_back(results(call, scene.on(shared)));
    std::array<int, 2> wrong{};
    {
        std::vector<std::jthread> threads;
        for (std::size_t t = 0; t < 2; ++t)
            threads.emplace_back([&, t] {
                for (std::size_t n = 0; n < 3 * expected.size(); ++n) {
                    const std::size_t i = (t == 0 ? n : 5 * n + 2) % expected.size();
                    const auto got = results(calls()[i], scene.on(shared));
                    for (std::size_t image = 0; image < got.size(); ++image)
                        wrong[t] += !same(got[image], expected[i][image]);
                }
            });
    }
    CHECK(wrong == std::array{0, 0});
}

TEST_CASE("contract: whatever the camera and the storage are", "[contract]") {
    std::size_t next = 0;
    const auto check = [&](const Scene& scene, Storage storage) {
        const Camera& camera = scene.camera;
        for (const char* operation : {"linearize", "unproject", "normals"}) {
            const Call call = calls_of(operation).front();
            Inputs inputs = scene.on(device());
            std::vector<std::uint8_t> codes;
            if (storage != Storage::float32) {
                std::mt19937 random(19);
                codes.resize(scene.depth.size() * static_cast<std::size_t>(channels_of(storage)) *
                             element_bytes(element_of(storage)));
                std::ranges::generate(codes, [&] { return static_cast<std::uint8_t>(random()); });
                inputs.stored = {Image::from_host(device(), element_of(storage), codes.data(),
                                                  {camera.width, camera.height, channels_of(storage)}),
                                 camera, storage};
            } else {
                if (std::string(operation) == "linearize" && next++ % 3 == 0) // the others decode as it does
                    check_same_bits(call, scene, widths_and_groups[next % 4]);
                check_reach(call, scene);
            }
            check_tiles(call, inputs);
        }
    };
    const auto all = cameras(203, 157);
    for (const auto& [name, camera] : all) {
        const Scene own = seen_by(camera);
        INFO(name);
        check(own, Storage::float32);
        if (camera.lens)
            for (const Call& call : {circles_call(), calls_of("normals").at(0), calls_of("normals").at(2),
                                     calls_of("fog").at(0), calls_of("fog").at(2)})
                check_same_bits(call, own, widths_and_groups[next++ % 4]);
        if (name != "orthographic" && name != "a tilted matrix")
            continue;
        for (const char* operation : {"ssao", "fog", "dof_masks", "dof"})
            if (name != "orthographic" || operation[0] != 'd') // whose lens would be a telecentric one
                check_same_bits(calls_of(operation).at(1), own, widths_and_groups[next++ % 4]);
    }
    for (const std::pair<int, int>& width_and_group : widths_and_groups)
        check_same_bits(calls_of("ssao").front(), part_of_panorama(), width_and_group);
    for (const Storage storage : {Storage::float16, Storage::uint8, Storage::uint16, Storage::uint24,
                                  Storage::uint24_high, Storage::rgb8_red_low}) {
        INFO(to_string(storage));
        check(seen_by(all.front().second), storage);
    }
}

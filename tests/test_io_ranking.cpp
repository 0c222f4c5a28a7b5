// What values could be, where nobody says it. The truth is each input's own description, or the formula that made it.
#include "io_files.hpp"
#include "matrices.hpp"
#include "places.hpp"
#include "real_inputs.hpp"
#include "scene/scene.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/io.hpp>
#include <fathom/ranking.hpp>

#include <opencv2/imgcodecs.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

HostDepth host(const DepthFile& depth) {
    return {depth.values.data, depth.values.cols, depth.values.rows, depth.values.step, depth.storage};
}

/// The family that a description names: what its stored values are affine in, by the definitions in docs/camera.md.
Family family_of(Encoding encoding) {
    switch (encoding) {
    case Encoding::window:
        return Family::window_affine;
    case Encoding::linear:
    case Encoding::pseudo_linear: // z·w written per vertex: affine in z at every vertex
    case Encoding::view_z:
        return Family::planar;
    case Encoding::ray_distance:
        return Family::radial;
    case Encoding::inverse:
    case Encoding::inverse_range:
        return Family::inverse;
    default:
        return Family::other;
    }
}

/// How many inputs were named right, not named, and named wrong.
struct Count {
    int right = 0, unnamed = 0, wrong = 0;

    std::string in_words() const {
        return std::to_string(right) + " right, " + std::to_string(unnamed) + " not named, " + std::to_string(wrong) +
               " wrong";
    }

    void add(const std::string& name, const Ranking& ranking, Family truth, bool print = true) {
        ++(!ranking.family ? unnamed : *ranking.family == truth ? right : wrong);
        const std::string said = ranking.family ? to_string(*ranking.family) : "cannot tell";
        if (print || (ranking.family && *ranking.family != truth))
            std::cout << "  " << name << ": " << said << ", truth " << to_string(truth) << '\n';
        if (ranking.family && *ranking.family != truth)
            for (const std::string& sentence : ranking.evidence)
                std::cout << "    " << sentence << '\n';
    }
};

/// What a ray caster sees: distance along the axis and along the ray, infinite where nothing is.
struct Seen {
    int width, height;
    double focal_px;
    std::vector<double> z, along_ray;
    double nearest = 0, farthest = 0;

    /// From 0 for the farthest to 1 for the nearest, as relative depth has it.
    double relative(double depth) const { return (1 / depth - 1 / farthest) / (1 / nearest - 1 / farthest); }
};

Seen seen(const scene::Scene& scene, double fov_x_deg, int width = 320, int height = 240) {
    Camera camera;
    const double tangent = std::tan(fov_x_deg * std::numbers::pi / 360), aspect = static_cast<double>(width) / height;
    camera.projection = perspective(2 * std::atan(tangent / aspect), aspect, {0.05, 1000});
    camera.width = width;
    camera.height = height;
    const scene::Rendered image = scene::render(scene, camera);
    Seen result{width, height, width / (2 * tangent), image.z, {}};
    result.nearest = *std::ranges::min_element(image.z);
    result.farthest = *std::ranges::max_element(image.z);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double dx = (x + 0.5 - width / 2.0) / result.focal_px,
                         dy = (y + 0.5 - height / 2.0) / result.focal_px;
            result.along_ray.push_back(result.z[result.along_ray.size()] * std::sqrt(1 + dx * dx + dy * dy));
        }
    return result;
}

/// A pixel of it.
struct Place {
    const Seen& seen;
    std::size_t i;
    double z, along_ray;
};

/// A source of depth: its formula, as the source's documentation has it.
struct Source {
    const char* name;
    Family truth;
    std::function<DepthFile(const Seen&)> stored;
};
using Value = std::function<double(const Place&)>;

template <typename Element>
DepthFile image_of(const Seen& seen, int type, Storage storage, const Value& value) {
    cv::Mat image(seen.height, seen.width, type);
    for (std::size_t i = 0; i < seen.z.size(); ++i)
        image.ptr<Element>(0)[i] = static_cast<Element>(value({seen, i, seen.z[i], seen.along_ray[i]}));
    return {image, storage, {}};
}

Source floats(const char* name, Family truth, const Value& value) {
    return {name, truth,
            [value](const Seen& seen) { return image_of<float>(seen, CV_32FC1, Storage::float32, value); }};
}

/// Codes of 16 bits; what is above them is `above`.
Source codes(const char* name, Family truth, double above, const Value& value) {
    return {name, truth, [above, value](const Seen& seen) {
                const Value again = value; // which may draw random numbers
                return image_of<std::uint16_t>(seen, CV_16UC1, Storage::uint16, [&](const Place& p) {
                    const double code = std::round(again(p));
                    return code > 65535 || std::isnan(code) ? above : code;
                });
            }};
}

/// Four channels of 8 bits of a PNG, B first, that are read back as the packing says.
Source packed(const char* name, Family truth, Packing packing, const std::function<cv::Vec4b(double z)>& bytes) {
    return {name, truth, [packing, bytes](const Seen& seen) {
                cv::Mat bgra(seen.height, seen.width, CV_8UC4);
                std::ranges::transform(seen.z, bgra.ptr<cv::Vec4b>(0), bytes);
                const TempFolder folder;
                cv::imwrite((folder / "depth.png").string(), bgra);
                return read_depth(folder / "depth.png", {.packing = packing});
            }};
}

/// One pixel in thirty is not measured.
bool is_hole(std::size_t i) {
    return (i * 2654435761U >> 7) % 30 == 0;
}

double window(double z, double near, double far) {
    return z < far ? (1 / near - 1 / z) / (1 / near - 1 / far) : 1;
}

std::uint8_t byte(unsigned code, int n) {
    return static_cast<std::uint8_t>(code >> (8 * n));
}

const std::vector<Source>& sources() {
    static const std::vector<Source> all{
        packed("CARLA, 24 bits in R, G and B", Family::planar, Packing::rgb_red_low,
               [](double z) {
                   const auto code = static_cast<unsigned>(std::round(std::min(z / 1000, 1.0) * 16777215));
                   return cv::Vec4b(byte(code, 2), byte(code, 1), byte(code, 0), 255);
               }),
        codes("Kinect, millimetres with holes", Family::planar, 0,
              [](const Place& p) { return is_hole(p.i) ? 0 : 1000 * p.z; }),
        floats("Isaac Sim, distance_to_camera", Family::radial, [](const Place& p) { return p.along_ray; }),
        floats("AirSim, DepthPerspective", Family::radial,
               [](const Place& p) { return std::min(p.along_ray, 65504.0); }),
        floats("Mitsuba 2, 0 where nothing is", Family::radial,
               [](const Place& p) { return std::isinf(p.along_ray) ? 0 : p.along_ray; }),
        floats("Habitat-sim, metres", Family::planar, [](const Place& p) { return std::isinf(p.z) ? 0 : p.z; }),
        codes("stereo disparity, 256 steps a pixel, with holes", Family::inverse, 0,
              [](const Place& p) { return is_hole(p.i) ? 0 : 256 * 0.2 * p.seen.focal_px / p.z; }),
        {"MuJoCo's depth buffer, 24 bits", Family::window_affine,
         [](const Seen& seen) {
             return image_of<std::uint32_t>(seen, CV_32SC1, Storage::uint24,
                                            [](const Place& p) { return std::round(16777215 * window(p.z, 0.1, 50)); });
         }},
        packed("three.js, packDepthToRGBA", Family::window_affine, Packing::rgba_red_high,
               [](double z) {
                   const double v = window(z, 0.1, 100);
                   const auto code = v >= 1 ? 0xffffffU : static_cast<unsigned>(v * 0x1p24);
                   return cv::Vec4b(byte(code, 0), byte(code, 1), byte(code, 2), v >= 1 ? 255 : 0);
               }),
        {"Hypersim, half floats", Family::radial,
         [](const Seen& seen) {
             const DepthFile depth = image_of<float>(seen, CV_32FC1, Storage::float32, [](const Place& p) {
                 return std::isinf(p.along_ray) ? NAN : p.along_ray;
             });
             cv::Mat half;
             depth.values.convertTo(half, CV_16F);
             return DepthFile{half, Storage::float16, {}};
         }},
    };
    return all;
}

/// More sources, of which some look like others.
const std::vector<Source>& more_sources() {
    static const std::vector<Source> all{
        codes("Virtual KITTI 2, centimetres", Family::planar, 65535, [](const Place& p) { return 100 * p.z; }),
        floats("a reversed buffer without a far plane", Family::window_affine,
               [](const Place& p) { return 0.1 / p.z; }),
        floats("Nuke's depth.Z", Family::inverse, [](const Place& p) { return 1 / p.z; }),
        floats("Middlebury's disparity, infinite holes", Family::inverse,
               [](const Place& p) {
                   return is_hole(p.i) ? static_cast<double>(infinity) : 0.5 * p.seen.focal_px / p.z - 2;
               }),
        floats("Habitat-lab, 0 to 1", Family::planar, [](const Place& p) { return std::min(p.z / 10, 1.0); }),
        floats("linear from a near plane at 0.5", Family::planar,
               [](const Place& p) { return std::clamp((p.z - 0.5) / 49.5, 0.0, 1.0); }),
        floats("V-Ray's Z, near is white", Family::planar,
               [](const Place& p) { return std::clamp((50 - p.z) / 49.5, 0.0, 1.0); }),
        codes("a 16-bit depth buffer", Family::window_affine, 65535,
              [](const Place& p) { return 65535 * window(p.z, 0.1, 100); }),
        floats("a depth buffer of floats", Family::window_affine, [](const Place& p) { return window(p.z, 0.1, 100); }),
        floats("Blender's Z", Family::planar, [](const Place& p) { return std::min(p.z, 1e10); }),
        floats("logarithmic depth", Family::other,
               [](const Place& p) { return std::min(std::log(p.z + 1) / std::log(101.0), 1.0); }),
        floats("exponential depth", Family::other,
               [](const Place& p) { return std::min(std::log(p.z / 0.1) / std::log(1000.0), 1.0); }),
        floats("median depth", Family::other, [](const Place& p) { return std::isinf(p.z) ? 1 : p.z / (p.z + 3); }),
        floats("relative depth, A + B/z", Family::inverse, [](const Place& p) { return 3 + 7 / p.z; }),
        floats("relative depth, 0 to 1", Family::inverse, [](const Place& p) { return p.seen.relative(p.z); }),
        codes("relative depth, 16 bits", Family::inverse, 65535,
              [](const Place& p) { return 65535 * p.seen.relative(p.z); }),
        codes("noisy millimetres", Family::planar, 0,
              [random = std::mt19937(1), normal = std::normal_distribution<double>()](const Place& p) mutable {
                  return 1000 * p.z * (1 + 0.002 * p.z * normal(random));
              }),
    };
    return all;
}

Count sources_in_a_room() {
    Count count;
    const Seen room = seen(scene::room(), 80);
    for (const Source& source : sources())
        count.add(source.name, rank_encodings(host(source.stored(room))), source.truth);
    return count;
}

void check_unnamed(const char* name, const cv::Mat& image) {
    INFO(name);
    for (int type : {CV_32F, CV_16U}) {
        cv::Mat values;
        image.convertTo(values, type, type == CV_16U ? 10000 : 1);
        const Ranking ranking =
            rank_encodings(host(DepthFile{values, type == CV_16U ? Storage::uint16 : Storage::float32, {}}));
        INFO((ranking.family ? to_string(*ranking.family) : "cannot tell"));
        CHECK(!ranking.family);
    }
}

} // namespace

TEST_CASE("ranking: the family of every source in a room, none wrong") {
    const Count count = sources_in_a_room();
    CHECK(count.wrong == 0);
    CHECK(count.right == 10);
}

TEST_CASE("ranking: the family of 32 inputs, none wrong", "[real]") {
    constexpr int least_right = 27; // as docs/inspect.md says
    Count count = sources_in_a_room();
    for (const char* folder : {"opengl", "blender", "habitat"})
        if (!real::there(folder))
            return;

    for (const auto& entry : fs::directory_iterator(real::data / "opengl")) {
        if (entry.path().extension() != ".json")
            continue;
        const std::string name = entry.path().stem().string();
        count.add(name, rank_encodings(host(real::opengl_depth(name))),
                  family_of(read_camera(entry.path()).camera.encoding));
    }
    for (const char* view : {"blender/perspective", "blender/orthographic"})
        count.add(view, rank_encodings(host(read_depth(real::data / view / "sharp.exr"))),
                  family_of(read_camera(real::data / view / "camera.json").camera.encoding));
    count.add("habitat", rank_encodings(host(read_depth(real::data / "habitat/room.depth.exr"))),
              family_of(read_camera(real::data / "habitat/room.camera.json").camera.encoding));
    std::cout << "ranking of 32 inputs: " << count.in_words() << '\n';
    CHECK(count.right + count.unnamed + count.wrong == 32);
    CHECK(count.right >= least_right);
    CHECK(count.wrong == 0);
}

TEST_CASE("ranking: every source in every scene and under three angles of view, none wrong", "[slow]") {
    std::vector<std::pair<std::string, Seen>> views;
    for (const std::string& name : scene::names())
        for (const double fov : {45.0, 70.0, 100.0})
            views.emplace_back(name, seen(scene::named(name), fov, 240, 180));
    Count all;
    for (const auto* list : {&sources(), &more_sources()})
        for (const Source& source : *list) {
            Count count;
            for (const auto& [name, view] : views)
                count.add(source.name + (" in " + name), rank_encodings(host(source.stored(view))), source.truth,
                          false);
            std::cout << "  " << source.name << ": " << count.in_words() << '\n';
            CHECK(count.wrong == 0);
            all.right += count.right;
            all.unnamed += count.unnamed;
            all.wrong += count.wrong;
        }
    std::cout << "ranking of " << sources().size() + more_sources().size() << " sources in " << views.size()
              << " views: " << all.in_words() << '\n';
    constexpr int least_right = 255; // docs/inspect.md: 262
    CHECK(all.right >= least_right); // saying nothing is no way to be never wrong
}

TEST_CASE("ranking: what is no depth, or shows no planes, has no family") {
    std::mt19937 random(7);
    std::normal_distribution<float> normal;
    check_unnamed("noise", filled(200, 150, [&](int, int) { return 2 + 0.3 * static_cast<double>(normal(random)); }));
    check_unnamed("noise from 0 to 1",
                  filled(200, 150, [&](int, int) { return static_cast<double>(random()) / 0x1p32; }));
    check_unnamed("one value", filled(200, 150, [](int, int) { return 0.5; }));
    check_unnamed("one pixel", filled(1, 1, [](int, int) { return 0.5; }));
    check_unnamed("one row", filled(500, 1, [](int x, int) { return 1.0 / (x + 1); }));
    check_unnamed("nothing but NaN", filled(200, 150, [](int, int) { return NAN; }));
    check_unnamed("nothing but infinity", filled(200, 150, [](int, int) { return INFINITY; }));
    check_unnamed("steps", filled(200, 150, [](int x, int) { return 1.0 + x / 50; }));
    check_unnamed("a wave", filled(200, 150, [](int x, int y) { return 2 + std::sin(x * 0.05) * std::cos(y * 0.04); }));
    check_unnamed("a photograph of a sphere", filled(200, 150, [](int x, int y) {
                      const double r = std::hypot(x - 100, y - 75) / 60;
                      return r < 1 ? 0.2 + 0.8 * std::sqrt(1 - r * r) : 0.1;
                  }));
    for (const double radius : {1.0, 3.0}) {
        const Seen sphere = seen({scene::Sphere{{0, 0, -5}, radius}}, 60);
        check_unnamed("a sphere alone", filled(sphere.width, sphere.height, [&](int x, int y) {
                          return sphere.z[static_cast<std::size_t>(y * sphere.width + x)];
                      }));
    }
    CHECK_THROWS_AS(rank_encodings(HostDepth{}), std::invalid_argument);
}

TEST_CASE("ranking: what a renderer wrote beside depth has no family", "[real]") {
    if (!real::there("blender"))
        return;
    for (const char* view : {"blender/perspective", "blender/orthographic"})
        for (const char* channel : {"ViewLayer.Combined.G", "ViewLayer.AO.R", "ViewLayer.Normal.X"})
            check_unnamed(channel, read_depth(real::data / view / "sharp.exr", {.channel = channel}).values);
}

TEST_CASE("ranking: what is named beside the family agrees with how the values were made") {
    const Seen view = seen(scene::room(), 73);
    const auto guess_of = [&](const char* name) {
        for (const auto* list : {&sources(), &more_sources()})
            for (const Source& source : *list)
                if (source.name == std::string(name)) {
                    const Ranking ranking = rank_encodings(host(source.stored(view)));
                    REQUIRE(!ranking.guesses.empty());
                    return ranking.guesses.front();
                }
        throw std::logic_error(name);
    };
    const auto camera_of = [&](const Guess& guess) {
        const TempFolder folder;
        return camera_for(read_camera(put(folder / "camera.json", guess.camera_file)), view.width, view.height);
    };
    // The angle of view of radial depth is measured: floats give it to a hundredth of a degree, as printed.
    CHECK_THAT(guess_of("Isaac Sim, distance_to_camera").camera_file, ContainsSubstring("\"fov_x_deg\": 73}"));
    const Camera linear = camera_of(guess_of("linear from a near plane at 0.5"));
    CHECK(linear.encoding == Encoding::linear);
    CHECK(*linear.near_plane / *linear.far_plane == Approx(0.01).epsilon(1e-3));
    const Camera white = camera_of(guess_of("V-Ray's Z, near is white")); // 50 at 0 and 0.5 at 1
    CHECK(*white.near_plane / *white.far_plane == Approx(100).epsilon(0.01));
    const Camera logarithmic = camera_of(guess_of("logarithmic depth"));
    CHECK(logarithmic.encoding == Encoding::logarithmic);
    CHECK(*logarithmic.far_plane == Approx(100).epsilon(0.01));
    const Camera exponential = camera_of(guess_of("exponential depth"));
    CHECK(*exponential.far_plane / *exponential.near_plane == Approx(1000).epsilon(0.01));
    CHECK(camera_of(guess_of("Kinect, millimetres with holes")).scale == 0.001);
}

TEST_CASE("ranking: every camera file to start from is one") {
    const Seen room = seen(scene::room(), 70), spheres = seen(scene::spheres(), 70);
    for (const Seen* view : {&room, &spheres})
        for (const auto* list : {&sources(), &more_sources()})
            for (const Source& source : *list)
                for (const Guess& guess : rank_encodings(host(source.stored(*view))).guesses) {
                    INFO(source.name << ": " << guess.camera_file);
                    const TempFolder folder;
                    CHECK(camera_for(read_camera(put(folder / "camera.json", guess.camera_file)), view->width,
                                     view->height)
                              .width == view->width);
                }
}

TEST_CASE("ranking: values below 0 get cameras under which they are depths") {
    const Seen view = seen(scene::room(), 73);
    const std::pair<Family, Value> kinds[] = {{Family::planar, [](const Place& p) { return -p.z; }},
                                              {Family::radial, [](const Place& p) { return -p.along_ray; }},
                                              {Family::inverse, [](const Place& p) { return -1 / p.z; }}};
    for (const auto& [family, value] : kinds) {
        const DepthFile stored = image_of<float>(view, CV_32FC1, Storage::float32, value);
        const Ranking ranking = rank_encodings(host(stored));
        REQUIRE(!ranking.guesses.empty());
        CHECK(ranking.guesses.front().family == family);
        for (const Guess& guess : ranking.guesses) {
            INFO(guess.camera_file);
            const TempFolder folder;
            const Camera camera =
                camera_for(read_camera(put(folder / "camera.json", guess.camera_file)), view.width, view.height);
            const double x = view.width / 2, y = view.height / 2;
            const auto middle = static_cast<double>(stored.values.at<float>(view.height / 2, view.width / 2));
            CHECK(view_depth(camera, Storage::float32, x, y, middle) > 0);
            CHECK(camera.scale < 0);
        }
    }
    // From 0 to -1 with a sky at -1, which lies beyond the farthest surface.
    DepthFile counted =
        image_of<float>(view, CV_32FC1, Storage::float32, [](const Place& p) { return -(p.z - 1) / 20; });
    counted.values.rowRange(0, view.height / 4) = -1;
    const Ranking ranking = rank_encodings(host(counted));
    REQUIRE(!ranking.guesses.empty());
    CHECK(ranking.guesses.front().family == Family::planar);
    CHECK(ranking.guesses.front().camera_file.find("\"depth_range\": [0, -") != std::string::npos);
    CHECK(ranking.guesses.front().camera_file.find("\"background_from\": -1") != std::string::npos);
}

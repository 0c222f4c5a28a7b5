// What one device makes of every operation: does it give the bits of another device, how fast is it, and how long does its
// driver compile?
//   device_report results FILE [SCENES [LARGEST]]
//                                         writes every result of 20 scenes, or fewer, of all ways to store depth, and through lenses
//   device_report compare FILE REFERENCE  compares two such files
//   device_report times [WIDTH HEIGHT]    times each operation against a copy of the depth image
// Each prints lines of fields with tabs between them. The environment chooses: DEVICE names the device, the CPU without it;
// ARITHMETIC=two_float does without double where there is double; CLOCK=processor times all threads.

#include "compile_times.hpp"

#include <CL/cl.h>

#include <fathom/fathom.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <tuple>

using namespace fathom;

namespace {

constexpr double near_plane = 0.5, far_plane = 100;

/// Depth and colours that are the same bits on every host: integers, and arithmetic that IEEE 754 rounds.
struct Scene {
    Camera camera;
    Storage storage = Storage::float32;
    std::vector<std::uint8_t> depth; ///< as `storage` holds it
    Element color_type = Element::f32;
    int color_channels = 3;
    std::vector<std::uint8_t> colors;

    StoredDepth on(const Device& device) const {
        const Layout layout{camera.width, camera.height, channels_of(storage)};
        return {Image::from_host(device, element_of(storage), depth.data(), layout), camera, storage};
    }
    Image picture(const Device& device) const {
        return Image::from_host(device, color_type, colors.data(), {camera.width, camera.height, color_channels});
    }
};

/// A way to store depth that needs no other projection than the perspective one.
struct Stored {
    Encoding encoding = Encoding::window;
    Storage storage = Storage::float32;
    Along along = Along::axis;
    bool from_near_plane = false;
};

/// Every encoding as floats, and everything else that may hold a depth.
const Stored ways_to_store[] = {
    {Encoding::view_z},
    {Encoding::ray_distance},
    {Encoding::ray_distance, Storage::float32, Along::axis, true},
    {Encoding::linear},
    {Encoding::linear, Storage::float32, Along::ray},
    {Encoding::logarithmic},
    {Encoding::exponential},
    {Encoding::median},
    {Encoding::pseudo_linear},
    {Encoding::inverse},
    {Encoding::inverse, Storage::float32, Along::ray},
    {Encoding::inverse_range},
    {Encoding::inverse_range, Storage::float32, Along::ray},
    {Encoding::window, Storage::float16},
    {Encoding::window, Storage::uint8},
    {Encoding::window, Storage::uint16},
    {Encoding::window, Storage::uint24},
    {Encoding::window, Storage::uint24_high},
    {Encoding::window, Storage::rgb8_red_low},
    {Encoding::window, Storage::rgb8_red_high},
    {Encoding::window, Storage::bgr8_red_low},
    {Encoding::window, Storage::bgr8_red_high},
    {Encoding::view_z, Storage::uint16},
};
constexpr int main_scenes = 20, straight_scenes = main_scenes + static_cast<int>(std::size(ways_to_store));

/// A lens, and along what depth counts through it. The numbers are those of an image of this size.
struct Lensed {
    LensModel model;
    int width, height;
    Along along = Along::ray;
    Encoding encoding = Encoding::view_z;
    ViewAxes axes = ViewAxes::opencv;
    Storage storage = Storage::float32;
};

/// A lens without a name: its rays are the same bits on every host, since nothing but a square root makes them.
LensModel map_of_rays(int width, int height) {
    RayMap map{width, height, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double right = (x + 0.5 - width / 2.0) / 60, down = (y + 0.5 - height / 2.0) / 60,
                         squeezed = 1 - (right * right + down * down) / 8,
                         length = std::sqrt(right * right + down * down + squeezed * squeezed);
            const bool none = right * right + down * down > 2;
            for (const double part : {right, down, squeezed})
                map.rays.push_back(none ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(part / length));
        }
    return lens_of_rays(std::move(map));
}

std::vector<Lensed> lenses() {
    using enum LensLaw;
    return {
        {{brown, 100, 101, 80, 60, {-0.35, 0.13, 1e-3, -5e-4, 0.01}}, 161, 121, Along::axis, Encoding::window},
        {{brown, 101, 101, 65.5, 66.75, {5.6, 3.6, 7e-5, -9e-5, 0.19, 5.9, 5.4, 1}},
         128,
         115,
         Along::axis,
         Encoding::view_z,
         ViewAxes::opencv,
         Storage::uint16},
        {{brown, 100, 101, 96, 54, {-0.1, 0.02, 1e-3, -5e-4, 0, 0, 0, 0, 1e-3, 2e-4, -1e-3, 1e-4}},
         191,
         107,
         Along::ray,
         Encoding::ray_distance,
         ViewAxes::directx},
        {{brown, 80, 80, 77, 43, {-0.3, 0.1, 1e-3, -5e-4, -0.02}}, 153, 86, Along::axis},                // with a fold
        {{brown, 160, 161, 80, 60, {-0.1, 0.02, 1e-3, -5e-4}}, 161, 121, Along::axis, Encoding::window}, // dof takes it
        {{opencv_fisheye, 48, 48.5, 80, 79.5, {0.05, -0.01, 0.002, -3e-4}}, 161, 160, Along::axis},
        {{opencv_fisheye, 48, 48.5, 80, 79.5, {0.05, -0.03, 0, 0}},
         160,
         159,
         Along::cube,
         Encoding::view_z,
         ViewAxes::opengl},
        {{equidistant, 50, 50, 96, 54}, 191, 108},
        {{equisolid, 57, 57, 80.5, 80.5}, 161, 161, Along::ray, Encoding::inverse},
        {{stereographic, 40, 40, 96, 54}, 192, 108, Along::ray, Encoding::linear},
        {{double_sphere, 54, 54, 80, 80, {-0.2, 0.6}}, 161, 159, Along::cube},
        {{blender_polynomial, 5.3, 5.3, 96, 54, {0, -0.0919, -0.0019, -0.00017, 0}},
         192,
         108,
         Along::ray,
         Encoding::ray_distance,
         ViewAxes::opengl},
        {{equirectangular, 206 / 6.283185307179586, 103 / 3.141592653589793, 103, 51.5},
         206,
         103,
         Along::ray,
         Encoding::ray_distance,
         ViewAxes::opengl},
        {{equirectangular, 80, 84, -20, 100}, 140, 60, Along::cube},
        {map_of_rays(161, 121), 161, 121, Along::ray, Encoding::ray_distance},
        {map_of_rays(130, 97), 130, 97, Along::axis},
    };
}

template <typename T>
void append(std::vector<std::uint8_t>& bytes, T value) {
    const auto memory = std::bit_cast<std::array<std::uint8_t, sizeof(T)>>(value);
    bytes.insert(bytes.end(), memory.begin(), memory.end());
}

/// Distance in scene units: slopes, boxes before them, and what lies behind everything.
double distance_at(int x, int y, int width, bool boxes) {
    const auto wave = [](int i, int period) { return std::abs(2.0 * (i % period) / period - 1); };
    if (y < 3 && x % 5 == 0)
        return far_plane;
    const double ground = 4 + 0.03 * y + wave(x, 37) + 0.5 * wave(y + x / 3, 23);
    return boxes && x / 19 % 3 == 1 && y % 31 < 17 && x * 3 > width ? ground - 2.25 : ground;
}

Projection projection_of(int kind, double aspect) {
    const DepthSpan span{near_plane, far_plane};
    switch (kind) {
    case 1:
        return with_oblique_near_plane(perspective(1.0, aspect, span), {0.125, 0.25, -1, -0.75});
    case 2:
        return orthographic({-4 * aspect, 4 * aspect, -4, 4}, span);
    case 3: {
        Eigen::Matrix4d tilted = perspective(1.0, aspect, span).matrix.cast<double>();
        tilted.row(3) = Eigen::RowVector4d(0.0625, -0.03125, -1, 0);
        return from_matrix(tilted);
    }
    default:
        return perspective(1.0, aspect, span);
    }
}

float stored_value(const Camera& camera, double z) {
    constexpr double median = 8, scale = 1 / near_plane - 1 / far_plane;
    switch (camera.encoding) {
    case Encoding::window:
        return camera.projection.matrix(3, 2) == 0
                   ? static_cast<float>((z - near_plane) / (far_plane - near_plane))
                   : static_cast<float>(far_plane * (z - near_plane) / (z * (far_plane - near_plane)));
    case Encoding::linear:
    case Encoding::logarithmic:
    case Encoding::exponential:
    case Encoding::pseudo_linear:
        return static_cast<float>((z - near_plane) / (far_plane - near_plane));
    case Encoding::median:
        return static_cast<float>(0.5 + 0.5 * (z - median) / (z + median));
    case Encoding::inverse:
        return static_cast<float>(1 / z);
    case Encoding::inverse_range:
        return static_cast<float>((1 / near_plane - 1 / z) / scale);
    default:
        return static_cast<float>(z);
    }
}

/// A pixel's depth as memory holds it. `value` is from 0 to 1 where it becomes a code.
void append_depth(Scene& scene, float value) {
    const auto code = [&](double most) {
        return static_cast<std::uint32_t>(std::clamp(double{value}, 0.0, 1.0) * most);
    };
    const std::uint32_t code24 = code(0xffffff);
    const auto bytes = [&](int first, int second, int third) {
        for (const int shift : {first, second, third})
            append(scene.depth, static_cast<std::uint8_t>(code24 >> shift));
    };
    switch (scene.storage) {
    case Storage::float32:
        return append(scene.depth, value);
    case Storage::float16:
        return append(scene.depth, static_cast<Eigen::half>(value).x);
    case Storage::uint8:
        return append(scene.depth, static_cast<std::uint8_t>(code(0xff)));
    case Storage::uint16:
        return append(scene.depth, static_cast<std::uint16_t>(code(0xffff)));
    case Storage::uint24:
        return append(scene.depth, code24);
    case Storage::uint24_high:
        return append(scene.depth, code24 << 8);
    case Storage::rgb8_red_low:
    case Storage::bgr8_red_high:
        return bytes(0, 8, 16);
    case Storage::rgb8_red_high:
    case Storage::bgr8_red_low:
        return bytes(16, 8, 0);
    }
}

void append_color(Scene& scene, int level) {
    switch (scene.color_type) {
    case Element::u8:
        return append(scene.colors, static_cast<std::uint8_t>(level));
    case Element::u16:
        return append(scene.colors, static_cast<std::uint16_t>(level * 257));
    case Element::f16:
        return append(scene.colors, static_cast<Eigen::half>(static_cast<float>(level) / 256).x);
    default:
        return append(scene.colors, static_cast<float>(level) / 256);
    }
}

/// The scene is seen through a lens. A smaller image is the middle of the lens's.
void look_through(Scene& scene, const Lensed& lensed) {
    Camera& camera = scene.camera;
    camera.projection = perspective(1.0, 1.0, {near_plane, far_plane}, {.view_axes = lensed.axes});
    camera.lens = lensed.model;
    camera.lens->cx -= (lensed.width - camera.width) / 2;
    camera.lens->cy -= (lensed.height - camera.height) / 2;
    camera.encoding = lensed.encoding;
    if (camera.encoding != Encoding::ray_distance)
        camera.along = lensed.along;
    scene.storage = lensed.storage;
}

/// `boxes`: does something stand before the slopes?
Scene scene(int index, int width, int height, bool boxes = true) {
    Scene made;
    Camera& camera = made.camera;
    const bool main = index < main_scenes, straight = index < straight_scenes;
    const Stored way = main || !straight ? Stored{} : ways_to_store[index - main_scenes];
    camera.projection = projection_of(main && index % 7 < 4 ? index % 7 : 0, double(width) / height);
    camera.width = width;
    camera.height = height;
    camera.encoding = way.encoding;
    camera.along = way.along;
    camera.from_near_plane = way.from_near_plane;
    camera.near_plane = near_plane;
    camera.far_plane = far_plane;
    camera.median = 8;
    camera.view = Eigen::Matrix4d::Identity();
    if (index % 2 == 1) // a turn that has exact numbers
        camera.view->topLeftCorner<2, 2>() << 0.6, -0.8, 0.8, 0.6;
    if (main && index % 7 == 4)
        camera.encoding = Encoding::ray_distance;
    if (main && index % 7 == 5)
        camera.encoding = Encoding::view_z;
    if (main && index % 7 == 6)
        camera.encoding = Encoding::logarithmic;
    made.storage = way.storage;
    if (!straight)
        look_through(made, lenses().at(static_cast<std::size_t>(index - straight_scenes)));
    if (main && index % 3 == 2 && camera.encoding == Encoding::window)
        made.storage = Storage::uint16;
    const bool floats = made.storage == Storage::float32 || made.storage == Storage::float16;
    const bool distances = made.storage == Storage::uint16 && camera.encoding == Encoding::view_z;
    if (distances)
        camera.scale = 128.0 / 65535;
    constexpr std::pair<Element, int> pictures[] = {
        {Element::f32, 3}, {Element::f32, 4}, {Element::f16, 4}, {Element::u8, 3}, {Element::u16, 4}};
    std::tie(made.color_type, made.color_channels) = pictures[main ? index % 2 : index % 5];
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool missing = floats && (x * 7 + y * 13) % 101 == 50;
            const float value = stored_value(camera, distance_at(x, y, width, boxes));
            append_depth(made, missing ? std::numeric_limits<float>::quiet_NaN() : distances ? value / 128 : value);
            for (int channel = 0; channel < made.color_channels; ++channel)
                append_color(made, channel == 3 ? 255 : (x * 31 + y * 17 + channel * 85 + (boxes ? 0 : 64)) % 256);
        }
    return made;
}

/// Results as floats, of which halves and codes are rounded.
struct Values {
    std::vector<float> numbers;
    double step = 0; ///< of the rounding
};

template <typename T>
std::vector<float> numbers_of(const Image& image, const std::function<float(T)>& number) {
    std::vector<T> memory(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
                          static_cast<std::size_t>(image.channels()));
    image.download(memory.data());
    std::vector<float> numbers(memory.size());
    std::ranges::transform(memory, numbers.begin(), number);
    return numbers;
}

void add(Values& all, const Image& image) {
    if (!image)
        return;
    std::vector<float> part;
    switch (image.element()) {
    case Element::u8:
        part = numbers_of<std::uint8_t>(image, [](std::uint8_t code) { return static_cast<float>(code) / 255; });
        all.step = 1.0 / 255;
        break;
    case Element::u16:
        part = numbers_of<std::uint16_t>(image, [](std::uint16_t code) { return static_cast<float>(code) / 65535; });
        all.step = 1.0 / 65535;
        break;
    case Element::f16:
        part = numbers_of<Eigen::half>(image, [](Eigen::half half) { return static_cast<float>(half); });
        all.step = 0x1p-11; // of numbers below 1
        break;
    default:
        part = numbers_of<float>(image, [](float number) { return number; });
    }
    all.numbers.insert(all.numbers.end(), part.begin(), part.end());
}

CircleOfConfusion lens_of(const Camera& camera) {
    const bool telecentric = camera.projection.matrix(3, 2) == 0;
    return telecentric ? CircleOfConfusion{.k = 3, .g = 1, .telecentric = true} : CircleOfConfusion{.k = 12, .g = 60};
}
constexpr Quality qualities[] = {Quality::fast, Quality::balanced, Quality::accurate};

/// Every operation on one scene; which quality and which choices follow from the scene's number.
std::map<std::string, Values> results_of(const Device& device, int index, const Scene& scene) {
    const StoredDepth depth = scene.on(device);
    const Image picture = scene.picture(device);
    const Quality quality = qualities[index % 3];
    const CircleOfConfusion lens = lens_of(scene.camera);
    const int width = scene.camera.width, height = scene.camera.height;
    const Scene behind = ::scene(index, width, height, false); // without boxes
    const StoredDepth depth_behind = behind.on(device);
    const Image picture_behind = behind.picture(device);
    const std::vector<float> constant(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.375f);
    const Space space = index % 2 == 1 ? Space::world : Space::view;
    const int channels = index / 2 % 2 == 1 ? 4 : 3;
    const bool straight = !scene.camera.lens;
    std::map<std::string, Values> all;
    const auto run = [&](const char* name, const auto& images) {
        compile_for(name);
        for (const Image& image : images())
            add(all[name], image);
    };
    using Images = std::vector<Image>;
    run("linearize", [&] { return Images{linearize(depth).image}; });
    run("unproject", [&] {
        const Background background = index % 3 == 1 ? Background::decode : Background::inf;
        return Images{unproject(depth),
                      unproject(depth, {.space = space, .channels = channels, .background = background})};
    });
    run("normals", [&] {
        return Images{normals(depth), normals(depth, {.space = space, .channels = channels}),
                      index % 4 == 2 ? normals(depth, {.noise = 1e-3}) : Image{},
                      index % 4 == 3 ? normals(depth, {.method = NormalMethod::least_squares}) : Image{}};
    });
    run("ssao", [&] {
        SsaoOptions options{
            .sampling = Sampling{.quality = quality}, .bent_normal = index % 2 == 1, .confidence = index % 4 == 1};
        const Occlusion open = ssao(depth, 0.75, options);
        options.falloff = index % 3 == 0 ? 0.25 : 0;
        options.border = index % 3 == 1 && straight ? Border::clamp : Border::open;
        std::get<Sampling>(options.sampling).half_resolution = index % 3 == 2;
        options.normals_space = space;
        switch (index % 5) {
        case 0:
            options.thickness = Silhouette{};
            break;
        case 1:
            options.thickness = Image::from_host(device, Element::f32, constant.data(), {width, height});
            break;
        case 2:
            options.thickness = depth_behind;
            break;
        case 3:
            options.normals = normals(depth, {.space = space});
            break;
        default:
            options.thickness = std::numeric_limits<double>::infinity();
        }
        const Occlusion other = ssao(depth, 0.75, options);
        return Images{open.visibility,  open.bent_normal,  open.confidence,
                      other.visibility, other.bent_normal, other.confidence};
    });
    run("dof_masks", [&] {
        const DofMasks masks = dof_masks(depth, lens,
                                         {.near_weight = true,
                                          .far_weight = true,
                                          .max_near_coc = straight,
                                          .near_alpha = straight,
                                          .disocclusion = straight,
                                          .mixed_pixels = straight});
        return Images{masks.coc,        masks.near_weight,  masks.far_weight,  masks.max_near_coc,
                      masks.near_alpha, masks.disocclusion, masks.mixed_pixels};
    });
    run("dof", [&] {
        if (!straight &&
            (scene.camera.lens->law != LensLaw::brown || circle_deformation(scene.camera) > dof_shape_error))
            return Images{};
        const Aperture apertures[] = {
            {}, {.blades = 6, .rotation_degrees = 15}, {.rotation_degrees = 30, .ratio = 0.5}};
        DofOptions options{.aperture = apertures[index / 2 % 3], .quality = quality};
        if (index % 5 == 1)
            options.clean_plate = CleanPlate{picture_behind, depth_behind};
        return Images{dof(depth, picture, lens, options)};
    });
    run("fog", [&] {
        FogOptions options{.density = 0.02};
        if (index % 2 == 1) {
            options.height_falloff = 0.125;
            options.sky = index % 4 == 1 ? FogSky::keep : FogSky::fog;
            options.alpha = index % 4 == 3 ? FogAlpha::straight : FogAlpha::premultiplied;
        }
        return Images{fog(depth, picture, options)};
    });
    return all;
}

/// Bands of rows, which a budget asks for.
void add_bands(std::map<std::string, Values>& all, const Device& banded, const Scene& scene) {
    const StoredDepth depth = scene.on(banded);
    compile_for("ssao");
    add(all["ssao"], ssao(depth, 0.05, {.sampling = Sampling{.quality = Quality::fast}}).visibility);
    compile_for("dof");
    add(all["dof"], dof(depth, scene.picture(banded), {.k = 2, .g = 10}, {.quality = Quality::fast}));
}

/// `banded`: the same device with a memory budget.
void write_results(const Device& device, const Device& banded, const std::string& path, int scenes, int largest) {
    std::ofstream file(path, std::ios::binary);
    std::mt19937 random(7);
    const std::vector<Lensed> through = lenses();
    for (int index = 0; index < straight_scenes + static_cast<int>(through.size()); ++index) {
        const unsigned columns = index < main_scenes ? 161 : 40, rows = index < main_scenes ? 121 : 30;
        int width = index == 0 ? 161 : 1 + static_cast<int>(random() % columns),
            height = index == 0 ? 121 : 1 + static_cast<int>(random() % rows);
        if (index >= straight_scenes) {
            const Lensed& lensed = through[static_cast<std::size_t>(index - straight_scenes)];
            width = lensed.width;
            height = lensed.height;
        }
        width = std::min(largest, width);
        height = std::min(largest, height);
        if (index >= scenes && index < main_scenes)
            continue;
        auto all = results_of(device, index, scene(index, width, height));
        if (index == 0 && width > 100) // not on a simulated device
            add_bands(all, banded, scene(0, 161, 600));
        for (const auto& [name, values] : all) {
            const std::uint64_t count = values.numbers.size();
            file << name << ' ' << index << ' ' << width << ' ' << height << ' ' << count << ' ' << values.step << '\n';
            file.write(reinterpret_cast<const char*>(values.numbers.data()),
                       static_cast<std::streamsize>(count * sizeof(float)));
        }
    }
    file.close();
    if (!file)
        throw Error("cannot write " + path);
    for (const auto& [kernel, seconds] : compile_seconds())
        std::cout << "compile\t" << kernel.first << '\t' << kernel.second << '\t' << seconds << '\n';
}

struct Record {
    std::string name;
    std::array<int, 3> scene{}; ///< its number, width and height
    Values values;
};

std::vector<Record> read_results(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<Record> records;
    std::string line;
    while (std::getline(file, line)) {
        std::istringstream fields(line);
        Record record;
        std::uint64_t count = 0;
        fields >> record.name;
        for (int& each : record.scene)
            fields >> each;
        fields >> count >> record.values.step;
        record.values.numbers.resize(count);
        file.read(reinterpret_cast<char*>(record.values.numbers.data()),
                  static_cast<std::streamsize>(count * sizeof(float)));
        if (!fields || !file)
            throw Error(path + " is damaged");
        records.push_back(std::move(record));
    }
    if (records.empty())
        throw Error(path + " holds no results");
    return records;
}

/// Counts from the least number to the greatest.
std::int64_t place_of(float value) {
    const auto bits = std::bit_cast<std::int32_t>(value);
    return bits < 0 ? -static_cast<std::int64_t>(bits & 0x7fffffff) : bits;
}

struct Differences {
    std::size_t values = 0;
    std::size_t different = 0; ///< have other bits; NaN is NaN
    std::size_t unequal = 0;   ///< are other numbers, or a number on one device only
    std::int64_t ulp = 0;      ///< the largest difference between two numbers
    double largest = 0;        ///< the largest difference, less the step of halves and codes
};

/// The distances of a scene's pixels, which positions have: of each value of `record`, its pixel's.
std::vector<double> distances(const std::vector<Record>& records, const Record& record) {
    const auto positions = std::ranges::find_if(
        records, [&](const Record& each) { return each.name == "unproject" && each.scene == record.scene; });
    const auto pixels = static_cast<std::size_t>(record.scene[1]) * static_cast<std::size_t>(record.scene[2]);
    const std::size_t first = std::min(3 * pixels, record.values.numbers.size()); // of two images of positions
    std::vector<double> of_values;
    for (std::size_t k = 0; k < record.values.numbers.size(); ++k) {
        const std::size_t channels = record.name == "linearize" ? 1
                                     : k < first                ? 3
                                                                : (record.values.numbers.size() - first) / pixels,
                          pixel = (k < first ? k : k - first) / channels;
        of_values.push_back(
            Eigen::Map<const Eigen::Vector3f>(&positions->values.numbers[3 * pixel]).cast<double>().norm());
    }
    return of_values;
}

/// Does an operation keep to what a device may differ by whose arithmetic is not exact? Empty where no bound is stated.
std::string within_class(const std::string& operation, const Differences& found, bool through_lens) {
    static const std::map<std::string, double> largest{{"normals", inexact::normals_error},
                                                       {"ssao", inexact::ssao_error},
                                                       {"dof_masks", inexact::dof_masks_error},
                                                       {"dof", inexact::dof_error},
                                                       {"fog", inexact::fog_error}};
    static const std::map<std::string, double> ulps{{"linearize", inexact::linearize_ulp},
                                                    {"unproject", inexact::unproject_ulp}};
    if (through_lens && (operation == "normals" || operation == "ssao"))
        return "";
    const bool within = !ulps.contains(operation) ? found.largest <= largest.at(operation)
                        : through_lens            ? found.largest <= inexact::distance_error_through_lens
                                                  : static_cast<double>(found.ulp) <= ulps.at(operation);
    return within ? "within" : "beyond";
}

void compare(const std::string& path, const std::string& reference) {
    const auto found = read_results(path), right = read_results(reference);
    std::map<std::string, Differences> all, through_lenses;
    if (found.size() != right.size())
        throw Error(path + " and " + reference + " have another number of results");
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (found[i].name != right[i].name || found[i].scene != right[i].scene ||
            found[i].values.numbers.size() != right[i].values.numbers.size())
            throw Error(path + " and " + reference + " are of different scenes");
        const bool through_lens = found[i].scene[0] >= straight_scenes;
        Differences& so_far = (through_lens ? through_lenses : all)[found[i].name];
        const bool of_distance = through_lens && (found[i].name == "linearize" || found[i].name == "unproject");
        const std::vector<double> distance = of_distance ? distances(right, right[i]) : std::vector<double>();
        so_far.values += found[i].values.numbers.size();
        for (std::size_t k = 0; k < found[i].values.numbers.size(); ++k) {
            const float a = found[i].values.numbers[k], b = right[i].values.numbers[k];
            if (std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b) || (std::isnan(a) && std::isnan(b)))
                continue;
            ++so_far.different;
            so_far.unequal += a != b;
            if (a == b) // 0 of either sign
                continue;
            if (!std::isfinite(a) || !std::isfinite(b)) { // a number on one device only
                so_far.ulp = std::numeric_limits<std::int32_t>::max();
                so_far.largest = std::numeric_limits<double>::infinity();
                continue;
            }
            so_far.ulp = std::max(so_far.ulp, std::abs(place_of(a) - place_of(b)));
            const double difference =
                std::abs(static_cast<double>(a) - static_cast<double>(b)) / (of_distance ? distance[k] : 1);
            so_far.largest = std::max(so_far.largest, difference - found[i].values.step);
        }
    }
    const auto print = [](const char* kind, const std::string& name, const Differences& d, const std::string& verdict) {
        std::cout << kind << '\t' << name << '\t' << d.values << '\t' << d.different << '\t' << d.unequal << '\t'
                  << d.ulp << '\t' << d.largest << '\t' << verdict << '\n';
    };
    for (const auto& [name, d] : all)
        print("bits", name, d, within_class(name, d, false));
    for (const auto& [name, d] : through_lenses)
        print("lens", name, d, within_class(name, d, true));
}

/// The median of several runs, in seconds. The first one compiles and is not counted.
double seconds_of(const Device& device, int runs, const std::function<void()>& action) {
    std::vector<double> times;
    for (int run = 0; run <= runs; ++run) {
        const double start = seconds_now();
        action();
        device.finish();
        times.push_back(seconds_now() - start);
    }
    times.erase(times.begin());
    std::ranges::nth_element(times, times.begin() + runs / 2);
    return times[static_cast<std::size_t>(runs / 2)];
}

void time_operations(const Device& device, int width, int height) {
    constexpr int runs = 5;
    const Scene large = scene(0, width, height);
    const StoredDepth depth = large.on(device);
    const Image picture = large.picture(device);
    const std::size_t bytes = large.depth.size();
    const Image to(device, Element::f32, {width, height});
    const double copy = seconds_of(device, 4 * runs, [&] {
        if (clEnqueueCopyBuffer(device.queue(), depth.image.buffer(), to.buffer(), 0, 0, bytes, 0, nullptr, nullptr) !=
            CL_SUCCESS)
            throw Error("the device cannot copy");
    });
    std::cout << "copy\t" << copy * 1e3 << '\n';
    const CircleOfConfusion lens = lens_of(large.camera);
    const Image three(device, Element::f32, {width, height, 3});
    const DofMasksOptions weights{.near_weight = true, .focus_weight = true, .far_weight = true};
    const DofMasks masks = dof_masks(depth, lens, weights);
    const double radius = 0.05 * 4; // a twentieth of what the camera sees
    const std::pair<const char*, std::function<void()>> operations[] = {
        {"linearize", [&] { linearize(depth, to); }},
        {"unproject", [&] { unproject(depth, three); }},
        {"normals", [&] { normals(depth, three); }},
        {"ssao", [&] { ssao(depth, radius); }},
        {"dof_masks", [&] { dof_masks(depth, masks, lens, weights); }},
        {"dof", [&] { dof(depth, picture, three, lens); }},
        {"fog", [&] { fog(depth, picture, three, {.density = 0.02}); }},
    };
    for (const auto& [name, action] : operations) {
        const double seconds = seconds_of(device, runs, action);
        std::cout << "time\t" << name << '\t' << seconds * 1e3 << '\t' << seconds / copy << std::endl;
    }
}

std::string driver_version(const Device& device) {
    char version[256] = {};
    clGetDeviceInfo(device.id(), CL_DRIVER_VERSION, sizeof version - 1, version, nullptr);
    return version;
}

int number_or(const char* text, int otherwise) {
    return text ? std::atoi(text) : otherwise;
}

} // namespace

int main(int count, char* arguments[]) {
    const auto argument = [&](int index) { return index < count ? arguments[index] : nullptr; };
    try {
        const std::string what = argument(1) ? argument(1) : "";
        if (what == "compare" && count == 4) {
            compare(argument(2), argument(3));
            return 0;
        }
        const char* const wanted = std::getenv("DEVICE");
        const char* const sums = std::getenv("ARITHMETIC");
        DeviceOptions options{.arithmetic = sums && std::string(sums) == "two_float" ? Arithmetic::two_float
                                                                                     : Arithmetic::automatic};
        const std::string name = wanted ? wanted : "cpu";
        const Device device = Device::open(name, options);
        options.memory_budget = std::size_t{5} << 20; // the least of these bands
        std::cout << "device\t" << device.info().name << '\t' << device.info().version << '\t'
                  << device.options().vector_width << '\t' << driver_version(device) << '\n';
        if (what == "results" && argument(2)) {
            std::cout << "probe\t" << to_string(probe_arithmetic(device)) << std::endl;
            std::cout << "sums\t" << (device.options().arithmetic == Arithmetic::fp64 ? "fp64" : "two_float") << '\n';
            write_results(device, Device::open(name, options), argument(2), number_or(argument(3), main_scenes),
                          number_or(argument(4), 161));
        } else if (what == "times") {
            time_operations(device, number_or(argument(2), 1920), number_or(argument(3), 1080));
        } else {
            throw Error(
                "usage: device_report results FILE [SCENES [LARGEST]] | compare FILE REFERENCE | times [WIDTH HEIGHT]");
        }
    } catch (const std::exception& error) {
        std::cerr << "device_report: " << error.what() << '\n';
        return 1;
    }
}

// The same bits for every vector width, group size, sub-image and region, in place or not; and nothing written
// beside the destination.

#include "catch.hpp"
#include "judge.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using oracle::Subject;

namespace {

constexpr int vector_widths[] = {1, 4, 8, 16};
const std::vector<int> group_sizes{1, 7, 64, 256}, few_group_sizes{7, 64}; // each is another build of the kernel
constexpr std::uint32_t guard = 0x7fa5a5a5;                                // a NaN that no kernel makes

const Device& device(Arithmetic arithmetic, int vector_width, int group_size) {
    static std::map<std::tuple<Arithmetic, int, int>, Device> devices;
    const auto found = devices.find({arithmetic, vector_width, group_size});
    if (found != devices.end())
        return found->second;
    return devices[{arithmetic, vector_width, group_size}] =
               Device::open("cpu", {arithmetic, vector_width, group_size});
}

/// A rectangle of elements within memory that is full of guards.
template <typename Element>
struct Guarded {
    std::vector<Element> memory;
    std::size_t start, stride, row_elements;
    int rows;

    Guarded(int width, int height, int channels, std::size_t start_, std::size_t padding)
        : start(start_), stride(static_cast<std::size_t>(width * channels) + padding),
          row_elements(static_cast<std::size_t>(width * channels)), rows(height) {
        memory.resize(start + stride * static_cast<std::size_t>(height) + 64);
        for (std::size_t i = 0; i < memory.size(); ++i) {
            const std::uint32_t bits = guard;
            std::memcpy(&memory[i], &bits, sizeof(Element));
        }
    }
    Element* row(int y) { return memory.data() + start + stride * static_cast<std::size_t>(y); }

    bool guards_hold() const {
        for (std::size_t i = 0; i < memory.size(); ++i) {
            const bool inside = i >= start && (i - start) / stride < static_cast<std::size_t>(rows) &&
                                (i - start) % stride < row_elements;
            const std::uint32_t bits = guard;
            if (!inside && std::memcmp(&memory[i], &bits, sizeof(Element)) != 0)
                return false;
        }
        return true;
    }
    std::vector<Element> packed() const {
        std::vector<Element> values;
        for (int y = 0; y < rows; ++y) {
            const auto first =
                memory.begin() + static_cast<std::ptrdiff_t>(start + stride * static_cast<std::size_t>(y));
            values.insert(values.end(), first, first + static_cast<std::ptrdiff_t>(row_elements));
        }
        return values;
    }
};

std::vector<Subject> subjects() {
    const auto plain = oracle::from_field_of_view(1.1, 1.5, {0.1, 1e6});
    Subject logarithmic = oracle::named(plain, "exponential");
    logarithmic.camera.encoding = Encoding::logarithmic;
    logarithmic.camera.far_plane = 1e4;
    Subject ray_distance = oracle::named(plain, "ray distance");
    ray_distance.camera.encoding = Encoding::ray_distance;
    Subject inverse_ray_distance = oracle::named(plain, "inverse-ray-distance");
    inverse_ray_distance.camera.encoding = Encoding::inverse;
    inverse_ray_distance.camera.along = Along::ray;
    inverse_ray_distance.camera.missing = -1;
    inverse_ray_distance.camera.background_from = 1e-6;
    return {
        oracle::named(plain, "reciprocal"),
        oracle::named(with_oblique_near_plane(plain, {0.3, 0.2, -1, -0.2}), "reciprocal-affine"),
        oracle::named(
            with_oblique_near_plane(oracle::from_orthographic({-5, 7, -4, 3}, {-3, 100}), {0.3, -0.2, -1, -2}),
            "affine"),
        oracle::named(oracle::from_matrix(oracle::tilted(oracle::perspective_matrix(0.7, 0.5, 0.1, 100), 0.2, -0.1)),
                      "rational"),
        logarithmic,
        ray_distance,
        inverse_ray_distance};
}

template <typename Element>
bool same_memory(const std::vector<Element>& a, const std::vector<Element>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Element)) == 0;
}

/// Results: nobody promises a NaN's sign and payload, and on SSE2 they depend on the vector width.
bool same(const std::vector<float>& a, const std::vector<float>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
        return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y) || (std::isnan(x) && std::isnan(y));
    });
}

/// Fills a rectangle with a patch's stored values, of which some are background, NaN, −0, denormal or infinite.
void fill(Guarded<float>& target, const Subject& subject, const oracle::Patch& patch) {
    std::mt19937 random(5);
    const oracle::Truth truth(subject, Storage::float32);
    auto values = oracle::stored_values(subject, truth, patch, random);
    const float special[] = {1.0f, std::numeric_limits<float>::quiet_NaN(), -0.0f, 1e-40f, INFINITY, -1.0f, 0.0f};
    for (std::size_t i = 0; i < values.size(); i += 11)
        values[i] = special[i / 11 % std::size(special)];
    for (int y = 0; y < patch.height; ++y)
        std::copy_n(values.begin() + y * patch.width, patch.width, target.row(y));
}

Image source_on(const Device& device, Guarded<float>& memory, int width) {
    return Image::from_host(device, Element::f32, memory.row(0), {width, memory.rows, 1, memory.stride});
}

} // namespace

TEST_CASE("same bits: linearize, whatever the vector width, the groups, the strides and the offsets", "[same-bits]") {
    const std::array<std::pair<int, int>, 9> sizes{
        {{1, 1}, {1, 9}, {37, 1}, {3, 5}, {7, 4}, {15, 3}, {17, 6}, {64, 2}, {131, 7}}};
    std::mt19937 random(17);
    std::uniform_int_distribution<std::size_t> odd(0, 9);
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        for (const Subject& subject : subjects()) {
            for (const auto& [width, height] : sizes) {
                const oracle::Patch patch{4099, 8191, width, height};
                std::vector<float> first;
                for (const int vector_width : vector_widths) {
                    for (const int group_size : arithmetic == oracle::widest() ? group_sizes : few_group_sizes) {
                        INFO(subject.name << ", " << oracle::name(arithmetic) << ", " << width << " x " << height
                                          << ", vector width " << vector_width << ", groups of " << group_size);
                        const Device& on = device(arithmetic, vector_width, group_size);
                        Guarded<float> in(width, height, 1, 1 + odd(random), odd(random));
                        Guarded<float> out(width, height, 1, 1 + odd(random), odd(random));
                        fill(in, subject, patch);
                        const StoredDepth stored{source_on(on, in, width), subject.camera, Storage::float32, patch.x,
                                                 patch.y};
                        const Image result =
                            Image::onto_host(on, Element::f32, out.row(0), {width, height, 1, out.stride});
                        const auto before = in.memory;
                        linearize(stored, result);
                        result.download(out.row(0), out.stride);
                        const auto bits = out.packed();
                        if (first.empty())
                            first = bits;
                        REQUIRE(same(bits, first));
                        REQUIRE(out.guards_hold());
                        REQUIRE(same_memory(before, in.memory));

                        linearize(stored, stored.image);
                        stored.image.download(in.row(0), in.stride);
                        REQUIRE(same(in.packed(), first));
                        REQUIRE(in.guards_hold());
                    }
                }
            }
        }
    }
}

TEST_CASE("same bits: unproject, whatever the vector width, the groups, the strides and the offsets", "[same-bits]") {
    const std::array<std::pair<int, int>, 6> sizes{{{1, 1}, {1, 9}, {37, 1}, {7, 4}, {17, 3}, {67, 5}}};
    std::mt19937 random(18);
    std::uniform_int_distribution<std::size_t> odd(0, 9);
    const auto all = subjects();
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        for (const Subject& subject : {all.front(), all[2], all[3]}) {
            for (const int channels : {3, 4}) {
                for (const auto& [width, height] : sizes) {
                    const oracle::Patch patch{4099, 8191, width, height};
                    std::vector<float> first;
                    for (const int vector_width : vector_widths) {
                        for (const int group_size :
                             channels == 3 && subject.name == "reciprocal" ? group_sizes : few_group_sizes) {
                            INFO(subject.name << ", " << oracle::name(arithmetic) << ", " << width << " x " << height
                                              << ", vector width " << vector_width << ", groups of " << group_size
                                              << ", " << channels << " channels");
                            const Device& on = device(arithmetic, vector_width, group_size);
                            Guarded<float> in(width, height, 1, 1 + odd(random), odd(random));
                            Guarded<float> out(width, height, channels, 1 + odd(random), odd(random));
                            fill(in, subject, patch);
                            const Image result =
                                Image::onto_host(on, Element::f32, out.row(0), {width, height, channels, out.stride});
                            unproject({source_on(on, in, width), subject.camera, Storage::float32, patch.x, patch.y},
                                      result, {.channels = channels});
                            result.download(out.row(0), out.stride);
                            const auto bits = out.packed();
                            if (first.empty())
                                first = bits;
                            REQUIRE(same(bits, first));
                            REQUIRE(out.guards_hold());
                        }
                    }
                }
            }
        }
    }
}

TEST_CASE("same bits: a region of the whole, of any storage", "[same-bits]") {
    const int width = 203, height = 37;
    std::mt19937 random(19);
    for (const Storage storage : {Storage::float32, Storage::float16, Storage::uint8, Storage::uint16, Storage::uint24,
                                  Storage::uint24_high, Storage::rgb8_red_low}) {
        for (Subject subject : subjects()) {
            if (storage != Storage::float32 && subject.name != "reciprocal" && subject.name != "rational")
                continue;
            subject.camera.width = width;
            subject.camera.height = height;
            const auto elements = static_cast<std::size_t>(width * height * channels_of(storage));
            std::vector<std::uint8_t> codes(elements * element_bytes(element_of(storage)));
            for (auto& byte : codes)
                byte = static_cast<std::uint8_t>(random());
            for (const int vector_width : {1, 16}) {
                const Device& on = device(oracle::widest(), vector_width, 64);
                const StoredDepth whole{
                    Image::from_host(on, element_of(storage), codes.data(), {width, height, channels_of(storage)}),
                    subject.camera, storage};
                std::vector<float> all(static_cast<std::size_t>(width * height));
                std::vector<float> positions(3 * all.size());
                linearize(whole).image.download(all.data());
                unproject(whole).download(positions.data());
                for (const auto& [x, y, w, h] : {std::array{0, 0, 1, 1},
                                                 {3, 5, 1, 30},
                                                 {1, 36, 201, 1},
                                                 {101, 7, 5, 9},
                                                 {77, 3, 126, 31},
                                                 {13, 2, 33, 17}}) {
                    const StoredDepth part = whole.region(x, y, w, h);
                    std::vector<float> depth(static_cast<std::size_t>(w * h)), points(3 * depth.size());
                    linearize(part).image.download(depth.data());
                    unproject(part).download(points.data());
                    for (int row = 0; row < h; ++row) {
                        const auto there = static_cast<std::size_t>((y + row) * width + x),
                                   here = static_cast<std::size_t>(row * w), count = static_cast<std::size_t>(w);
                        INFO(subject.name << ", " << to_string(storage) << ", vector width " << vector_width
                                          << ", region " << x << ", " << y << ", " << w << " x " << h);
                        REQUIRE(std::memcmp(&all[there], &depth[here], 4 * count) == 0);
                        REQUIRE(std::memcmp(&positions[3 * there], &points[3 * here], 12 * count) == 0);
                    }
                }
            }
        }
    }
}

// Results above 16 MiB are written past the cache where their rows allow it: through other instructions.
TEST_CASE("same bits: large aligned results, which are written past the cache", "[same-bits]") {
    const int width = 2048, height = 2049;
    const Subject subject = oracle::named(oracle::from_field_of_view(1.1, 1.5, {0.1, 1e6}), "large", width, height);
    std::vector<float> values(static_cast<std::size_t>(width) * height);
    std::mt19937 random(20);
    for (float& value : values)
        value = static_cast<float>(random() >> 8) * 0x1p-24f;
    std::vector<float> first, first_positions;
    for (const int vector_width : vector_widths) {
        const Device& on = device(oracle::widest(), vector_width, 64);
        const StoredDepth stored{Image::from_host(on, Element::f32, values.data(), {width, height}), subject.camera};
        std::vector<float> depth(values.size()), positions(3 * values.size());
        linearize(stored).image.download(depth.data());
        unproject(stored).download(positions.data());
        if (first.empty()) {
            first = depth;
            first_positions = positions;
        }
        CHECK(same(depth, first));
        CHECK(same(positions, first_positions));
    }
}

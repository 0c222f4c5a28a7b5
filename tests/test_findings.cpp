// What an image holds and what a camera makes of it, against numbers counted by hand and formulas of the standard form.
#include "catch.hpp"

#include <fathom/findings.hpp>

using namespace fathom;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

template <typename Element>
HostDepth host(const std::vector<Element>& values, int width, Storage storage, int channels = 1) {
    const std::size_t row = static_cast<std::size_t>(width * channels);
    return {values.data(), width, static_cast<int>(values.size() / row), row * sizeof(Element), storage};
}

// 1/z runs from 1/0.5 at 0 to 1/100 at 1.
Camera camera_of(int width, int height) {
    return {.projection = perspective(1.0, 1.5, {0.5, 100}), .width = width, .height = height};
}

double depth_of(double stored) {
    return 1 / (2 + stored * (0.01 - 2));
}

} // namespace

TEST_CASE("findings: stored values are counted and ranked", "[findings]") {
    std::vector<float> values{not_a_number, infinity, -infinity, 0, 1};
    for (int i = 1; i <= 95; ++i)
        values.push_back(static_cast<float>(i) / 128);
    const StoredStatistics found = stored_statistics(host(values, 10, Storage::float32));
    CHECK(found.pixels == 100);
    CHECK((found.nan == 1 && found.inf == 1 && found.minus_inf == 1));
    CHECK((found.at_zero == 1 && found.at_largest == 1));
    CHECK((found.min == 0 && found.max == 1));
    // Finite values in order: 0, 1/128 … 95/128, 1. Nearest rank of P % is the value number ceil(97 P / 100).
    CHECK(found.percentiles == std::array{0.0, 4 / 128.0, 24 / 128.0, 48 / 128.0, 72 / 128.0, 92 / 128.0, 1.0});
    const StoredStatistics none = stored_statistics(host(std::vector{not_a_number}, 1, Storage::float32));
    CHECK((std::isnan(none.min) && std::isnan(none.percentiles[3]) && none.pixels == 1));
}

TEST_CASE("findings: every storage is read as its codes say, rows apart or not", "[findings]") {
    const std::vector<std::uint8_t> bytes{0x56, 0x34, 0x12, 0, 0, 0, 0xff, 0xff, 0xff, 9, 9, 9}; // a last column aside
    for (const auto& [storage, code] : {std::pair{Storage::rgb8_red_low, 0x123456},
                                        {Storage::rgb8_red_high, 0x563412},
                                        {Storage::bgr8_red_low, 0x563412},
                                        {Storage::bgr8_red_high, 0x123456}}) {
        const StoredStatistics found = stored_statistics(host(bytes, 4, storage, 3));
        CHECK((found.pixels == 4 && found.at_zero == 1 && found.at_largest == 1));
        const HostDepth first{bytes.data(), 1, 1, 3, storage};
        CHECK(stored_statistics(first).max == code);
    }
    const std::vector<std::uint32_t> words{0xab000001, 0xab000002, 0x12345678, 0x00ffffff};
    HostDepth first_column{words.data(), 1, 2, 2 * sizeof(std::uint32_t), Storage::uint24};
    CHECK((stored_statistics(first_column).min == 1 && stored_statistics(first_column).max == 0x345678));
    first_column.storage = Storage::uint24_high;
    CHECK((stored_statistics(first_column).min == 0x123456 && stored_statistics(first_column).max == 0xab0000));
    const std::vector<std::uint16_t> halves{0x3c00, 0x4000, 0x7c00, 0x7e00};
    const StoredStatistics half = stored_statistics(host(halves, 2, Storage::float16));
    CHECK((half.min == 1 && half.max == 2 && half.inf == 1 && half.nan == 1));
    CHECK(stored_statistics(host(halves, 2, Storage::uint16)).max == 0x7e00);
}

TEST_CASE("findings: a camera's range, background and surfaces", "[findings]") {
    const std::vector<std::uint16_t> codes{65535, 0, 100, 200, 300, 65535};
    const HostDepth stored = host(codes, 3, Storage::uint16);
    const std::vector<float> depth{infinity, 4, 2, 8, not_a_number, infinity}; // not what linearize gives, on purpose
    const CameraFindings found = camera_findings(camera_of(3, 2), stored, depth);
    CHECK(found.form.form == Form::reciprocal);
    CHECK(found.background == 2);
    REQUIRE(found.invalid);
    CHECK(*found.invalid == 1);
    CHECK(found.bits == DepthBits::d16);
    REQUIRE(found.range.size() == 3);
    const double codes_of_range[] = {0, 32767, 65535};
    for (std::size_t i = 0; i < 3; ++i) {
        CHECK(found.range[i].name == std::string(std::array{"near", "middle", "far"}[i]));
        CHECK(found.range[i].stored == codes_of_range[i]);
        CHECK(found.range[i].z == Approx(depth_of(codes_of_range[i] / 65535)));
    }
    REQUIRE(found.surfaces.size() == 3);
    const std::array<SurfacePoint, 3> expected{
        {{"nearest", 2, 2.5, 0.5, {}, {}}, {"middle", 4, 1.5, 0.5, {}, {}}, {"farthest", 8, 0.5, 1.5, {}, {}}}};
    for (std::size_t i = 0; i < 3; ++i) {
        const SurfacePoint& point = found.surfaces[i];
        CHECK(point.name == std::string(expected[i].name));
        CHECK((point.z == expected[i].z && point.x == expected[i].x && point.y == expected[i].y));
        CHECK(point.spacing == depth_spacing(found.camera, DepthBits::d16, point.x, point.y, point.z));
        CHECK(point.error_bound == depth_error_bound(found.camera, DepthBits::d16, point.x, point.y, point.z));
    }
    CHECK(found.attainable[2].place == std::string("centre"));
    CHECK(found.attainable[2].z == Approx(100));

    const CameraFindings not_decoded = camera_findings(camera_of(3, 2), stored);
    CHECK((!not_decoded.invalid && not_decoded.surfaces.empty() && not_decoded.range.size() == 3));
    const CameraFindings no_surface = camera_findings(camera_of(3, 2), stored, std::vector<float>(6, not_a_number));
    CHECK((no_surface.invalid == std::size_t{6} && no_surface.surfaces.empty()));
    CHECK_THROWS_AS(camera_findings(camera_of(2, 2), stored), std::invalid_argument);
    CHECK_THROWS_AS(camera_findings(camera_of(3, 2), stored, std::vector<float>(5)), std::invalid_argument);
}

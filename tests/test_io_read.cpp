// Depth out of PNG, TIFF, PFM and PGM: which types are depth, and that their values come back untouched.
#include "io_files.hpp"
#include "matrices.hpp"
#include "real_inputs.hpp"

#include <fathom/io.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

fs::path encoded(const fs::path& file, const cv::Mat& image) {
    Bytes bytes;
    REQUIRE(cv::imencode(file.extension().string(), image, bytes));
    return put(file, bytes);
}

/// An uncompressed grey TIFF, 3 × 2, in either byte order. `format`: 1 unsigned, 2 signed, 3 float, 0 not said.
Bytes tiff(bool little, unsigned bits, unsigned format, const std::vector<std::uint32_t>& codes) {
    Bytes bytes{static_cast<unsigned char>(little ? 'I' : 'M'), static_cast<unsigned char>(little ? 'I' : 'M')};
    const auto put_number = [&](std::uint32_t value, unsigned size) {
        for (unsigned i = 0; i < size; ++i)
            bytes.push_back(static_cast<unsigned char>(value >> 8 * (little ? i : size - 1 - i)));
    };
    std::vector<std::array<std::uint32_t, 2>> tags{{256, 3}, {257, 2}, {258, bits}, {259, 1},           {262, 1},
                                                   {273, 0}, {277, 1}, {278, 2},    {279, 6 * bits / 8}};
    if (format)
        tags.push_back({339, format});
    const auto pixels = static_cast<std::uint32_t>(8 + 2 + 12 * tags.size() + 4);
    put_number(42, 2);
    put_number(8, 4);
    put_number(static_cast<std::uint32_t>(tags.size()), 2);
    for (const auto& [tag, value] : tags) {
        put_number(tag, 2);
        const bool is_short = tag != 273 && tag != 279;
        put_number(is_short ? 3 : 4, 2);
        put_number(1, 4);
        put_number(tag == 273 ? pixels : value, is_short ? 2 : 4);
        if (is_short)
            put_number(0, 2);
    }
    put_number(0, 4);
    for (const auto code : codes)
        put_number(code, bits / 8);
    return bytes;
}

} // namespace

TEST_CASE("read: 16-bit PNG, TIFF and PGM keep their codes", "[io]") {
    const TempFolder folder;
    cv::Mat codes(7, 5, CV_16UC1);
    cv::randu(codes, 0, 65536);
    for (const std::string name : {"a.png", "a.tif", "a.pgm"}) {
        const auto depth = read_depth(encoded(folder / name, codes));
        CHECK(depth.storage == Storage::uint16);
        CHECK(depth.channel.empty());
        CHECK(same(depth.values, codes));
    }
}

TEST_CASE("read: codes that do not count to 65535 are refused", "[io]") {
    const TempFolder folder;
    check_says([&] { read_depth(put(folder / "a.pgm", std::string("P5\n1 1\n4095\n\1\2"))); },
               {"a.pgm: ", "counts to 4095"});
    check_says(
        [&] {
            read_depth(put(folder / "a.tif", tiff(true, 12, 1, {0, 0, 0, 0, 0, 0, 0, 0, 0})));
        },
        {"a.tif: ", "samples of 12 bits"});
    for (const char* text : {"P5\n1 1\n0\n\1", "P5\n1 1\n70000\n\1\2", "P2\n1 1\n70000\n8"})
        check_says([&] { read_depth(put(folder / "a.pgm", std::string(text))); },
                   {"a.pgm: ", "a grey map counts to 1 to 65535"});
    for (const std::string text : {"P2\n2 1\n100\n7 101", "P5\n2 1\n100\n\7\145"})
        check_says([&] { read_depth(put(folder / "a.pgm", text), {.as_counted = true}); },
                   {"a.pgm: ", "a code is 101, beyond the largest"});
}

TEST_CASE("read: the content decides, not the extension", "[io]") {
    const TempFolder folder;
    cv::Mat codes(7, 5, CV_16UC1, cv::Scalar(7));
    fs::rename(encoded(folder / "a.png", codes), folder / "a.exr");
    CHECK(same(read_depth(folder / "a.exr").values, codes));
}

TEST_CASE("read: float PFM in both byte orders, its scale and its comments ignored, row 0 on top", "[io]") {
    const TempFolder folder;
    const float values[] = {1, 2, 3, 4, 5, 6}; // the file's first row is the lowest
    const cv::Mat expected = (cv::Mat_<float>(3, 2) << 5, 6, 3, 4, 1, 2);
    for (const bool little : {true, false}) {
        const std::string header = std::string("Pf\n# written by hand\n2 3\n") + (little ? "-0.25\n" : "4\n");
        Bytes bytes(header.begin(), header.end());
        for (const float value : values) {
            auto raw = std::bit_cast<std::array<unsigned char, 4>>(value);
            if (little != (std::endian::native == std::endian::little))
                std::reverse(raw.begin(), raw.end());
            bytes.insert(bytes.end(), raw.begin(), raw.end());
        }
        const auto depth = read_depth(put(folder / "a.pfm", bytes));
        CHECK(depth.storage == Storage::float32);
        CHECK(same(depth.values, expected));
    }
}

TEST_CASE("read: TIFF of unsigned and signed 32-bit codes, floats and halves, in both byte orders", "[io]") {
    const TempFolder folder;
    const std::vector<std::uint32_t> codes{0, 1, 0xffffff, 0x123456, 2, 3};
    const std::vector<std::uint32_t> high{0, 0x100, 0xffffff00, 0x12345678, 2, 3};
    const std::vector<std::uint32_t> halves{0x3c00, 0x4000, 0x7c00, 0x7e00, 1, 0x3555};
    for (const bool little : {true, false}) {
        for (const unsigned format : {1u, 2u}) {
            const auto depth = read_depth(put(folder / "a.tif", tiff(little, 32, format, codes)));
            CHECK(depth.storage == Storage::uint24);
            REQUIRE(depth.values.type() == CV_32SC1);
            CHECK(std::equal(codes.begin(), codes.end(), depth.values.ptr<std::uint32_t>()));
        }
        const auto file = put(folder / "high.tif", tiff(little, 32, 1, high));
        const auto depth = read_depth(file, {.packing = Packing::uint24_high});
        CHECK(depth.storage == Storage::uint24_high);
        CHECK(std::equal(high.begin(), high.end(), depth.values.ptr<std::uint32_t>()));
        check_says([&] { read_depth(file); }, {"pixel (2, 0) holds 4294967040", "uint24-high"});

        const auto half = read_depth(put(folder / "half.tif", tiff(little, 16, 3, halves)));
        CHECK(half.storage == Storage::float16);
        REQUIRE(half.values.type() == CV_16FC1);
        CHECK(std::equal(halves.begin(), halves.end(), half.values.ptr<std::uint16_t>()));
    }
    const auto unsaid = put(folder / "unsaid.tif", tiff(true, 32, 0, codes));
    check_says([&] { read_depth(unsaid); }, {"SampleFormat"});
    const auto heights =
        read_depth(put(folder / "signed.tif", tiff(true, 16, 2, {0, 1, 0x7fff, 0x8000, 0xd8f1, 0xffff})));
    CHECK(heights.storage == Storage::float32);
    const float expected[] = {0, 1, 32767, -32768, -9999, -1};
    CHECK(std::equal(std::begin(expected), std::end(expected), heights.values.ptr<float>()));
}

TEST_CASE("read: 24 bits packed in R, G, B need the packing, and come back as B, G, R", "[io]") {
    const TempFolder folder;
    const cv::Mat bgr(2, 2, CV_8UC3, cv::Scalar(3, 2, 1));
    const cv::Mat bgra(2, 2, CV_8UC4, cv::Scalar(3, 2, 1, 255));
    for (const auto& image : {bgr, bgra})
        for (const std::string name : {"a.png", "a.tif"}) {
            const auto file = encoded(folder / name, image);
            for (const auto& [packing, storage] : {std::pair{Packing::rgb_red_low, Storage::bgr8_red_low},
                                                   {Packing::rgb_red_high, Storage::bgr8_red_high}}) {
                const auto depth = read_depth(file, {.packing = packing});
                CHECK(depth.storage == storage);
                CHECK(same(depth.values, bgr));
            }
            check_says([&] { read_depth(file); }, {"unsigned 8-bit", "\"packing\""});
        }
}

TEST_CASE("read: images that hold no depth are refused with what would", "[io]") {
    const TempFolder folder;
    const auto refused = [&](const std::string& name, const cv::Mat& image, const ReadOptions& options = {}) {
        const auto file = encoded(folder / name, image);
        return refusal([&] { read_depth(file, options); });
    };
    check_says(refused("a.png", cv::Mat(3, 4, CV_8UC1, cv::Scalar(9))), {"unsigned 8-bit with 1 channel", "16-bit"});
    check_says(refused("a.png", cv::Mat(3, 4, CV_16UC3, cv::Scalar(9))), {"unsigned 16-bit with 3 channels"});
    check_says(refused("a.jpg", cv::Mat(3, 4, CV_8UC3, cv::Scalar(9))), {"is a JPEG, which is not read"});

    check_says(refused("a.pgm", cv::Mat(3, 4, CV_8UC1, cv::Scalar(9))), {"unsigned 8-bit"});
    check_says(refused("a.png", cv::Mat(3, 4, CV_16UC1, cv::Scalar(9)), {.channel = "Z"}), {"no channel \"Z\""});
    for (const auto packing :
         {Packing::uint24, Packing::uint24_high, Packing::rgb_red_low, Packing::rgba_red_low, Packing::uint8})
        check_says(refused("a.png", cv::Mat(3, 4, CV_16UC1, cv::Scalar(9)), {.packing = packing}),
                   {"the packing \"" + std::string(to_string(packing)) + "\" needs", "camera file"});
    write_image(folder / "colour.pfm", cv::Mat(3, 4, CV_32FC3, cv::Scalar(1)));
    check_says([&] { read_depth(folder / "colour.pfm"); }, {"32-bit float with 3 channels"});
}

TEST_CASE("read: a PNG's remarks do not reach stderr", "[io]") {
    const TempFolder folder;
    Bytes bytes;
    REQUIRE(cv::imencode(".png", cv::Mat(3, 4, CV_16UC1, cv::Scalar(9)), bytes));
    // A colour profile that libpng complains about, with the right check sum.
    const Bytes profile{0, 0, 0, 5, 'i', 'C', 'C', 'P', 'x', 0, 0, 'n', 'o', 0x8c, 0x8f, 0x43, 0x9f};
    bytes.insert(bytes.begin() + 33, profile.begin(), profile.end());
    const auto file = put(folder / "a.png", bytes);
    StderrCapture said(folder);
    const auto outcome = refusal([&] { read_depth(file); });
    CHECK(said.end() == "");
    CHECK((outcome.starts_with("(") || contains(outcome, "check sum")));
}

TEST_CASE("read: the OpenGL buffers", "[io][real]") {
    if (!real::there("opengl"))
        return;
    const fs::path data = real::data / "opengl";
    int files = 0;
    for (const auto& entry : fs::directory_iterator(data)) {
        const auto name = entry.path().filename().string();
        if (!contains(name, ".depth."))
            continue;
        const auto depth = read_depth(entry.path());
        CHECK(depth.values.size() == cv::Size(161, 121));
        CHECK(depth.storage == (name.ends_with(".png") ? Storage::uint16 : Storage::float32));
        ++files;
    }
    CHECK(files == 19);
}

// Depth out of PNG, TIFF, PFM and PGM: which types are depth, and that their values come back untouched.
#include "io_files.hpp"
#include "matrices.hpp"
#include "tiff_files.hpp"

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

} // namespace

TEST_CASE("read: codes that do not count to 65535 are refused", "[io]") {
    const TempFolder folder;
    check_says([&] { read_depth(put(folder / "a.pgm", std::string("P5\n1 1\n4095\n\1\2"))); },
               {"a.pgm: ", "counts to 4095"});
    const auto twelve_bits = [](TIFF* tiff) { TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 12); };
    const cv::Mat codes(2, 4, CV_16UC1, cv::Scalar(0));
    check_says([&] { read_depth(write_tiff(folder / "a.tif", codes, SAMPLEFORMAT_UINT, {.more = twelve_bits})); },
               {"a.tif: ", "samples of 12 bits"});
    for (const char* text : {"P5\n1 1\n0\n\1", "P5\n1 1\n70000\n\1\2"})
        check_says([&] { read_depth(put(folder / "a.pgm", std::string(text))); },
                   {"a.pgm: ", "a grey map counts to 1 to 65535"});
    check_says([&] { read_depth(put(folder / "a.pgm", std::string("P5\n2 1\n100\n\7\145")), {.as_counted = true}); },
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

TEST_CASE("read: TIFF of codes in the high bits, of signed codes below 0, and of codes that nobody describes", "[io]") {
    const TempFolder folder;
    const cv::Mat high = (cv::Mat_<int>(1, 3) << 0, 0x100, static_cast<int>(0xffffff00u));
    for (const char* mode : {"wl", "wb"}) {
        const auto file = write_tiff(folder / "high.tif", high, SAMPLEFORMAT_UINT, {.mode = mode});
        const auto depth = read_depth(file, {.packing = Packing::uint24_high});
        CHECK(depth.storage == Storage::uint24_high);
        CHECK(same(depth.values, high));
        check_says([&] { read_depth(file); }, {"pixel (2, 0) holds 4294967040", "uint24-high"});
    }
    const auto unset = [](TIFF* tiff) { TIFFUnsetField(tiff, TIFFTAG_SAMPLEFORMAT); };
    check_says([&] { read_depth(write_tiff(folder / "unsaid.tif", high, SAMPLEFORMAT_UINT, {.more = unset})); },
               {"SampleFormat"});
    const cv::Mat below = (cv::Mat_<short>(1, 4) << 0, 32767, -32768, -9999);
    const auto heights = read_depth(write_tiff(folder / "signed.tif", below, SAMPLEFORMAT_INT, {}));
    CHECK(heights.storage == Storage::float32);
    CHECK(same(heights.values, (cv::Mat_<float>(1, 4) << 0, 32767, -32768, -9999)));
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
    check_says(refused("a.png", cv::Mat(3, 4, CV_8UC1, cv::Scalar(9))),
               {"a.png: is unsigned 8-bit with 1 channel", "16-bit", "\"packing\": \"uint8\""});
    const cv::Mat photograph = filled<cv::Vec3b>(48, 32, [](int x, int y) {
        return cv::Vec3b(cv::saturate_cast<uchar>(90 + x + y), cv::saturate_cast<uchar>(80 + x + y),
                         cv::saturate_cast<uchar>(60 + x + 3 * (y % 9)));
    });
    check_says(refused("a.png", photograph), {"unsigned 8-bit with 3 channels", "save raw depth"});
    check_says(refused("a.png", cv::Mat(3, 4, CV_16UC3, cv::Scalar(9))), {"unsigned 16-bit with 3 channels"});
    check_says(refused("a.jpg", cv::Mat(3, 4, CV_8UC3, cv::Scalar(9))),
               {"is a JPEG, which is not read", "save it as .png"});

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

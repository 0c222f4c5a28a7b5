// TIFF in the forms that other programs write: tiles and strips, compressed or not, either byte order, BigTIFF, turned.
#include "io_files.hpp"
#include "matrices.hpp"
#include "tiff_files.hpp"

#include <fathom/io.hpp>

#include <opencv2/core.hpp>

#include <tiffio.h>

using namespace fathom;
using namespace fathom::test;

namespace {

const std::vector<TiffForm> forms{
    {},
    {.rows = 1},
    {.rows = 100},
    {.mode = "wb"},
    {.mode = "wl8"},
    {.mode = "wb8", .compression = COMPRESSION_LZW, .rows = 3},
    {.compression = COMPRESSION_ADOBE_DEFLATE, .predictor = PREDICTOR_HORIZONTAL},
    {.mode = "wb", .compression = COMPRESSION_PACKBITS},
    {.rows = 16, .tiled = true},
    {.mode = "wb8", .compression = COMPRESSION_LZW, .rows = 16, .tiled = true},
};

} // namespace

TEST_CASE("tiff: depth of every type comes back bit for bit from every form of file", "[io]") {
    const TempFolder folder;
    for (const auto& [type, format, storage] : {std::tuple{CV_16UC1, SAMPLEFORMAT_UINT, Storage::uint16},
                                                {CV_32SC1, SAMPLEFORMAT_UINT, Storage::uint24},
                                                {CV_32SC1, SAMPLEFORMAT_INT, Storage::uint24},
                                                {CV_16UC1, SAMPLEFORMAT_IEEEFP, Storage::float16},
                                                {CV_32FC1, SAMPLEFORMAT_IEEEFP, Storage::float32}}) {
        cv::Mat image(23, 37, type);
        cv::randu(image, 0, CV_MAT_DEPTH(type) == CV_32S ? 1 << 24 : 30000);
        for (const TiffForm& form : forms) {
            INFO(image.elemSize() * 8 << " bits, format " << format << ", " << form.mode << ", compression "
                                      << form.compression << ", " << form.rows << (form.tiled ? " tiled" : " rows"));
            const auto file = write_tiff(folder / "a.tif", image, static_cast<std::uint16_t>(format), form);
            const DepthFile depth = read_depth(file);
            CHECK(depth.storage == storage);
            cv::Mat values = depth.values;
            if (storage == Storage::float16)
                values = cv::Mat(depth.values.size(), CV_16UC1, depth.values.data);
            CHECK(same(values, image));
        }
    }
}

TEST_CASE("tiff: pictures of 16 bits and floats come in B, G, R", "[io]") {
    const TempFolder folder;
    for (const auto& [type, format] : {std::pair{CV_16UC3, SAMPLEFORMAT_UINT},
                                       {CV_16UC4, SAMPLEFORMAT_UINT},
                                       {CV_32FC3, SAMPLEFORMAT_IEEEFP},
                                       {CV_32FC4, SAMPLEFORMAT_IEEEFP}}) {
        cv::Mat image(23, 37, type);
        cv::randu(image, 0, 30000);
        for (const TiffForm& form : forms) {
            const cv::Mat color =
                read_color(write_tiff(folder / "a.tif", image, static_cast<std::uint16_t>(format), form));
            REQUIRE(color.channels() == image.channels());
            double worst = 0;
            for (int c = 0; c < color.channels(); ++c) {
                cv::Mat floats;
                plane(image, c == 3 ? 3 : 2 - c).convertTo(floats, CV_32F);
                worst = std::max(
                    worst, cv::norm(plane(color, c) * (image.depth() == CV_16U ? 65535.0 : 1), floats, cv::NORM_INF));
            }
            CHECK(worst < 0.01);
        }
    }
}

TEST_CASE("tiff: an image stands upright, whatever its orientation says of its rows", "[io]") {
    const TempFolder folder;
    const cv::Mat rows = (cv::Mat_<float>(2, 3) << 1, 2, 3, 4, 5, 6);
    const std::vector<cv::Mat> upright{
        rows,
        (cv::Mat_<float>(2, 3) << 3, 2, 1, 6, 5, 4),  // the first column on the right
        (cv::Mat_<float>(2, 3) << 6, 5, 4, 3, 2, 1),  // the first row below, the first column on the right
        (cv::Mat_<float>(2, 3) << 4, 5, 6, 1, 2, 3),  // the first row below
        (cv::Mat_<float>(3, 2) << 1, 4, 2, 5, 3, 6),  // the first row on the left, the first column on top
        (cv::Mat_<float>(3, 2) << 4, 1, 5, 2, 6, 3),  // the first row on the right
        (cv::Mat_<float>(3, 2) << 6, 3, 5, 2, 4, 1),  // the first row on the right, the first column below
        (cv::Mat_<float>(3, 2) << 3, 6, 2, 5, 1, 4)}; // the first row on the left, the first column below
    for (std::uint16_t orientation = 1; orientation <= 8; ++orientation) {
        INFO("orientation " << orientation);
        const auto file = write_tiff(folder / "a.tif", rows, SAMPLEFORMAT_IEEEFP, {.orientation = orientation});
        CHECK(same(read_depth(file).values, upright[orientation - 1u]));
    }
}

TEST_CASE("tiff: strips that are not there are refused, wrong counts of their bytes are mended", "[io]") {
    const TempFolder folder;
    const cv::Mat image(8, 8, CV_16UC1, cv::Scalar(9));
    const auto file = write_tiff(folder / "a.tif", image, SAMPLEFORMAT_UINT, {.mode = "wl", .rows = 8});
    const Bytes whole = get(file);
    REQUIRE_NOTHROW(read_depth(file));
    const auto with = [&](std::uint16_t tag, std::uint32_t value) { // in the directory at the file's end
        Bytes bytes = whole;
        const std::size_t directory = bytes[4] | bytes[5] << 8;
        for (std::size_t i = 0; i < bytes[directory]; ++i) {
            unsigned char* entry = bytes.data() + directory + 2 + 12 * i;
            if ((entry[0] | entry[1] << 8) != tag)
                continue;
            entry[2] = TIFF_LONG;
            for (int byte = 0; byte < 4; ++byte)
                entry[8 + byte] = static_cast<unsigned char>(value >> (8 * byte));
        }
        return put(folder / "b.tif", bytes);
    };
    // libtiff works out a wrong count of bytes by itself, from the image's size: no value may be lost.
    for (const std::uint32_t count : {0u, 100u, 1000u})
        CHECK(same(read_depth(with(TIFFTAG_STRIPBYTECOUNTS, count)).values, image));
    check_says([&] { read_depth(with(TIFFTAG_STRIPOFFSETS, 1 << 30)); }, {"b.tif: is damaged or cut short"});
    check_says([&] { read_depth(with(TIFFTAG_IMAGEWIDTH, 1 << 30)); }, {"1073741824 x 8 pixels"});
    check_says([&] { read_depth(with(TIFFTAG_ROWSPERSTRIP, 1)); }, {"b.tif: is damaged or cut short"});
}

TEST_CASE("tiff: integers of 64 bits are refused", "[io]") {
    const TempFolder folder;
    for (const int format : {SAMPLEFORMAT_UINT, SAMPLEFORMAT_INT}) {
        const auto file =
            write_tiff(folder / "a.tif", cv::Mat::zeros(8, 8, CV_64FC1), static_cast<std::uint16_t>(format), {});
        check_says([&] { read_depth(file); }, {"a.tif: has samples of 64 bits"});
    }
}

TEST_CASE("tiff: directories that go round or lead nowhere end the count of pages", "[io]") {
    const TempFolder folder;
    const cv::Mat image(8, 8, CV_16UC1, cv::Scalar(9));
    const Bytes whole = get(write_tiff(folder / "a.tif", image, SAMPLEFORMAT_UINT, {.mode = "wl", .rows = 8}));
    const std::size_t directory = whole[4] | whole[5] << 8, next = directory + 2 + 12u * whole[directory];
    for (const std::size_t to : {directory, directory + 2, std::size_t{8}, std::size_t{0x7fffffff}}) {
        Bytes bytes = whole;
        for (std::size_t byte = 0; byte < 4; ++byte)
            bytes[next + byte] = static_cast<unsigned char>(to >> (8 * byte));
        const DepthFile depth = read_depth(put(folder / "b.tif", bytes));
        CHECK(same(depth.values, image));
        CHECK(depth.pages <= 2);
    }
}

TEST_CASE("tiff: kinds of samples that no reader has are refused by their names", "[io]") {
    const TempFolder folder;
    const cv::Mat halves(8, 8, CV_16UC1, cv::Scalar(0x3c00)), words(8, 8, CV_32SC1, cv::Scalar(1)),
        colors(8, 8, CV_16UC3, cv::Scalar(1, 2, 3));
    for (const auto& [image, format, says] : {std::tuple(words, SAMPLEFORMAT_VOID, "SampleFormat 4"),
                                              {words, SAMPLEFORMAT_COMPLEXINT, "SampleFormat 5"},
                                              {colors, SAMPLEFORMAT_INT, "SampleFormat 2"}}) {
        const auto file = write_tiff(folder / "a.tif", image, static_cast<std::uint16_t>(format), {});
        check_says([&] { read_color(file); }, {"a.tif: ", says});
    }
    const auto file =
        write_tiff(folder / "half.tif", halves, SAMPLEFORMAT_IEEEFP, {.compression = COMPRESSION_ADOBE_DEFLATE});
    CHECK(read_depth(file).storage == Storage::float16);
}

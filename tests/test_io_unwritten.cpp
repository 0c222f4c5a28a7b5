// What decoders leave unwritten is refused, and never shows: images over two patterns of memory are the same.
#include "io_files.hpp"
#include "matrices.hpp"
#include "tiff_files.hpp"

#include "io/formats.hpp"

#include <fathom/io.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <malloc.h>

using namespace fathom;
using namespace fathom::test;

namespace {

/// What a TIFF's strips or tiles are made of.
struct Coding {
    std::uint16_t compression, predictor = PREDICTOR_NONE;
    int type = CV_32FC1;
    bool white_is_0 = false;

    std::uint16_t format() const { return CV_MAT_DEPTH(type) == CV_32F ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT; }
    TiffForm form(std::uint32_t rows, bool tiled = false) const {
        return {.compression = compression,
                .predictor = predictor,
                .rows = rows,
                .tiled = tiled,
                .more = [*this](TIFF* tiff) {
                    if (white_is_0)
                        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISWHITE);
                    if (compression == COMPRESSION_JPEG)
                        TIFFSetField(tiff, TIFFTAG_JPEGTABLESMODE, 0);
                }};
    }
};

/// Steps, which every codec makes shorter, and no two rows alike.
cv::Mat steps_of(int type, cv::Size size) {
    cv::Mat image(size, type);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            for (int c = 0; c < image.channels(); ++c) {
                const int value = 1 + (x / 5 + 3 * y + 7 * c) % 200;
                const std::size_t at = static_cast<std::size_t>(x * image.channels() + c);
                if (image.depth() == CV_32F)
                    image.ptr<float>(y)[at] = static_cast<float>(value) / 7;
                else if (image.depth() == CV_16U)
                    image.ptr<std::uint16_t>(y)[at] = static_cast<std::uint16_t>(300 * value);
                else
                    image.ptr(y)[at] = static_cast<unsigned char>(value);
            }
    return image;
}

/// The bytes that stand for an image as one strip.
Bytes encoded(const fs::path& file, const cv::Mat& image, const Coding& coding) {
    write_tiff(file, image, coding.format(), coding.form(static_cast<std::uint32_t>(image.rows)));
    TIFF* tiff = TIFFOpen(file.c_str(), "rc"); // libtiff would take a strip that is not packed for several
    Bytes bytes(TIFFGetStrileByteCount(tiff, 0));
    REQUIRE(TIFFReadRawStrip(tiff, 0, bytes.data(), static_cast<tmsize_t>(bytes.size())) ==
            static_cast<tmsize_t>(bytes.size()));
    TIFFClose(tiff);
    fs::remove(file); // to write into a file that is there makes some disks wait
    return bytes;
}

/// A TIFF whose strips, or tiles, each hold more or fewer pixels than they should.
fs::path misfit(const TempFolder& folder, const cv::Mat& image, const Coding& coding, cv::Size piece, bool tiled,
                cv::Size more) {
    const fs::path file = folder / "misfit.tif";
    fs::remove(file);
    TIFF* tiff = begun_tiff(file, image.size(), coding.type, coding.format(),
                            coding.form(static_cast<std::uint32_t>(piece.height), tiled));
    std::uint32_t i = 0;
    for (int y = 0; y < image.rows; y += piece.height)
        for (int x = 0; x < image.cols; x += piece.width, ++i) {
            const int rows = tiled ? piece.height : std::min(piece.height, image.rows - y);
            cv::Mat held = steps_of(coding.type, {piece.width + more.width, std::max(rows + more.height, 1)});
            const cv::Rect seen(x, y, std::min({piece.width, held.cols, image.cols - x}),
                                std::min({rows, held.rows, image.rows - y}));
            image(seen).copyTo(held(cv::Rect({}, seen.size())));
            Bytes bytes = encoded(folder / "piece.tif", held, coding);
            const auto size = static_cast<tmsize_t>(bytes.size());
            REQUIRE((tiled ? TIFFWriteRawTile : TIFFWriteRawStrip)(tiff, i, bytes.data(), size) == size);
        }
    TIFFClose(tiff);
    return file;
}

/// What `read` gives over memory that is filled with a pattern; nothing where it refuses.
template <typename Read>
cv::Mat over(unsigned char pattern, const Read& read) {
    mallopt(M_PERTURB, pattern); // the C library fills memory with the pattern's complement
    cv::Mat image;
    refusal([&] { image = read(); });
    mallopt(M_PERTURB, 0);
    return image;
}

/// The image of a TIFF, which is the same over two patterns.
cv::Mat over_patterns(const fs::path& file) {
    const auto all = [&] {
        Bytes bytes = get(file);
        return io::read_by_opencv(file, bytes)->image;
    };
    const cv::Mat image = over(0x55, all);
    const auto alike = [&](const cv::Mat& other) { return image.empty() ? other.empty() : same(image, other); };
    CHECK(alike(over(0xaa, all)));
    return image;
}

std::vector<Coding> codings() {
    std::vector<Coding> all;
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_PACKBITS, COMPRESSION_DEFLATE,
                                  COMPRESSION_ADOBE_DEFLATE, COMPRESSION_LZMA, COMPRESSION_ZSTD, COMPRESSION_LERC,
                                  COMPRESSION_PIXARLOG, COMPRESSION_JPEG, COMPRESSION_WEBP})
        for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_32FC1})
            for (const int predictor : {PREDICTOR_NONE, PREDICTOR_HORIZONTAL, PREDICTOR_FLOATINGPOINT}) {
                const bool predicts = compression == COMPRESSION_LZW || compression == COMPRESSION_DEFLATE ||
                                      compression == COMPRESSION_ADOBE_DEFLATE || compression == COMPRESSION_LZMA ||
                                      compression == COMPRESSION_ZSTD;
                const bool fits = (compression != COMPRESSION_JPEG || CV_MAT_DEPTH(type) == CV_8U) &&
                                  (compression != COMPRESSION_WEBP || type == CV_8UC3) &&
                                  (compression != COMPRESSION_PIXARLOG || type != CV_8UC1);
                if (TIFFIsCODECConfigured(static_cast<std::uint16_t>(compression)) && fits &&
                    (predictor == PREDICTOR_NONE || predicts) &&
                    (predictor != PREDICTOR_FLOATINGPOINT || type == CV_32FC1))
                    all.push_back(
                        {static_cast<std::uint16_t>(compression), static_cast<std::uint16_t>(predictor), type});
            }
    all.push_back({COMPRESSION_LZW, PREDICTOR_NONE, CV_8UC1, true});
    all.push_back({COMPRESSION_ADOBE_DEFLATE, PREDICTOR_NONE, CV_8UC1, true});
    return all;
}

} // namespace

TEST_CASE("unwritten: strips and tiles of a TIFF that hold more than their pixels are cut or refused, those with fewer "
          "refused, "
          "over any memory",
          "[io]") {
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    const TempFolder folder;
    int files = 0, whole = 0, refused = 0;
    for (const Coding& coding : codings())
        for (const auto& [rows, tiled] : {std::pair{32, false}, {16, false}, {1, false}, {16, true}})
            for (const int more : {-1, 0, 1, 63}) {
                const bool is_read = std::ranges::none_of(
                    std::array{COMPRESSION_JPEG, COMPRESSION_WEBP, COMPRESSION_LERC, COMPRESSION_PIXARLOG},
                    [&](int other) { return coding.compression == other; });
                for (const int wider : {0, -5, 5}) {
                    if ((wider != 0 && is_read) || (rows == 1 && more < 0))
                        continue;
                    const cv::Mat image = steps_of(coding.type, {48, 33});
                    const cv::Size piece(tiled ? 16 : image.cols, rows);
                    const fs::path file = misfit(folder, image, coding, piece, tiled, {wider, more});
                    CAPTURE(coding.compression, coding.predictor, coding.type, rows, tiled, more, wider);
                    const cv::Mat read = over_patterns(file);
                    ++files;
                    (read.empty() ? refused : whole) += 1;
                    if (!is_read || (more < 0 && coding.compression != COMPRESSION_NONE)) // whose strips have no end
                        CHECK(read.empty());
                    else if (more == 0)
                        CHECK(!read.empty());
                    if (read.empty() || more < 0)
                        continue;
                    const cv::Mat theirs = cv::imread(file, cv::IMREAD_UNCHANGED);
                    if (!coding.white_is_0)
                        CHECK(same(io::swap_red_and_blue(read), image));
                    else if (more == 0)
                        CHECK(same(read, theirs));
                }
            }
    std::cout << files << " TIFFs, " << whole << " read whole, " << refused << " refused\n";
}

TEST_CASE("unwritten: damaged pictures of every other format are refused, or the same over any memory", "[io]") {
    std::mt19937 random(1);
    const TempFolder folder;
    int read = 0, refused = 0;
    for (const std::string name : {"a.png", "a.jpg", "a.hdr", "a.ppm", "a.pfm", "a.npy", "a.exr"}) {
        cv::Mat image = steps_of(
            name == "a.hdr" || name == "a.pfm" || name == "a.npy" || name == "a.exr" ? CV_32FC3 : CV_8UC3, {96, 65});
        if (name == "a.npy" || name == "a.pfm" || name == "a.exr")
            write_color(folder / name, image);
        else
            REQUIRE(cv::imwrite(folder / name, image));
        const Bytes whole = get(folder / name);
        for (int round = 0; round < 150; ++round) {
            Bytes bytes = whole;
            for (int i = 0; i < 1 + round % 3; ++i)
                bytes[random() % bytes.size()] = static_cast<unsigned char>(random());
            if (round % 5 == 0)
                bytes.resize(bytes.size() / 2 + random() % (bytes.size() / 2));
            const auto file = put(folder / ("b" + fs::path(name).extension().string()), bytes);
            const cv::Mat one = over(0x55, [&] { return read_color(file); }),
                          other = over(0xaa, [&] { return read_color(file); });
            CAPTURE(name, round);
            CHECK(one.empty() == other.empty());
            if (!one.empty() && !other.empty())
                CHECK(same(one, other));
            (one.empty() ? refused : read) += 1;
        }
    }
    std::cout << read << " damaged pictures read, " << refused << " refused\n";
}

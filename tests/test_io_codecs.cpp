// PNG, JPEG, Radiance and TIFF: what stands before OpenCV's codecs changes no pixel, refuses what they would fill with anything, and
// keeps what they print from others.
#include "catch.hpp"
#include "io_files.hpp"
#include "matrices.hpp"
#include "places.hpp"
#include "tiff_files.hpp"

#include "io/formats.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <atomic>
#include <thread>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr int width = 37, height = 23;

/// The same pixels, or neither was read.
bool alike(const cv::Mat& a, const cv::Mat& b) {
    return (a.empty() && b.empty()) || same(a, b);
}

/// What the library reads.
cv::Mat read(const std::string& name, Bytes bytes) {
    if (const auto map = io::read_pgm(name, bytes, false))
        return *map;
    return io::read_by_opencv(name, bytes).value_or(io::PictureFile{}).image;
}

cv::Mat by_opencv(const Bytes& bytes) {
    return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
}

/// The first three channels, or three times the only one.
cv::Mat three_of(const cv::Mat& image) {
    cv::Mat three(image.size(), CV_MAKETYPE(image.depth(), 3));
    for (int c = 0; c < 3; ++c) {
        cv::Mat one;
        cv::extractChannel(image, one, image.channels() == 1 ? 0 : c);
        cv::insertChannel(one, three, c);
    }
    return three;
}

Bytes noise(std::size_t size) {
    static std::mt19937 random(1); // NOLINT: the same each time
    Bytes bytes(size);
    std::ranges::generate(bytes, [] { return static_cast<unsigned char>(random()); });
    return bytes;
}

/// Codes that a codec can make shorter: steps, and runs of a code.
cv::Mat steps(int type, cv::Size size = {width, height}) {
    cv::Mat image(size, type), parts(1 + size.height / 3, 1 + size.width / 5, type);
    cv::randu(parts, 0, parts.depth() == CV_16U ? 65536 : 256);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            std::memcpy(image.ptr(y, x), parts.ptr(y / 3, x / 5), image.elemSize());
    return image;
}

/// The files of the fuzzer's corpus of a format: one of each kind of it.
std::vector<std::pair<std::string, Bytes>> corpus(const std::string& format) {
    std::vector<std::pair<std::string, Bytes>> files;
    for (const auto& entry : fs::directory_iterator(fs::path(places::sources) / "tests/fuzz/corpus" / format)) {
        Bytes bytes = get(entry.path());
        bytes.erase(bytes.begin()); // the target's choice
        files.emplace_back(entry.path().filename().string(), bytes);
    }
    return files;
}

Bytes one_of(const std::string& format, const std::string& name) {
    const auto files = corpus(format);
    return std::ranges::find(files, name, &std::pair<std::string, Bytes>::first)->second;
}

} // namespace

TEST_CASE("codecs: every kind of PNG and JPEG has the pixels that OpenCV reads", "[io]") {
    for (const std::string format : {"png", "jpeg"}) {
        const auto files = corpus(format);
        CHECK(files.size() >= 11);
        for (const auto& [name, file] : files) {
            CAPTURE(format, name);
            const cv::Mat expected = by_opencv(file), held = read("a." + format, file);
            REQUIRE(!expected.empty());
            // What one colour or a palette says of transparency is not read.
            CHECK(same(held, contains(name, "transparent") && held.channels() == 3 ? three_of(expected) : expected));
        }
    }
}

TEST_CASE("codecs: a damaged JPEG is refused, or has the pixels that OpenCV reads; nothing is printed", "[io]") {
    const TempFolder folder;
    std::mt19937 random(3); // NOLINT
    for (const auto& [name, whole] : corpus("jpeg")) {
        constexpr int rounds = 150;
        int differ = 0, refused = 0;
        for (int round = 0; round < rounds; ++round) {
            Bytes bytes = whole;
            bytes[random() % bytes.size()] = static_cast<unsigned char>(random());
            StderrCapture said(folder);
            cv::Mat held;
            refused += !refusal([&] { held = read("a.jpg", bytes); }).starts_with("(");
            const std::string printed = said.end();
            CHECK(printed == "");
            StderrCapture by_others(folder);
            const cv::Mat expected = by_opencv(bytes);
            by_others.end();
            differ += !held.empty() && !alike(held, expected);
        }
        CAPTURE(name);
        CHECK(differ == 0);
        CHECK(refused < rounds);
    }
}

TEST_CASE("codecs: a JPEG whose end stands in a comment is refused", "[io]") {
    Bytes file = one_of("jpeg", "progressive");
    const Bytes scan{0xff, 0xda}, comment{0xff, 0xfe, 0, 4, 0xff, 0xd9};
    const auto second = std::search(std::search(file.begin(), file.end(), scan.begin(), scan.end()) + 2, file.end(),
                                    scan.begin(), scan.end());
    REQUIRE(second != file.end());
    file.insert(file.erase(second, file.end()), comment.begin(), comment.end());
    check_says([&] { read("a.jpg", file); }, {"a.jpg: ends in the middle of the picture"});
}

TEST_CASE("codecs: Radiance pictures have the floats that OpenCV reads, and it reads ours", "[io]") {
    for (const cv::Size size :
         {cv::Size(7, 3), cv::Size(8, 3), cv::Size(300, 20), cv::Size(32767, 2), cv::Size(32768, 2)})
        for (const bool smooth : {true, false}) {
            CAPTURE(size, smooth);
            cv::Mat bgr(size, CV_32FC3);
            if (smooth)
                steps(CV_8UC3, size).convertTo(bgr, CV_32F, 1 / 255.0);
            else
                for (auto& pixel : cv::Mat_<cv::Vec3f>(bgr))
                    for (int c = 0; c < 3; ++c) // of all exponents, with nothing among them
                        pixel[c] = std::ldexp(static_cast<float>(noise(1)[0]), noise(1)[0] % 3 ? noise(1)[0] - 136 : 0);
            cv::min(bgr, 1e38, bgr);
            Bytes file;
            REQUIRE(cv::imencode(".hdr", bgr, file));
            const cv::Mat expected = by_opencv(file);
            CHECK(alike(read("a.hdr", file), expected));
            const Bytes ours = io::radiance_bytes(bgr);
            CHECK(alike(by_opencv(ours), expected));
            CHECK(alike(read("a.hdr", ours), expected));
        }
}

TEST_CASE("codecs: headers are read here, whatever OpenCV makes of them", "[io]") {
    Bytes runs;
    REQUIRE(cv::imencode(".hdr", cv::Mat(steps(CV_8UC3)), runs));
    const std::string line = "# " + std::string(300, 'x') + "\n", text(runs.begin(), runs.end());
    const std::size_t second = text.find('\n') + 1;
    const std::string longer = text.substr(0, second) + line + text.substr(second);
    CHECK(alike(read("a.hdr", Bytes(longer.begin(), longer.end())), by_opencv(runs)));
    for (const std::string before : {"P5\n# a\r1 1 255\n2 1 255\n", "P5 2 1 255.0\n"}) {
        const std::string pgm = before + "\x07\x08";
        CHECK(alike(read("a.pgm", Bytes(pgm.begin(), pgm.end())), (cv::Mat_<unsigned char>(1, 2) << 7, 8)));
    }
}

TEST_CASE("codecs: a Radiance picture without runs is read, and one that is damaged is refused", "[io]") {
    const std::string head = "#?RADIANCE\n# by hand\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n";
    Bytes flat(head.begin(), head.end());
    const Bytes pixels = noise(4 * 16);
    flat.insert(flat.end(), pixels.begin(), pixels.end());
    CHECK(alike(read("a.hdr", flat), by_opencv(flat)));

    Bytes runs;
    REQUIRE(cv::imencode(".hdr", cv::Mat(steps(CV_8UC3)), runs));
    const std::string text(runs.begin(), runs.end());
    for (const Bytes& whole : {flat, runs})
        for (std::size_t size = 10; size < whole.size(); ++size) {
            const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
            CHECK(refusal([&] { read("a.hdr", cut); }).starts_with("a.hdr: "));
        }
    for (const auto& [what, with] :
         {std::pair{"rgbe\n", "xyze\n"}, {"-Y", "+Y"}, {"+X 37", "+X 38"}, {"+X 37", "+X 0"}}) {
        std::string changed = text;
        changed.replace(text.find(what), std::strlen(what), with);
        check_says([&] { read("a.hdr", Bytes(changed.begin(), changed.end())); }, {"a.hdr: "});
    }
    for (int round = 0; round < 500; ++round) {
        Bytes bytes = runs;
        bytes[60 + std::size_t{noise(1)[0]}] = noise(1)[0];
        cv::Mat held, expected;
        refusal([&] { held = read("a.hdr", bytes); });
        try {
            expected = by_opencv(bytes);
        } catch (const cv::Exception&) {
        }
        CHECK(alike(held, expected));
    }
}

TEST_CASE(
    "codecs: TIFFs of palettes and of white that is 0 have the pixels that OpenCV reads, other colours are refused",
    "[io]") {
    const TempFolder folder;
    const auto tiff = [&](int type, int photometric, int planes = PLANARCONFIG_CONTIG, std::uint16_t orientation = 1) {
        const auto fields = [&](TIFF* out) {
            TIFFSetField(out, TIFFTAG_PHOTOMETRIC, photometric);
            TIFFSetField(out, TIFFTAG_PLANARCONFIG, planes);
            if (photometric == PHOTOMETRIC_YCBCR)
                TIFFSetField(out, TIFFTAG_YCBCRSUBSAMPLING, 1, 1);
            std::vector<std::uint16_t> maps(3 * 256);
            std::ranges::generate(maps, [at = 1u]() mutable { return static_cast<std::uint16_t>(at *= 40503); });
            if (photometric == PHOTOMETRIC_PALETTE)
                TIFFSetField(out, TIFFTAG_COLORMAP, maps.data(), maps.data() + 256, maps.data() + 512);
        };
        return get(write_tiff(folder / "a.tif", steps(type), SAMPLEFORMAT_UINT,
                              {.rows = 5, .orientation = orientation, .more = fields}));
    };
    for (const int photometric : {PHOTOMETRIC_PALETTE, PHOTOMETRIC_MINISWHITE})
        for (std::uint16_t orientation = 1; orientation <= 8; ++orientation) {
            CAPTURE(photometric, orientation);
            const Bytes file = tiff(CV_8UC1, photometric, PLANARCONFIG_CONTIG, orientation);
            CHECK(same(read("a.tif", file), by_opencv(file)));
        }
    for (const auto& [type, photometric, planes, says] :
         {std::tuple{CV_8UC2, PHOTOMETRIC_MINISBLACK, PLANARCONFIG_CONTIG, "2 samples"},
          {CV_16UC2, PHOTOMETRIC_MINISBLACK, PLANARCONFIG_CONTIG, "2 samples"},
          {CV_8UC4, PHOTOMETRIC_SEPARATED, PLANARCONFIG_CONTIG, "colours that are not read (5)"},
          {CV_8UC3, PHOTOMETRIC_YCBCR, PLANARCONFIG_CONTIG, "colours that are not read (6)"},
          {CV_8UC3, PHOTOMETRIC_CIELAB, PLANARCONFIG_CONTIG, "colours that are not read (8)"},
          {CV_8UC3, PHOTOMETRIC_RGB, PLANARCONFIG_SEPARATE, "separate planes"},
          {CV_8UC4, PHOTOMETRIC_RGB, PLANARCONFIG_SEPARATE, "separate planes"}})
        check_says([&, type = type, photometric = photometric,
                    planes = planes] { read("a.tif", tiff(type, photometric, planes)); },
                   {"a.tif: ", says});
}

TEST_CASE("codecs: an alpha of 8 bits is not multiplied in, and one that is stays, as a TIFF says", "[io]") {
    const TempFolder folder;
    const cv::Mat codes = steps(CV_8UC4);
    Bytes bytes = io::tiff_bytes(codes);
    CHECK(alike(read("a.tif", bytes), codes));
    CHECK(io::read_by_opencv("a.tif", bytes)->straight_alpha == true);
    Bytes floats = io::tiff_bytes(cv::Mat(codes.size(), CV_32FC4, cv::Scalar(1, 2, 3, 0.5)));
    CHECK(io::read_by_opencv("a.tif", floats)->straight_alpha == std::nullopt);
}

TEST_CASE("codecs: what others print while an image is read is printed", "[io]") {
    const TempFolder folder;
    const Bytes jpeg = one_of("jpeg", "rgb");
    StderrCapture said(folder);
    std::atomic<bool> done = false;
    std::thread other([&] {
        for (int i = 0; i < 200; ++i) {
            std::fputs("x", stderr);
            std::cerr << "y";
        }
        done = true;
    });
    while (!done) {
        Bytes damaged = jpeg;
        damaged[damaged.size() / 2] ^= 0xff;
        refusal([&] { read("a.jpg", damaged); });
    }
    other.join();
    const std::string printed = said.end();
    CHECK(std::ranges::count(printed, 'x') == 200);
    CHECK(std::ranges::count(printed, 'y') == 200);
    CHECK(printed.size() == 400);
}

TEST_CASE("codecs: OpenCV reads the PNG and JPEG that are written, which are as short as its own", "[io]") {
    for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4}) {
        CAPTURE(type);
        const cv::Mat codes = steps(type);
        Bytes theirs;
        REQUIRE(cv::imencode(".png", codes, theirs));
        for (const Bytes& file :
             {io::png_bytes(codes),
              io::png_bytes(codes, PictureFormat{.exif = {'I', 'I', 42, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0}})}) {
            CHECK(alike(by_opencv(file), codes));
            CHECK(alike(read("a.png", file), codes));
        }
        CHECK(io::png_bytes(codes).size() <= theirs.size());
    }
    const cv::Mat codes = steps(CV_8UC3);
    Bytes theirs;
    REQUIRE(cv::imencode(".jpg", codes, theirs, {cv::IMWRITE_JPEG_QUALITY, 95}));
    CHECK(alike(by_opencv(io::jpeg_bytes(codes, {})), by_opencv(theirs)));
}

// PNG, JPEG, Radiance and TIFF: what stands before OpenCV's codecs changes no pixel, refuses what they would fill with anything, and
// keeps what they print from others.
#include "catch.hpp"
#include "io_files.hpp"
#include "matrices.hpp"

#include "io/formats.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <jpeglib.h>
#include <png.h>
#include <tiffio.h>

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

Bytes png_of_noise(int bits, int color, bool interlaced, bool transparent) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    Bytes file;
    png_set_write_fn(
        png, &file,
        [](png_structp from, png_bytep data, std::size_t size) {
            auto& to = *static_cast<Bytes*>(png_get_io_ptr(from));
            to.insert(to.end(), data, data + size);
        },
        [](png_structp) {});
    png_set_IHDR(png, info, width, height, bits, color, interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    const Bytes palette = noise(3 * 256), alphas = noise(2);
    const png_color_16 one{.index = 0, .red = 1, .green = 1, .blue = 1, .gray = 1};
    const bool has_palette = color == PNG_COLOR_TYPE_PALETTE;
    if (has_palette)
        png_set_PLTE(png, info, reinterpret_cast<png_const_colorp>(palette.data()), 1 << bits);
    if (transparent)
        png_set_tRNS(png, info, has_palette ? alphas.data() : nullptr, has_palette ? 2 : 1, &one);
    Bytes pixels = noise(png_get_rowbytes(png, info) * height);
    std::vector<png_bytep> rows;
    for (std::size_t y = 0; y < height; ++y)
        rows.push_back(pixels.data() + y * png_get_rowbytes(png, info));
    png_write_info(png, info);
    png_write_image(png, rows.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return file;
}

struct JpegForm {
    J_COLOR_SPACE input, inside;
    int sampling = 2; ///< pixels of the first channel for one of the others, in a row and a column
    bool progressive = false, arithmetic = false;
    unsigned restart = 0;
};

Bytes jpeg_of(const JpegForm& form) {
    jpeg_error_mgr errors;
    jpeg_compress_struct jpeg;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* memory = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&jpeg, &memory, &size);
    jpeg.image_width = width;
    jpeg.image_height = height;
    jpeg.in_color_space = form.input;
    jpeg.input_components = form.input == JCS_GRAYSCALE ? 1 : form.input == JCS_RGB ? 3 : 4;
    jpeg_set_defaults(&jpeg);
    jpeg_set_colorspace(&jpeg, form.inside);
    jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = form.sampling;
    jpeg.arith_code = form.arithmetic;
    jpeg.restart_interval = form.restart;
    if (form.progressive)
        jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    const cv::Mat image = steps(CV_8UC(jpeg.input_components));
    while (jpeg.next_scanline < jpeg.image_height) {
        auto* row = const_cast<JSAMPROW>(image.ptr(static_cast<int>(jpeg.next_scanline)));
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    const Bytes file(memory, memory + size);
    std::free(memory); // NOLINT: libjpeg's
    return file;
}

const JpegForm jpeg_forms[] = {
    {JCS_GRAYSCALE, JCS_GRAYSCALE, 1},
    {JCS_RGB, JCS_YCbCr},
    {JCS_RGB, JCS_YCbCr, 1},
    {JCS_RGB, JCS_RGB, 1},
    {JCS_RGB, JCS_YCbCr, 2, true},
    {JCS_RGB, JCS_YCbCr, 2, false, true},
    {JCS_RGB, JCS_YCbCr, 2, false, false, 1},
    {JCS_CMYK, JCS_CMYK, 1},
    {JCS_CMYK, JCS_YCCK},
};

struct TiffKind {
    int photometric, samples, bits, planes = PLANARCONFIG_CONTIG;
};

Bytes tiff_of_noise(const fs::path& file, const TiffKind& kind, int orientation) {
    TIFF* tiff = TIFFOpen(file.c_str(), "w");
    REQUIRE(tiff);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planes);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, orientation);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 5);
    if (kind.photometric == PHOTOMETRIC_YCBCR)
        TIFFSetField(tiff, TIFFTAG_YCBCRSUBSAMPLING, 1, 1);
    const std::uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
    if (kind.samples == 2 || (kind.samples == 4 && kind.photometric == PHOTOMETRIC_RGB))
        TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
    std::vector<std::uint16_t> maps(3u << kind.bits);
    std::ranges::generate(maps, [at = 1u]() mutable { return static_cast<std::uint16_t>(at *= 40503); });
    if (kind.photometric == PHOTOMETRIC_PALETTE)
        TIFFSetField(tiff, TIFFTAG_COLORMAP, maps.data(), maps.data() + (1 << kind.bits),
                     maps.data() + (2 << kind.bits));
    const int planes = kind.planes == PLANARCONFIG_SEPARATE ? kind.samples : 1;
    for (int plane = 0; plane < planes; ++plane)
        for (std::uint32_t y = 0; y < height; ++y)
            REQUIRE(TIFFWriteScanline(tiff, noise(static_cast<std::size_t>(TIFFScanlineSize(tiff))).data(), y,
                                      static_cast<std::uint16_t>(plane)) == 1);
    TIFFClose(tiff);
    return get(file);
}

} // namespace

TEST_CASE("codecs: every kind of PNG has the pixels that OpenCV reads", "[io]") {
    int files = 0;
    for (const int bits : {1, 2, 4, 8, 16})
        for (const int color : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                PNG_COLOR_TYPE_RGB_ALPHA, PNG_COLOR_TYPE_PALETTE})
            for (const int form : {0, 1, 2, 3}) {
                const bool interlaced = form % 2, transparent = form / 2;
                const bool is_plain = color == PNG_COLOR_TYPE_GRAY || (color == PNG_COLOR_TYPE_PALETTE && bits <= 8);
                if ((bits < 8 && !is_plain) || (color == PNG_COLOR_TYPE_PALETTE && bits == 16) ||
                    (transparent && (color & PNG_COLOR_MASK_ALPHA)))
                    continue;
                CAPTURE(bits, color, interlaced, transparent);
                const Bytes file = png_of_noise(bits, color, interlaced, transparent);
                const cv::Mat expected = by_opencv(file), held = read("a.png", file);
                REQUIRE(!expected.empty());
                // What one colour or a palette says of transparency is not read.
                CHECK(alike(held, transparent && held.channels() == 3 ? three_of(expected) : expected));
                ++files;
            }
    CHECK(files == 52);
}

TEST_CASE("codecs: every kind of JPEG has the pixels that OpenCV reads", "[io]") {
    for (const JpegForm& form : jpeg_forms) {
        CAPTURE(form.input, form.inside, form.sampling, form.progressive, form.arithmetic, form.restart);
        const Bytes file = jpeg_of(form);
        CHECK(alike(read("a.jpg", file), by_opencv(file)));
    }
}

TEST_CASE("codecs: a damaged JPEG is refused, or has the pixels that OpenCV reads; nothing is printed", "[io]") {
    const TempFolder folder;
    std::mt19937 random(3); // NOLINT
    for (const JpegForm& form : jpeg_forms) {
        const Bytes whole = jpeg_of(form);
        int differ = 0, refused = 0;
        for (int round = 0; round < 150; ++round) {
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
        CAPTURE(form.inside, form.progressive, form.arithmetic);
        CHECK(differ == 0);
        CHECK(refused < 100);
    }
}

TEST_CASE("codecs: a JPEG whose end stands in a comment is refused", "[io]") {
    Bytes file = jpeg_of(jpeg_forms[4]);
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
            CHECK(static_cast<double>(ours.size()) < 1.01 * static_cast<double>(file.size()));
        }
}

TEST_CASE("codecs: headers are read here, whatever OpenCV makes of them", "[io]") {
    Bytes runs;
    REQUIRE(cv::imencode(".hdr", cv::Mat(steps(CV_8UC3)), runs));
    const std::string line = "# " + std::string(300, 'x') + "\n", text(runs.begin(), runs.end());
    const std::size_t second = text.find('\n') + 1;
    const std::string longer = text.substr(0, second) + line + text.substr(second);
    CHECK(alike(read("a.hdr", Bytes(longer.begin(), longer.end())), by_opencv(runs)));
    for (const std::string pgm : {"P2 2 1 255\n100.5 7\n", "P2 2 1 255\n1e1 7\n", "P2 2 1 255\n100,7 8\n"})
        check_says([&] { read("a.pgm", Bytes(pgm.begin(), pgm.end())); }, {"a.pgm: ", "where a number belongs"});
    for (const std::string pgm : {"P2 2 1 255\n256 7\n", "P2 2 1 65535\n70000 7\n"})
        check_says([&] { read("a.pgm", Bytes(pgm.begin(), pgm.end())); }, {"a.pgm: ", "beyond the largest"});
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
    for (const TiffKind& kind :
         {TiffKind{PHOTOMETRIC_PALETTE, 1, 8}, TiffKind{PHOTOMETRIC_MINISWHITE, 1, 8}, TiffKind{PHOTOMETRIC_RGB, 4, 8}})
        for (int orientation = 1; orientation <= 8; ++orientation) {
            CAPTURE(kind.photometric, kind.samples, kind.bits, kind.planes, orientation);
            const Bytes file = tiff_of_noise(folder / "a.tif", kind, orientation);
            const cv::Mat expected = by_opencv(file), held = read("a.tif", file);
            REQUIRE(!expected.empty());
            CHECK(alike(kind.samples == 4 ? three_of(held) : held, kind.samples == 4 ? three_of(held) : expected));
        }
    for (const auto& [kind, says] : {std::pair{TiffKind{PHOTOMETRIC_MINISBLACK, 2, 8}, "2 samples"},
                                     {TiffKind{PHOTOMETRIC_MINISBLACK, 2, 16}, "2 samples"},
                                     {TiffKind{PHOTOMETRIC_SEPARATED, 4, 8}, "colours that are not read (5)"},
                                     {TiffKind{PHOTOMETRIC_YCBCR, 3, 8}, "colours that are not read (6)"},
                                     {TiffKind{PHOTOMETRIC_CIELAB, 3, 8}, "colours that are not read (8)"},
                                     {TiffKind{PHOTOMETRIC_RGB, 3, 8, PLANARCONFIG_SEPARATE}, "separate planes"},
                                     {TiffKind{PHOTOMETRIC_RGB, 4, 8, PLANARCONFIG_SEPARATE}, "separate planes"}})
        check_says([&, kind = kind] { read("a.tif", tiff_of_noise(folder / "a.tif", kind, 1)); }, {"a.tif: ", says});
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
    const Bytes jpeg = jpeg_of(jpeg_forms[1]);
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

// Pictures as light: transfer curves against IEC 61966-2-1, alpha, orientation, and what files say about themselves.
#include "io_files.hpp"
#include "matrices.hpp"
#include "tiff_files.hpp"

#include "doubts/look.hpp"

#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <opencv2/imgcodecs.hpp>

#include <zlib.h>

using namespace fathom;
using namespace fathom::test;

namespace {

/// IEC 61966-2-1, in double.
double light_of(double code) {
    return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4);
}

/// A light is the float nearest to the exact one, but for the rounding of the code itself.
constexpr double tolerance = 0x1p-22;

/// Every code of 8 or 16 bits in B, G and R.
template <typename Code>
cv::Mat every_code() {
    const int count = static_cast<int>(std::numeric_limits<Code>::max()) + 1, side = count == 256 ? 16 : 256;
    cv::Mat image(side, side, CV_MAKETYPE(cv::DataType<Code>::depth, 3));
    for (int i = 0; i < count; ++i)
        image.at<cv::Vec<Code, 3>>(i / side, i % side) = {static_cast<Code>(i), static_cast<Code>(count - 1 - i),
                                                          static_cast<Code>((i * 7) % count)};
    return image;
}

Bytes encoded(const std::string& extension, const cv::Mat& image) {
    Bytes bytes;
    REQUIRE(cv::imencode(extension, image, bytes));
    return bytes;
}

void big_endian(Bytes& bytes, std::size_t value, int count) {
    for (int i = count - 1; i >= 0; --i)
        bytes.push_back(static_cast<unsigned char>(value >> (8 * i)));
}

/// Puts a chunk behind a PNG's header.
Bytes with_chunk(Bytes png, const std::string& type, const Bytes& content) {
    Bytes chunk;
    big_endian(chunk, content.size(), 4);
    chunk.insert(chunk.end(), type.begin(), type.end());
    chunk.insert(chunk.end(), content.begin(), content.end());
    big_endian(chunk, crc32(0, chunk.data() + 4, static_cast<uInt>(chunk.size() - 4)), 4);
    png.insert(png.begin() + 33, chunk.begin(), chunk.end());
    return png;
}

/// Puts a segment behind a JPEG's first marker.
Bytes with_segment(Bytes jpeg, unsigned char marker, const std::string& name, const Bytes& content) {
    Bytes segment{0xff, marker};
    big_endian(segment, 2 + name.size() + content.size(), 2);
    segment.insert(segment.end(), name.begin(), name.end());
    segment.insert(segment.end(), content.begin(), content.end());
    jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());
    return jpeg;
}

/// Exif that holds an orientation and nothing else.
Bytes exif(unsigned char orientation, bool little) {
    if (little)
        return {'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0, 0, 0, 0, 0};
    return {'M', 'M', 0, 42, 0, 0, 0, 8, 0, 1, 1, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0, 0, 0, 0, 0};
}

/// A colour profile with three curves of this kind, padded to a size.
Bytes profile(const Bytes& curve, std::size_t size = 300) {
    Bytes icc(128, 0);
    std::copy_n("RGB ", 4, icc.begin() + 16);
    big_endian(icc, 3, 4);
    for (const std::string tag : {"rTRC", "gTRC", "bTRC"}) {
        icc.insert(icc.end(), tag.begin(), tag.end());
        big_endian(icc, 132 + 3 * 12, 4);
        big_endian(icc, curve.size(), 4);
    }
    icc.insert(icc.end(), curve.begin(), curve.end());
    while (icc.size() < size)
        icc.push_back(static_cast<unsigned char>(icc.size() * 31));
    return icc;
}

const Bytes straight_curve{'c', 'u', 'r', 'v', 0, 0, 0, 0, 0, 0, 0, 0};
const Bytes gamma_1{'c', 'u', 'r', 'v', 0, 0, 0, 0, 0, 0, 0, 1, 1, 0};
const Bytes parametric_1{'p', 'a', 'r', 'a', 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0};
const Bytes gamma_2{'c', 'u', 'r', 'v', 0, 0, 0, 0, 0, 0, 0, 1, 2, 0};

Bytes iccp(const Bytes& icc) {
    Bytes content{'i', 'c', 'c', 0, 0}, compressed(compressBound(icc.size()));
    uLongf size = compressed.size();
    compress(compressed.data(), &size, icc.data(), icc.size());
    content.insert(content.end(), compressed.begin(), compressed.begin() + static_cast<std::ptrdiff_t>(size));
    return content;
}

template <typename Code>
void check_codes(const std::string& extension) {
    const TempFolder folder;
    const cv::Mat image = every_code<Code>();
    const auto file = put(folder / ("codes" + extension), encoded(extension, image));
    const Picture picture = read_picture(file);
    REQUIRE(picture.color.type() == CV_32FC3);
    CHECK(picture.format.encoding == ColorEncoding::srgb);
    CHECK(picture.format.bits == static_cast<int>(8 * sizeof(Code)));
    double worst = 0;
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
            for (int c = 0; c < 3; ++c) {
                const double code =
                    static_cast<double>(image.at<cv::Vec<Code, 3>>(y, x)[c]) / std::numeric_limits<Code>::max();
                const double light = light_of(code), got = static_cast<double>(picture.color.at<cv::Vec3f>(y, x)[c]);
                worst = std::max(worst, light == 0 ? std::abs(got) : std::abs(got / light - 1));
            }
    CHECK(worst <= tolerance);

    const auto again = folder / ("again" + extension); // no code changes on the way
    write_picture(again, picture);
    CHECK(same(cv::imread(again.string(), cv::IMREAD_UNCHANGED), image));

    const Picture linear = read_picture(file, {.encoding = ColorEncoding::linear});
    CHECK(linear.color.at<cv::Vec3f>(1, 3)[0] == static_cast<float>(image.at<cv::Vec<Code, 3>>(1, 3)[0]) /
                                                     static_cast<float>(std::numeric_limits<Code>::max()));
    write_picture(again, linear);
    CHECK(same(cv::imread(again.string(), cv::IMREAD_UNCHANGED), image));
}

} // namespace

TEST_CASE("picture: every code of 8 and 16 bits is its light, and comes back", "[picture]") {
    for (const std::string extension : {".png", ".tif"}) {
        check_codes<std::uint8_t>(extension);
        check_codes<std::uint16_t>(extension);
    }
}

TEST_CASE("picture: a JPEG is sRGB of 8 bits, and written as one", "[picture]") {
    const TempFolder folder;
    const cv::Mat plain(32, 48, CV_8UC3, cv::Scalar(20, 200, 128));
    const Picture picture = read_picture(put(folder / "a.jpg", encoded(".jpg", plain)));
    CHECK((picture.format.encoding == ColorEncoding::srgb && picture.format.bits == 8));
    for (int c = 0; c < 3; ++c) { // a JPEG's own rounding: two codes
        const double code = plain.at<cv::Vec3b>(0, 0)[c] / 255.0,
                     light = static_cast<double>(picture.color.at<cv::Vec3f>(9, 9)[c]);
        CHECK((light >= light_of(code - 2 / 255.0) && light <= light_of(code + 2 / 255.0)));
    }
    Picture soft = picture;
    soft.color = filled<cv::Vec3f>(
        48, 32, [](int x, int y) { return cv::Vec3f(0.1f, static_cast<float>(x) / 47, static_cast<float>(y) / 31); });
    write_picture(folder / "b.jpeg", soft);
    const Picture back = read_picture(folder / "b.jpeg");
    CHECK(cv::norm(back.color, soft.color, cv::NORM_L2) / std::sqrt(32 * 48 * 3) < 0.02);
    const cv::Mat grey(8, 8, CV_8UC1, cv::Scalar(99));
    CHECK(read_picture(put(folder / "grey.jpg", encoded(".jpg", grey))).color.channels() == 3);
}

TEST_CASE("picture: a file that says linear is linear", "[picture]") {
    const TempFolder folder;
    const Bytes png = encoded(".png", every_code<std::uint8_t>());
    const auto encoding = [&](const Bytes& bytes, const char* name = "a.png") {
        return read_picture(put(folder / name, bytes)).format.encoding;
    };
    CHECK(encoding(with_chunk(png, "gAMA", {0, 1, 0x86, 0xa0})) == ColorEncoding::linear); // 1.0
    CHECK(encoding(with_chunk(png, "gAMA", {0, 0, 0xb1, 0x8f})) == ColorEncoding::srgb);   // 1/2.2
    CHECK(encoding(with_chunk(with_chunk(png, "gAMA", {0, 1, 0x86, 0xa0}), "sRGB", {0})) == ColorEncoding::srgb);
    for (const Bytes& curve : {straight_curve, gamma_1, parametric_1})
        CHECK(encoding(with_chunk(png, "iCCP", iccp(profile(curve)))) == ColorEncoding::linear);
    CHECK(encoding(with_chunk(png, "iCCP", iccp(profile(gamma_2)))) == ColorEncoding::srgb);
    const Bytes jpeg = encoded(".jpg", every_code<std::uint8_t>());
    Bytes part{1, 1};
    const Bytes linear = profile(straight_curve);
    part.insert(part.end(), linear.begin(), linear.end());
    CHECK(encoding(with_segment(jpeg, 0xe2, std::string("ICC_PROFILE\0", 12), part), "a.jpg") == ColorEncoding::linear);
    write_picture(folder / "b.png", {cv::Mat(4, 4, CV_32FC3, cv::Scalar::all(0.25)), {}}); // linear floats
    const Picture back = read_picture(folder / "b.png");
    CHECK((back.format.encoding == ColorEncoding::linear && back.format.bits == 16));
    CHECK(std::abs(back.color.at<cv::Vec3f>(0, 0)[0] - 0.25f) < 1e-5f);
}

TEST_CASE("picture: what a camera turned stands upright", "[picture]") {
    const TempFolder folder;
    cv::Mat image(16, 24, CV_8UC3, cv::Scalar::all(40));
    image(cv::Rect(0, 0, 8, 8)).setTo(cv::Scalar::all(220)); // bright on the first rows and columns
    // Where the first rows and columns lie, and so the bright corner, by Exif 2.32.
    struct Turn {
        unsigned char orientation;
        bool bottom, right, swapped;
    };
    for (const Turn& turn : {Turn{1, false, false, false},
                             {2, false, true, false},
                             {3, true, true, false},
                             {4, true, false, false},
                             {5, false, false, true},
                             {6, false, true, true},
                             {7, true, true, true},
                             {8, true, false, true}})
        for (const bool little : {true, false}) {
            INFO("orientation " << int{turn.orientation});
            const Bytes data = exif(turn.orientation, little);
            const Bytes jpeg = with_segment(encoded(".jpg", image), 0xe1, std::string("Exif\0\0", 6), data);
            const Bytes png = with_chunk(encoded(".png", image), "eXIf", data);
            for (const auto& [name, bytes] : {std::pair{"a.jpg", jpeg}, {"a.png", png}}) {
                const Picture picture = read_picture(put(folder / name, bytes));
                REQUIRE(picture.color.size() == (turn.swapped ? cv::Size(16, 24) : cv::Size(24, 16)));
                const int x = turn.right ? picture.color.cols - 4 : 3, y = turn.bottom ? picture.color.rows - 4 : 3;
                CHECK(picture.color.at<cv::Vec3f>(y, x)[1] > 0.5f);
                CHECK(picture.color.at<cv::Vec3f>(picture.color.rows - 1 - y, picture.color.cols - 1 - x)[1] < 0.1f);
                CHECK(picture.format.exif == exif(1, little));
                write_picture(folder / (std::string("again-") + name), picture); // which is turned no second time
                CHECK(read_picture(folder / (std::string("again-") + name)).color.size() == picture.color.size());
            }
        }
}

TEST_CASE("picture: the profile and the camera's data stay in a file of the same type", "[picture]") {
    const TempFolder folder;
    const Bytes icc = profile(gamma_2, 150000), data = exif(1, true); // in three segments of a JPEG
    Picture picture{cv::Mat(8, 8, CV_32FC3, cv::Scalar::all(0.5)), {ColorEncoding::srgb, 8, icc, data}};
    for (const char* name : {"a.jpg", "a.png", "a.tif"}) {
        write_picture(folder / name, picture);
        const Picture back = read_picture(folder / name);
        INFO(name);
        CHECK(back.format.icc == icc);
        CHECK(back.format.exif == (std::string(name) == "a.tif" ? Bytes{} : data));
        CHECK(loses_metadata(folder / name, picture.format) == (std::string(name) == "a.tif"));
    }
    CHECK(loses_metadata("a.exr", picture.format));
    CHECK_FALSE(loses_metadata("a.exr", {}));
    picture.format.encoding = ColorEncoding::linear; // a profile does not fit codes of another kind
    CHECK(format_for("a.jpg", picture.format).icc.empty());
}

TEST_CASE("picture: an alpha is multiplied in, whatever the file does", "[picture]") {
    const TempFolder folder;
    const cv::Mat codes(4, 4, CV_16UC4, cv::Scalar(65535, 32768, 0, 16384));
    const double alpha = 16384 / 65535.0;
    const Picture png = read_picture(put(folder / "a.png", encoded(".png", codes)));
    CHECK(png.color.at<cv::Vec4f>(0, 0)[0] == Approx(alpha));
    CHECK(png.color.at<cv::Vec4f>(0, 0)[1] == Approx(alpha * light_of(32768 / 65535.0)));
    CHECK(png.color.at<cv::Vec4f>(0, 0)[3] == Approx(alpha));
    for (const char* name : {"b.png", "b.tif"}) {
        write_picture(folder / name, png);
        CHECK(same(cv::imread((folder / name).string(), cv::IMREAD_UNCHANGED), codes));
        CHECK(cv::norm(read_picture(folder / name).color, png.color, cv::NORM_INF) < 1e-6);
    }
    const Picture bytes{cv::Mat(4, 4, CV_32FC4, cv::Scalar(0.25, 0.25, 0.25, 0.5)), {ColorEncoding::srgb, 8}};
    write_picture(folder / "bytes.tif", bytes); // in 8 bits, too
    CHECK(cv::norm(read_picture(folder / "bytes.tif").color, bytes.color, cv::NORM_INF) < 0.01);
    const auto tiff = [&](std::uint16_t kind, bool floats = false) { // white, if the alpha is multiplied in
        const cv::Mat pixel = floats ? cv::Mat(1, 1, CV_32FC4, cv::Scalar(0.5, 0.5, 0.5, 0.25))
                                     : cv::Mat(1, 1, CV_16UC4, cv::Scalar::all(16384));
        const auto says_kind = [&](TIFF* out) { TIFFSetField(out, TIFFTAG_EXTRASAMPLES, 1, &kind); };
        const auto format = static_cast<std::uint16_t>(floats ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
        return read_picture(write_tiff(folder / "c.tif", pixel, format, {.more = says_kind}))
            .color.at<cv::Vec4f>(0, 0)[0];
    };
    CHECK(tiff(EXTRASAMPLE_UNASSALPHA) == Approx(alpha * light_of(alpha)));
    CHECK(tiff(EXTRASAMPLE_ASSOCALPHA) == Approx(alpha));
    CHECK(tiff(EXTRASAMPLE_UNASSALPHA, true) == 0.125f);
    CHECK(tiff(EXTRASAMPLE_ASSOCALPHA, true) == 0.5f);
    CHECK(tiff(EXTRASAMPLE_UNSPECIFIED, true) == 0.5f);
    CHECK(tiff(EXTRASAMPLE_UNSPECIFIED) == Approx(alpha * light_of(alpha)));
}

TEST_CASE("picture: Exif data of a TIFF, which is not read, is told", "[picture]") {
    const TempFolder folder;
    for (const bool has_exif : {false, true}) {
        const auto file = write_tiff(folder / "a.tif", cv::Mat(1, 1, CV_8UC3, cv::Scalar(1, 2, 3)), SAMPLEFORMAT_UINT,
                                     {.more = [&](TIFF* out) {
                                         if (has_exif)
                                             TIFFSetField(out, TIFFTAG_EXIFIFD, toff_t{8}); // nobody looks into it
                                     }});
        CHECK(read_picture(file).format.incomplete == has_exif);
    }
}

TEST_CASE("picture: floats keep their values, and codes end at 0 and 1", "[picture]") {
    const TempFolder folder;
    cv::Mat color(2, 3, CV_32FC3, cv::Scalar(0.5, 2, -1));
    color.at<cv::Vec3f>(1, 1) = cv::Vec3f::all(std::numeric_limits<float>::quiet_NaN());
    for (const char* name : {"a.exr", "a.pfm", "a.tif"}) {
        write_picture(folder / name, {color, {}});
        const Picture back = read_picture(folder / name);
        CHECK((back.format.bits == 32 && back.format.encoding == ColorEncoding::linear));
        CHECK(back.color.at<cv::Vec3f>(0, 0) == color.at<cv::Vec3f>(0, 0));
        CHECK(std::isnan(back.color.at<cv::Vec3f>(1, 1)[0]));
    }
    for (const char* name : {"a.png", "a.jpg"}) {
        write_picture(folder / name, {color, {}});
        const cv::Mat codes = cv::imread((folder / name).string(), cv::IMREAD_UNCHANGED);
        if (std::string(name) == "a.png") {
            CHECK(codes.at<cv::Vec3w>(0, 0) == cv::Vec3w(32768, 65535, 0));
            CHECK(codes.at<cv::Vec3w>(1, 1) == cv::Vec3w(0, 0, 0));
        }
    }
    write_picture(folder / "a.hdr", {cv::Mat(2, 3, CV_32FC3, cv::Scalar(0.5, 2, 1)), {}});
    const Picture radiance = read_picture(folder / "a.hdr"); // 8 bits and a common exponent
    CHECK(cv::norm(radiance.color.at<cv::Vec3f>(0, 0) - cv::Vec3f(0.5f, 2, 1)) < 0.02);
    write_picture(folder / "b.hdr", {color, {}});
    CHECK(radiance.format.bits == 32);
}

TEST_CASE("picture: near and far in a PNG's text are told where the camera has others", "[picture]") {
    const TempFolder folder;
    const cv::Mat codes(4, 8, CV_16UC1, cv::Scalar(30000));
    Bytes png;
    REQUIRE(cv::imencode(".png", codes, png));
    const auto text = [](const std::string& keyword, const std::string& value) {
        Bytes content(keyword.begin(), keyword.end());
        content.push_back(0);
        content.insert(content.end(), value.begin(), value.end());
        return content;
    };
    const auto read = [&](const Bytes& bytes) { return read_depth(put(folder / "a.png", bytes)).near_and_far; };
    CHECK(read(png) == std::array<std::optional<double>, 2>{});
    const auto found =
        read(with_chunk(with_chunk(png, "tEXt", text("zNear", "0.25")), "tEXt", text("Far plane", "40 ")));
    CHECK(found == std::array<std::optional<double>, 2>{0.25, 40});
    CHECK(read(with_chunk(png, "tEXt", text("Far", "away"))) == std::array<std::optional<double>, 2>{});

    Camera camera;
    camera.width = 8;
    camera.height = 4;
    camera.encoding = Encoding::window;
    camera.projection = perspective(1, 2, {0.25, 40});
    camera.near_plane = 0.25;
    camera.far_plane = 40;
    CHECK(!near_and_far_doubt(camera, found));
    const auto doubt = near_and_far_doubt(camera, {0.1, 40});
    REQUIRE(doubt);
    CHECK(in_words(*doubt) ==
          "the text of the file says other ends than the camera, which has near = 0.25; say \"near\": 0.1");
    camera.encoding = Encoding::view_z; // which needs neither
    CHECK(!near_and_far_doubt(camera, {0.1, 40}));
}

TEST_CASE("picture: what a file cannot hold, and what is damaged, is refused", "[picture]") {
    const TempFolder folder;
    const cv::Mat transparent(2, 3, CV_32FC4, cv::Scalar(0.1, 0.1, 0.1, 0.5));
    for (const char* name : {"a.jpg", "a.hdr"}) {
        check_says(
            [&] {
                write_picture(folder / name, {transparent, {}});
            },
            {name, "pixel (0, 0) has an alpha of 0.5", "write a .png, .tif or .exr"});
        CHECK(folder.files() == 0);
    }
    write_picture(folder / "b.jpg", {cv::Mat(2, 3, CV_32FC4, cv::Scalar(0.1, 0.1, 0.1, 1)), {}});

    Bytes longer = encoded(".png", every_code<std::uint8_t>()); // what follows a PNG is no part of it
    longer.insert(longer.end(), 40, 0xff);
    CHECK(read_picture(put(folder / "longer.png", longer)).color.rows == 16);
    cv::Mat noise(24, 24, CV_8UC3);
    cv::randu(noise, 0, 255);
    Bytes data = exif(6, true), thumbnail = encoded(".jpg", noise(cv::Rect(0, 0, 8, 8)).clone());
    data.insert(data.end(), thumbnail.begin(), thumbnail.end()); // whose end is not the picture's
    const Bytes whole = with_segment(encoded(".jpg", noise), 0xe1, std::string("Exif\0\0", 6), data);
    for (std::size_t size = 1; size + 2 < whole.size(); size += 1 + whole.size() / 300) {
        const auto file =
            put(folder / "cut.jpg", Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
        CHECK(refusal([&] { read_picture(file); }).starts_with(file.string()));
    }
    check_says([&] { read_depth(put(folder / "depth.jpg", whole)); }, {"is a JPEG"});
}

// NumPy's arrays, written by the format's documentation (numpy.lib.format), byte for byte; and point clouds, read back.
#include "io_files.hpp"
#include "program.hpp"
#include "tiff_files.hpp"

#include <fathom/io.hpp>

#include <zlib.h>

using namespace fathom;
using namespace fathom::test;

namespace {

std::string header(const std::string& descr, bool fortran, const std::string& shape, int version = 1) {
    std::string text =
        "{'descr': '" + descr + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': " + shape + ", }\n";
    std::string bytes = "\x93NUMPY";
    bytes += static_cast<char>(version);
    bytes += '\0';
    for (std::size_t i = 0, size = text.size(); i < (version == 1 ? 2u : 4u); ++i, size >>= 8)
        bytes += static_cast<char>(size & 0xff);
    return bytes + text;
}

template <typename Element>
void append(std::string& bytes, Element value, bool big) {
    char raw[sizeof(Element)];
    std::memcpy(raw, &value, sizeof(Element));
    if (big == (std::endian::native == std::endian::little))
        std::reverse(std::begin(raw), std::end(raw));
    bytes.append(raw, sizeof(Element));
}

constexpr int rows = 3, cols = 5;

/// What a pixel and a channel hold: whole numbers below 128 in three channels, which every type holds.
int truth(int y, int x, int c) {
    return 1 + x + y * cols + 40 * c;
}

template <typename Element>
std::string array(
    const std::string& type, bool big, bool fortran, int channels = 1, int version = 1,
    const std::function<Element(int)>& as_element = [](int value) { return static_cast<Element>(value); }) {
    std::string shape = "(" + std::to_string(rows) + ", " + std::to_string(cols);
    shape += channels == 1 ? ")" : ", " + std::to_string(channels) + ")";
    std::string bytes = header((big ? ">" : "<") + type, fortran, shape, version);
    const auto put_one = [&](int y, int x, int c) { append(bytes, as_element(truth(y, x, c)), big); };
    if (fortran)
        for (int c = 0; c < channels; ++c)
            for (int x = 0; x < cols; ++x)
                for (int y = 0; y < rows; ++y)
                    put_one(y, x, c);
    else
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < cols; ++x)
                for (int c = 0; c < channels; ++c)
                    put_one(y, x, c);
    return bytes;
}

template <typename Element>
void check_type(const TempFolder& folder, const std::string& type, Storage storage) {
    for (const bool big : {false, true})
        for (const bool fortran : {false, true})
            for (const int version : {1, 2, 3}) {
                INFO(type << (big ? " big-endian" : "") << (fortran ? ", columns first" : "") << ", version "
                          << version);
                const auto depth =
                    read_depth(put(folder / "a.npy", array<Element>(type, big, fortran, 1, version)),
                               {.packing = storage == Storage::uint8 ? std::optional(Packing::uint8) : std::nullopt});
                CHECK(depth.storage == storage);
                REQUIRE(depth.values.size() == cv::Size(cols, rows));
                cv::Mat values;
                depth.values.convertTo(values, CV_64F);
                for (int y = 0; y < rows; ++y)
                    for (int x = 0; x < cols; ++x)
                        CHECK(values.at<double>(y, x) == truth(y, x, 0));
            }
}

/// A picture of any type of array, in both orders of bytes, without and with an alpha.
template <typename Element>
void check_picture(const TempFolder& folder, const std::string& type, float largest, auto&&... as_element) {
    for (const bool big : {false, true})
        for (const int channels : {3, 4}) {
            INFO(type << (big ? " big-endian, " : ", ") << channels << " channels");
            const cv::Mat color =
                read_color(put(folder / "a.npy", array<Element>(type, big, false, channels, 1, as_element...)));
            REQUIRE(color.type() == CV_32FC(channels));
            for (int y = 0; y < rows; ++y)
                for (int x = 0; x < cols; ++x)
                    for (int c = 0; c < channels; ++c) {
                        const int of_file = c == 3 ? 3 : 2 - c; // which holds R, G, B, A; OpenCV's are B, G, R, A
                        CHECK(color.ptr<float>(y, x)[c] == static_cast<float>(truth(y, x, of_file)) / largest);
                    }
        }
}

/// An archive as APPNOTE.TXT of PKWARE has it, with the members' names and bytes.
struct Zip {
    bool deflated = false;
    std::map<std::string, std::string> members = {};

    static std::string number(std::uint64_t value, int count) {
        std::string bytes;
        for (int i = 0; i < count; ++i, value >>= 8)
            bytes += static_cast<char>(value & 0xff);
        return bytes;
    }

    static std::string raw_deflate(const std::string& text) {
        std::string packed(compressBound(text.size()), '\0');
        z_stream stream{};
        REQUIRE(deflateInit2(&stream, 9, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) == Z_OK);
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
        stream.avail_in = static_cast<uInt>(text.size());
        stream.next_out = reinterpret_cast<Bytef*>(packed.data());
        stream.avail_out = static_cast<uInt>(packed.size());
        REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
        packed.resize(stream.total_out);
        deflateEnd(&stream);
        return packed;
    }

    std::string bytes() const {
        std::string all, directory;
        for (const auto& [name, text] : members) {
            const std::string packed = deflated ? raw_deflate(text) : text;
            const auto sum = crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
            const std::string sizes = number(packed.size(), 8) + number(text.size(), 8),
                              method = number(deflated ? 8 : 0, 2) + number(0, 4) + number(sum, 4);
            const std::string two = number(packed.size(), 4) + number(text.size(), 4);
            directory += "PK\x01\x02" + number(45, 2) + number(45, 2) + number(0, 2) + method + two +
                         number(name.size(), 2) + number(0, 2 + 2 + 2 + 2 + 4) + number(all.size(), 4) + name;
            all += "PK\x03\x04" + number(45, 2) + number(0, 2) + method + two + number(name.size(), 2) + number(0, 2) +
                   name + packed;
        }
        return all + directory + "PK\x05\x06" + number(0, 4) + number(members.size(), 2) + number(members.size(), 2) +
               number(directory.size(), 4) + number(all.size(), 4) + number(0, 2);
    }
};

} // namespace

TEST_CASE("npy: every type, byte order and order of axes", "[io]") {
    const TempFolder folder;
    check_type<float>(folder, "f4", Storage::float32);
    check_type<double>(folder, "f8", Storage::float32);
    check_type<std::uint8_t>(folder, "u1", Storage::uint8);
    check_type<std::int8_t>(folder, "i1", Storage::uint8);
    check_type<std::uint16_t>(folder, "u2", Storage::uint16);
    check_type<std::int16_t>(folder, "i2", Storage::uint16);
    std::string heights = header("<i2", false, "(1, 2)");
    append<std::int16_t>(heights, -9999, false);
    append<std::int16_t>(heights, 300, false);
    const DepthFile signed_16 = read_depth(put(folder / "heights.npy", heights)); // floats hold what is below 0
    CHECK(signed_16.storage == Storage::float32);
    CHECK((signed_16.values.at<float>(0, 0) == -9999 && signed_16.values.at<float>(0, 1) == 300));
    check_type<std::uint32_t>(folder, "u4", Storage::uint24);
    check_type<std::int32_t>(folder, "i4", Storage::uint24);
    check_type<std::uint64_t>(folder, "u8", Storage::uint24);
    check_type<std::int64_t>(folder, "i8", Storage::uint24);
    for (const char* type : {"<u4", "<u8", "<i8"}) { // in the high bits
        std::string high = header(type, false, "(1, 2)");
        for (const std::uint64_t code : {0xffffff00u, 0x100u}) {
            if (type[2] == '4')
                append(high, static_cast<std::uint32_t>(code), false);
            else
                append(high, code, false);
        }
        const cv::Mat codes = read_depth(put(folder / "high.npy", high), {.packing = Packing::uint24_high}).values;
        CHECK(static_cast<std::uint32_t>(codes.at<int>(0, 0)) == 0xffffff00u);
        CHECK(codes.at<int>(0, 1) == 0x100);
    }
    std::string bits = header("<u4", false, "(48, 64)"); // of floats: a slanted wall below a sky of 0
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x)
            append(bits, y < 12 ? 0.0f : 600.0f / (60.0f + 2.0f * static_cast<float>(y) + static_cast<float>(x)),
                   false);
    check_says([&] { read_depth(put(folder / "bits.npy", bits)); },
               {"bits.npy", "are the bits of floats", "save floats"});
    std::string halves = header("<f2", false, "(1, 2)");
    append<std::uint16_t>(halves, 0x3c00, false); // 1
    append<std::uint16_t>(halves, 0x7e00, false); // NaN
    const auto depth = read_depth(put(folder / "h.npy", halves));
    CHECK(depth.storage == Storage::float16);
    CHECK(static_cast<float>(depth.values.at<cv::float16_t>(0, 0)) == 1);
    CHECK(std::isnan(static_cast<float>(depth.values.at<cv::float16_t>(0, 1))));
}

TEST_CASE("npy: a float64 is the nearest float, and axes of one element are left out", "[io]") {
    const TempFolder folder;
    for (const char* shape : {"(1, 2)", "(1, 1, 2)", "(1, 2, 1)", "(1, 1, 2, 1)", "(1, 1, 1, 2)"}) {
        std::string bytes = header("<f8", false, shape);
        append(bytes, 0.1, false);
        append(bytes, std::numeric_limits<double>::infinity(), false);
        const cv::Mat values = read_depth(put(folder / "a.npy", bytes)).values;
        REQUIRE(values.size() == cv::Size(2, 1));
        CHECK(values.at<float>(0, 0) == 0.1f);
        CHECK(std::isinf(values.at<float>(0, 1)));
    }
}

TEST_CASE("npy: pictures and normals have channels in the order of the array", "[io]") {
    const TempFolder folder;
    const auto half = [](int value) { return std::bit_cast<std::uint16_t>(cv::float16_t(static_cast<float>(value))); };
    check_picture<std::uint16_t>(folder, "f2", 1, half);
    check_picture<float>(folder, "f4", 1);
    check_picture<double>(folder, "f8", 1);
    check_picture<std::uint8_t>(folder, "u1", 255);
    check_picture<std::uint16_t>(folder, "u2", 65535);
    std::string bytes = header("<f4", false, "(1, 1, 3)");
    for (const float value : {0.0f, 0.6f, 0.8f})
        append(bytes, value, false);
    CHECK(cv::norm(read_normals(put(folder / "n.npy", bytes)).at<cv::Vec3f>(0, 0) - cv::Vec3f(0, 0.6f, 0.8f)) < 1e-7);
}

TEST_CASE("npy: damaged arrays and those that are no image are refused in one line", "[io]") {
    const TempFolder folder;
    const std::string good = array<float>("f4", false, false);
    const auto check = [&](const std::string& bytes, const std::string& said) {
        check_says([&] { read_depth(put(folder / "a.npy", bytes)); }, {"a.npy: ", said});
    };
    for (std::size_t length = 7; length < good.size(); ++length)
        CHECK_THROWS_AS(read_depth(put(folder / "a.npy", good.substr(0, length))), Error);
    check(good.substr(0, good.size() - 1), "ends too early: 5 × 3 pixels do not fit");
    check(good.substr(0, 20), "ends within its header");
    check(header("<c8", false, "(3, 5)"), "is a NumPy array of '<c8'; save floats, or integers");
    check(header("|O", false, "(3, 5)"), "is a NumPy array of '|O'");
    check(header("<f4", false, "(3,)"), "of shape (3,), which is no image");
    check(header("<f4", false, "()"), "of shape (), which is no image");
    check(header("<f4", false, "(2, 3, 5)"), "of shape (2, 3, 5), which is no image");
    check(header("<f4", true, "(3, 5, 3)"), "of channels in Fortran's order");
    check(header("<f4", false, "(0, 5)"), "says it has 5 x 0 pixels");
    check(header("<f4", false, "(99999999999999999999, 5)"), "pixels; it is damaged");
    check(header("<f4", false, "(-3, 5)"), "says it has 5 x -3 pixels");
    std::string negative = header("<i4", false, "(1, 2)");
    append(negative, 7, false);
    append(negative, -7, false);
    check(negative, "pixel (1, 0) holds -7, which is no depth");
    std::string structured = good;
    structured.replace(structured.find("'<f4'"), 5, "[('a'");
    check(structured, "is a NumPy array of [('a'");
    std::string nameless = good;
    nameless.replace(nameless.find("shape"), 5, "shapp");
    check(nameless, "without \"shape\" in its header");
    std::string newer = good;
    newer[6] = 9;
    check(newer, "of format 9; 1 to 3 are read");
}

TEST_CASE("npy: results are float32 in rows, with a header of a multiple of 64 bytes", "[io]") {
    const TempFolder folder;
    for (const int channels : {1, 3, 7}) {
        cv::Mat values(rows, cols, CV_32FC(channels));
        cv::randu(values, -1, 1);
        write_image(folder / "a.npy", values, {});
        const Bytes bytes = get(folder / "a.npy");
        const std::size_t data = values.total() * values.elemSize();
        REQUIRE(bytes.size() > data);
        CHECK((bytes.size() - data) % 64 == 0);
        CHECK(std::memcmp(bytes.data() + bytes.size() - data, values.data, data) == 0);
        const std::string text(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(data));
        CHECK(text.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
        CHECK(text.find("'shape': (3, 5" + (channels > 1 ? ", " + std::to_string(channels) : "") + ")") !=
              std::string::npos);
        CHECK(contains(text, "'descr': '<f4', 'fortran_order': False"));
        CHECK(text.ends_with("\n"));
        CHECK(static_cast<std::size_t>(bytes[8]) + 256 * bytes[9] + 10 == text.size());
    }
}

TEST_CASE("ply: points have the colours and normals of their pixels", "[io]") {
    const TempFolder folder;
    cv::Mat positions(1, 3, CV_32FC3, cv::Scalar(1, 2, 3)), normals(1, 3, CV_32FC3, cv::Scalar(0, 0, 1)),
        colors(1, 3, CV_32FC4, cv::Scalar(0, 0.5, 1, 1));
    positions.at<cv::Vec3f>(0, 1)[2] = std::numeric_limits<float>::quiet_NaN(); // is left out
    normals.at<cv::Vec3f>(0, 2) = {0, 1, 0};
    colors.at<cv::Vec4f>(0, 2) = {0.25f, 0.25f, 0.25f, 0.25f}; // white, a quarter of it there
    write_image(folder / "a.ply", positions, {.normals = normals, .colors = colors});
    const Bytes bytes = get(folder / "a.ply");
    const std::string text(bytes.begin(), bytes.end());
    const auto end = text.find("end_header\n") + 11;
    CHECK(contains(
        text, "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty "
              "float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend"));
    REQUIRE(text.size() - end == 2 * 27);
    const auto float_at = [&](std::size_t at) {
        float value;
        std::memcpy(&value, bytes.data() + end + at, 4);
        return value;
    };
    CHECK((float_at(0) == 1 && float_at(8) == 3 && float_at(12) == 0 && float_at(20) == 1));
    CHECK((float_at(27 + 16) == 1 && float_at(27 + 20) == 0));
    CHECK((bytes[end + 24] == 255 && bytes[end + 25] == 188 && bytes[end + 26] == 0)); // of 1, 0.5, 0 in sRGB
    CHECK((bytes[end + 51] == 255 && bytes[end + 52] == 255 && bytes[end + 53] == 255));
    check_says([&] { write_image(folder / "b.ply", positions, {.normals = cv::Mat(2, 2, CV_32FC3)}); },
               {"b.ply: its normals must be 3 floats for each of the 3 × 1 positions"});
}

TEST_CASE("ply: the program writes colours and normals, and only into .ply", "[io]") {
    const Folder folder;
    const std::string depth = depth_file(folder, "z.tif"), camera = camera_file(folder), cloud = folder / "out/p.ply";
    cv::imwrite(folder / "c.png", cv::Mat(height, width, CV_8UC3, cv::Scalar(10, 20, 30)));
    check_done(
        {"unproject", depth, "--camera", camera, "-o", cloud, "--color", folder / "c.png", "--normals", "--quiet"});
    const std::string text = content(cloud);
    const auto end = text.find("end_header\n") + 11;
    CHECK(contains(text, "element vertex " + std::to_string(width * height - 1)));
    REQUIRE((text.size() - end) % 27 == 0);
    CHECK(text.substr(end + 24, 3) == "\x1e\x14\x0a");
    check_refused({"unproject", depth, "--camera", camera, "-o", folder / "out/p.exr", "--normals"}, 2,
                  "only a .ply holds normals of points");
    check_refused({"unproject", depth, "--camera", camera, "-o", folder / "out/p.exr", "--color", folder / "c.png"}, 2,
                  "only a .ply holds colours of points");
}

TEST_CASE("npz: one array, or one that is named, stored and deflated", "[io]") {
    const TempFolder folder;
    const std::string depth = array<float>("f4", false, false), other = array<std::uint16_t>("u2", false, true);
    for (const bool deflated : {false, true}) {
        const fs::path one = put(folder / "one.npz", Zip{deflated, {{"depth.npy", depth}, {"note.txt", "x"}}}.bytes()),
                       two = put(folder / "two.npz",
                                 Zip{deflated, {{"a/../depth.npy", depth}, {"mask.npy", other}}}.bytes());
        const cv::Mat truth = read_depth(put(folder / "a.npy", depth)).values;
        const DepthFile found = read_depth(one);
        CHECK(found.storage == Storage::float32);
        CHECK(found.channel.empty());
        CHECK(same(found.values, truth));
        CHECK(same(read_depth(one, {.channel = "depth"}).values, truth));
        CHECK(same(read_depth(two, {.channel = "a/../depth"}).values, truth)); // a name, and never a path
        CHECK(read_depth(two, {.channel = "mask"}).storage == Storage::uint16);
        check_says([&] { read_depth(two); }, {"two.npz: holds several arrays", "--channel", "a/../depth, mask"});
        check_says([&] { read_depth(two, {.channel = "dept"}); }, {"has no array \"dept\"", "mask"});
        CHECK(same(read_relative(put(folder / "r.npz", Zip{deflated, {{"r.npy", other}}}.bytes())).values,
                   read_relative(put(folder / "r.npy", other)).values));
    }
}

TEST_CASE("npz: without a name the only image is taken, or the one that is called depth", "[io]") {
    const TempFolder folder;
    const auto of = [](float value) {
        std::string bytes = header("<f4", false, "(6, 7)");
        for (int i = 0; i < 42; ++i)
            append(bytes, value, false);
        return bytes;
    };
    std::string focal = header("<f4", false, "()"), matrix = header("<f8", false, "(4, 4)");
    append(focal, 500.f, false);
    matrix += std::string(128, 'x');
    const std::map<std::string, std::string> beside{
        {"K.npy", matrix}, {"focallength_px.npy", focal}, {"names.npy", header("|O", false, "(6, 7)")}};
    const auto value = [&](std::map<std::string, std::string> members) {
        members.insert(beside.begin(), beside.end());
        return read_depth(put(folder / "a.npz", Zip{true, members}.bytes())).values.at<float>(3, 3);
    };
    CHECK(value({{"z.npy", of(3)}}) == 3);
    CHECK(value({{"confidence.npy", of(1)}, {"depth.npy", of(4)}}) == 4);
    CHECK(value({{"Depth.npy", of(5)}, {"rgb.npy", of(1)}}) == 5);
    check_says([&] { value({{"a.npy", of(1)}, {"b.npy", of(2)}}); }, {"holds several arrays", "a, b, focallength_px"});
    check_says([&] { value({}); }, {"holds several arrays"});
    std::string twice = Zip{false, {{"a.npy", of(1)}, {"b.npy", of(2)}}}.bytes();
    for (std::size_t at = 0; (at = twice.find("b.npy", at)) != std::string::npos;)
        twice[at] = 'a';
    check_says([&] { read_depth(put(folder / "twice.npz", twice)); }, {"two members named \"a.npy\""});
    check_says([&] { read_depth(put(folder / "empty.npz", "PK\5\6" + std::string(18, '\0'))); },
               {"without a NumPy array"});
}

TEST_CASE("npz: of very many arrays one has to be named, which takes no time", "[io]") {
    const TempFolder folder;
    Zip zip{.deflated = true};
    for (int i = 0; i < 65'000; ++i)
        zip.members["image" + std::to_string(i) + ".npy"] = std::string(40, 'x');
    const auto file = put(folder / "a.npz", zip.bytes());
    const auto begin = std::chrono::steady_clock::now();
    check_says([&] { read_depth(file); }, {"a.npz: holds several arrays", "image0, ", "and 64976 more"});
    CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(2));
}

TEST_CASE("npz: what is damaged, lies about its size or takes too much is refused before it is unpacked", "[io]") {
    const TempFolder folder;
    const auto check = [&](const std::string& bytes, const std::string& said, std::size_t memory = 0) {
        check_says([&] { read_depth(put(folder / "a.npz", bytes), {.memory = memory}); }, {"a.npz: ", said});
    };
    const std::string depth = array<float>("f4", false, false);
    for (const bool deflated : {false, true}) {
        const std::string good = Zip{deflated, {{"depth.npy", depth}}}.bytes();
        const cv::Mat truth = read_depth(put(folder / "good.npz", good)).values;
        for (std::size_t length = 5; length < good.size(); ++length)
            CHECK_THROWS_AS(read_depth(put(folder / "a.npz", good.substr(0, length))), Error);
        for (std::size_t i = 4; i < good.size(); ++i) { // no bit is read as if it were right but names and dates
            std::string bad = good;
            bad[i] = static_cast<char>(bad[i] ^ 0x10);
            cv::Mat found;
            try {
                found = read_depth(put(folder / "a.npz", bad)).values;
            } catch (const Error&) {
                continue;
            }
            CHECK(same(found, truth));
        }
        Zip lying{deflated, {{"depth.npy", header("<f4", false, "(30000, 30000)") + std::string(60, 'x')}}};
        check(lying.bytes(), "by its header, and has ");
        check(Zip{deflated, {{"depth.npy", header("|O", false, "(3, 5)")}}}.bytes(), "is a NumPy array of '|O'");
        check(Zip{deflated, {{"depth.npy", "no array"}}}.bytes(), "holds no NumPy array");
        check(Zip{deflated, {{"depth.txt", "no array"}}}.bytes(), "is an archive without a NumPy array");
        check(good, "may be taken; raise --memory", 64);
    }
    Zip large{true, {{"depth.npy", header("<f4", false, "(2048, 2048)") + std::string(std::size_t{16} << 20, '\0')}}};
    CHECK(read_depth(put(folder / "l.npz", large.bytes())).values.rows == 2048);
    check(large.bytes(), "array \"depth\" takes 16 MiB, and 8 may be taken", std::size_t{8} << 20);
    std::string bomb = large.bytes(); // its size is said to be far beyond what its bytes can hold
    const std::size_t at = bomb.find("PK\x01\x02") + 24;
    bomb.replace(at, 4, Zip::number(0x7fffffff, 4));
    check(bomb, "is a damaged or truncated archive");
}

TEST_CASE("npy: COLMAP's maps of depth and normals", "[io]") {
    const TempFolder folder;
    const auto map = [&](int channels) {
        std::string bytes = std::to_string(cols) + "&" + std::to_string(rows) + "&" + std::to_string(channels) + "&";
        for (int c = 0; c < channels; ++c)
            for (int y = 0; y < rows; ++y)
                for (int x = 0; x < cols; ++x)
                    append(bytes, channels == 1 ? static_cast<float>(truth(y, x, c)) : c == 2 ? 1.0f : 0.0f, false);
        return bytes;
    };
    const cv::Mat depth = read_depth(put(folder / "left.jpg.geometric.bin", map(1))).values;
    REQUIRE(depth.size() == cv::Size(cols, rows));
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < cols; ++x)
            CHECK(depth.at<float>(y, x) == static_cast<float>(truth(y, x, 0)));
    CHECK(read_normals(put(folder / "n.bin", map(3))).at<cv::Vec3f>(1, 2) == cv::Vec3f(0, 0, 1));
    const std::string good = map(1);
    for (std::size_t length = 1; length < good.size(); ++length)
        CHECK_THROWS_AS(read_depth(put(folder / "a.bin", good.substr(0, length))), Error);
    check_says([&] { read_depth(put(folder / "a.bin", good + std::string(4, '\0'))); },
               {"a.bin: is damaged", "pixels have 60 bytes, and it has 64"});
    for (const char* bad : {"5&3&2&", "5&-3&1&", "0&3&1&", "99999999999&9999999999&1&", "5&3&1", "5&3&x&", "&&&"})
        CHECK_THROWS_AS(read_depth(put(folder / "a.bin", std::string(bad) + std::string(60, '\0'))), Error);
}

TEST_CASE("npy: equal channels of 16 bits or floats are one, and colours are refused", "[io]") {
    const TempFolder folder;
    for (const char* name : {"a.tif", "a.pfm", "a.npy"}) {
        cv::Mat grey(rows, cols, CV_32FC1);
        cv::randu(grey, 1, 2);
        cv::Mat colors = merged({grey, grey, grey});
        write_image(folder / name, colors);
        CHECK(same(read_depth(folder / name).values, grey));
        colors.at<cv::Vec3f>(2, 3)[1] += 0.25f;
        write_image(folder / name, colors);
        check_says([&] { read_depth(folder / name); }, {"with 3 channels, which holds no depth"});
    }
    cv::Mat codes(rows, cols, CV_16UC1);
    cv::randu(codes, 0, 65535);
    for (const char* name : {"c.png", "c.tif"}) {
        cv::imwrite((folder / name).string(), merged({codes, codes, codes}));
        const DepthFile found = read_depth(folder / name);
        CHECK(found.storage == Storage::uint16);
        CHECK(same(found.values, codes));
    }
}

TEST_CASE("npy: a grey map that counts to another number is lengths as it counts, and no fraction of a range", "[io]") {
    const Folder folder;
    const std::string codes = "P5 3 1 2047 \x03\xe8\x07\xd0\x07\xff";
    const std::string file = put(fs::path(folder / "raw.pgm"), codes).string();
    const DepthFile found = read_depth(file, {.as_counted = true});
    CHECK(found.storage == Storage::uint16);
    CHECK(same(found.values, (cv::Mat_<std::uint16_t>(1, 3) << 1000, 2000, 2047)));
    check_says([&] { read_depth(file); }, {"raw.pgm: counts to 2047"});
    write(folder / "mm.json", R"({"perspective": {"fov_y_deg": 60}, "encoding": "view-z", "scale": 0.001})");
    check_done({"linearize", file, "--camera", folder / "mm.json", "-o", folder / "out/z.npy", "--quiet"});
    CHECK(same(channel(folder / "out/z.npy"), (cv::Mat_<float>(1, 3) << 1.f, 2.f, 2.047f)));
    write(folder / "window.json", R"({"perspective": {"fov_y_deg": 60, "near": 0.1, "far": 9}})");
    check_refused({"linearize", file, "--camera", folder / "window.json", "-o", folder / "out/w.npy"}, 1,
                  "or say that they are lengths");
}

TEST_CASE("npy: a TIFF of doubles is read as floats, and its pages are told", "[io]") {
    const Folder folder;
    const std::string file = folder / "a.tif", camera = folder / "camera.json";
    cv::Mat doubles(rows, cols, CV_64FC1), floats;
    cv::randu(doubles, 1, 2);
    doubles.convertTo(floats, CV_32F);
    cv::imwrite(file, doubles);
    CHECK(same(read_depth(file).values, floats));
    write(camera, R"({"perspective": {"fov_y_deg": 60}, "encoding": "view-z"})");
    const Arguments linearize{"linearize", file, "--camera", camera, "-o", folder / "out/z.npy", "--quiet"};
    check_done(linearize);
    const auto with = [&](std::uint32_t kind, std::uint32_t second) { // of the second image
        const auto add = [&](const char* mode, std::uint32_t type) {
            write_tiff(file, (cv::Mat_<float>(1, 2) << 1, 2), SAMPLEFORMAT_IEEEFP,
                       {.mode = mode, .more = [&](TIFF* tiff) { TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, type); }});
        };
        add("w", kind);
        add("a", second);
        return run(linearize).err;
    };
    CHECK(contains(with(FILETYPE_PAGE, FILETYPE_PAGE), "a.tif: has 2 pages, and the first is taken"));
    CHECK(contains(with(0, 0), "a.tif: has 2 pages, and the first is taken"));
    CHECK(with(0, FILETYPE_REDUCEDIMAGE).empty());
    CHECK(with(0, FILETYPE_MASK).empty());
}

// Files that are missing, cut short or damaged, or on disks that do not answer: one line that says so, nothing else on stderr, no
// crash.
#include "io_files.hpp"
#include "places.hpp"

#include "camera_file/file.hpp"

#include <fathom/import_camera.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <zlib.h>

#include <cerrno>

using namespace fathom;
using namespace fathom::test;

namespace {

/// A depth file of every kind that is read, small enough to be cut at every byte.
std::vector<fs::path> samples(const TempFolder& folder) {
    cv::Mat floats(9, 16, CV_32FC1);
    cv::randu(floats, 0.5f, 9.0f);
    cv::Mat codes(9, 16, CV_16UC1);
    cv::randu(codes, 0, 65536);
    std::vector<fs::path> files;
    for (const std::string name : {"a.exr", "a.tif", "a.pfm"}) {
        write_image(folder / name, floats);
        files.push_back(folder / name);
    }
    for (const std::string name : {"b.png", "b.tif", "b.pgm"}) {
        Bytes bytes;
        REQUIRE(cv::imencode(fs::path(name).extension().string(), codes, bytes)); // its directory lies at the end
        files.push_back(put(folder / name, bytes));
    }
    return files;
}

} // namespace

TEST_CASE("damage: what holds images in something else is named, with a way to take them out", "[io]") {
    const TempFolder folder;
    const auto check = [&](const char* name, std::string bytes, const std::vector<std::string>& words) {
        bytes.resize(4096); // zeros
        const auto file = put(folder / name, bytes);
        check_says([&] { read_depth(file); }, words);
        check_says([&] { read_color(file); }, words);
    };
    check("d.npy.gz", "\x1f\x8b\x08", {"gzip", "gunzip"});
    check("d.hdf5", "\x89HDF\r\n\x1a\n", {"HDF5", "h5py"});
    check("d.mkv", "\x1a\x45\xdf\xa3", {"Matroska", "ffmpeg"});
    check("d.bag", "#ROSBAG V2.0\n", {"rosbag", "cv_bridge"});
    check("d.png", std::string(12, '\0') + "\x89PNG\r\n\x1a\n", {"compressedDepth", "12 bytes"});
    check("d.mp4", std::string(3, '\0') + "\x18" + "ftypisom", {"video", "16-bit .png"});
    check("d.dpt", "PIEH", {"Sintel", "numpy.fromfile"});
    check("d.raw", "BT\x8f@", {"is no image", "raw floats with no header"});
}

TEST_CASE("damage: files that cannot be read say why", "[io]") {
    const TempFolder folder;
    check_says([&] { read_depth(folder / "none.exr"); }, {"none.exr: there is no such file"});
    check_says([&] { read_depth(put(folder / "empty.png", "")); }, {"empty.png: is empty"});
    check_says([&] { read_depth(folder.path()); }, {"is a folder"});
    check_says([&] { read_depth(put(folder / "a", "x") / "b.exr"); }, {"b.exr: "});
    check_says([&] { read_depth("/dev/null"); }, {"is no regular file"});
    check_says([&] { read_depth(put(folder / "text.exr", "no image at all")); }, {"is no image that holds depth"});
    check_says([&] { read_camera(folder / "none.json"); }, {"none.json: there is no such file"});
    if (::geteuid() == 0) {
        WARN("root may read everything: permissions are not tested");
        return;
    }
    const auto secret = put(folder / "secret.exr", "x");
    fs::permissions(secret, fs::perms::none);
    check_says([&] { read_depth(secret); }, {"secret.exr: cannot be read", "permissions"});
}

TEST_CASE("damage: a file cut anywhere is refused", "[io]") {
    const TempFolder folder;
    for (const auto& sample : samples(folder)) {
        const auto whole = get(sample);
        REQUIRE_NOTHROW(read_depth(sample));
        const auto cut = folder / ("cut" + sample.extension().string());
        StderrCapture said(folder);
        std::size_t accepted = 0;
        for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 400) {
            put(cut, Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)));
            accepted += refusal([&] { read_depth(cut); }).starts_with("(");
        }
        CHECK(said.end() == "");
        INFO(sample);
        CHECK(accepted <= (sample.extension() == ".tif" ? 4 : 0)); // bytes that say where another page would be
    }
}

TEST_CASE("damage: sizes that a file cannot hold are refused before memory is asked for", "[io]") {
    const TempFolder folder;
    const auto says = [&](const std::string& name, const Bytes& bytes) {
        const auto file = put(folder / name, bytes);
        return refusal([&] { read_picture(file); });
    };
    const auto patched = [](Bytes bytes, std::string_view name, std::size_t behind, const Bytes& value) {
        const Bytes wanted(name.begin(), name.end());
        const auto at = std::search(bytes.begin(), bytes.end(), wanted.begin(), wanted.end());
        REQUIRE(at != bytes.end());
        std::copy(value.begin(), value.end(), at + static_cast<std::ptrdiff_t>(name.size() + behind));
        return bytes;
    };
    const cv::Mat picture(8, 8, CV_8UC3, cv::Scalar(10, 20, 30));
    Bytes png, jpeg, tiff, hdr;
    REQUIRE(cv::imencode(".png", picture, png));
    REQUIRE(cv::imencode(".jpg", picture, jpeg));
    REQUIRE(cv::imencode(".tif", picture, tiff));
    cv::Mat floats;
    picture.convertTo(floats, CV_32F);
    REQUIRE(cv::imencode(".hdr", floats, hdr));

    png = patched(png, "IHDR", 0, {0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30}); // 30000 x 30000
    const uLong sum = crc32_z(0, png.data() + 12, 17);
    png = patched(png, "IHDR", 13,
                  {Bytes::value_type(sum >> 24), Bytes::value_type(sum >> 16), Bytes::value_type(sum >> 8),
                   Bytes::value_type(sum)});
    check_says(says("a.png", png), {"a.png: ends too early: 30000 × 30000 pixels do not fit into"});
    check_says(says("a.jpg", patched(jpeg, "\xff\xc0", 3, {0x75, 0x30, 0x75, 0x30})),
               {"a.jpg: ends too early: 30000 × 30000 pixels do not fit into"});
    check_says(says("a.hdr", patched(hdr, "-Y ", 0, {'9'})), {"a.hdr: "}); // 9 x 8: the rows are not there
    const std::string wide = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n";
    check_says(says("a.hdr", Bytes(wide.begin(), wide.end())), {"a.hdr: ends too early: 30000 × 30000"});

    // A square of 30000 pixels in each of the fields of a TIFF that hold its width and height: 256 and 257.
    for (std::size_t i = 0; i + 12 < tiff.size(); ++i)
        if ((tiff[i] == 0 || tiff[i] == 1) && tiff[i + 1] == 1 && tiff[i + 3] == 0 && tiff[i + 4] == 1) {
            tiff[i + 8] = 0x30;
            tiff[i + 9] = 0x75;
        }
    check_says(says("a.tif", tiff), {"a.tif: ", "write or copy it again"});

    write_image(folder / "a.exr", floats, {.channels = {"R", "G", "B"}});
    const Bytes exr = get(folder / "a.exr");
    const Bytes window{0, 0, 0, 0, 0, 0, 0, 0, 0x2f, 0x75, 0, 0, 7, 0, 0, 0};
    check_says(says("wide.exr", patched(exr, std::string_view("dataWindow\0box2i\0", 17), 4, window)),
               {"wide.exr: ends too early: 30000 × 8 pixels do not fit into"});
    for (const Bytes& size : {Bytes{0xff, 0xff, 0xff, 0x7f}, Bytes{0xff, 0xff, 0xff, 0xff}})
        check_says(says("long.exr", patched(exr, std::string_view("channels\0chlist\0", 16), 0, size)),
                   {"long.exr: is damaged or cut short"});
}

TEST_CASE("damage: what is listed or compared is bounded in number and in time", "[io]") {
    // Seconds: what compares each with each takes minutes, and AddressSanitizer makes allocations about ten times slower.
    const double most = places::sanitized ? 20 : 2;
    const TempFolder folder;
    const auto says = [&](const fs::path& file, const std::function<void()>& read, const std::string& part) {
        const std::clock_t begin = std::clock(); // of the processor: others use it, too
        check_says(read, {file.filename().string() + ": ", part});
        CHECK(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC < most);
    };
    std::string attributes("v/1\x01\2\0\0\0", 8), channels("v/1\x01\2\0\0\0channels\0chlist\0\xff\xff\xff\0", 28);
    for (int i = 0; i < 200'000; ++i) {
        attributes += "a" + std::to_string(i) + std::string("\0string\0\1\0\0\0x", 13);
        channels += "c" + std::to_string(i) + std::string(17, '\0');
    }
    channels += std::string(1 << 24, '\0');
    for (const auto& [name, text] : {std::pair{"attributes.exr", attributes}, {"channels.exr", channels}}) {
        const auto file = put(folder / name, text);
        says(
            file, [&] { read_depth(file); }, "names of attributes, types and channels");
    }
    std::string list = "1";
    for (int i = 1; i < 500'000; ++i)
        list += ",1";
    for (const auto& [name, text] :
         {std::pair{"matrix.yaml", "camera_matrix: [" + list + "]\n"},
          {"lens.yaml", "camera_matrix: [9,0,1,0,9,1,0,0,1]\ndistortion_coefficients: {data: [" + list + "]}\n"},
          {"ros.yaml", "K: [9,0,1,0,9,1,0,0,1]\nD: [" + list + "]\n"}}) {
        const auto file = put(folder / name, text);
        says(
            file, [&] { import_camera(file); }, "has 500000 numbers");
    }
}

TEST_CASE("damage: an EXR whose tiles are far larger than its image is refused", "[io]") {
    const TempFolder folder;
    std::ifstream seed(fs::path(places::sources) / "tests/fuzz/corpus/exr/found_tile_of_a_small_image",
                       std::ios::binary);
    seed.get(); // the target's choice
    const std::string bytes(std::istreambuf_iterator<char>(seed), {});
    check_says([&] { read_depth(put(folder / "tiles.exr", bytes)); },
               {"tiles.exr: has tiles of 23000 x 23000 pixels", "smaller tiles"});
}

TEST_CASE("damage: files that are far longer than what they hold are refused unread", "[io]") {
    constexpr std::uintmax_t bytes = std::uintmax_t{20} << 30; // of zeros, which take no room on the disk
    const TempFolder folder;
    const std::string ihdr("\0\0\0\rIHDR\0\0\0\x0a\0\0\0\x0a", 16);
    const std::string array = "{'descr': '<f4', 'fortran_order': False, 'shape': (10, 10), }";
    const std::pair<const char*, std::string> beginnings[] = {
        {"a.pfm", "Pf\n10 10\n-1\n"},          {"a.pgm", "P5\n10 10\n65535\n"},
        {"a.png", "\x89PNG\r\n\x1a\n" + ihdr}, {"a.npy", std::string("\x93NUMPY\x01\0\x76\0", 10) + array},
        {"a.jpg", "\xff\xd8\xff\xe0"},         {"a.hdr", "#?RADIANCE\n"},
    };
    for (const auto& [name, beginning] : beginnings) {
        CAPTURE(name);
        const auto file = put(folder / name, beginning);
        fs::resize_file(file, bytes);
        check_says([&] { read_picture(file); }, {name, "has 21474836480 bytes", "check that it is the right one"});
    }
    const auto noise = put(folder / "noise.png", "xx");
    fs::resize_file(noise, bytes);
    check_says([&] { read_depth(noise); }, {"noise.png: is no image that holds depth"});
    const auto camera = put(folder / "camera.json", "{");
    fs::resize_file(camera, bytes);
    check_says([&] { read_camera(camera); }, {"camera.json: has 21474836480 bytes"});
    check_says([&] { import_camera(camera); }, {"camera.json: has 21474836480 bytes"});
}

TEST_CASE("disks: one that does not answer is told from a file that is forbidden or not there", "[io]") {
    CHECK_THROWS_AS(io::refuse_read("a.exr", EIO), io::UnansweredRead);
    CHECK_THROWS_AS(io::check_answer("a.exr", {EIO, std::generic_category()}), io::UnansweredRead);
    for (const int error : {EACCES, ENOENT}) {
        try {
            io::refuse_read("a.exr", error);
        } catch (const io::UnansweredRead&) {
            FAIL("is told as a disk that does not answer");
        } catch (const Error&) {
        }
        CHECK_NOTHROW(io::check_answer("a.exr", {error, std::generic_category()}));
    }
}

TEST_CASE("disks: two names of one file are the same, and no name of none is", "[io]") {
    const TempFolder folder;
    const fs::path file = put(folder / "a", std::string("text")), link = folder / "b";
    CHECK_FALSE(io::is_same(file, link));
    CHECK_FALSE(io::is_same(link, link));
    fs::create_symlink(file, link);
    CHECK(io::is_same(file, link));
    CHECK(io::whole_path(link) == fs::canonical(file));
    CHECK(io::whole_path(folder / "none" / ".." / "a") == fs::canonical(file));
    CHECK(io::whole_path("").empty());
}

// Results into files: every format holds what it was given, and whatever goes wrong leaves nothing behind.
#include "io_files.hpp"
#include "matrices.hpp"

#include <fathom/io.hpp>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <sys/resource.h>

#include <csignal>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

cv::Mat floats(int channels) {
    cv::Mat image(5, 7, CV_32FC(channels));
    cv::randu(image, -9.0f, 9.0f);
    image.ptr<float>(1)[2] = infinity;
    image.ptr<float>(3)[4] = not_a_number;
    return image;
}

/// While it lives no file grows beyond this size: what a full disk looks like to a program.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &kept_);
        const rlimit small{bytes, kept_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &small);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;
    ~FileSizeLimit() {
        ::setrlimit(RLIMIT_FSIZE, &kept_);
        std::signal(SIGXFSZ, handler_);
    }

private:
    rlimit kept_{};
    void (*handler_)(int);
};

} // namespace

TEST_CASE("write: depth comes back bit for bit from .exr, .tif and .pfm", "[io]") {
    const TempFolder folder;
    const auto z = floats(1);
    for (const std::string name : {"z.exr", "z.tif", "z.TIFF", "z.pfm"}) {
        write_image(folder / name, z, {.channels = {"Z"}});
        CHECK(same(read_depth(folder / name).values, z));
    }
    CHECK(folder.files() == 4);
}

TEST_CASE("write: part of a matrix is written as what it shows", "[io]") {
    const TempFolder folder;
    const auto part = floats(1)(cv::Rect(2, 1, 3, 4));
    for (const std::string name : {"z.exr", "z.tif", "z.pfm"}) {
        write_image(folder / name, part);
        CHECK(same(read_depth(folder / name).values, part.clone()));
    }
}

TEST_CASE("write: exr channels have the names and the order they were given", "[io]") {
    const TempFolder folder;
    const auto image = floats(4);
    const std::vector<std::string> names{"coc", "near", "focus", "far"};
    write_image(folder / "a.exr", image, {.channels = names});
    for (int c = 0; c < 4; ++c)
        CHECK(same(read_depth(folder / "a.exr", {.channel = names[static_cast<std::size_t>(c)]}).values,
                   plane(image, c)));
    for (const std::vector<std::string>& wrong :
         {std::vector<std::string>{}, {"a", "b", "c"}, {"a", "b", "c", "c"}, {"a", "b", "c", ""}})
        check_says([&] { write_image(folder / "b.exr", image, {.channels = wrong}); }, {"a name of its own"});
    CHECK(folder.files() == 1);
}

TEST_CASE("write: x, y, z lie in that order in .tif and .pfm", "[io]") {
    const TempFolder folder;
    for (const int channels : {3, 4}) {
        const auto image = floats(channels);
        for (const std::string name : {"p.tif", "p.pfm"}) {
            if (channels == 4 && name == "p.pfm")
                continue;
            write_image(folder / name, image);
            const auto bytes =
                get(folder / name); // uncompressed: .tif behind its first 8 bytes, .pfm from below at the end
            const auto row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
            for (int y = 0; y < image.rows; ++y) {
                const auto row = static_cast<std::size_t>(y) * row_bytes;
                const auto at = name == "p.tif" ? 8 + row : bytes.size() - row - row_bytes;
                CHECK(std::memcmp(bytes.data() + at, image.ptr(y), row_bytes) == 0);
            }
        }
        const auto seen = cv::imread((folder / "p.tif").string(), cv::IMREAD_UNCHANGED); // another reader: z, y, x
        REQUIRE(seen.type() == image.type());
        CHECK(same(plane(seen, 2), plane(image, 0)));
        CHECK(same(plane(seen, 0), plane(image, 2)));
    }
}

TEST_CASE("write: png takes a scale, rounds and clips", "[io]") {
    const TempFolder folder;
    const cv::Mat image = (cv::Mat_<float>(1, 7) << 0, 0.5f, 1, 2, -1, not_a_number, infinity);
    check_says([&] { write_image(folder / "v.png", image); }, {"--png-scale"});
    write_image(folder / "v.png", image, {.png_scale = 1.0});
    const cv::Mat expected = (cv::Mat_<ushort>(1, 7) << 0, 32768, 65535, 65535, 0, 0, 65535);
    CHECK(same(read_depth(folder / "v.png").values, expected));
    write_image(folder / "v.png", image, {.png_scale = 0.5});
    CHECK(read_depth(folder / "v.png").values.at<ushort>(0, 2) == 32768);

    write_image(folder / "v.png", image, {.png_scale = 0.5, .png_offset = 0.5});
    const cv::Mat signs = (cv::Mat_<ushort>(1, 7) << 32768, 49151, 65535, 65535, 0, 0, 65535);
    CHECK(same(read_depth(folder / "v.png").values, signs));

    write_image(folder / "n.png", cv::Mat(1, 1, CV_32FC3, cv::Scalar(0.25, 0.5, 1)), {.png_scale = 1.0});
    const auto bgr = cv::imread((folder / "n.png").string(), cv::IMREAD_UNCHANGED);
    CHECK(bgr.at<cv::Vec3w>(0, 0) == cv::Vec3w(65535, 32768, 16384));
}

TEST_CASE("write: what cannot be written is refused, and nothing is left behind", "[io]") {
    const TempFolder folder;
    const auto z = floats(1);
    check_says([&] { write_image(folder / "z.jpg", z); }, {"\".jpg\"", ".exr, .tif, .pfm, .npy, .png or .ply"});
    check_says([&] { write_image(folder / "z", z); }, {"the extension \"\""});
    check_says([&] { write_image(folder / "z.pfm", floats(4)); }, {"1 or 3 channels"});
    check_says([&] { write_image(folder / "z.exr", cv::Mat(2, 2, CV_64FC1, cv::Scalar(1))); }, {"32-bit floats"});
    check_says([&] { write_image(folder / "z.exr", cv::Mat()); }, {"32-bit floats"});
    check_says([&] { write_color(folder / "grey.exr", z); }, {"a picture has 3 or 4 channels"});
    check_says([&] { write_image(folder / "none" / "z.exr", z); }, {"there is no folder", "none"});
    CHECK(folder.files() == 0);

    fs::create_directory(folder / "folder.exr");
    check_says([&] { write_image(folder / "folder.exr", z); }, {"is a folder"});
    put(folder / "file", "x");
    check_says([&] { write_image(folder / "file" / "z.exr", z); }, {"cannot be written"});
    fs::create_symlink("/dev/full", folder / "full.pfm");
    check_says([&] { write_image(folder / "full.pfm", z); }, {"is no regular file"});
    CHECK(folder.files() == 3);
}

TEST_CASE("write: a full disk leaves the old file as it was and nothing beside it", "[io]") {
    const TempFolder folder;
    cv::Mat large(400, 400, CV_32FC1);
    cv::randu(large, 0.0f, 1.0f);
    for (const std::string name : {"z.exr", "z.tif", "z.pfm"}) {
        put(folder / name, "old");
        std::string said;
        {
            const FileSizeLimit full(4096);
            said = refusal([&] { write_image(folder / name, large); });
        }
        check_says(said, {name + ": cannot be written", "free some space"});
        CHECK(get(folder / name) == Bytes{'o', 'l', 'd'});
    }
    CHECK(folder.files() == 3);
}

TEST_CASE("write: of images that belong together all are written or none", "[io]") {
    const TempFolder folder;
    cv::Mat large(400, 400, CV_32FC1, cv::Scalar(1));
    const cv::Mat small = floats(1);
    put(folder / "a.pfm", "old");
    for (const auto& name : {"z.jpg", "none/z.exr"})
        CHECK_THROWS_AS(write_images({{folder / "a.pfm", small}, {folder / "b.exr", small}, {folder / name, small}}),
                        Error);
    {
        const FileSizeLimit full(4096);
        CHECK_THROWS_AS(write_images({{folder / "a.pfm", small}, {folder / "b.pfm", large}}), Error);
    }
    CHECK(get(folder / "a.pfm") == Bytes{'o', 'l', 'd'});
    CHECK(folder.files() == 1);
    write_images({{folder / "a.pfm", small}, {folder / "b.pfm", large}});
    CHECK(same(read_depth(folder / "a.pfm").values, small));
    CHECK(same(read_depth(folder / "b.pfm").values, large));
}

TEST_CASE("write: a file keeps its permissions and a link keeps pointing", "[io]") {
    const TempFolder folder;
    const auto z = floats(1);
    put(folder / "real.exr", "old");
    fs::permissions(folder / "real.exr", fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
    fs::create_symlink("real.exr", folder / "link.exr");
    write_image(folder / "link.exr", z);
    CHECK(fs::is_symlink(folder / "link.exr"));
    fs::create_symlink("not-yet.exr", folder / "dangling.exr");
    write_image(folder / "dangling.exr", z);
    CHECK(fs::is_symlink(folder / "dangling.exr"));
    CHECK(fs::is_regular_file(folder / "not-yet.exr"));
    CHECK(same(read_depth(folder / "real.exr").values, z));
    CHECK(fs::status(folder / "real.exr").permissions() ==
          (fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read));
    CHECK(folder.files() == 4);
}

TEST_CASE("write: names may be as long as names can be, and relative", "[io]") {
    const TempFolder folder;
    const auto long_name = std::string(251, 'n') + ".exr";
    write_image(folder / long_name, floats(1));
    CHECK(fs::exists(folder / long_name));
    const auto kept = fs::current_path();
    fs::current_path(folder.path());
    CHECK_NOTHROW(write_image("here.pfm", floats(1)));
    fs::current_path(kept);
    CHECK(fs::exists(folder / "here.pfm"));
}

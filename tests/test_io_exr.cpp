// Depth out of OpenEXR files: which channel, which window, which of them are refused.
#include "exr_files.hpp"
#include "io_files.hpp"
#include "matrices.hpp"

#include <fathom/io.hpp>

#include <OpenEXR/ImfFloatVectorAttribute.h>

#include <opencv2/core.hpp>

using namespace fathom;
using namespace fathom::test;
using Imath::Box2i;
using Imath::V2i;

namespace {

double value(const cv::Mat& image, int x, int y) {
    if (image.type() == CV_32SC1)
        return image.at<int>(y, x);
    return image.type() == CV_16FC1 ? static_cast<float>(image.at<cv::float16_t>(y, x)) : image.at<float>(y, x);
}

/// Every pixel of the display window: channel `c` inside the data window, NaN outside.
void check_pixels(const cv::Mat& image, const ExrImage& picture, std::size_t c) {
    REQUIRE(image.size() == cv::Size(picture.display.size().x + 1, picture.display.size().y + 1));
    int wrong = 0;
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            const V2i at(x + picture.display.min.x, y + picture.display.min.y);
            const auto found = value(image, x, y);
            wrong += picture.data.intersects(at) ? found != truth(c, at.x, at.y) : !std::isnan(found);
        }
    CHECK(wrong == 0);
}

} // namespace

TEST_CASE("exr: names of channels are printable in a refusal, whatever bytes they are", "[io]") {
    const TempFolder folder;
    const auto file = write(folder / "a.exr", {.channels = {"\xff\xc2", "\x1b[31m", "Höhe", "\xc2\x9b"}});
    const auto said = refusal([&] { read_depth(file); });
    check_says(said, {"\\xff\\xc2", " [31m", "Höhe", "\\xc2\\x9b"});
    CHECK(!contains(said, '\xff'));
}

TEST_CASE("exr: the channel that is named like depth is taken", "[io]") {
    const TempFolder folder;
    struct Case {
        std::vector<std::string> channels;
        std::string taken;
    };
    const Case cases[] = {
        {{"Z"}, "Z"},
        {{"R", "G", "B", "A", "Z"}, "Z"},
        {{"ViewLayer.Depth.Z", "ViewLayer.Position.X", "ViewLayer.Position.Y", "ViewLayer.Position.Z"},
         "ViewLayer.Depth.Z"},
        {{"ViewLayer.Depth.V", "ViewLayer.Mist.V"}, "ViewLayer.Depth.V"},
        {{"R", "V"}, "V"},
        {{"R", "depth.V"}, "depth.V"},
        {{"A", "Y"}, "Y"},
        {{"disparity"}, "disparity"},
        {{"V", "Z", "Layer.Depth.Z"}, "Z"},
        {{"Layer.Depth.Z", "V", "Y"}, "Layer.Depth.Z"},
        {{"B", "Depth", "G", "R", "Y"}, "Depth"},
        {{"A", "ZDepth"}, "ZDepth"},
        {{"B", "G", "R", "left.Z"}, "left.Z"},
        {{"N.X", "N.Y", "N.Z", "left.Z"}, "left.Z"},
        {{"Depth", "U", "V"}, "Depth"},
        {{"distance", "Y"}, "distance"},
    };
    for (const auto& each : cases) {
        const ExrImage picture{.channels = each.channels};
        const auto depth = read_depth(write(folder / "a.exr", picture));
        CHECK(depth.channel == each.taken);
        const auto at = std::find(each.channels.begin(), each.channels.end(), each.taken) - each.channels.begin();
        check_pixels(depth.values, picture, static_cast<std::size_t>(at));
    }
}

TEST_CASE("exr: a channel asked for is taken, whatever it is called", "[io]") {
    const TempFolder folder;
    const ExrImage picture{.channels = {"Z", "far.W"}};
    const auto file = write(folder / "a.exr", picture);
    check_pixels(read_depth(file, {.channel = "far.W"}).values, picture, 1);
    check_says([&] { read_depth(file, {.channel = "Depth"}); }, {"a.exr: has no channel \"Depth\"; it has Z, far.W"});
}

TEST_CASE("exr: R, G and B that are alike are depth, and those that differ a picture", "[io]") {
    const TempFolder folder;
    const auto file = folder / "grey.exr";
    for (const bool half : {false, true})
        for (const int channels : {3, 4}) {
            std::vector<cv::Mat> planes(3, filled(9, 6, [](int x, int y) { return 1 + x + 0.5 * y; }));
            planes.resize(static_cast<std::size_t>(channels), cv::Mat(6, 9, CV_32FC1, cv::Scalar(1)));
            cv::Mat depth = merged(planes);
            depth.ptr<float>(2, 3)[0] = depth.ptr<float>(2, 3)[1] = depth.ptr<float>(2, 3)[2] = NAN;
            const std::vector<std::string> names{"R", "G", "B", "A"};
            const WriteOptions options{
                .channels = {names.begin(), names.begin() + channels}, .png_scale = {}, .half = half};
            write_image(file, depth, options);
            const DepthFile read = read_depth(file);
            REQUIRE(read.values.channels() == 1);
            CHECK(read.storage == (half ? Storage::float16 : Storage::float32));
            for (int y = 0; y < depth.rows; ++y)
                for (int x = 0; x < depth.cols; ++x)
                    CHECK((value(read.values, x, y) == 1 + x + 0.5 * y || (x == 3 && y == 2)));
            CHECK(read_relative(file).values.size() == depth.size());
            depth.ptr<float>(4, 5)[1] += 1;
            write_image(file, depth, options);
            check_says([&] { read_depth(file); }, {"no channel that is named like depth", "B, G, R"});
        }
}

TEST_CASE("exr: without a channel that is named like depth, all are listed", "[io]") {
    const TempFolder folder;
    const auto color = write(folder / "colour.exr", {.channels = {"R", "G", "B"}});
    check_says([&] { read_depth(color); }, {"no channel that is named like depth", "B, G, R"});
    const auto position = write(folder / "position.exr", {.channels = {"X", "Y", "Z"}});
    check_says([&] { read_depth(position); }, {"X, Y, Z"});
    for (const char* result : {"AO", "coc", "near", "confidence"}) // which Y repeats
        check_says(
            [&] {
                read_depth(write(folder / "result.exr", {.channels = {result, "Y"}}));
            },
            {"no channel that is named like depth", result});
}

TEST_CASE("exr: float, half and uint keep their values and say how they are stored", "[io]") {
    const TempFolder folder;
    const std::map<Imf::PixelType, std::pair<int, Storage>> kinds{{Imf::FLOAT, {CV_32FC1, Storage::float32}},
                                                                  {Imf::HALF, {CV_16FC1, Storage::float16}},
                                                                  {Imf::UINT, {CV_32SC1, Storage::uint24}}};
    for (const auto& [type, kind] : kinds)
        for (const auto compression :
             {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::PIZ_COMPRESSION}) {
            const ExrImage picture{.type = type, .compression = compression};
            const auto depth = read_depth(write(folder / "a.exr", picture));
            CHECK(depth.values.type() == kind.first);
            CHECK(depth.storage == kind.second);
            check_pixels(depth.values, picture, 0);
            if (type == Imf::UINT)
                CHECK(read_depth(folder / "a.exr", {.packing = Packing::uint24_high}).storage == Storage::uint24_high);
        }
}

TEST_CASE("exr: the display window is read; NaN outside the data window, overscan cropped", "[io]") {
    const TempFolder folder;
    const Box2i display{{0, 0}, {6, 4}};
    const std::pair<Box2i, Box2i> windows[] = {
        {display, {{2, 1}, {4, 3}}},              // smaller
        {display, {{-3, -2}, {9, 6}}},            // overscan
        {display, {{-3, 2}, {3, 6}}},             // across the lower left corner
        {display, {{0, 0}, {6, 2}}},              // same width
        {display, {{-7, -6}, {-2, -3}}},          // nowhere
        {{{-5, -4}, {2, 1}}, {{-5, -4}, {2, 1}}}, // a display window that does not begin at 0
        {{{3, 2}, {9, 4}}, {{0, 0}, {6, 6}}},
    };
    for (const auto& [shown, data] : windows)
        for (const auto type : {Imf::FLOAT, Imf::HALF}) {
            const ExrImage picture{.display = shown, .data = data, .type = type};
            check_pixels(read_depth(write(folder / "a.exr", picture)).values, picture, 0);
            check_pixels(read_depth(write_tiled(folder / "tiled.exr", picture)).values, picture, 0);
        }
}

TEST_CASE("exr: integer depth has no value for nothing", "[io]") {
    const TempFolder folder;
    const ExrImage overscan{.data = {{-3, -2}, {9, 6}}, .type = Imf::UINT};
    check_pixels(read_depth(write(folder / "a.exr", overscan)).values, overscan, 0);
    const auto crop = write(folder / "b.exr", {.data = {{2, 1}, {4, 3}}, .type = Imf::UINT});
    check_says([&] { read_depth(crop); }, {"write depth as float"});
}

TEST_CASE("exr: every part of a multipart file is searched", "[io]") {
    const TempFolder folder;
    const std::vector<ExrImage> parts{{.channels = {"R", "G", "B"}, .part = "colour"},
                                      {.channels = {"X", "Y", "Z"}, .part = "position"},
                                      {.channels = {"Z"}, .type = Imf::HALF, .part = "depth"}};
    const auto file = write(folder / "a.exr", parts);
    const auto depth = read_depth(file);
    CHECK(depth.channel == "depth.Z");
    CHECK(depth.storage == Storage::float16);
    check_pixels(depth.values, parts[2], 0);
    check_pixels(read_depth(file, {.channel = "position.Y"}).values, parts[1], 1);
    check_says([&] { read_depth(file, {.channel = "mist"}); }, {"colour.B", "depth.Z"});
}

TEST_CASE("exr: channels are listed as they can be asked for", "[io]") {
    const TempFolder folder;
    const auto file = write(folder / "a.exr", {{.channels = {"R"}, .type = Imf::UINT, .part = "colour"},
                                               {.channels = {"Z"}, .type = Imf::HALF, .part = "depth"}});
    const auto listed = list_channels(file);
    REQUIRE(listed.size() == 2);
    CHECK((listed[0].name == "colour.R" && listed[0].type == "uint"));
    CHECK((listed[1].name == "depth.Z" && listed[1].type == "half"));
    CHECK(list_channels(write_deep(folder / "deep.exr")).at(0).type == "deep float");
    CHECK(list_channels(put(folder / "a.txt", "no image")).empty());
    check_says([&] { list_channels(folder / "none.exr"); }, {"there is no such file"});
}

TEST_CASE("exr: deep files are refused", "[io]") {
    const TempFolder folder;
    const auto file = write_deep(folder / "deep.exr");
    check_says([&] { read_depth(file); }, {"deep.exr: channel \"Z\" is deep", "flatten"});
}

TEST_CASE("exr: a file whose rows were not all written is refused", "[io]") {
    const TempFolder folder;
    const ExrImage picture{.display = {{0, 0}, {31, 63}}, .data = {{0, 0}, {31, 63}}};
    const auto file = folder / "half.exr";
    {
        const Pixels pixels(picture);
        Imf::OutputFile exr(file.c_str(), header_of(picture));
        exr.setFrameBuffer(pixels.frame);
        exr.writePixels(20);
    }
    check_says([&] { read_depth(file); }, {"half.exr: is incomplete"});
}

TEST_CASE("exr: windows that no image has are refused before memory is asked for", "[io]") {
    const TempFolder folder;
    const ExrImage picture{.compression = Imf::NO_COMPRESSION};
    const auto bytes = get(write(folder / "a.exr", picture));
    const auto at = [&](const std::string& name) {
        return std::search(bytes.begin(), bytes.end(), name.begin(), name.end()) - bytes.begin() +
               static_cast<std::ptrdiff_t>(name.size() + sizeof("box2i") + 1 + 4);
    };
    const Bytes huge{0xff, 0xff, 0xff, 0x3f};
    for (const auto window : {"displayWindow", "dataWindow"})
        for (const std::ptrdiff_t corner : {8, 12}) {
            auto broken = bytes;
            std::copy(huge.begin(), huge.end(), broken.begin() + at(window) + corner);
            const auto file = put(folder / "b.exr", broken);
            check_says([&] { read_depth(file); }, {"b.exr: "});
        }
}

TEST_CASE("exr: attributes that are longer than what they hold are refused", "[io]") {
    const TempFolder folder;
    const auto bytes = get(write(folder / "a.exr", {.more = [](Imf::Header& header) {
                                     header.insert("numbers", Imf::FloatVectorAttribute({1, 2}));
                                 }}));
    for (const std::string type : {"chlist", "floatvector"}) {
        auto longer = bytes;
        const auto size = std::search(longer.begin(), longer.end(), type.begin(), type.end()) +
                          static_cast<std::ptrdiff_t>(type.size() + 1);
        const auto end = size + 4 + *size;
        ++*size;
        longer.insert(end, 0);
        const auto file = put(folder / "longer.exr", longer);
        check_says([&] { read_depth(file); }, {"longer.exr: is damaged or cut short: the sizes in its header"});
    }
}

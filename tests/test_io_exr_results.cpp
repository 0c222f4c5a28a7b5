// Results as OpenEXR: the header of the file that they belong to, its windows, and its channels beside the new ones.
#include "exr_files.hpp"
#include "program.hpp"

#include <fathom/io.hpp>

#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfEnvmapAttribute.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPreviewImage.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfStringVectorAttribute.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/ImfTimeCodeAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

using namespace fathom;
using namespace fathom::test;

namespace {

class Text : public Imf::OStream {
public:
    Text() : OStream("text") {}
    void write(const char c[], int n) override { bytes.append(c, static_cast<std::size_t>(n)); }
    std::uint64_t tellp() override { return bytes.size(); }
    void seekp(std::uint64_t) override { FAIL("attributes are written in one go"); }

    std::string bytes;
};

using Attributes = std::map<std::string, std::string>; ///< type and bytes of each

Attributes attributes_of(const Imf::Header& header) {
    Attributes all;
    for (auto each = header.begin(); each != header.end(); ++each) {
        Text text;
        each.attribute().writeValueTo(text, 1);
        all[each.name()] = std::string(each.attribute().typeName()) + ":" + text.bytes;
    }
    return all;
}

/// What a result's header has of its own; the rest is its source's.
Attributes inherited(const Imf::Header& header) {
    Attributes all = attributes_of(header);
    for (const char* own : {"channels", "compression", "chunkCount", "dataWindow", "lineOrder", "preview", "tiles",
                            "type", "version", "maxSamplesPerPixel"})
        all.erase(own);
    return all;
}

void dress(Imf::Header& header) {
    header.insert("comments", Imf::StringAttribute("a shot"));
    header.insert("studio/frame", Imf::IntAttribute(1001));
    header.insert("worldToCamera", Imf::M44fAttribute(Imath::M44f(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1)));
    header.insert("layers", Imf::StringVectorAttribute({"a", "b"}));
    Imf::addChromaticities(header, Imf::Chromaticities());
    Imf::addTimeCode(header, Imf::TimeCode(1, 2, 3, 4));
    Imf::addEnvmap(header, Imf::ENVMAP_LATLONG);
    Imf::addXDensity(header, 72);
    header.pixelAspectRatio() = 1.5f;
    header.screenWindowCenter() = Imath::V2f(0.25f, -0.5f);
    header.screenWindowWidth() = 2;
    header.setPreviewImage(Imf::PreviewImage(2, 2));
}

cv::Mat values_of(cv::Size size, int channels) {
    cv::Mat values(size, CV_32FC(channels));
    for (int y = 0; y < size.height; ++y)
        for (int i = 0; i < size.width * channels; ++i)
            values.ptr<float>(y)[i] = static_cast<float>(y * 100 + i) / 7;
    return values;
}

cv::Rect window_of(const ExrImage& picture) {
    const auto first = picture.data.min - picture.display.min, size = picture.data.size() + V2i(1, 1);
    return {first.x, first.y, size.x, size.y};
}

cv::Size size_of(const Box2i& box) {
    return {box.size().x + 1, box.size().y + 1};
}

/// Channels of a part of a file, the numbers of their types in front of their bits.
std::map<std::string, std::string> bits_of(const fs::path& file, int number) {
    std::map<std::string, std::string> all;
    Imf::MultiPartInputFile exr(file.c_str());
    Imf::InputPart part(exr, number);
    const Box2i window = part.header().dataWindow();
    std::map<std::string, cv::Mat> planes;
    Imf::FrameBuffer frame;
    const Imf::ChannelList& channels = part.header().channels();
    for (auto each = channels.begin(); each != channels.end(); ++each) {
        cv::Mat& plane = planes[each.name()];
        plane.create(size_of(window), each.channel().type == Imf::HALF ? CV_16UC1 : CV_32SC1);
        frame.insert(each.name(),
                     Imf::Slice::Make(each.channel().type, plane.data, window, plane.elemSize(), plane.step));
    }
    part.setFrameBuffer(frame);
    part.readPixels(window.min.y, window.max.y);
    for (const auto& [name, plane] : planes)
        all[name] = std::to_string(channels.findChannel(name)->type) +
                    std::string(reinterpret_cast<const char*>(plane.data), plane.total() * plane.elemSize());
    return all;
}

/// The packed bytes of all chunks of a part.
std::string packed(const fs::path& file, int number) {
    Imf::MultiPartInputFile exr(file.c_str());
    const Imf::Header& header = exr.header(number);
    const std::string type = header.hasType() ? header.type() : header.hasTileDescription() ? Imf::TILEDIMAGE : "";
    const Box2i window = header.dataWindow();
    std::string all;
    const char* bytes = nullptr;
    int count = 0;
    if (type == Imf::TILEDIMAGE) {
        Imf::TiledInputPart part(exr, number);
        for (int l = 0; l < part.numLevels(); ++l)
            for (int y = 0; y < part.numYTiles(l); ++y)
                for (int x = 0; x < part.numXTiles(l); ++x) {
                    int tx = x, ty = y, lx = l, ly = l;
                    part.rawTileData(tx, ty, lx, ly, bytes, count);
                    all.append(bytes, static_cast<std::size_t>(count));
                }
    } else if (type == Imf::DEEPSCANLINE) {
        Imf::DeepScanLineInputPart part(exr, number);
        for (int y = window.min.y; y <= window.max.y; ++y) {
            std::uint64_t size = 0;
            part.rawPixelData(y, nullptr, size);
            std::string chunk(size, '\0');
            part.rawPixelData(y, chunk.data(), size);
            all += chunk;
        }
    } else {
        Imf::InputPart part(exr, number);
        for (int y = window.min.y; y <= window.max.y; ++y) {
            part.rawPixelData(y, bytes, count);
            all.append(bytes, static_cast<std::size_t>(count));
        }
    }
    return all;
}

ExrSource source_of(const fs::path& file, const ExrImage& picture, bool append = false) {
    return {file, picture.channels.front(), {window_of(picture), size_of(picture.display)}, append};
}

/// Every part of `old` is in `result` as it was, and one more is called `name`.
void check_copied(const fs::path& result, const fs::path& old, const std::string& name) {
    const Imf::MultiPartInputFile a(old.c_str()), b(result.c_str());
    REQUIRE(b.parts() == a.parts() + 1);
    for (int i = 0; i < a.parts(); ++i) {
        Attributes before = attributes_of(a.header(i)), after = attributes_of(b.header(i));
        for (const char* of_parts : {"chunkCount", "type", "name"}) { // which a file of one part does not need
            after.erase(of_parts);
            before.erase(of_parts);
        }
        CHECK(after == before);
        CHECK(packed(result, i) == packed(old, i));
    }
    CHECK(b.header(a.parts()).name() == name);
}

} // namespace

TEST_CASE("exr results: a header keeps all attributes of its source, and both windows", "[io]") {
    const TempFolder folder;
    for (const auto& [display, data] : {std::pair<Box2i, Box2i>{{{0, 0}, {6, 4}}, {{0, 0}, {6, 4}}},
                                        {{{0, 0}, {6, 4}}, {{-3, -2}, {9, 6}}},
                                        {{{0, 0}, {6, 4}}, {{2, 1}, {4, 4}}},
                                        {{{-5, 7}, {2, 9}}, {{-9, 3}, {-1, 8}}}}) {
        const ExrImage picture{.display = display, .data = data, .part = "beauty", .more = dress};
        const fs::path file = write(folder / "a.exr", picture), result = folder / "b.exr";
        write_image(result, values_of(size_of(data), 3),
                    {.channels = {"N.X", "N.Y", "N.Z"}, .source = source_of(file, picture)});
        const Imf::MultiPartInputFile exr(result.c_str());
        CHECK(inherited(exr.header(0)) == inherited(Imf::MultiPartInputFile(file.c_str()).header(0)));
        CHECK(exr.header(0).dataWindow() == data);
        CHECK(exr.header(0).displayWindow() == display);
        CHECK(exr.header(0).name() == "beauty");
        CHECK(!exr.header(0).hasPreviewImage());
        CHECK(inherited(exr.header(0)).size() > 12);
    }
}

TEST_CASE("exr results: the part of the channel gives the header", "[io]") {
    const TempFolder folder;
    const std::vector<ExrImage> parts{{.channels = {"R"}, .part = "colour"},
                                      {.data = {{1, 1}, {4, 3}}, .channels = {"Z"}, .part = "depth"}};
    const fs::path file = write(folder / "a.exr", parts), result = folder / "b.exr";
    ExrSource source = source_of(file, parts[1]);
    source.channel = "depth.Z";
    write_image(result, values_of({4, 3}, 1), {.channels = {"AO"}, .source = source});
    const Imf::MultiPartInputFile exr(result.c_str());
    CHECK(exr.parts() == 1);
    CHECK(exr.header(0).name() == "depth");
    CHECK(exr.header(0).dataWindow() == parts[1].data);
}

TEST_CASE("exr results: channels are added to a flat file that keeps every bit", "[io]") {
    const TempFolder folder;
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION})
        for (const auto type : {Imf::HALF, Imf::FLOAT, Imf::UINT}) {
            const ExrImage picture{.data = {{-1, 0}, {8, 3}},
                                   .channels = {"R", "Z", "matte.id"},
                                   .type = type,
                                   .compression = compression,
                                   .more = dress};
            const fs::path file = write(folder / "a.exr", picture), result = folder / "b.exr";
            const cv::Mat values = values_of(size_of(picture.data), 1);
            write_image(result, values, {.channels = {"AO"}, .source = source_of(file, picture, true)});
            auto bits = bits_of(result, 0);
            CHECK(bits["AO"] == std::to_string(Imf::FLOAT) +
                                    std::string(reinterpret_cast<const char*>(values.data), values.total() * 4));
            bits.erase("AO");
            CHECK(bits == bits_of(file, 0));
            const Imf::MultiPartInputFile exr(result.c_str());
            CHECK(exr.parts() == 1);
            CHECK(exr.header(0).compression() == compression);
            CHECK(inherited(exr.header(0)) == inherited(Imf::MultiPartInputFile(file.c_str()).header(0)));
            check_says(
                [&] {
                    write_image(folder / "c.exr", values,
                                {.channels = {"R"}, .source = source_of(file, picture, true)});
                },
                {"c.exr: cannot have two channels \"R\"", "a.exr has one"});
            CHECK(!fs::exists(folder / "c.exr"));
        }
}

TEST_CASE("exr results: a part is added beside unchanged copies of all others", "[io]") {
    const TempFolder folder;
    const fs::path result = folder / "b.exr";
    const cv::Mat values = values_of({7, 5}, 3);
    const auto append = [&](const fs::path& file, const std::string& channel) {
        WriteOptions options{.channels = {"N.X", "N.Y", "N.Z"}};
        options.source = ExrSource{file, channel, {{0, 0, 7, 5}, {7, 5}}, true};
        write_image(result, values, options);
    };
    const auto check_values = [&] {
        for (int i = 0; i < 3; ++i)
            CHECK(same(channel(result, "N.N." + std::string(1, "XYZ"[i])), plane(values, i)));
    };
    SECTION("of a file that loses bits") {
        const fs::path file =
            write(folder / "a.exr", {.channels = {"Z", "R"}, .compression = Imf::DWAA_COMPRESSION, .more = dress});
        append(file, "Z");
        check_copied(result, file, "N");
        check_values();
    }
    SECTION("of tiles") {
        const fs::path file = write_tiled(folder / "a.exr", {.more = dress});
        append(file, "Z");
        check_copied(result, file, "N");
        check_values();
    }
    SECTION("of several parts, one of which has the name") {
        const fs::path file = write(folder / "a.exr", {{.channels = {"Z"}, .part = "N", .more = {}},
                                                       {.channels = {"R", "G"}, .type = Imf::HALF, .part = "colour"}});
        append(file, "N.Z");
        check_copied(result, file, "N2");
    }
    SECTION("when the result has another data window") {
        const ExrImage wide{.data = {{-2, -2}, {9, 9}}};
        const fs::path file = write(folder / "a.exr", wide);
        append(file, "Z");
        check_copied(result, file, "N");
        check_values();
    }
    SECTION("of a deep part beside a flat one") {
        const fs::path file = folder / "a.exr";
        write_deep_and_flat(file);
        WriteOptions options{.channels = {"AO"}};
        options.source = ExrSource{file, "flat.Z", {{0, 0, 4, 3}, {4, 3}}, true};
        write_image(result, values_of({4, 3}, 1), options);
        check_copied(result, file, "AO");
    }
}

TEST_CASE("exr results: halves round to nearest, and what they cannot hold is refused", "[io]") {
    const TempFolder folder;
    cv::Mat values = values_of({9, 4}, 1);
    values.at<float>(0, 0) = std::numeric_limits<float>::quiet_NaN();
    values.at<float>(0, 1) = std::numeric_limits<float>::infinity();
    values.at<float>(0, 2) = 65519.0f; // the last that rounds to 65504
    write_image(folder / "a.exr", values, {.half = true});
    cv::Mat expected, found = channel(folder / "a.exr", "Z");
    values.convertTo(expected, CV_16F);
    CHECK(same(found, expected));
    values.at<float>(3, 8) = -65520.0f;
    check_says([&] { write_image(folder / "b.exr", values, {.half = true}); },
               {"b.exr: pixel (8, 3) is -65520", "a half ends at 65504"});
}

TEST_CASE("exr results: every compression but dwaa keeps every bit, and the number of threads changes none", "[io]") {
    const TempFolder folder;
    const cv::Mat values = values_of({131, 77}, 3);
    std::map<ExrCompression, std::string> files;
    for (const int threads : {1, 5})
        for (const auto compression : {ExrCompression::none, ExrCompression::zips, ExrCompression::zip,
                                       ExrCompression::piz, ExrCompression::dwaa}) {
            set_exr_threads(threads);
            const fs::path file = folder / "a.exr";
            write_image(file, values, {.channels = {"N.X", "N.Y", "N.Z"}, .compression = compression});
            for (int i = 0; i < 3; ++i) {
                const bool loses = compression == ExrCompression::dwaa && i == 1; // which is named like luminance
                CHECK(same(channel(file, "N." + std::string(1, "XYZ"[i])), plane(values, i)) != loses);
            }
            const std::string bytes = content(file);
            CHECK(files.try_emplace(compression, bytes).first->second == bytes);
        }
    CHECK(std::set<std::string>{files[ExrCompression::none], files[ExrCompression::zips], files[ExrCompression::zip],
                                files[ExrCompression::piz], files[ExrCompression::dwaa]}
              .size() == 5);
}

TEST_CASE("exr results: the program computes overscan and crops where they lie", "[io]") {
    const Folder folder;
    const double f = 20, cx = 7.5, cy = 4;
    const std::string camera = folder / "camera.json";
    write(camera, R"({"intrinsics": {"fx": 20, "fy": 20, "cx": 7.5, "cy": 4}, "encoding": "inverse", "scale": 4096})");
    for (const Box2i& data : {Box2i{{0, 0}, {15, 9}}, Box2i{{-4, -3}, {20, 12}}, Box2i{{5, 2}, {9, 8}}}) {
        const ExrImage picture{.display = {{0, 0}, {15, 9}}, .data = data, .channels = {"Z"}, .more = dress};
        const fs::path file = write(fs::path(folder / "z.exr"), picture);
        const std::string result = folder / "out/p.exr";
        check_done({"unproject", file.string(), "--camera", camera, "-o", result, "--quiet"});
        CHECK(Imf::MultiPartInputFile(result.c_str()).header(0).dataWindow() == data);
        const DepthFile x = read_depth(result, {.channel = "P.X", .packing = {}, .overscan = true}),
                        y = read_depth(result, {.channel = "P.Y", .packing = {}, .overscan = true});
        constexpr double tolerance = 0x1p-22; // two roundings of a float, and those of its constants
        double worst = 0;
        for (int row = 0; row < x.values.rows; ++row)
            for (int col = 0; col < x.values.cols; ++col) {
                const int px = col + data.min.x, py = row + data.min.y;
                const double z = 4096 / truth(0, px, py),
                             size = z * std::max({1.0, std::abs(px - cx), std::abs(py - cy)}) / f;
                worst = std::max({worst, std::abs(x.values.at<float>(row, col) - z * (px + 0.5 - cx) / f) / size,
                                  std::abs(y.values.at<float>(row, col) + z * (py + 0.5 - cy) / f) / size});
            }
        CHECK(worst <= tolerance);
        std::cout << "exr results: positions in a data window of " << x.values.cols << " x " << x.values.rows
                  << " off by at most " << worst << ", allowed " << tolerance << "\n";

        // A file without windows has the display window.
        check_done({"linearize", file.string(), "--camera", camera, "-o", folder / "out/z.pfm", "--quiet"});
        const cv::Mat shown = channel(folder / "out/z.pfm");
        REQUIRE(shown.size() == cv::Size(16, 10));
        for (int row = 0; row < 10; ++row)
            for (int col = 0; col < 16; ++col) {
                const float z = shown.at<float>(row, col);
                CHECK((data.intersects(V2i(col, row)) ? z == Approx(4096 / truth(0, col, row)) : std::isnan(z)));
            }
    }
}

TEST_CASE("exr results: a lens and a region count pixels in the display window", "[io]") {
    const Folder folder;
    const std::string camera = folder / "camera.json";
    write(camera, R"({"intrinsics": {"fx": 20, "fy": 20, "cx": 8, "cy": 5}, "encoding": "inverse", "scale": 4096})");
    const ExrImage small{.display = {{0, 0}, {15, 9}}, .data = {{0, 0}, {15, 9}}},
        large{.display = {{0, 0}, {15, 9}}, .data = {{-4, -3}, {20, 12}}};
    write(fs::path(folder / "small.exr"), small);
    write(fs::path(folder / "large.exr"), large);
    for (const char* name : {"small", "large"}) {
        check_done({"dof-masks", folder / (name + std::string(".exr")), "--camera", camera, "--focus-at", "9,3",
                    "--f-stop", "2", "--focal-length-mm", "45", "--sensor-mm", "36", "--mm-per-unit", "10", "-o",
                    folder / (name + std::string(".coc.exr")), "--quiet"});
        check_done({"ssao", folder / (name + std::string(".exr")), "--camera", camera, "--radius", "20", "--region",
                    "5,4,6,3", "-o", folder / (name + std::string(".ao.exr")), "--quiet"});
        CHECK(Imf::MultiPartInputFile((folder / (name + std::string(".ao.exr"))).c_str()).header(0).dataWindow() ==
              Box2i({5, 4}, {10, 6}));
    }
    const cv::Mat a = channel(folder / "small.coc.exr", "coc"), b = channel(folder / "large.coc.exr", "coc");
    REQUIRE(a.size() == b.size());
    constexpr double tolerance = 0x1p-21; // of two ways to the same constants in double, rounded to float
    CHECK(cv::norm(a, b, cv::NORM_INF) <= tolerance * cv::norm(a, cv::NORM_INF));
    CHECK(std::abs(b.at<float>(3, 9)) <= tolerance * cv::norm(a, cv::NORM_INF));
    check_refused({"ssao", folder / "large.exr", "--camera", camera, "--radius", "20", "--region", "18,0,9,9", "-o",
                   folder / "out/a.exr"},
                  1, "--region 18,0,9,9 reaches beyond the image");
}

TEST_CASE("exr results: pictures and depths beside an overscan lie in the same pixels", "[io]") {
    const Folder folder;
    const std::string camera = folder / "camera.json";
    write(camera, R"({"intrinsics": {"fx": 20, "fy": 20, "cx": 8, "cy": 5}, "encoding": "inverse", "scale": 4096})");
    const ExrImage depth{.display = {{0, 0}, {15, 9}}, .data = {{-4, -3}, {20, 12}}};
    const std::string z = write(fs::path(folder / "z.exr"), depth).string();
    // The picture has another data window, which the result keeps. Without fog it comes out as it went in.
    const ExrImage colors{
        .display = {{0, 0}, {15, 9}}, .data = {{-4, -3}, {9, 12}}, .channels = {"R", "G", "B"}, .more = dress};
    const std::string picture = write(fs::path(folder / "c.exr"), colors).string(), result = folder / "out/f.exr";
    check_done({"fog", z, "--color", picture, "--camera", camera, "-o", result, "--density", "0", "--quiet"});
    const Imf::MultiPartInputFile exr(result.c_str());
    CHECK(exr.header(0).dataWindow() == colors.data);
    CHECK(inherited(exr.header(0)) == inherited(Imf::MultiPartInputFile(picture.c_str()).header(0)));
    const DepthFile red = read_depth(result, {.channel = "R", .packing = {}, .overscan = true});
    CHECK(red.values.at<float>(2, 3) == static_cast<float>(truth(0, -1, -1)));

    // No blur leaves the picture's window either, whether more pixels have a depth or fewer: nothing is NaN, and nothing is cut off.
    for (const Imath::Box2i& window : {colors.data, Imath::Box2i{{2, 1}, {30, 7}}, colors.display}) {
        ExrImage part = colors;
        part.data = window;
        const std::string cut = write(fs::path(folder / "cut.exr"), part).string(), blurred = folder / "out/b.exr";
        check_done({"dof", z, "--color", cut, "--camera", camera, "-o", blurred, "--circle", "9,99", "--quiet"});
        const Imath::Box2i expected{window.min, {std::min(window.max.x, depth.data.max.x), window.max.y}};
        CHECK(Imf::MultiPartInputFile(blurred.c_str()).header(0).dataWindow() == expected);
        const cv::Mat values = read_depth(blurred, {.channel = "R", .packing = {}, .overscan = true}).values;
        CHECK(cv::checkRange(values));
    }
    ExrImage elsewhere = colors;
    elsewhere.data = {{100, 100}, {110, 110}};
    check_refused({"dof", z, "--color", write(fs::path(folder / "elsewhere.exr"), elsewhere).string(), "--camera",
                   camera, "-o", folder / "out/e.exr", "--circle", "9,99"},
                  1, "has no pixel within the data window of the depth");

    // A file without windows is as large as the display window.
    cv::imwrite(folder / "c.png", cv::Mat(10, 16, CV_8UC3, cv::Scalar(10, 20, 30)));
    check_done({"fog", z, "--color", folder / "c.png", "--camera", camera, "-o", folder / "out/g.png", "--density", "0",
                "--quiet"});
    CHECK(same(cv::imread(folder / "out/g.png", cv::IMREAD_UNCHANGED), cv::imread(folder / "c.png")));
    const std::string other =
        write(fs::path(folder / "d.exr"), {.display = {{0, 0}, {20, 9}}, .channels = {"R", "G", "B"}}).string();
    check_refused({"fog", z, "--color", other, "--camera", camera, "-o", folder / "out/h.exr", "--density", "0"}, 1,
                  "d.exr: has a display window of 21 × 10 pixels, and that of the depth is 16 × 10");
}

TEST_CASE("exr results: --append, --half and --compression of the program", "[io]") {
    const Folder folder;
    const std::string camera = camera_file(folder), z = folder / "z.exr";
    ExrImage picture{.display = {{0, 0}, {width - 1, height - 1}}, .channels = {"Z", "R", "G", "B"}};
    picture.data = picture.display;
    write(fs::path(z), picture);
    write(folder / "camera.json",
          R"({"perspective": {"fov_y_deg": 60, "near": 0.1}, "encoding": "inverse", "scale": 4096})");
    struct Case {
        Arguments arguments;
        std::vector<std::string> added;
    };
    for (const Case& each :
         {Case{{"linearize"}, {"linear.Z"}}, Case{{"normals"}, {"N.X", "N.Y", "N.Z"}},
          Case{{"unproject"}, {"P.X", "P.Y", "P.Z"}}, Case{{"ssao", "--radius", "9"}, {"AO"}},
          Case{{"dof-masks", "--circle", "9,99"}, {"depth.coc", "depth.near", "depth.focus", "depth.far"}},
          Case{{"dof", "--color", z, "--circle", "9,99"}, {"dof.R", "dof.G", "dof.B"}},
          Case{{"fog", "--color", z, "--density", "0.1"}, {"fog.R", "fog.G", "fog.B"}}}) {
        const std::string result = folder / "out/r.exr";
        check_done(joined(each.arguments, {z, "--camera", camera, "-o", result, "--append", "--half", "--quiet"}));
        std::set<std::string> names;
        for (const Channel& found : list_channels(result)) {
            names.insert(found.name);
            const bool is_old = std::ranges::find(picture.channels, found.name) != picture.channels.end();
            CHECK(found.type == (is_old ? "float" : "half"));
        }
        std::set<std::string> expected(each.added.begin(), each.added.end());
        expected.insert(picture.channels.begin(), picture.channels.end());
        for (const std::string& name : each.added) { // layer.pass.letter, which is how Blender finds a pass
            const std::string last = name.substr(name.rfind('.') + 1);
            for (const std::string& known :
                 last.size() == 1 ? std::vector{name} : std::vector{last + ".R", last + ".G", last + ".B"}) {
                REQUIRE(names.contains("Fathom." + known));
                CHECK(same(channel(result, "Fathom." + known), channel(result, name)));
                expected.insert("Fathom." + known);
            }
        }
        CHECK(names == expected);
        CHECK(same(channel(result, "Z"), channel(z, "Z")));
        CHECK(same(channel(result), channel(z, "Z"))); // what was appended is neither depth nor a picture by itself
        CHECK(color_channels(result) == std::vector<std::string>{"R", "G", "B"});
    }
    const auto normals = [&](const Arguments& more, const std::string& name) {
        return run(joined({"normals", z, "--camera", camera, "-o", folder / name, "--quiet"}, more));
    };
    check_refused(normals({"--append"}, "out/a.png"), 2, "--append adds channels to an EXR; write .exr");
    check_refused(normals({"--half"}, "out/a.tif"), 2, "--half is for .exr");
    check_refused(normals({"--compression", "piz"}, "out/a.tif"), 2, "--compression is for .exr");
    check_refused(normals({"--compression", "b44"}, "out/a.exr"), 2, "none, zips, zip, piz or dwaa");
    const std::string plain = depth_file(folder, "plain.tif");
    check_refused({"linearize", plain, "--camera", camera, "-o", folder / "out/b.exr", "--append"}, 1,
                  "plain.tif: is no OpenEXR file, and --append adds to one");
    check_done(normals({"--compression", "piz"}, "out/p.exr"));
    CHECK(Imf::MultiPartInputFile((folder / "out/p.exr").c_str()).header(0).compression() == Imf::PIZ_COMPRESSION);
}

TEST_CASE("exr results: OpenCV opens every result of one number a pixel, and pictures", "[io]") {
    setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 1);
    const Folder folder;
    const std::string camera = folder / "camera.json", z = folder / "z.exr";
    ExrImage picture{.display = {{0, 0}, {width - 1, height - 1}}, .channels = {"Z", "R", "G", "B"}};
    picture.data = picture.display;
    write(fs::path(z), picture);
    write(camera, R"({"perspective": {"fov_y_deg": 60, "near": 0.1}, "encoding": "inverse", "scale": 4096})");
    struct Opened {
        Arguments arguments;
        std::vector<std::string> options, channels; ///< of each result, and the channel that is seen
    };
    for (const Opened& each : {Opened{{"linearize"}, {"-o"}, {"Z"}},
                               {{"ssao", "--radius", "9"}, {"-o", "--confidence"}, {"AO", "confidence"}},
                               {{"dof-masks", "--circle", "9,99"},
                                {"-o", "--max-near-coc", "--near-alpha", "--disocclusion", "--mixed-pixels",
                                 "--tile-min-coc", "--tile-max-coc"},
                                {"coc", "coc", "near", "disocclusion", "mixed", "min", "max"}},
                               {{"dof-masks", "--circle", "9,99", "--mask", "far"}, {"-o"}, {"far"}},
                               {{"dof", "--color", z, "--circle", "9,99"}, {"-o"}, {"B"}},
                               {{"fog", "--color", z, "--density", "0.1"}, {"-o"}, {"B"}}})
        for (const Arguments& more : {Arguments{}, {"--half"}}) {
            Arguments command = joined(each.arguments, joined({z, "--camera", camera, "--quiet"}, more));
            for (std::size_t i = 0; i < each.options.size(); ++i)
                command = joined(command, {each.options[i], folder / ("out/" + std::to_string(i) + ".exr")});
            check_done(command);
            for (std::size_t i = 0; i < each.options.size(); ++i) {
                INFO(each.arguments.front() << " " << each.channels[i]);
                const std::string file = folder / ("out/" + std::to_string(i) + ".exr");
                const cv::Mat seen = cv::imread(file, cv::IMREAD_UNCHANGED);
                cv::Mat own;
                channel(file, each.channels[i]).convertTo(own, CV_32F);
                REQUIRE(seen.depth() == CV_32F);
                CHECK(same(plane(seen, 0), own));
            }
        }
    write_image(folder / "out/unnamed.exr", values_of({7, 5}, 1));
    CHECK(same(cv::imread(folder / "out/unnamed.exr", cv::IMREAD_UNCHANGED), values_of({7, 5}, 1)));
}

TEST_CASE("exr results: a picture in other primaries than sRGB's is told where a file cannot say so", "[io]") {
    const Folder folder;
    const std::string camera = camera_file(folder), z = depth_file(folder, "z.exr"), picture = folder / "c.exr";
    const auto fog = [&](const std::string& out, const std::function<void(Imf::Header&)>& more) {
        const Box2i window{{0, 0}, {width - 1, height - 1}};
        write(fs::path(picture), {.display = window, .data = window, .channels = {"R", "G", "B"}, .more = more});
        const Outcome outcome = run({"fog", z, "--color", picture, "--camera", camera, "-o", folder / ("out/" + out),
                                     "--density", "0.01", "--quiet"});
        CHECK(outcome.code == 0);
        return outcome.err;
    };
    const auto primaries = [](V2i red, V2i green, V2i blue) { // in thousandths
        const auto at = [](V2i place) {
            return Imath::V2f(static_cast<float>(place.x) / 1000, static_cast<float>(place.y) / 1000);
        };
        return [=](Imf::Header& header) {
            Imf::addChromaticities(header, {at(red), at(green), at(blue), {0.32168f, 0.33767f}});
        };
    };
    const auto words = [](const char* name, const char* value) {
        return [=](Imf::Header& header) { header.insert(name, Imf::StringAttribute(value)); };
    };
    const auto ap1 = primaries({713, 293}, {165, 830}, {128, 44}), p3 = primaries({680, 320}, {265, 690}, {150, 60});
    CHECK(contains(fog("a.png", ap1), "out/a.png: counts as sRGB, but the header of the picture says ACEScg, "));
    const std::string line = "out/a.jpg: counts as sRGB, but the header of the picture says ";
    CHECK(contains(fog("a.jpg", ap1), line + "ACEScg, "));
    CHECK(contains(fog("a.jpg", words("oiio:ColorSpace", "ACES - ACEScg")), line + "ACEScg, "));
    CHECK(contains(fog("a.jpg", words("color_space", "acescg")), line + "ACEScg, "));
    CHECK(contains(fog("a.jpg", words("colorInteropID", "lin_ap0_scene")), line + "ACES2065-1, "));
    CHECK(contains(fog("a.jpg",
                       [&](Imf::Header& header) {
                           primaries({640, 330}, {300, 600}, {150, 60})(header);
                           words("oiio:ColorSpace", "ACEScg")(header);
                       }),
                   line + "ACEScg, "));
    CHECK(contains(fog("a.jpg", p3), line + "other primaries, "));
    CHECK(fog("a.jpg", primaries({640, 330}, {300, 600}, {150, 60})).empty());
    CHECK(fog("a.jpg", words("oiio:ColorSpace", "lin_srgb")).empty());
    CHECK(fog("a.jpg", nullptr).empty());
    for (const char* out : {"a.exr", "a.tif", "a.npy"})
        CHECK(fog(out, ap1).empty());
}

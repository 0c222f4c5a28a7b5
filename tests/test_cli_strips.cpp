// Images that go strip by strip: the bytes of every result, and every line that is said, are those of the image as a whole.
#include "catch.hpp"
#include "cli/options/described.hpp"
#include "exr_files.hpp"
#include "program.hpp"
#include "tiff_files.hpp"

#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <tiffio.h>

using namespace fathom;
using namespace fathom::test;
using fathom::test::write;

namespace {

/// The time at the end of a line differs.
std::string without_time(std::string line) {
    const std::size_t at = line.rfind("  ");
    return line.ends_with(" ms\n") ? line.substr(0, at) : line;
}

/// Runs both programs, and compares all that they say and write. Gives what the one by strips said. `outputs`: the options of
/// the results.
Outcome check_same(const Folder& folder, const Arguments& arguments, const std::string& extension,
                   const Arguments& outputs = {"-o"}) {
    const auto run_into = [&](const std::string& name, const std::string& program) {
        fs::create_directory(folder / name);
        Arguments all = arguments;
        for (const std::string& output : outputs)
            all = joined(all, {output, folder / (name + "/result" + output + extension)});
        Outcome outcome = run(all, {.program = program});
        for (std::string* text : {&outcome.err, &outcome.out})
            for (std::size_t at; (at = text->find("/" + name + "/")) != std::string::npos;)
                text->replace(at, name.size() + 2, "/");
        outcome.out = without_time(outcome.out);
        return outcome;
    };
    INFO("fathom " << arguments.front() << " " << arguments.at(1) << " to " << extension);
    const Outcome expected = run_into("whole", places::program), got = run_into("strips", places::by_strips);
    CHECK(got.code == expected.code);
    CHECK(got.err == expected.err);
    CHECK(got.out == expected.out);
    for (const std::string& output : outputs) {
        const std::string file = "/result" + output + extension, strips = folder / ("strips" + file);
        CHECK(fs::exists(strips) == (got.code == 0));
        const bool same_bytes = content(strips) == content(folder / ("whole" + file));
        CHECK(same_bytes);
    }
    for (const char* name : {"whole", "strips"}) { // nothing is left beside the result
        const auto files = std::distance(fs::directory_iterator(folder / name), fs::directory_iterator());
        CHECK(files == (got.code == 0 ? std::ssize(outputs) : 0));
        fs::remove_all(folder / name);
    }
    return got;
}

/// Depth-buffer values of slanted surfaces with steps between them, some background, and a few NaN.
cv::Mat surfaces(int columns, int rows) {
    cv::Mat depth(rows, columns, CV_32FC1);
    std::mt19937 random(7);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const int which = (x / 17 + y / 13) % 5;
            depth.at<float>(y, x) = which == 4 && y % 13 < 6 ? 1.0f
                                    : random() % 97 == 0     ? std::numeric_limits<float>::quiet_NaN()
                                                             : 0.9f + 0.01f * static_cast<float>(which) +
                                                               1e-4f * static_cast<float>(x % 17 + 2 * (y % 13));
        }
    return depth;
}

struct ExrForm {
    Imf::PixelType type = Imf::FLOAT;
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    int tile = 0;
    Imf::LineOrder order = Imf::INCREASING_Y;
    int margin = 0; ///< of the data window around the display window; below 0 within it
};

cv::Mat as_type(const cv::Mat& values, Imf::PixelType type) {
    cv::Mat plane;
    if (type == Imf::UINT)
        values.convertTo(plane, CV_32S, 0xffffff);
    else
        values.convertTo(plane, type == Imf::HALF ? CV_16F : CV_32F);
    return plane;
}

/// `image`: one channel Z, or B, G, R and perhaps an alpha.
std::string write_exr(const std::string& file, const cv::Mat& image, const ExrForm& form = {}) {
    const int m = form.margin;
    const Box2i data({-m, -m}, {image.cols - 1 - m, image.rows - 1 - m}),
        display({0, 0}, {image.cols - 1 - 2 * m, image.rows - 1 - 2 * m});
    Imf::Header header(display, data, 1, Imath::V2f(0, 0), 1, form.order, form.compression);
    std::vector<cv::Mat> planes;
    cv::split(image, planes);
    const std::vector<std::string> names =
        planes.size() == 1 ? std::vector<std::string>{"Z"} : std::vector<std::string>{"B", "G", "R", "A"};
    Imf::FrameBuffer frame;
    for (std::size_t i = 0; i < planes.size(); ++i) {
        planes[i] = as_type(planes[i], form.type);
        header.channels().insert(names[i], Imf::Channel(form.type));
        frame.insert(names[i], Imf::Slice::Make(form.type, planes[i].data, data, planes[i].elemSize(), planes[i].step));
    }
    if (form.tile > 0) {
        const auto side = static_cast<unsigned>(form.tile);
        header.setTileDescription({side, side, Imf::ONE_LEVEL});
        Imf::TiledOutputFile exr(file.c_str(), header);
        exr.setFrameBuffer(frame);
        exr.writeTiles(0, exr.numXTiles() - 1, 0, exr.numYTiles() - 1);
    } else {
        Imf::OutputFile exr(file.c_str(), header);
        exr.setFrameBuffer(frame);
        exr.writePixels(image.rows);
    }
    return file;
}

/// `image` in the file's order of channels.
std::string write_tiff(const std::string& file, const cv::Mat& image, const TiffForm& form = {}) {
    const bool is_float = image.depth() == CV_32F || image.depth() == CV_16F;
    return test::write_tiff(file, image, is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT, form).string();
}

cv::Mat converted(const cv::Mat& values, int depth, double scale = 1) {
    cv::Mat result;
    values.convertTo(result, depth, scale);
    return result;
}

const std::string camera_text = R"("perspective": {"fov_y_deg": 60, "aspect": 1.5, "near": 0.5, "far": 100},)"
                                R"("view": [[1, 0, 0, 1], [0, 0, 1, 2], [0, -1, 0, 3], [0, 0, 0, 1]])";

std::string camera_for(const Folder& folder, const std::string& more = {}) {
    const std::string file = folder / "camera.json";
    write(file, "{" + camera_text + more + "}");
    return file;
}

} // namespace

TEST_CASE("strips: every operation, from EXR of every kind", "[cli][slow]") {
    const Folder folder;
    const cv::Mat depth = surfaces(61, 83);
    const std::string camera = camera_for(folder);
    const std::vector<ExrForm> forms{{},
                                     {.type = Imf::HALF, .compression = Imf::PIZ_COMPRESSION},
                                     {.compression = Imf::NO_COMPRESSION},
                                     {.compression = Imf::ZIPS_COMPRESSION, .order = Imf::DECREASING_Y},
                                     {.type = Imf::HALF, .compression = Imf::DWAB_COMPRESSION},
                                     {.compression = Imf::PXR24_COMPRESSION, .tile = 16},
                                     {.type = Imf::HALF, .tile = 7},
                                     {.compression = Imf::RLE_COMPRESSION, .tile = 128},
                                     {.margin = 6},
                                     {.tile = 16, .margin = -5}};
    for (const ExrForm& form : forms) {
        const std::string file = write_exr(folder / "depth.exr", depth, form);
        check_same(folder, {"linearize", file, "--camera", camera}, ".exr");
        check_same(folder, {"normals", file, "--camera", camera}, ".exr");
    }
    const std::string file = write_exr(folder / "depth.exr", depth, {.tile = 16}),
                      color = write_exr(folder / "color.exr", cv::Mat(83, 61, CV_32FC3, cv::Scalar(0.25, 0.5, 2)));
    for (const char* extension : {".exr", ".tif"}) {
        check_same(folder, {"linearize", file, "--camera", camera, "--background", "decode"}, extension);
        check_same(folder, {"unproject", file, "--camera", camera, "--space", "world", "--origin", "1,2,3"}, extension);
        check_same(folder, {"normals", file, "--camera", camera, "--space", "world"}, extension);
        check_same(folder, {"normals", file, "--camera", camera, "--noise", "1e-3"}, extension);
        check_same(folder, {"normals", file, "--camera", camera, "--max-error", "9", "--explain"}, extension);
        check_same(folder, {"fog", file, "--camera", camera, "--color", color, "--density", "0.05"}, extension);
    }
    for (const char* compression : {"none", "zips", "piz", "dwaa"})
        check_same(folder, {"unproject", file, "--camera", camera, "--half", "--compression", compression}, ".exr");
    write_exr(file, cv::Mat(83, 61, CV_32FC1, cv::Scalar(0.5)), {.type = Imf::UINT, .tile = 16});
    check_same(folder, {"linearize", file, "--camera", camera}, ".exr");
}

TEST_CASE("strips: every operation, from TIFF of every kind", "[cli][slow]") {
    const Folder folder;
    const cv::Mat depth = surfaces(61, 83);
    const std::string camera = camera_for(folder);
    const std::vector<TiffForm> forms{
        {},
        {.mode = "w8", .rows = 100},
        {.mode = "wb", .rows = 100},
        {.mode = "wb8", .compression = COMPRESSION_LZW, .rows = 30},
        {.compression = COMPRESSION_ADOBE_DEFLATE, .predictor = PREDICTOR_HORIZONTAL, .rows = 100},
        {.rows = 16, .tiled = true},
        {.mode = "wb8", .compression = COMPRESSION_ADOBE_DEFLATE, .rows = 48, .tiled = true},
    };
    for (const TiffForm& form : forms)
        for (const cv::Mat& values : {depth, converted(depth, CV_16U, 65535), converted(depth, CV_16F)}) {
            if (values.depth() != CV_16U && form.predictor == PREDICTOR_HORIZONTAL)
                continue;
            const std::string file = write_tiff(folder / "depth.tif", values, form);
            check_same(folder, {"linearize", file, "--camera", camera}, ".tif");
            if (values.depth() == CV_32F)
                check_same(folder, {"normals", file, "--camera", camera}, ".exr");
        }
    const std::string file = write_tiff(folder / "depth.tif", depth, {.mode = "w8"});
    cv::Mat color(83, 61, CV_32FC3);
    cv::randu(color, 0, 1);
    for (const cv::Mat& picture : {color, converted(color, CV_8U, 255), converted(color, CV_16U, 65535)}) {
        const std::string clear = write_tiff(folder / "color.tif", picture, {.rows = 100});
        for (const char* extension : {".exr", ".tif"})
            for (const char* space : {"auto", "linear"})
                check_same(folder,
                           {"fog", file, "--camera", camera, "--color", clear, "--color-space", space, "--density",
                            "0.05", "--height-falloff", "0.1"},
                           extension);
    }
    cv::imwrite(folder / "color.png", converted(color, CV_8U, 255)); // is read whole
    check_same(folder, {"fog", file, "--camera", camera, "--color", folder / "color.png", "--density", "0.05"}, ".tif");
    check_same(folder, {"unproject", file, "--camera", camera}, ".tif");
    const std::string packed = camera_for(folder, R"(, "packing": "rgb-low-first")");
    write_tiff(file, converted(color, CV_8U, 255));
    check_same(folder, {"linearize", file, "--camera", packed}, ".tif");
    const std::string bytes = camera_for(folder, R"(, "packing": "uint8")");
    write_tiff(file, converted(depth, CV_8U, 255));
    check_same(folder, {"linearize", file, "--camera", bytes}, ".tif");
}

TEST_CASE("strips: operations that look around, and several results", "[cli][slow]") {
    const Folder folder;
    const std::string camera = camera_for(folder), exr = folder / "depth.exr", tiff = folder / "depth.tif";
    const cv::Mat depth = surfaces(29, 700); // several strips, with what they look at around them
    write_exr(exr, depth, {.tile = 16});
    write_tiff(tiff, depth);
    cv::Mat color(depth.size(), CV_32FC3);
    cv::randu(color, 0, 1);
    const std::string light = write_exr(folder / "color.exr", color),
                      codes = write_tiff(folder / "color.tif", converted(color, CV_8U, 255)),
                      whole = folder / "color.png";
    cv::imwrite(whole, converted(color, CV_8U, 255));
    const auto check = [&](const std::string& operation, const std::string& file, const Arguments& options,
                           const Arguments& outputs = {"-o"}) {
        return check_same(folder, joined({operation, file, "--camera", camera}, options), fs::path(file).extension(),
                          outputs);
    };
    check("ssao", exr, {"--radius", "0.02", "--quality", "fast"});
    check("ssao", exr, {"--radius", "1", "--quality", "fast"}, {"-o", "--bent-normal", "--confidence"});
    check("ssao", tiff, {"--radius", "1", "--full-resolution"});
    check("ssao", tiff, {"--radius", "1e-6", "--half-resolution"}); // which is doubtful
    const Arguments circle{"--circle", "40,300"};
    check("dof-masks", exr, circle);
    check("dof-masks", exr, {"--circle", "400,2080"},
          {"-o", "--max-near-coc", "--near-alpha", "--disocclusion", "--mixed-pixels"});
    check("dof-masks", tiff, joined(circle, {"--mask", "near", "--max-coc-px", "5"})); // which cuts most of them off
    for (const char* quality : {"fast", "balanced", "accurate"})
        check("dof", exr, joined(circle, {"--color", light, "--quality", quality}));
    for (const std::string& picture : {codes, whole})
        check("dof", tiff, joined(circle, {"--color", picture, "--highlights", "1.5", "--sky", "sharp"}));
    const std::string cut =
        write_exr(folder / "cut.exr", color(cv::Rect(3, 3, color.cols - 6, color.rows - 6)).clone(), {.margin = -3});
    for (const std::string& of : {exr, tiff}) // which has no data window
        check("dof", of, joined(circle, {"--color", cut}));
    const Arguments lens{"--f-stop", "2", "--sensor-mm", "36"};
    check("dof-masks", exr, joined(lens, {"--focus-along", "3,5,6"}));
    // These are made of the whole image.
    check("dof-masks", exr, joined(lens, {"--focus-at", "3,5"}));
    check("dof-masks", exr, circle, {"-o", "--near-alpha", "--tile-max-coc"});
    check("ssao", exr, {"--radius", "0.02", "--region", "3,100,20,300"});

    write_exr(exr, cv::Mat(depth.size(), CV_32FC1, cv::Scalar(1)));
    check("ssao", exr, {"--radius", "0.02"}); // background alone
    write_exr(exr, cv::Mat(depth.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN())));
    check_refused(check("ssao", exr, {"--radius", "0.02"}), 1, "all of its values are NaN");
}

TEST_CASE("strips: whatever operation is described, with its results", "[cli]") {
    const Folder folder;
    const std::string camera = camera_for(folder, R"(, "ao_distance": 0.02)"),
                      exr = write_exr(folder / "depth.exr", surfaces(29, 300)),
                      light = write_exr(folder / "color.exr", cv::Mat(300, 29, CV_32FC3, cv::Scalar(0.25, 0.5, 2)));
    for (const description::Operation& operation : description::operations()) {
        std::string name = operation.name;
        std::ranges::replace(name, '_', '-');
        Arguments command{name, exr, "--camera", camera}, outputs{"-o"};
        if (!operation.lens.empty())
            command = joined(command, {"--circle", "40,300"});
        for (const description::Option& option : operation.options)
            if (option.required)
                command = joined(command, {cli::spelled(option), option.is_image() ? light : "0.05"});
        const std::shared_ptr<void> call = operation.make(nullptr);
        for (const description::Result& result : operation.results_of(call.get(), {})) {
            const std::string spelled = cli::spelled(result.name);
            if (!result.wanted && !spelled.empty() && std::string_view(result.shape.sides) == "H, W")
                outputs.push_back(spelled);
        }
        check_same(folder, command, ".exr", outputs);
    }
}

TEST_CASE("strips: pixels that do not count", "[cli]") {
    const Folder folder;
    const cv::Mat depth = surfaces(29, 700);
    cv::Mat mask(depth.size(), CV_32FC1);
    cv::randu(mask, 0, 1);
    mask.setTo(0, mask < 0.7);
    const std::string camera = camera_for(folder), exr = write_exr(folder / "depth.exr", depth, {.margin = 6}),
                      words = write_tiff(folder / "depth.tif", converted(depth, CV_16U, 65535)),
                      of_exr = write_exr(folder / "mask.exr", mask, {.margin = 6}),
                      of_tiff = write_tiff(folder / "mask.tif", converted(mask, CV_8U, 255)),
                      small = folder / "mask.png";
    cv::imwrite(small, converted(mask, CV_8U, 255)); // is read whole
    for (const Arguments& which :
         {Arguments{"--ignore", of_exr}, {"--ignore", of_exr, "--ignore-below", "0.8"}, {"--valid", "4.6,5.5"}}) {
        check_same(folder, joined({"linearize", exr, "--camera", camera}, which), ".exr");
        check_same(folder, joined({"normals", exr, "--camera", camera}, which), ".exr");
    }
    for (const Arguments& which : {Arguments{"--ignore", of_tiff},
                                   {"--ignore", small},
                                   {"--valid", "4.6,5.5"},
                                   {"--ignore", small, "--valid", "0,5"}}) { // whose camera names no code
        check_same(folder, joined({"linearize", words, "--camera", camera}, which), ".tif");
        check_same(folder, joined({"ssao", words, "--camera", camera, "--radius", "0.02", "--quality", "fast"}, which),
                   ".exr");
    }
    cv::imwrite(small, cv::Mat(depth.size(), CV_8UC1, cv::Scalar(1)));
    check_refused(check_same(folder, {"linearize", words, "--camera", camera, "--ignore", small}, ".tif"), 1,
                  "no pixel is left that counts");
}

TEST_CASE("strips: sizes", "[cli]") {
    const Folder folder;
    const std::string camera = camera_for(folder);
    for (const auto& [columns, rows] : {std::pair{1, 1}, {1, 3001}, {3001, 1}, {2, 19}, {65'537, 3}, {5, 65'537}}) {
        const cv::Mat depth = surfaces(columns, rows);
        const std::string exr = write_exr(folder / "depth.exr", depth, {.tile = 16}),
                          tiff = write_tiff(folder / "depth.tif", depth);
        for (const char* operation : {"linearize", "normals"}) {
            check_same(folder, {operation, exr, "--camera", camera}, ".exr");
            check_same(folder, {operation, tiff, "--camera", camera}, ".tif");
        }
    }
}

TEST_CASE("strips: take less memory than the whole", "[cli]") {
    if (places::sanitized) {
        WARN("skipped: AddressSanitizer keeps freed memory for a while");
        return;
    }
    const Folder folder;
    constexpr long image_mib = 61; // the whole holds the depth and the result at once
    const std::string camera = camera_for(folder),
                      file = write_tiff(folder / "depth.tif", cv::Mat(8000, 2000, CV_32FC1, cv::Scalar(0.5)),
                                        {.rows = 64});
    const Arguments ssao{"ssao", "--radius", "0.001", "--quality", "fast"}, bound{"--memory", "32M"};
    for (const auto& [operation, program, more] : {std::tuple{Arguments{"linearize"}, places::by_strips, Arguments{}},
                                                   {Arguments{"linearize"}, places::program, bound},
                                                   {ssao, places::program, bound}}) {
        const std::string result = folder / "out/result.tif";
        const Arguments all = joined(operation, {file, "--camera", camera, "-o", result});
        const Outcome whole = run(all);
        const std::string expected = content(result);
        const Outcome strips = run(joined(all, more), {.program = program});
        CHECK(whole.code == 0);
        CHECK(strips.code == 0);
        const bool same_bytes = content(result) == expected;
        CHECK(same_bytes);
        std::cout << "strips: " << operation.front() << " of 61 MiB of depth takes " << strips.peak_mib
                  << " MiB in strips and " << whole.peak_mib << " MiB as a whole\n";
        CHECK(strips.peak_mib + image_mib < whole.peak_mib);
    }
}

TEST_CASE("strips: what is probably wrong is told as of the whole image", "[cli][slow]") {
    const Folder folder;
    const auto said = [&](const cv::Mat& values, const std::string& camera, const std::string& what) {
        for (const Arguments& strict : {Arguments{}, Arguments{"--strict"}}) {
            const Outcome exr = check_same(
                folder, joined({"linearize", write_exr(folder / "depth.exr", values), "--camera", camera}, strict),
                ".exr");
            INFO(exr.err << "must say: " << what);
            CHECK(contains(exr.err, what));
            CHECK(exr.code == (strict.empty() && !contains(exr.err, "no pixel") ? 0 : 1));
            check_same(folder,
                       joined({"normals", write_tiff(folder / "depth.tif", values), "--camera", camera}, strict),
                       ".tif");
        }
    };
    const std::string window = camera_for(folder);
    cv::Mat many = surfaces(200, 150);
    many.rowRange(100, 150) = 7;
    said(many, window, "of the pixels are invalid: the values run from");
    said(cv::Mat(150, 200, CV_32FC1, cv::Scalar(7)), window, "no pixel has a depth: the values are 7");
    said(cv::Mat(150, 200, CV_32FC1, cv::Scalar(std::nan(""))), window, "all of its values are NaN");
    cv::Mat crowded(150, 200, CV_32FC1);
    cv::randu(crowded, 0.01, 0.02);
    said(crowded, window, "of the near plane");
    const std::string metric = camera_for(folder, R"(, "encoding": "view-z")");
    cv::Mat buffer = surfaces(200, 150);
    cv::patchNaNs(buffer, 1);
    said(buffer, metric, "as in a depth buffer");
    cv::Mat sky = ramp(200, 150) * 50;
    sky.rowRange(0, 9) = 1e10;
    said(sky, metric, "which renderers write where nothing is");
    said(ramp(200, 150) * 90 + 1, metric, "and flat if the values are depth-buffer values");
    cv::Mat behind(150, 200, CV_32FC1);
    cv::randu(behind, 10, 900);
    said(behind, metric, "behind the far plane of the projection");
    const std::string inverse = camera_for(folder, R"(, "encoding": "inverse")");
    said(1 / (ramp(200, 150) + 1) * 40, inverse, "which looks like disparity without its");
    const std::string packed = camera_for(folder, R"(, "packing": "rgb-low-first")");
    cv::Mat picture(150, 200, CV_8UC3);
    for (int y = 0; y < 150; ++y)
        for (int x = 0; x < 200; ++x)
            picture.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<uchar>((x + y) / 2)) + cv::Vec3b(0, 1, 2);
    const std::string file = write_tiff(folder / "packed.tif", picture);
    check_refused(check_same(folder, {"linearize", file, "--camera", packed}, ".exr"), 1, "colours of a picture");
    picture = cv::Mat(150, 200, CV_8UC3, cv::Scalar::all(9));
    picture.at<cv::Vec3b>(0, 0) = {0, 0, 0};
    write_tiff(file, picture);
    check_refused(check_same(folder, {"linearize", file, "--camera", packed}, ".exr"), 1, "has R = G = B");
}

TEST_CASE("strips: what is wrong in the middle leaves no result", "[cli]") {
    const Folder folder;
    const std::string camera = camera_for(folder);
    cv::Mat depth(150, 200, CV_32FC1);
    cv::randu(depth, 0.5, 0.9);
    const auto damaged = [](const std::string& file) {
        std::string bytes = content(file);
        for (std::size_t i = 0; i < 400; ++i)
            bytes[bytes.size() * 6 / 10 + i] ^= '\x5a';
        write(file, bytes);
        return file;
    };
    check_refused(
        check_same(folder, {"linearize", damaged(write_exr(folder / "a.exr", depth)), "--camera", camera}, ".exr"), 1,
        "a.exr: is damaged or cut short");
    const TiffForm packed{.compression = COMPRESSION_ADOBE_DEFLATE, .rows = 10};
    const std::string tiff = damaged(write_tiff(folder / "a.tif", depth, packed));
    for (const char* program :
         {places::program, places::by_strips}) // zlib's reason depends on how much it was asked for
        check_refused(run({"normals", tiff, "--camera", camera, "-o", folder / "out/n.tif"}, {.program = program}), 1,
                      "a.tif: is damaged or cut short");
    CHECK(folder.results().empty());
    const std::string half = write_tiff(folder / "half.tif", depth);
    fs::resize_file(half, fs::file_size(half) / 2);
    check_refused(check_same(folder, {"linearize", half, "--camera", camera}, ".tif"), 1,
                  "half.tif: is damaged or cut short");

    const std::string metric = camera_for(folder, R"(, "encoding": "view-z")"),
                      far_away = write_exr(folder / "far.exr", depth + 5);
    depth.at<float>(120, 33) = 70000;
    check_refused(check_same(folder, {"linearize", write_exr(far_away, depth), "--camera", metric, "--half"}, ".exr"),
                  1, "pixel (33, 120) is 70000");
    // What is probably wrong with the image is told, too, and with --strict instead.
    const cv::Mat units(150, 200, CV_16UC1, cv::Scalar(65530));
    const Arguments halves{"linearize", write_tiff(folder / "units.tif", units), "--camera", metric, "--half"};
    const Outcome doubtful = check_same(folder, halves, ".exr");
    CHECK(doubtful.code == 1);
    CHECK(doubtful.err.find("its integers count as scene units") < doubtful.err.find("pixel (0, 0) is 65530"));
    CHECK(doubtful.err.find("pixel (0, 0) is 65530") != std::string::npos);
    check_refused(check_same(folder, joined(halves, {"--strict"}), ".exr"), 1, "its integers count as scene units");
    const std::string codes = write_exr(folder / "codes.exr", depth, {.type = Imf::UINT});
    check_refused(check_same(folder, {"linearize", codes, "--camera", camera}, ".exr"), 1, "pixel (33, 120) holds");
    check_refused(
        check_same(folder,
                   {"fog", write_exr(folder / "a.exr", depth), "--camera", metric, "--density", "1", "--color",
                    write_exr(folder / "color.exr", cv::Mat(145, 200, CV_32FC3, cv::Scalar::all(1)))},
                   ".exr"),
        1, "same ratio of width to height");
    const std::string smaller = write_exr(folder / "smaller.exr", cv::Mat(75, 100, CV_32FC3, cv::Scalar::all(1)));
    check_refused(run({"fog", folder / "a.exr", "--camera", metric, "--density", "1", "--color", smaller, "-o",
                       folder / "out/smaller.exr"},
                      {.program = places::by_strips}),
                  1, "images this large go through by rows");
}

TEST_CASE("strips: a full disk is told, and the old result stays", "[cli]") {
    const Folder folder;
    const std::string camera = camera_for(folder), file = write_exr(folder / "depth.exr", surfaces(400, 7500)),
                      result = folder / "out/z.tif";
    write(result, "old");
    const Arguments arguments{"linearize", file, "--camera", camera, "-o", result};
    check_done(arguments, {.program = places::by_strips}); // compiles the kernel, which takes files, too
    write(result, "old");
    const Outcome outcome = run(arguments, {.largest_file = 5'000'000, .program = places::by_strips});
    check_refused(outcome, 1, "z.tif: cannot be written");
    CHECK(content(result) == "old");
    CHECK(folder.results() == std::vector<std::string>{"z.tif"});
}

namespace {

// A gigapixel, in rows whose number of bytes is no round one.
constexpr int wide = 65'537, high = 16'384;
constexpr long most_mib = 600;

/// Stored values that differ from row to row, with a surface in every 64th column and nothing elsewhere.
float stored_at(int x, int y) {
    return x % 64 == 1 ? 0.5f + 0.25f * static_cast<float>(y % 1024) / 1024 : 1.0f;
}

cv::Mat rows_of(int first, int rows) {
    cv::Mat part(rows, wide, CV_32FC1);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < wide; ++x)
            part.at<float>(y, x) = stored_at(x, first + y);
    return part;
}

void write_gigapixel_exr(const std::string& file) {
    constexpr int tile = 128;
    Imf::Header header(wide, high, 1, Imath::V2f(0, 0), 1, Imf::INCREASING_Y, Imf::RLE_COMPRESSION);
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    header.setTileDescription({tile, tile, Imf::ONE_LEVEL});
    Imf::TiledOutputFile exr(file.c_str(), header);
    for (int row = 0; row < exr.numYTiles(); ++row) {
        const cv::Mat part = rows_of(row * tile, tile);
        Imf::FrameBuffer frame;
        frame.insert("Z", Imf::Slice::Make(Imf::FLOAT, part.data, Imath::V2i(0, row * tile), std::int64_t{wide},
                                           std::int64_t{tile}, part.elemSize(), part.step[0]));
        exr.setFrameBuffer(frame);
        exr.writeTiles(0, exr.numXTiles() - 1, row, row);
    }
}

void write_gigapixel_tiff(const std::string& file) {
    constexpr int rows = 64;
    TIFF* tiff = TIFFOpen(file.c_str(), "w8");
    REQUIRE(tiff);
    for (const auto& [tag, value] : {std::pair{TIFFTAG_IMAGEWIDTH, wide},
                                     {TIFFTAG_IMAGELENGTH, high},
                                     {TIFFTAG_BITSPERSAMPLE, 32},
                                     {TIFFTAG_SAMPLESPERPIXEL, 1},
                                     {TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP},
                                     {TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK},
                                     {TIFFTAG_COMPRESSION, COMPRESSION_NONE},
                                     {TIFFTAG_ROWSPERSTRIP, rows}})
        TIFFSetField(tiff, static_cast<std::uint32_t>(tag), value);
    for (int strip = 0; strip < high / rows; ++strip) {
        const cv::Mat part = rows_of(strip * rows, rows);
        REQUIRE(TIFFWriteEncodedStrip(tiff, static_cast<std::uint32_t>(strip), part.data,
                                      static_cast<tmsize_t>(part.total() * 4)) > 0);
    }
    TIFFClose(tiff);
}

void run_within_memory(const Arguments& arguments) {
    const auto start = std::chrono::steady_clock::now();
    const Outcome outcome = run(arguments, {.patience_s = 1800});
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::cout << "gigapixel: " << arguments.front() << " " << fs::path(arguments[1]).extension().string() << " "
              << outcome.peak_mib << " MiB at most, allowed " << most_mib << "; " << static_cast<int>(seconds)
              << " s\n";
    check_done(outcome);
    CHECK(outcome.peak_mib <= most_mib);
}

std::uint64_t available_memory_kib() {
    std::ifstream file("/proc/meminfo");
    for (std::string name, rest; file >> name; std::getline(file, rest))
        if (std::uint64_t kib = 0; name == "MemAvailable:" && file >> kib)
            return kib;
    return 0;
}

} // namespace

TEST_CASE("strips: a gigapixel needs no more than 600 MiB", "[cli][exhaustive]") {
    std::string made = (fs::path(places::by_strips).parent_path() / "gigapixel-XXXXXX").string();
    REQUIRE(mkdtemp(made.data()));
    const fs::path folder = made;
    const struct Remove {
        const fs::path& folder;
        ~Remove() { fs::remove_all(folder); }
    } remove{folder};
    constexpr std::uintmax_t disk = std::uintmax_t{11} << 30;
    constexpr std::uint64_t memory_kib = 4 << 20;
    if (fs::space(folder).available < disk || available_memory_kib() < memory_kib) {
        WARN("skipped: a gigapixel takes 11 GiB of disk and 4 GiB of memory");
        return;
    }
    const std::string camera = folder / "camera.json", exr = folder / "depth.exr", tiff = folder / "depth.tif",
                      z = folder / "z.tif", result = folder / "result.exr";
    write(camera, R"({"perspective": {"fov_y_deg": 60, "near": 0.5, "far": 100}})");
    Camera described{.projection = perspective(std::numbers::pi / 3, double{wide} / high, {0.5, 100}),
                     .width = wide,
                     .height = high};
    const auto depth_at = [&](int x, int y) {
        return static_cast<double>(
            view_depth(described, Storage::float32, x + 0.5, y + 0.5, static_cast<double>(stored_at(x, y))));
    };

    const auto check_distances = [&] {
        TIFF* read = TIFFOpen(z.c_str(), "r");
        REQUIRE(read);
        CHECK(TIFFIsBigTIFF(read));
        std::vector<float> row(wide);
        double worst = 0;
        std::size_t others = 0;
        for (int y = 0; y < high; ++y) {
            REQUIRE(TIFFReadScanline(read, row.data(), static_cast<std::uint32_t>(y), 0) == 1);
            const double expected = depth_at(1, y);
            for (int x = 0; x < wide; ++x)
                if (x % 64 == 1)
                    worst =
                        std::max(worst, std::abs(static_cast<double>(row[static_cast<std::size_t>(x)]) / expected - 1));
                else
                    others += row[static_cast<std::size_t>(x)] != std::numeric_limits<float>::infinity();
        }
        TIFFClose(read);
        std::cout << "gigapixel: distances off by at most " << worst * 0x1p24 << " x 2^-24, allowed 2\n";
        CHECK(worst <= 0x1p-23);
        CHECK(others == 0);
        fs::remove(z);
    };

    write_gigapixel_exr(exr);
    run_within_memory({"linearize", exr, "--camera", camera, "-o", z});
    check_distances();
    run_within_memory({"unproject", exr, "--camera", camera, "-o", result});
    {
        Imf::InputFile file(result.c_str());
        std::vector<float> depths(wide);
        for (const int y : {0, high / 2, high - 1}) {
            Imf::FrameBuffer frame;
            frame.insert("P.Z", Imf::Slice::Make(Imf::FLOAT, depths.data(), Imath::V2i(0, y), std::int64_t{wide},
                                                 std::int64_t{1}));
            file.setFrameBuffer(frame);
            file.readPixels(y);
            double worst = 0;
            for (std::size_t x = 1; x < wide; x += 64)
                worst = std::max(worst, std::abs(static_cast<double>(depths[x]) / -depth_at(1, y) - 1));
            CHECK(worst <= 0x1p-22);
        }
    }
    run_within_memory({"normals", exr, "--camera", camera, "-o", result, "--half"});
    fs::remove(exr);
    write_gigapixel_tiff(tiff);
    run_within_memory({"linearize", tiff, "--camera", camera, "-o", z});
    check_distances();
}

// fathom ssao: images beside the depth reach the library, and what is wrong is told in one line. Its options and its results are
// those of test_cli_options.cpp.
#include "rendered_input.hpp"
#include "ssao_call.hpp"

#include <fathom/ssao.hpp>

#include <nlohmann/json.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

struct Room : RenderedInput {
    explicit Room(const std::string& more = view) : RenderedInput(scene::room(), more) {}

    Arguments arguments(const std::string& output, const Arguments& more = {}) const {
        return joined({"ssao", input, "--camera", camera, "-o", output, "--radius", "0.8"}, more);
    }

    cv::Mat expected(const std::function<void(SsaoCall&)>& change = {}) const {
        SsaoCall options = options_of(0.8);
        if (change)
            change(options);
        return to_mat(ssao(stored, options).visibility);
    }
};

cv::Mat thickness_map() {
    return filled(width, height, [](int x, int) { return 0.02 * x; });
}

/// Where solids end, in the codes of this depth: behind it by more from column to column, and in front of it in every fifth.
cv::Mat backs_of(const cv::Mat& depth) {
    cv::Mat backs;
    depth.convertTo(backs, CV_32F, 1 / 65535.0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            float& end = backs.at<float>(y, x);
            end = x % 5 == 4 ? 0.5f * end : end + (1 - end) * static_cast<float>(x) / width;
        }
    return backs;
}

} // namespace

TEST_CASE("ssao program: every image beside the depth reaches the library") {
    const Room room;
    const std::string output = room.folder / "out/ao.exr";
    const std::string map = depth_file(room.folder, "thickness.pfm", thickness_map());
    const cv::Mat thickness = thickness_map();
    const Device& device = room.stored.image.device();
    const cv::Mat backs = backs_of(room.depth);
    const cv::Mat both = merged({cv::Mat(backs.size(), CV_32F, cv::Scalar(0.5)), backs});
    const std::string back = depth_file(room.folder, "back.pfm", backs), of_layers = room.folder / "layers.exr";
    write_image(of_layers, both, {.channels = {"Z", "solid.ZBack"}});
    const auto with_backs = [&](SsaoCall& o) {
        o.thickness = StoredDepth{to_device(device, backs), room.stored.camera, Storage::float32};
    };
    const std::string view_file = room.folder / "normals.exr", world_file = room.folder / "normals.tif";
    check_done({"normals", room.input, "--camera", room.camera, "-o", view_file});
    check_done({"normals", room.input, "--camera", room.camera, "-o", world_file, "--space", "world"});
    const cv::Mat view_normals = read_normals(view_file), world_normals = read_normals(world_file);
    struct Case {
        Arguments arguments;
        std::function<void(SsaoCall&)> change;
    };
    const std::vector<Case> cases{
        {{"--thickness-map", map}, [&](SsaoCall& o) { o.thickness = to_device(device, thickness); }},
        {{"--back-depth", back}, with_backs},
        {{"--back-depth", of_layers}, with_backs},
        {{"--normals", view_file}, [&](SsaoCall& o) { o.normals = to_device(device, view_normals); }},
        {{"--normals", world_file, "--normals-space", "world"},
         [&](SsaoCall& o) {
             o.normals = to_device(device, world_normals);
             o.normals_space = Space::world;
         }},
    };
    const cv::Mat plain = room.expected();
    for (const Case& c : cases) {
        INFO(c.arguments[0] << ' ' << c.arguments[1]);
        check_done(room.arguments(output, c.arguments));
        const cv::Mat found = channel(output, "AO");
        CHECK(same(found, room.expected(c.change)));
        CHECK(!same(found, plain));
    }
}

TEST_CASE("ssao program: --json names the files of all results") {
    const Room room;
    const std::string ao = room.folder / "out/ao.png", bent = room.folder / "out/bent.png",
                      sure = room.folder / "out/sure.png";
    const Outcome outcome = check_done(room.arguments(ao, {"--bent-normal", bent, "--confidence", sure, "--json"}));
    const auto line = nlohmann::json::parse(outcome.out);
    CHECK(line["output"] == ao);
    CHECK(line["bent_normal"] == bent);
    CHECK(line["confidence"] == sure);
}

TEST_CASE("ssao program: normals of the world need the camera file's view") {
    const Room room{std::string()};
    const std::string normals = room.folder / "normals.pfm";
    write_image(normals, cv::Mat(height, width, CV_32FC3, cv::Scalar(0, 0, 1)));
    check_done(room.arguments(room.folder / "out/ao.exr", {"--normals", normals}));
    check_refused(room.arguments(room.folder / "out/world.exr", {"--normals", normals, "--normals-space", "world"}), 1,
                  room.camera);
    CHECK(room.folder.results() == std::vector<std::string>{"ao.exr"});
}

TEST_CASE("ssao program: the radius is the camera file's unless it is given") {
    const Room room(R"(, "ao_distance": 0.8)");
    const std::string output = room.folder / "out/ao.exr";
    check_done({"ssao", room.input, "--camera", room.camera, "-o", output});
    CHECK(same(channel(output, "AO"), room.expected()));
    check_done({"ssao", room.input, "--camera", room.camera, "-o", output, "--radius", "0.3"});
    CHECK(same(channel(output, "AO"), room.expected([](SsaoCall& o) { o.radius = 0.3; })));

    const Arguments without{"ssao", room.input, "--camera", camera_file(room.folder), "-o", output};
    check_refused(without, 2, "--radius");
    camera_file(room.folder, R"(, "ao_distance": 0)");
    check_refused(without, 2, "\"ao_distance\" is 0");
}

TEST_CASE("ssao program: of one input's files all are written or none") {
    const Room room;
    const std::string output = room.folder / "out/ao.exr", nowhere = room.folder / "out/nowhere/sure.exr";
    check_refused(room.arguments(output, {"--confidence", nowhere}), 1, nowhere);
    CHECK(room.folder.results().empty());
    write(room.folder / "file", "");
    check_refused(room.arguments(output, {"--confidence", room.folder / "file/sure.exr"}), 1, "file/sure.exr");
    CHECK(room.folder.results().empty());
}

TEST_CASE("ssao program: wrong usage is told before anything is done") {
    const Room room;
    const std::string output = room.folder / "out/ao.exr";
    const std::vector<std::pair<Arguments, std::string>> cases{
        {{"--thickness", "shadow"}, "inf, or silhouette"},
        {{"--normals-space", "world"}, "--normals"},
        {{"--region", "1,2,3"}, "X,Y,W,H"},
        {{"--region", "1.5,0,5,5"}, "X,Y,W,H"},
        {{"--confidence", output}, "--confidence"},
        {{"--confidence", room.input}, room.input},
        {{"--bent-normal", room.camera}, room.camera},
        {{"--confidence", room.folder / "out/sure.ply"}, ".ply"},
        {{"--confidence", ""}, "--confidence"},
        {{"--png-scale", "2"}, "--png-scale"},
        {{"--thicknes", "2"}, "did you mean --thickness?"},
    };
    for (const auto& [more, named] : cases)
        check_refused(room.arguments(output, more), 2, named);
    CHECK(room.folder.results().empty());
}

TEST_CASE("ssao program: refuses companions and regions that do not fit the image") {
    const Room room;
    const std::string output = room.folder / "out/ao.exr";
    const auto refused = [&](const Arguments& more, const std::vector<std::string>& named) {
        const Outcome outcome = run(room.arguments(output, more));
        for (const std::string& name : named)
            check_refused(outcome, 1, name);
    };
    refused({"--region", "30,0,20,5"}, {room.input, "--region 30,0,20,5", "48 × 32"});
    refused({"--region", "0,2147483647,5,5"}, {"--region", "48 × 32"});
    refused({"--region=-1,0,5,5"}, {"--region -1,0,5,5", "48 × 32"});
    const std::string small = depth_file(room.folder, "small.exr", ramp(10, 20));
    refused({"--thickness-map", small}, {small, "10 × 20", "48 × 32"});
    const std::string codes = depth_file(room.folder, "codes.png");
    refused({"--thickness-map", codes}, {codes, "float"});
    refused({"--thickness-map", room.folder / "none.exr"}, {room.folder / "none.exr"});
    refused({"--back-depth", small}, {small, "10 × 20", "48 × 32"});
    refused({"--back-depth", room.input}, {room.input, "ZBack", "the depth image itself"});
    const std::string few = room.folder / "few.pfm";
    write_image(few, cv::Mat(20, 10, CV_32FC3, cv::Scalar(0, 0, 1)));
    refused({"--normals", few}, {few, "10 × 20", "48 × 32"});
    refused({"--normals", room.input}, {room.input, "normals"});
    refused({"--normals", room.folder / "none.exr"}, {room.folder / "none.exr"});
    CHECK(room.folder.results().empty());
}

TEST_CASE("ssao program: Blender's normals beside the depth count, if the camera file knows the world") {
    const Room room;
    const std::string world = room.folder / "world.exr", blender = room.folder / "blender.exr";
    check_done({"normals", room.input, "--camera", room.camera, "-o", world, "--space", "world"});
    const cv::Mat normals = read_normals(world);
    std::vector<cv::Mat> channels;
    cv::split(normals, channels);
    channels.push_back(read_depth(room.input).values);
    const cv::Mat all = merged(channels);
    const std::vector<std::string> names{"View.Normal.X", "View.Normal.Y", "View.Normal.Z", "View.Depth.Z"};
    write_image(blender, all, {.channels = names});
    const auto visibility = [&](const std::string& camera, const Arguments& more = {}) {
        const std::string output = room.folder / "out/ao.exr";
        CHECK(run(joined({"ssao", blender, "--camera", camera, "-o", output, "--radius", "0.8"}, more)).code == 0);
        return channel(output, "AO");
    };
    const cv::Mat with_pass = visibility(room.camera), without = visibility(room.camera, {"--normals", "none"}),
                  given = visibility(room.camera, {"--normals", blender, "--normals-space", "world"});
    CHECK(same(with_pass, given));
    CHECK_FALSE(same(with_pass, without));
    for (const auto& [changed, is_taken] :
         {std::pair{std::vector<std::string>{"B.Normal.X", "B.Normal.Y", "B.Normal.Z", "A.Depth.Z"}, false},
          {{"View.Normal.X", "View.Normal.Y", "View.Position.Z", "View.Depth.Z"}, false},
          {{"View.Normal.X", "View.Normal.Y", "View.Normal.Z", "View.Depth.V"}, true}}) {
        INFO(changed.front() << ", " << changed.back());
        write_image(blender, all, {.channels = changed});
        CHECK(same(visibility(room.camera), is_taken ? with_pass : without));
    }
    cv::Mat means = all.clone(); // of hair: hardly a vector has a length of 1
    for (cv::Vec4f& pixel : cv::Mat_<cv::Vec4f>(means))
        pixel = {pixel[0] / 2, pixel[1] / 2, pixel[2] / 2, pixel[3]};
    write_image(blender, means, {.channels = names});
    CHECK_FALSE(same(visibility(room.camera), without));
    write_image(blender, all, {.channels = names});
    const Room nowhere("");
    CHECK(same(visibility(nowhere.camera), without));
}

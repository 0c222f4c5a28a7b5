// --memory: large images are done in bands, with the same bytes in the file; or a line says what they need.
#include "program.hpp"

using namespace fathom;
using namespace fathom::test;

namespace {

// Depth of steps between 3 and 4 m, as numbers that need no decoding.
cv::Mat steps(int columns, int rows) {
    cv::Mat depth(rows, columns, CV_32FC1);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            depth.at<float>(y, x) = 3.0f + 0.02f * static_cast<float>(x / 37 % 3 + y / 29 % 2 + (x / 211 + y / 97) % 4);
    return depth;
}

} // namespace

TEST_CASE("program: --memory keeps the bytes of a result, or says what is needed", "[slow]") {
    const Folder folder;
    const std::string depth = depth_file(folder, "depth.npy", steps(2400, 3200)), camera = folder / "camera.json";
    write(camera, R"({"perspective": {"fov_y_deg": 60, "near": 0.1, "far": 100}, "encoding": "view-z"})");
    const auto ssao = [&](const std::string& radius, const std::string& out, const Arguments& more) {
        return run(
            joined({"ssao", depth, "--camera", camera, "--radius", radius, "-o", folder / ("out/" + out)}, more));
    };
    check_done(ssao("0.02", "whole.npy", {}));
    check_done(ssao("0.02", "banded.npy", {"--memory", "64M"}));
    CHECK(content(folder / "out/whole.npy") == content(folder / "out/banded.npy"));
    check_refused(ssao("1", "none.npy", {"--memory", "1K"}), 1, "needs a memory budget of");
    CHECK(folder.results() == std::vector<std::string>{"banded.npy", "whole.npy"});

    const Arguments dof{"dof",           depth, "--camera", camera, "--color",           folder / "color.npy",
                        "--focus",       "3.1", "--f-stop", "1.4",  "--focal-length-mm", "35",
                        "--mm-per-unit", "100"};
    cv::Mat color(3200, 2400, CV_32FC3);
    cv::randu(color, 0, 1);
    write_image(folder / "color.npy", color);
    check_done(run(joined(dof, {"-o", folder / "out/blurred.npy"})));
    check_done(run(joined(dof, {"-o", folder / "out/blurred-in-bands.npy", "--memory", "64M"})));
    CHECK(content(folder / "out/blurred.npy") == content(folder / "out/blurred-in-bands.npy"));
}

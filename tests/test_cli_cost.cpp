#include "program.hpp"

#include <fathom/fathom.hpp>
#include <fathom/opencv.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

constexpr int columns = 1920, rows = 1080, frames = 5;
constexpr double most = 1.15; // of the time of the operation's kernels
constexpr int most_rounds = 8;

// Seconds of an operation whose images lie in the device's memory but not in its caches, from the first command to the end
// of the last.
double seconds_of(const Device& device, const std::function<void()>& operation) {
    static std::vector<int> other_memory(std::size_t{32} << 20);
    std::ranges::fill(other_memory, other_memory[0] + 1);
    const auto start = std::chrono::steady_clock::now();
    operation();
    device.finish();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::vector<double> numbers(const std::string& lines, const std::string& key) {
    std::vector<double> found;
    for (std::size_t at = lines.find('"' + key + "\":"); at != std::string::npos;
         at = lines.find('"' + key + "\":", at + 1))
        found.push_back(std::stod(lines.substr(at + key.size() + 3)));
    return found;
}

} // namespace

// The least of many times, since other programs only ever make them longer.
TEST_CASE("program: a frame after the first takes hardly longer to compute than its kernels", "[exhaustive]") {
    const Folder folder;
    const std::string camera = folder / "camera.json";
    write(camera, R"({"width": 1920, "height": 1080, "perspective": {"fov_y_deg": 50, "near": 0.5, "far": 100}})");
    cv::Mat depth(rows, columns, CV_32FC1), picture(rows, columns, CV_32FC3);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            depth.at<float>(y, x) = static_cast<float>(0.93 + 0.03 * std::sin(x * 0.031) * std::cos(y * 0.023));
            picture.at<cv::Vec3f>(y, x) = {0.1f, static_cast<float>(x % 64) / 64, static_cast<float>(y % 64) / 64};
        }
    const std::string colors = folder / "colors";
    fs::create_directory(colors);
    Arguments inputs;
    for (int frame = 0; frame < frames; ++frame) {
        const std::string name = std::to_string(frame) + ".exr";
        inputs.push_back(folder / name);
        write_image(inputs.back(), depth, {.channels = {"Z"}});
        write_image(fs::path(colors) / name, picture, {.channels = {"B", "G", "R"}});
    }

    const Device device = Device::open("cpu");
    const StoredDepth stored{to_device(device, depth), camera_for(read_camera(camera), columns, rows)};
    const Image sharp = to_device(device, picture), one(device, Element::f32, {columns, rows, 1}),
                three(device, Element::f32, {columns, rows, 3});
    const CircleOfConfusion lens =
        circle_of_confusion({.f_stop = 1.4, .focus = 5, .focal_length_mm = 20, .mm_per_unit = 40}, stored.camera);
    const Arguments lens_options{"--focus", "5", "--f-stop", "1.4", "--focal-length-mm", "20", "--mm-per-unit", "40"};
    struct Subject {
        Arguments command;
        std::function<void()> operation;
    };
    for (const Subject& subject :
         {Subject{{"linearize"}, [&] { linearize(stored, one); }},
          Subject{{"unproject"}, [&] { unproject(stored, three); }},
          Subject{{"normals"}, [&] { normals(stored, three); }},
          Subject{{"ssao", "--radius", "0.5"},
                  [&] {
                      ssao(stored, Occlusion{one, {}, {}}, 0.5);
                  }},
          Subject{joined({"dof", "--color", colors}, lens_options), [&] { dof(stored, sharp, three, lens); }}}) {
        const std::string& name = subject.command.front();
        const Arguments command =
            joined(joined(subject.command, inputs), // one frame at a time, and whole: rows of a PFM start at the bottom
                   {"--camera", camera, "-o", folder / "out", "--format", "pfm", "--json", "--memory", "1K"});
        double kernels = std::numeric_limits<double>::infinity(), computing = kernels;
        for (int round = 0; round < most_rounds && (round == 0 || computing > most * kernels); ++round) {
            for (int run_number = 0; run_number < frames; ++run_number)
                kernels = std::min(kernels, seconds_of(device, subject.operation));
            const Outcome outcome = check_done(command);
            const std::vector<double> times = numbers(outcome.out, "compute_seconds");
            REQUIRE(times.size() == frames);
            computing = std::min(computing, *std::min_element(times.begin() + 1, times.end()));
        }
        INFO(name << ": " << 1e3 * computing << " ms to compute, " << 1e3 * kernels << " ms of kernels");
        CHECK(computing <= most * kernels);
    }
}

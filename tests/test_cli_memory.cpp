// --memory: large images are done in bands, with the same bytes in the file; or a line says what they need.
#include "program.hpp"

using namespace fathom;
using namespace fathom::test;

namespace {

// Depth of steps between 3 and 4 m, as numbers that need no decoding.
cv::Mat steps(int columns, int rows) {
    return filled(columns, rows,
                  [](int x, int y) { return 3 + 0.02 * (x / 37 % 3 + y / 29 % 2 + (x / 211 + y / 97) % 4); });
}

bool same_files(const std::string& a, const std::string& b) {
    std::ifstream one(a, std::ios::binary), other(b, std::ios::binary);
    std::vector<char> of_one(1 << 20), of_other(1 << 20);
    while (one && other) {
        one.read(of_one.data(), static_cast<std::streamsize>(of_one.size()));
        other.read(of_other.data(), static_cast<std::streamsize>(of_other.size()));
        const auto read = one.gcount();
        if (read != other.gcount() || !std::equal(of_one.begin(), of_one.begin() + read, of_other.begin()))
            return false;
    }
    return fs::file_size(a) == fs::file_size(b) && fs::file_size(a) > 0;
}

/// A folder on a disk, for files of gigabytes. A folder of temporary files may be memory.
class FolderOnDisk {
public:
    FolderOnDisk() { REQUIRE(mkdtemp(path_.data())); }
    FolderOnDisk(const FolderOnDisk&) = delete;
    FolderOnDisk& operator=(const FolderOnDisk&) = delete;
    ~FolderOnDisk() { fs::remove_all(path_); }
    std::string operator/(const std::string& name) const { return path_ + "/" + name; }

private:
    std::string path_ = (fs::path(places::program).parent_path() / "memory-XXXXXX").string();
};

/// Runs a command on images of so many MiB, results included, with a budget and without. What it takes beside the budget
/// and its images, and the processor time that bands cost, are bounded.
void check_budget(const Arguments& command, const FolderOnDisk& folder, long budget_mib, long images_mib,
                  const std::string& extension = ".npy") {
    constexpr long program_mib = 200;
    constexpr double most_time = 1.3;
    constexpr unsigned patience_s = 1800;
    const std::string whole = folder / ("whole" + extension), banded = folder / ("banded" + extension);
    const std::string budget = std::to_string(budget_mib) + "M";
    // The first run compiles kernels.
    check_done(joined(command, {"-o", banded, "--memory", budget}), {.patience_s = patience_s});
    double in_bands_s = 0, at_once_s = 0;
    long peak_mib = 0;
    for (int round = 0; round < 2; ++round) {
        const Outcome in_bands = run(joined(command, {"-o", banded, "--memory", budget}), {.patience_s = patience_s});
        const Outcome at_once = run(joined(command, {"-o", whole}), {.patience_s = patience_s});
        check_done(in_bands);
        check_done(at_once);
        in_bands_s += in_bands.processor_seconds;
        at_once_s += at_once.processor_seconds;
        peak_mib = std::max(peak_mib, in_bands.peak_mib);
    }
    std::cout << "memory: " << command.front() << " --memory " << budget << ": " << peak_mib << " MiB at most, allowed "
              << budget_mib + images_mib + program_mib << "; " << in_bands_s / at_once_s
              << " times the processor time of the whole, allowed " << most_time << "\n";
    CHECK(peak_mib <= budget_mib + images_mib + program_mib);
    CHECK(in_bands_s <= most_time * at_once_s);
    CHECK(same_files(whole, banded));
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
    check_done(joined(dof, {"-o", folder / "out/blurred.npy"}));
    check_done(joined(dof, {"-o", folder / "out/blurred-in-bands.npy", "--memory", "64M"}));
    CHECK(content(folder / "out/blurred.npy") == content(folder / "out/blurred-in-bands.npy"));
}

TEST_CASE("program: ssao of 8192 x 8192 pixels keeps to 512 MiB, dof of 16384 x 8192 to 1 GiB, masks to 64 MiB",
          "[exhaustive]") {
    const FolderOnDisk folder;
    const std::string depth = folder / "depth.npy", color = folder / "color.npy", camera = folder / "camera.json";
    write(camera, R"({"perspective": {"fov_y_deg": 60, "near": 0.1, "far": 100}, "encoding": "view-z"})");
    SECTION("ssao") {
        write_image(depth, steps(8192, 8192));
        // A twentieth of what the camera sees at 3.5 m.
        check_budget({"ssao", depth, "--camera", camera, "--radius", "0.2"}, folder, 512, 256 + 256);
    }
    SECTION("dof-masks") {
        write_image(depth, steps(8192, 4096));
        check_budget({"dof-masks", depth, "--camera", camera, "--focus", "3.1", "--f-stop", "1.4", "--focal-length-mm",
                      "35", "--mm-per-unit", "100"},
                     folder, 64, 128 + 2 * 4 * 128, ".exr"); // a mask each, and all in one image
    }
    SECTION("dof") {
        write_image(depth, steps(16384, 8192));
        cv::Mat picture(8192, 16384, CV_32FC3);
        cv::randu(picture, 0, 1);
        write_image(color, picture);
        picture.release();
        check_budget({"dof", depth, "--camera", camera, "--color", color, "--focus", "3.1", "--f-stop", "1.4",
                      "--focal-length-mm", "35", "--mm-per-unit", "100"},
                     folder, 1024, 512 + 2 * 1536);
    }
}

TEST_CASE("memory: an allocation that fails ends in one line, or in the result", "[slow]") {
    if (places::sanitized)
        return; // which has an allocator of its own
    const Folder folder;
    const std::string depth = depth_file(folder, "depth.exr"), camera = camera_file(folder), z = folder / "out/z.exr";
    const Arguments command{"linearize", depth, "--camera", camera, "-o", z};
    check_done(run(command));
    const std::string whole = content(z);
    std::mt19937 random(1);
    std::map<int, int> codes;
    for (int i = 0; i < 80; ++i) {
        const auto number = std::to_string(i < 20 ? i + 1 : 1 + random() % 25'000); // before the driver's many
        CAPTURE(number);
        fs::remove(z);
        const Outcome outcome =
            run(command,
                {.before = {"env", std::string("LD_PRELOAD=") + places::failing_malloc, "FATHOM_FAILS_AT=" + number}});
        ++codes[outcome.code];
        CAPTURE(outcome.err);
        if (outcome.code == 0) {
            CHECK(content(z) == whole);
        } else {
            CHECK((outcome.code == 1 || outcome.code == 2));
            CHECK(outcome.err.starts_with("fathom: "));
            CHECK(std::ranges::count(outcome.err, '\n') == 1);
            CHECK(!fs::exists(z));
        }
    }
    for (const auto& [code, runs] : codes)
        std::cout << "code " << code << ": " << runs << " runs\n";
}

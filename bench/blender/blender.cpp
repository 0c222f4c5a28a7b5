// fathom_bench_blender: Blender's Defocus node beside dof, on the frames that dof is measured on; and both, with ssao, against
// a path tracer's frame.
//
// The node's circle has a radius of a/2 (d (1/S - 1/z) - 1) pixels, with a = lens/(2 aspect sensor f-stop) and d = 2 height
// lens/sensor (ConvertDepthToRadiusOperation of Blender 3.4). So a d = g gives it the circle of the lens, but for a/2 pixels.

#include "errors.hpp"
#include "path_traced.hpp"
#include "sweeps.hpp"
#include "temp_folder.hpp"

#include <fathom/error.hpp>

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

using namespace fathom;
using namespace fathom::bench;
namespace fs = std::filesystem;

namespace {

constexpr const char* node = "Blender's Defocus node";
constexpr const char* floor_name = "copy depth and RGB";

// What the node is given.
struct Frame {
    int width, height;
    double scale; ///< of the projection: x = scale X/z
    std::vector<float> depth, color;
    CircleOfConfusion circle;
};

struct Blurred {
    std::vector<float> color;
    std::vector<double> seconds; ///< of the node alone
};

std::size_t flipped(const Frame& frame, std::size_t pixel) {
    const auto width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
    return (height - 1 - pixel / width) * width + pixel % width;
}

void write_upside_down(const fs::path& file, const Frame& frame, const std::vector<float>& values,
                       std::size_t channels) {
    const std::size_t pixels = frame.depth.size();
    std::vector<float> four(4 * pixels, 1);
    for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            four[4 * i + c] = values[channels * flipped(frame, i) + c % channels];
    write_raw(file, four);
}

class Blender {
public:
    explicit Blender(std::string program) : program_(std::move(program)) {}

    // The picture, or with rounds how long they took.
    Blurred blurred(Frame frame, int rounds = 0, Clock clock = Clock::wall) const {
        const TempFolder folder("fathom-blender");
        double largest = 0;
        for (float& z : frame.depth) {
            z = std::isfinite(z) ? z : 1e10f; // as Blender's own pass has it
            largest = std::max(largest, 0.5 * std::abs(static_cast<double>(frame.circle.k - frame.circle.g / z)));
        }
        write_upside_down(folder / "depth.raw", frame, frame.depth, 1);
        write_upside_down(folder / "color.raw", frame, frame.color, 3);
        constexpr double sensor = 36;
        const double lens_to_sensor = frame.scale / 2;
        std::ofstream(folder / "request.json") << nlohmann::json{
            {"width", frame.width},
            {"height", frame.height},
            {"sensor", sensor},
            {"lens", sensor * lens_to_sensor},
            {"focus", static_cast<double>(frame.circle.g / frame.circle.k)},
            {"f_stop", frame.width * lens_to_sensor * lens_to_sensor / static_cast<double>(frame.circle.g)},
            {"largest_radius_px", std::ceil(largest)},
            {"processor_time", clock == Clock::processor},
            {"rounds", rounds}};
        const std::string command = "'" + program_ + "' -b --factory-startup --python-exit-code 1 --python '" +
                                    FATHOM_DEFOCUS + "' -- '" + folder.string() + "' >'" + folder.string() +
                                    "/log' 2>&1";
        if (std::system(command.c_str()) != 0 || !fs::exists(folder / "seconds.json"))
            throw Error("Blender failed: " + read_text(folder / "log"));
        Blurred result;
        if (rounds == 0) {
            const std::vector<float> four = read_raw(folder / "result.raw");
            if (four.size() != 4 * frame.depth.size())
                throw Error("Blender's result has " + std::to_string(four.size()) + " numbers");
            for (std::size_t i = 0; i < frame.depth.size(); ++i)
                for (std::size_t c = 0; c < 3; ++c)
                    result.color.push_back(four[4 * flipped(frame, i) + c]);
            return result;
        }
        const auto seconds = nlohmann::json::parse(read_text(folder / "seconds.json"));
        const double without = median(seconds["without"].get<std::vector<double>>());
        for (const double with : seconds["with"].get<std::vector<double>>())
            result.seconds.push_back(with - without);
        return result;
    }

private:
    std::string program_;
};

Frame frame_of(Case& on) {
    return {on.width(),
            on.height(),
            static_cast<double>(on.camera().projection.matrix(0, 0)),
            images::floats(linearize(on.stored()).image),
            images::floats(on.color()),
            on.lens()};
}

Method defocus(const Blender& blender) {
    const auto kept = std::make_shared<std::vector<float>>();
    return {"dof",
            node,
            Method::Kind::blender,
            Storage::float32,
            floor_name,
            [kept, &blender](Case& on) {
                *kept = blender.blurred(frame_of(on)).color;
                return Image::from_host(on.device(), Element::f32, kept->data(), {on.width(), on.height(), 3});
            },
            {},
            [](const View& view) { return view.camera().projection.is_perspective(); }};
}

Figures row_of(const char* operation, std::string method, Method::Kind kind, const char* scene, int width, int height) {
    return {.operation = operation,
            .method = std::move(method),
            .kind = kind_name(kind),
            .storage = to_string(Storage::float32),
            .scene = scene,
            .width = width,
            .height = height};
}

// The node's own time in the room that every method is timed in, beside the floor in the same run.
std::vector<Figures> timed(const Device& device, const Blender& blender, const std::vector<Method>& all, int width,
                           int height, const Effort& effort) {
    const View view = room_view(width, height);
    std::vector<Method> own;
    for (const Method& method : all)
        if (method.name == floor_name || (method.operation == "dof" && method.name == "fast"))
            own.push_back(method);
    std::vector<Figures> rows = presets(device, own, {view}, effort);
    Case on(device, view, 1);
    on.max_coc_px = width / 30.0;
    Figures row = row_of("dof", node, Method::Kind::blender, "room", width, height);
    row.radius_px = on.max_coc_px;
    row.seconds =
        blender.blurred(frame_of(on), width > error_size.first ? 1 : 3, effort.clock).seconds; // half a minute
    row.floor = floor_name;
    row.floor_seconds = rows.back().floor_seconds;
    effort.report(row);
    rows.push_back(row);
    return rows;
}

// Everything against the path tracer, nothing tuned to its frame.
std::vector<Figures> against_path_tracer(const Device& device, const Blender& blender, const Effort& effort) {
    std::vector<Figures> rows;
    const fs::path folder = fs::path(FATHOM_SHARED_DATA) / "blender" / "perspective";
    if (!fs::is_directory(folder)) {
        std::printf("skipped: no frame of a path tracer at %s\n", folder.string().c_str());
        return rows;
    }
    const auto [depth, sharp, truth, camera, circle] = oracle::path_traced(folder);
    const int width = depth.cols, height = depth.rows;
    const std::vector<char> near = oracle::near_edges(depth);
    const auto add = [&](Figures row, std::string unit, const std::vector<double>& errors) {
        row.error = summary(std::move(unit), errors);
        effort.report(row);
        rows.push_back(std::move(row));
    };
    const auto add_blur = [&](const std::string& method, Method::Kind kind, const std::vector<float>& got) {
        add(row_of("dof", method, kind, "path tracer", width, height), "colour", oracle::color_errors(got, truth));
        add(row_of("dof", method, kind, "path tracer, edges", width, height), "colour",
            oracle::color_errors(got, truth, &near));
    };
    const StoredDepth stored{Image::from_host(device, Element::f32, depth.data, {width, height}), camera};
    const Image color = Image::from_host(device, Element::f32, sharp.data(), {width, height, 3});
    const std::pair<const char*, Quality> qualities[] = {
        {"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}};
    for (const auto& [name, quality] : qualities)
        add_blur(name, Method::Kind::library, images::floats(dof(stored, color, circle, {.quality = quality})));
    add_blur("the sharp frame", Method::Kind::baseline, sharp);
    const std::vector<float> z(depth.ptr<float>(), depth.ptr<float>() + depth.total());
    add_blur(
        node, Method::Kind::blender,
        blender.blurred({width, height, static_cast<double>(camera.projection.matrix(0, 0)), z, sharp, circle}).color);

    const cv::Mat visibility = oracle::path_traced_visibility(folder);
    constexpr double ray_length = 1; // of the path tracer's pass
    for (const auto& [name, quality] : qualities)
        for (const bool constant : {false, true}) {
            const std::vector<float> got =
                images::floats(ssao(stored, ray_length,
                                    {.sampling = Sampling{.quality = quality},
                                     .thickness = constant ? std::optional<Thickness>(ray_length / 4) : std::nullopt})
                                   .visibility);
            std::vector<double> errors;
            for (std::size_t i = 0; i < got.size(); ++i)
                errors.push_back(static_cast<double>(got[i]) - static_cast<double>(visibility.ptr<float>()[i]));
            add(row_of("ssao", std::string(name) + (constant ? ", a quarter thick" : ""), Method::Kind::library,
                       "path tracer", width, height),
                "visibility", errors);
        }
    return rows;
}

constexpr const char* help =
    "usage: fathom_bench_blender [--blender PROGRAM] [--size WxH] [--rounds N] [--seconds S]\n"
    "                            [--processor-time] [--csv FILE]\n"
    "Blender's Defocus node beside dof: times at WxH (1920x1080), errors at 960x540 and against a path tracer.\n"
    "Without Blender it says so, and writes no file. Options as those of fathom_bench.\n";

} // namespace

int main(int argc, char** argv) {
    Comparison asked{.effort = {.report = print_row}};
    std::string program = "blender";
    if (const auto status = asked.read(argc, argv, help, "--blender", &program))
        return *status;
    if (std::system(("command -v '" + program + "' >/dev/null").c_str()) != 0) {
        std::printf("skipped: there is no Blender called %s\n", program.c_str());
        return 0;
    }
    const auto& [effort, width, height, csv] = asked;
    try {
        const Device device = Device::open("cpu");
        Baselines kernels(device);
        const std::vector<Method> all = methods(kernels);
        const Blender blender(program);
        const int error_width = std::min(width, error_size.first), error_height = error_width * height / width;
        std::vector<Figures> rows = timed(device, blender, all, error_width, error_height, effort);
        for (Figures& row : timed(device, blender, all, width, height, effort))
            rows.push_back(std::move(row));
        for (Figures& row : errors(device, {defocus(blender)}, views(error_width, error_height), "", effort.report))
            rows.push_back(std::move(row));
        for (Figures& row : against_path_tracer(device, blender, effort))
            rows.push_back(std::move(row));
        if (!csv.empty())
            table_of(device, rows, effort.clock).write_csv(csv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench_blender: %s\n", error.what());
        return 1;
    }
    return 0;
}

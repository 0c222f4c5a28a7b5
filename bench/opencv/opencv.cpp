// fathom_bench_opencv: what OpenCV offers for the same purposes beside Fathom's methods, in one run, on the same frames.
//
// OpenCV starts from metric depth; converting to it is not timed. Its positions and normals have its own axes, so the cameras
// here have them too.

#include "errors.hpp"
#include "sweeps.hpp"

#include <opencv2/core.hpp>
#include <opencv2/rgbd/depth.hpp>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <string>

using namespace fathom;
using namespace fathom::bench;

namespace {

// A frame as OpenCV is given it. The memory is aligned so that a device on the CPU reads results where they are.
class Frame {
public:
    explicit Frame(Case& on) : kept_(on.stored(Storage::float32).image), device_(on.device()) {
        const int width = on.width(), height = on.height();
        stored = matrix(height, width, CV_32F);
        z = matrix(height, width, CV_32F);
        floats = matrix(height, width, CV_32F);
        points = matrix(height, width, CV_32FC3);
        normals = matrix(height, width, CV_32FC3);
        on.stored(Storage::float32).image.download(stored.data);
        linearize(on.stored(Storage::float32)).image.download(z.data);
        const auto& m = on.camera().projection.matrix;
        const auto fx = static_cast<float>(m(0, 0) * width / 2), fy = static_cast<float>(m(1, 1) * height / 2);
        const auto cx = static_cast<float>(0.5 * width - 0.5), cy = static_cast<float>(0.5 * height - 0.5);
        camera = (cv::Mat_<float>(3, 3) << fx, 0, cx, 0, std::abs(fy), cy, 0, 0, 1);
    }

    Image image_of(const cv::Mat& matrix) const {
        return Image::from_host(device_, Element::f32, matrix.data, {matrix.cols, matrix.rows, matrix.channels()});
    }

    cv::Mat stored, z, floats, points, normals, camera;
    std::map<int, cv::Ptr<cv::rgbd::RgbdNormals>> computers;

private:
    cv::Mat matrix(int height, int width, int type) {
        constexpr std::size_t alignment = 128;
        const std::size_t size =
            static_cast<std::size_t>(height) * static_cast<std::size_t>(width) * CV_ELEM_SIZE(type);
        memory_.emplace_back(std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment), std::free);
        std::memset(memory_.back().get(), 0, size);
        return {height, width, type, memory_.back().get()};
    }

    Image kept_; // so that no other frame gets its place in memory, by which it is known
    Device device_;
    std::vector<std::shared_ptr<void>> memory_;
};

class Frames {
public:
    Frame& of(Case& on) {
        std::unique_ptr<Frame>& frame = made_[on.stored(Storage::float32).image.buffer()];
        if (!frame)
            frame = std::make_unique<Frame>(on);
        return *frame;
    }

private:
    std::map<const void*, std::unique_ptr<Frame>> made_;
};

// Results of OpenCV's functions must lie where they were asked for, or the frame would be judged by old ones.
const cv::Mat& in_place(const cv::Mat& result, const void* data) {
    if (result.data != data)
        throw Error("OpenCV has put a result elsewhere");
    return result;
}

std::vector<Method> opencv_methods(const std::shared_ptr<Frames>& frames) {
    std::vector<Method> list;
    const auto add = [&](const char* operation, std::string name, const char* floor, auto work) {
        list.push_back({operation, std::move(name), Method::Kind::opencv, Storage::float32, floor,
                        [=](Case& on) {
                            Frame& frame = frames->of(on);
                            return frame.image_of(work(frame, on));
                        },
                        [=](Case& on) { frames->of(on); }});
    };
    add("linearize", "OpenCV, Mat expression", "copy", [](Frame& f, Case& on) -> const cv::Mat& {
        const auto& frustum = *on.view().subject.frustum;
        const double near = static_cast<double>(frustum.near), far = static_cast<double>(frustum.far);
        const void* data = f.floats.data;
        f.floats = near * far / (far - (far - near) * f.stored);
        return in_place(f.floats, data);
    });
    add("unproject", "OpenCV, rgbd::depthTo3d", "spread", [](Frame& f, Case&) -> const cv::Mat& {
        const void* data = f.points.data;
        cv::rgbd::depthTo3d(f.z, f.camera, f.points);
        return in_place(f.points, data);
    });
    const auto add_normals = [&](std::string name, int method) {
        add("normals", std::move(name), "spread", [method](Frame& f, Case&) -> const cv::Mat& {
            auto& computer = f.computers[method];
            if (!computer)
                computer = cv::rgbd::RgbdNormals::create(f.z.rows, f.z.cols, CV_32F, f.camera, 5, method);
            const void* data = f.normals.data;
            const bool from_depth = method == cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_LINEMOD; // points crash 4.6
            if (!from_depth)
                cv::rgbd::depthTo3d(f.z, f.camera, f.points);
            (*computer)(from_depth ? f.z : f.points, f.normals);
            return in_place(f.normals, data);
        });
    };
    add_normals("OpenCV, FALS", cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_FALS);
    add_normals("OpenCV, LINEMOD", cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_LINEMOD);
    add_normals("OpenCV, SRI", cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_SRI);
    return list;
}

// OpenCV's and those of the library that they are compared with.
std::vector<Method> compared(Baselines& kernels) {
    std::vector<Method> list = opencv_methods(std::make_shared<Frames>());
    for (const Method& method : methods(kernels)) {
        const bool own =
            method.kind == Method::Kind::library && method.storage == Storage::float32 &&
            (method.operation == "linearize" || method.operation == "unproject" || method.operation == "normals");
        if (own || method.kind == Method::Kind::floor)
            list.push_back(method);
    }
    return list;
}

constexpr const char* help =
    "usage: fathom_bench_opencv [--size WxH] [--rounds N] [--seconds S] [--processor-time] [--csv FILE]\n"
    "OpenCV's methods beside Fathom's, on the CPU: times at WxH (1920x1080), errors at 960x540.\n"
    "Options as those of fathom_bench.\n";

} // namespace

int main(int argc, char** argv) {
    Comparison asked{.effort = {.report = print_row}};
    if (const auto status = asked.read(argc, argv, help))
        return *status;
    const auto& [effort, width, height, csv] = asked;
    try {
        const Device device = Device::open("cpu");
        Baselines kernels(device);
        const std::vector<Method> list = compared(kernels);
        const int error_width = std::min(width, error_size.first), error_height = error_width * height / width;
        std::vector<Figures> rows =
            presets(device, list,
                    {pinhole_views(error_width, error_height).front(), pinhole_views(width, height).front()}, effort);
        for (Figures& row : errors(device, list, pinhole_views(error_width, error_height), "", effort.report))
            rows.push_back(std::move(row));
        if (!csv.empty())
            table_of(device, rows, effort.clock).write_csv(csv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench_opencv: %s\n", error.what());
        return 1;
    }
    return 0;
}

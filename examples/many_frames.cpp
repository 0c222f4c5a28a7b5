// Linearizes many frames: while one is computed, the next are read and the last are written.

#include <fathom/camera_file.hpp>
#include <fathom/frames.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>

#include <exception>
#include <filesystem>
#include <iostream>
#include <vector>

int main(int argc, char* argv[]) {
    if (argc < 4) {
        std::cerr << "usage: many_frames CAMERA FOLDER DEPTH...\n";
        return 2;
    }
    const fathom::CameraFile described = fathom::read_camera(argv[1]);
    const std::vector<std::filesystem::path> files(argv + 3, argv + argc);
    const fathom::Device device = fathom::Device::open();
    fathom::set_exr_threads(0);

    struct Frame {
        fathom::DepthFile stored{{}, fathom::Storage::float32, {}};
        cv::Mat depth;
    };
    int failures = 0;
    fathom::for_each_frame<Frame>(
        files.size(),
        {.read = [&](std::size_t i, Frame& frame) { frame.stored = fathom::read_depth(files[i]); },
         .compute =
             [&](std::size_t, Frame& frame) {
                 const cv::Mat& values = frame.stored.values;
                 const fathom::Camera camera = fathom::camera_for(described, values.cols, values.rows);
                 fathom::linearize(device, values, camera, frame.depth, {}, frame.stored.storage);
             },
         .write = [&](std::size_t i,
                      Frame& frame) { fathom::write_image(argv[2] / files[i].stem().concat(".exr"), frame.depth); },
         .report =
             [&](std::size_t, Frame&, const std::exception_ptr& failure) {
                 try {
                     if (failure)
                         std::rethrow_exception(failure);
                 } catch (const std::exception& error) {
                     std::cerr << error.what() << '\n';
                     ++failures;
                 }
             },
         .bytes = [](const Frame& frame) { return 4 * frame.stored.values.total() * sizeof(float); }});
    return failures > 0;
}

// Two operations in a row: the view depth stays on the device and only positions come back.

#include <fathom/fathom.hpp>

#include <iostream>
#include <numbers>
#include <vector>

int main() {
    constexpr int width = 640, height = 480;
    const std::vector<float> stored(width * height, 0.99f);

    fathom::Camera camera;
    camera.projection =
        fathom::perspective(std::numbers::pi / 3, double{width} / height, {.near_plane = 0.1, .far_plane = 100});
    camera.width = width;
    camera.height = height;

    const auto device = fathom::Device::open();
    device.prepare(camera, fathom::Storage::float32, [](const fathom::StoredDepth& any) {
        fathom::unproject(fathom::linearize(any).stored()); // builds both, so that the first frame does not wait for it
    });
    const auto image = fathom::Image::from_host(device, fathom::Element::f32, stored.data(), {width, height});

    const fathom::ViewDepth depth = fathom::linearize({image, camera});
    const fathom::Image positions = fathom::unproject(depth.stored());

    std::vector<float> xyz(3 * width * height);
    positions.download(xyz.data());
    std::cout << "on " << device.info().name << ", the top left pixel lies at (" << xyz[0] << ", " << xyz[1] << ", "
              << xyz[2] << ")\n";
}

// Runs every kernel once for each form, storage and channel count, small: what Oclgrind watches.
//   every_kernel VECTOR_WIDTH
// Prints the device's name and how many images it made. Oclgrind's log says whether any of them was made wrongly.

#include "operations/parameters.hpp"
#include "runtime/state.hpp"

#include <fathom/fathom.hpp>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

using namespace fathom;

namespace {

constexpr int width = 35; // two whole vectors of 16 lanes and a tail that overlaps
constexpr int height = 3;

Camera camera_with(const Projection& projection) {
    Camera camera;
    camera.projection = projection;
    camera.width = width;
    camera.height = height;
    camera.view = Eigen::Matrix4d::Identity();
    return camera;
}

/// A camera for each form.
std::vector<Camera> cameras() {
    const auto wide = perspective(1.0, 1.3, {0.1, 100});
    Eigen::Matrix4d tilt = wide.matrix.cast<double>();
    tilt.row(3) = Eigen::RowVector4d(0.06, -0.04, -1, 0);
    std::vector<Camera> all{camera_with(wide), camera_with(with_oblique_near_plane(wide, {0.2, 0.1, -1, -3})),
                            camera_with(orthographic({-5, 6, -4, 3}, {0.5, 500})), camera_with(from_matrix(tilt))};
    Camera exponential = camera_with(wide);
    exponential.encoding = Encoding::logarithmic;
    exponential.far_plane = 100;
    Camera distance = camera_with(wide);
    distance.encoding = Encoding::ray_distance;
    all.push_back(exponential);
    all.push_back(distance);
    distance.encoding = Encoding::inverse;
    distance.along = Along::ray;
    all.push_back(distance);
    return all;
}

/// An image written in one go, the gaps between its rows included: after a write of a part Oclgrind takes the rest of a
/// buffer for uninitialised.
Image filled(const Device& device, Storage storage, int rows = height) {
    Image image(device, element_of(storage), {width, rows, channels_of(storage)});
    const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels_of(storage));
    const std::size_t size =
        (image.row_stride() * static_cast<std::size_t>(rows - 1) + row) * element_bytes(image.element());
    std::vector<std::uint8_t> content(size, 0x3e); // as a float or a half: a depth inside every range
    runtime::queue_of(device).enqueueWriteBuffer(runtime::buffer_of(image), CL_TRUE, 0, size, content.data());
    return image;
}

int run(const Device& device, const Camera& camera, Storage storage) {
    const StoredDepth whole{filled(device, storage), camera, storage};
    const StoredDepth part = whole.region(1, 1, width - 2, height - 1);
    int images = 0;
    for (const StoredDepth& stored : {whole, part}) {
        linearize(stored);
        unproject(stored);
        unproject(stored, {.space = Space::world, .channels = 4});
        images += 3;
    }
    if (storage == Storage::float32) {
        linearize(part, part.image);
        ++images;
    }
    device.finish();
    return images;
}

/// Windows that lie inside the image need more rows than the others' images have.
int run_normals(const Device& device, Camera camera) {
    camera.height = 9;
    const StoredDepth whole{filled(device, Storage::float32, camera.height), camera};
    for (const StoredDepth& stored : {whole, whole.region(1, 1, width - 2, camera.height - 1)}) {
        normals(stored, {.method = NormalMethod::neighbours});
        normals(stored, {.method = NormalMethod::least_squares, .space = Space::world, .channels = 4});
    }
    device.finish();
    return 4;
}

/// Windows that are wider than the margin's rows: 8 pixels under a perspective, 5 under an orthographic camera.
int run_noise(const Device& device, Camera camera) {
    camera.height = 9;
    const StoredDepth whole{filled(device, Storage::float32, camera.height), camera};
    normals(whole, {.noise = 0.1});
    device.finish();
    return 1;
}

/// Every choice of the occlusion kernels: few directions, since a simulated sample is slow.
int run_occlusion(const Device& device, const Camera& camera) {
    const StoredDepth whole{filled(device, Storage::float32), camera};
    const Image directions = normals(whole);
    SsaoOptions options{.sampling = Sampling{.slices = 1, .samples = 2}};
    Sampling& sampling = std::get<Sampling>(options.sampling);
    ssao(whole, 1, options);
    sampling.jitter = 4;
    options.thickness = std::numeric_limits<double>::infinity();
    options.border = Border::clamp;
    ssao(whole, 1, options);
    sampling.jitter = 1;
    options.normals = directions;
    ssao(whole, 1, options);
    options.normals = {};
    options.thickness = Silhouette{};
    ssao(whole.region(1, 1, width - 2, height - 1), 1, options);
    options.confidence = options.bent_normal = true;
    sampling.half_resolution = true;
    ssao(whole, 1, options);
    ssao(whole.region(1, 1, width - 2, height - 1), 1, options);
    device.finish();
    return 7;
}

/// Circles of every form, and what looks around a pixel.
int run_masks(const Device& device, const Camera& camera, bool around) {
    const StoredDepth whole{filled(device, Storage::float32), camera};
    DofMasksOptions options{.near_weight = true, .focus_weight = true, .far_weight = true};
    const CircleOfConfusion coc =
        depth_form(camera).perspective ? CircleOfConfusion{4, 8, 0, false} : CircleOfConfusion{4, 1, 0, true};
    dof_masks(whole, coc, options);
    options.near_weight = options.focus_weight = options.far_weight = false;
    options.max_near_coc = options.near_alpha = options.disocclusion = options.mixed_pixels = around;
    options.tile_px = 5;
    options.tile_min_coc = options.tile_max_coc = around;
    dof_masks(whole.region(1, 1, width - 2, height - 1), coc, options);
    device.finish();
    return 2;
}

/// The blur, near and far, read directly and through running sums: whole tiles, which are slow to simulate.
int run_blur(const Device& device, Camera camera) {
    camera.encoding = Encoding::view_z;
    const StoredDepth part = StoredDepth{filled(device, Storage::float32), camera}.region(1, 1, width - 2, height - 1);
    const auto depth = static_cast<double>(std::bit_cast<float>(0x3e3e3e3e));
    int images = 0;
    for (const auto& [circle, channels, element] :
         {std::tuple{-9.0, 3, Element::f32}, {9.0, 4, Element::f16}, {2.0, 3, Element::u8}}) {
        const Layout layout{part.image.width(), part.image.height(), channels};
        const std::vector<std::uint8_t> content(Image::allocation(element, layout), 0x41); // as a float bright
        const Image color(device, element, layout);
        runtime::queue_of(device).enqueueWriteBuffer(runtime::buffer_of(color), CL_TRUE, 0, content.size(),
                                                     content.data());
        const CircleOfConfusion coc{.k = circle + 20, .g = 20 * depth};
        DofOptions options{.quality = images % 2 ? Quality::fast : Quality::balanced};
        if (images > 0) // farther than the picture
            options.clean_plate = {color, part};
        if (options.clean_plate)
            options.clean_plate->depth.camera.scale = 2;
        dof(part, color, coc, options);
        options.quality = Quality::accurate;
        if (device.options().vector_width > 1) // one by one it takes the simulator more than five minutes
            dof(part, color, coc, options);
        ++images;
    }
    device.finish();
    return images;
}

/// Uniform and height fog, from the camera centre and from a distance, in pictures of every element.
int run_fog(const Device& device, const Camera& camera) {
    const StoredDepth part = StoredDepth{filled(device, Storage::float32), camera}.region(1, 1, width - 2, height - 1);
    int images = 0;
    for (const auto& [element, channels] :
         {std::tuple{Element::f32, 3}, {Element::f32, 4}, {Element::f16, 3}, {Element::u16, 4}, {Element::u8, 3}}) {
        const Layout layout{part.image.width(), part.image.height(), channels};
        const std::vector<std::uint8_t> content(Image::allocation(element, layout), 0x3e);
        const Image color(device, element, layout);
        runtime::queue_of(device).enqueueWriteBuffer(runtime::buffer_of(color), CL_TRUE, 0, content.size(),
                                                     content.data());
        fog(part, color, {.density = 0.1});
        fog(part, color, {.density = 0.1, .start = 1, .height_falloff = 0.5, .alpha = FogAlpha::straight});
        images += 2;
    }
    device.finish();
    return images;
}

/// Stores past the cache, which only images larger than it get, on an image small enough to simulate.
int run_streamed(const Device& device, const Camera& camera) {
    const int vector_width = device.options().vector_width;
    const StoredDepth stored = StoredDepth{filled(device, Storage::float32), camera}.region(0, 0, 32, height);
    const Image result(device, Element::f32, {32, height});
    const DepthForm form = depth_form(camera);
    const Rays view = camera_rays(camera);
    const Arithmetic arithmetic = device.options().arithmetic;
    runtime::Defines defines = decoder_defines(form, view, stored.storage, vector_width, /*stream=*/true);
    defines.emplace_back("LENS", false);
    runtime::launch(
        device, runtime::kernel(device, "linearize", defines), {static_cast<std::size_t>(32 / vector_width), height},
        stored.image, result, grid_parameters(stored, result, 0, 32),
        depth_parameters(form, stored.storage, Background::inf, arithmetic), ray_parameters(view, arithmetic));
    device.finish();
    return 1;
}

} // namespace

// every_kernel VECTOR_WIDTH [GROUP]
int main(int count, char** arguments) {
    const int vector_width = count > 1 ? std::atoi(arguments[1]) : 1;
    const std::string only = count > 2 ? arguments[2] : "";
    const auto wanted = [&](const char* group) { return only.empty() || only == group; };
    int images = 0;
    for (const Arithmetic arithmetic : {Arithmetic::fp64, Arithmetic::two_float}) {
        const Device device = Device::open("0", {.arithmetic = arithmetic, .vector_width = vector_width});
        if (images == 0)
            std::cout << device.info().name << '\n';
        if (wanted("decode")) {
            for (const Camera& camera : cameras())
                images += run(device, camera, Storage::float32);
            for (const Storage storage :
                 {Storage::float16, Storage::uint8, Storage::uint16, Storage::uint24, Storage::rgb8_red_low})
                images += run(device, cameras().front(), storage);
            images += run_streamed(device, cameras().front());
        }
        if (wanted("masks"))
            for (const Camera& camera : cameras())
                images += run_masks(device, camera, false);
        if (wanted("normals"))
            for (const std::size_t perspective_or_not : {0, 2})
                images += run_normals(device, cameras()[perspective_or_not]);
        if (wanted("noise"))
            for (const std::size_t perspective_or_not : {0, 2})
                images += run_noise(device, cameras()[perspective_or_not]);
        if (wanted("fog"))
            for (const std::size_t flat_or_tilted : {0, 3})
                images += run_fog(device, cameras()[flat_or_tilted]);
        if (arithmetic == Arithmetic::two_float)
            continue; // what follows reads what the others have decoded: one code for both
        if (wanted("around"))
            images += run_masks(device, cameras().front(), true);
        if (wanted("occlusion"))
            for (const std::size_t perspective_or_not : {0, 2})
                images += run_occlusion(device, cameras()[perspective_or_not]);
        if (wanted("blur"))
            images += run_blur(device, cameras().front());
    }
    std::cout << images << " images\n";
}

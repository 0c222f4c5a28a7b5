#include "operations.hpp"

#include "rounds.hpp"
#include "runtime/opencl.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace operations {

using namespace fathom;

Camera camera(int width, int height) {
    Camera camera;
    camera.projection = perspective(1.0, 1.0 * width / height, {0.5, 100});
    camera.width = width;
    camera.height = height;
    camera.view = Eigen::Matrix4d::Identity();
    return camera;
}

std::vector<float> depth(int width, int height) {
    std::vector<float> values;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double hills = 0.9 + 0.03 * std::sin(x * 0.31) * std::cos(y * 0.23);
            values.push_back(static_cast<float>(x > width / 2 ? hills + 0.04 : hills));
        }
    values.front() = std::numeric_limits<float>::quiet_NaN();
    values.back() = 1;
    return values;
}

int width = 40, height = 24;

namespace {

/// What an operation reads.
struct Inputs {
    int width, height;
    std::vector<float> values, picture, plate, thicknesses;
    std::vector<std::uint16_t> steps; // the depth in 16 bits
    StoredDepth stored, coarse;
    Image color, clean, thickness;

    explicit Inputs(const Device& device, int columns = operations::width, int rows = operations::height)
        : width(columns), height(rows), values(depth(columns, rows)) {
        for (const float value : values) {
            const bool valid = value == value;
            for (int channel = 0; channel < 3; ++channel)
                picture.push_back(valid ? std::fmod(value * 40 + static_cast<float>(channel) / 3, 1.0f) : 0.5f);
            thicknesses.push_back(valid ? 0.2f + 0.1f * value : 0.2f);
            steps.push_back(valid ? static_cast<std::uint16_t>(value * 65535) : std::uint16_t{0});
        }
        plate.assign(picture.size(), 0.25f);
        stored = {host(device, Element::f32, values.data(), 1), camera(width, height)};
        coarse = {host(device, Element::u16, steps.data(), 1), camera(width, height), Storage::uint16};
        color = host(device, Element::f32, picture.data(), 3);
        thickness = host(device, Element::f32, thicknesses.data(), 1);
        clean = host(device, Element::f32, plate.data(), 3);
    }

    Image host(const Device& device, Element element, const void* data, int channels) const {
        return Image::from_host(device, element, data, {width, height, channels});
    }
};

Bytes bytes(const std::vector<Image>& images) {
    Bytes all;
    for (const Image& image : images) {
        const std::size_t size = element_bytes(image.element()) *
                                 static_cast<std::size_t>(image.width() * image.height() * image.channels());
        all.resize(all.size() + size);
        image.download(all.data() + all.size() - size);
    }
    return all;
}

/// Into memory of the caller's that is the image.
Bytes onto_the_host(const Device& device) {
    const Inputs in(device);
    std::vector<float> result(in.values.size());
    const Image image = Image::onto_host(device, Element::f32, result.data(), {in.width, in.height});
    linearize(in.stored, image);
    image.download(result.data());
    Bytes copy(result.size() * sizeof(float));
    std::memcpy(copy.data(), result.data(), copy.size());
    return copy;
}

/// From an address that no float may have, which takes a copy.
Bytes from_an_odd_address(const Device& device) {
    const std::vector<float> values = depth(width, height);
    Bytes shifted(values.size() * sizeof(float) + 1);
    std::memcpy(shifted.data() + 1, values.data(), shifted.size() - 1);
    return bytes(
        {linearize({Image::from_host(device, Element::f32, shifted.data() + 1, {width, height}), camera(width, height)})
             .image});
}

Bytes a_region(const Device& device) {
    const Inputs in(device);
    const Image image = linearize(in.stored).image.region(3, 2, 20, 11);
    std::vector<float> rows(30 * 11); // with gaps between them
    image.download(rows.data(), 30);
    Bytes copy(rows.size() * sizeof(float));
    std::memcpy(copy.data(), rows.data(), copy.size());
    return copy;
}

Bytes focus(const Device& device) {
    const double depth = depth_at(Inputs(device).stored, 5, 5);
    Bytes copy(sizeof(depth));
    std::memcpy(copy.data(), &depth, sizeof(depth));
    return copy;
}

Bytes four_in_a_row(const Device& device) {
    const Inputs in(device);
    const ViewDepth z = linearize(in.stored);
    const Image turned = normals(z.stored());
    const Occlusion open = ssao(z.stored(), 0.5, {.normals = turned});
    const DofMasks masks = dof_masks(z.stored(), lens, weights);
    device.finish();
    return bytes({z.image, turned, open.visibility, masks.coc, masks.far_weight});
}

/// An event that an operation made, or did not.
struct Event {
    cl_event event = nullptr;
    Event() = default;
    Event(const Event&) = delete;
    Event& operator=(const Event&) = delete;
    ~Event() {
        if (event)
            clReleaseEvent(event);
    }
};

Bytes prepared(const Device& device) {
    const Inputs in(device);
    Image result;
    device.prepare(in.stored.camera, Storage::float32, [&](const StoredDepth& depth) { result = normals(depth); });
    return bytes({result, normals(in.stored)});
}

Bytes with_events(const Device& device) {
    const Inputs in(device);
    Event first, second;
    const Image turned = normals(in.stored, {}, {.event = &first.event});
    const ViewDepth z = linearize(in.stored, {}, {.wait = {first.event}, .event = &second.event});
    return bytes({turned, z.image});
}

template <typename Run>
Operation with_inputs(std::string name, Run run) {
    return {std::move(name), [run](const Device& device) {
                const Inputs in(device);
                return bytes({run(in)});
            }};
}

/// A call of an operation as it is described, in one of the four rounds of its options; `in_regions`: into parts of larger images,
/// which takes copies.
Operation described(const description::Operation& operation, std::size_t round, bool in_regions = false) {
    return {text(operation.name, ", round ", round, in_regions ? ", into regions" : ""),
            [&operation, round, in_regions](const Device& device) {
                const Inputs in(device);
                const std::shared_ptr<void> call = rounds::call_of(operation, round, in.color, lens, 0.5);
                std::vector<Image> made;
                rounds::with_images(operation, call.get(), in.stored, [&](const description::Shape& shape) {
                    Layout larger = shape.layout;
                    if (in_regions)
                        larger.width += 3, larger.height += 2;
                    const Image image(device, shape.element, larger);
                    made.push_back(in_regions ? image.region(1, 1, shape.layout.width, shape.layout.height) : image);
                    return made.back();
                });
                operation.run(call.get(), in.stored, {});
                return bytes(made);
            }};
}

std::vector<Operation> make_all() {
    using In = const Inputs&;
    std::vector<Operation> all{
        with_inputs("linearize, 16 bits", [](In in) { return linearize(in.coarse).image; }),
        with_inputs("normals, 16 bits", [](In in) { return normals(in.coarse); }),
        with_inputs("ssao, 16 bits", [](In in) { return ssao(in.coarse, 0.5).visibility; }),
        with_inputs("ssao, back depth",
                    [](In in) { return ssao(in.stored, 0.5, {.thickness = in.coarse}).visibility; }),
        with_inputs("ssao, thickness map",
                    [](In in) { return ssao(in.stored, 0.5, {.thickness = in.thickness}).visibility; }),
        with_inputs("dof, clean plate",
                    [](In in) {
                        return dof(in.stored, in.color, lens, {.clean_plate = CleanPlate{in.clean, in.coarse}});
                    }),
        with_inputs("dof, pinhole", [](In in) { return dof(in.stored, in.color, {}); }),
        with_inputs("fill_invalid", [](In in) { return fill_invalid(in.stored).image; }),
        with_inputs("grow_foreground", [](In in) { return grow_foreground(in.stored, 2).image; }),
        {"four in a row", four_in_a_row},
        {"one after the other's event", with_events},
        {"Device::prepare", prepared},
        {"a region with gaps between its rows", a_region},
        {"onto the host", onto_the_host},
        {"from an odd address", from_an_odd_address},
        {"depth_at", focus},
    };
    for (const description::Operation& operation : description::operations()) {
        for (std::size_t round = 0; round < 4; ++round)
            all.push_back(described(operation, round));
        if (operation.results)
            all.push_back(described(operation, 0, true));
    }
    return all;
}

} // namespace

const std::vector<Operation>& all() {
    static const std::vector<Operation> list = make_all();
    return list;
}

const Operation& in_huge_pages() {
    static const Operation large{
        "ssao in huge pages", [](const Device& device) {
            const Inputs in(device, 1024, 512);
            return bytes({ssao(in.stored, 0.5, {.sampling = Sampling{.samples = 1, .jitter = 1}}).visibility});
        }};
    return large;
}

} // namespace operations

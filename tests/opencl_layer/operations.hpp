#pragma once

#include <fathom/fathom.hpp>

#include <functional>
#include <string>
#include <vector>

/// Every operation with the choices that take another way through the library, on small images.
namespace operations {

using Bytes = std::vector<unsigned char>;

/// One call: makes its input in memory of its own, runs on the device, hands over every result. When it ends, by an exception
/// too, its memory is gone.
struct Operation {
    std::string name;
    std::function<Bytes(const fathom::Device&)> run;
};

/// Of the images. A test may set them to what it needs.
extern int width, height;

const std::vector<Operation>& all();

/// An image so large that its scratch memory is taken in huge pages.
const Operation& in_huge_pages();

/// The camera of an image of this size. Its depth is window depth from 0.5 to 100.
fathom::Camera camera(int width, int height);

/// Hills, steps, an invalid pixel and a sky, as window depth.
std::vector<float> depth(int width, int height);

inline constexpr fathom::CircleOfConfusion lens{8, 16};
inline constexpr fathom::DofMasksOptions weights{.near_weight = true, .focus_weight = true, .far_weight = true};

} // namespace operations

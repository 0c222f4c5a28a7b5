#pragma once

#include "catch.hpp"
#include "places.hpp"

#include <fathom/io.hpp>

/// Depth that others made, where it is there.
namespace fathom::real {

namespace fs = std::filesystem;

inline const fs::path data = test::places::shared_data;

/// A test without its inputs says so, and CTest counts it as skipped.
inline bool there(const char* folder) {
    if (fs::is_directory(data / folder))
        return true;
    WARN("skipped: no real inputs at " << (data / folder).string());
    return false;
}

/// A depth buffer of OpenGL's rasteriser.
inline DepthFile opengl_depth(const std::string& name) {
    const fs::path tiff = data / "opengl" / (name + ".depth.tif");
    return read_depth(fs::exists(tiff) ? tiff : data / "opengl" / (name + ".depth.png"));
}

} // namespace fathom::real

#include "regimes/regime.hpp"

#include <algorithm>

namespace fathom::regimes {

Curve& Panel::curve(const std::string& wanted) {
    const auto found = std::ranges::find(curves, wanted, &Curve::name);
    return found != curves.end() ? *found : curves.emplace_back(Curve{wanted});
}

Panel& Regime::panel(const std::string& wanted) {
    const auto found = std::ranges::find(panels, wanted, &Panel::quantity);
    return found != panels.end() ? *found : panels.emplace_back(Panel{wanted});
}

const std::vector<Sweep>& sweeps() {
    static const std::vector<Sweep> all{
        {"far-over-near", far_over_near},
        {"oblique-angle", oblique_angle},
        {"oblique-distance", oblique_distance},
        {"bits-of-depth", bits_of_depth},
        {"noise-on-depth", noise_on_depth},
        {"grazing-angle", grazing_angle},
        {"radius", radius_of_occlusion},
        {"ring", ring_of_a_radius},
        {"thickness", thin_occluders},
        {"border", border_of_the_image},
        {"focus", focus_distance},
        {"aperture", aperture},
        {"highlights", highlights},
        {"filter", filter_width},
        {"offset", depth_offset},
        {"motion", motion},
        {"w-range", w_range},
        {"field-of-view", field_of_view},
        {"distortion", distortion},
        {"latitude", latitude_of_a_panorama},
        {"radius-over-distance", radius_over_distance},
    };
    return all;
}

} // namespace fathom::regimes

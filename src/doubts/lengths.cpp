// Doubts about lengths that somebody gives an operation, for what an image shows: a radius, a lens.
#include "doubts/lengths.hpp"

#include "camera/form.hpp"
#include "doubts/stored_values.hpp"
#include "quantile.hpp"
#include "text.hpp"

#include <fathom/dof.hpp>
#include <fathom/doubts.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace fathom {
namespace {

constexpr double sky_depth = std::numeric_limits<double>::infinity();

// NaN where there is none.
double width_at(const CircleOfConfusion& circle, double z) {
    return std::abs(static_cast<double>(coc_at(circle, static_cast<long double>(z))));
}

std::string range_of(const Look& look) {
    return text("depths run from ", number(static_cast<double>(look.nearest), 4), " to ",
                number(static_cast<double>(look.farthest), 4));
}

} // namespace

double widest_shown(const CircleOfConfusion& circle, const Look& look, Sky sky) {
    double widest = 0;
    const auto add = [&](double z) { widest = std::max(widest, width_at(circle, z)); };
    if (look.surfaces() >
        0) { // Circles grow to either side of the focus, so that none is wider than those at the ends.
        add(static_cast<double>(look.nearest));
        add(static_cast<double>(look.farthest));
    }
    if (sky == Sky::blur && look.background > 0)
        add(sky_depth);
    return widest;
}

std::vector<std::string> radius_doubts(const Subject& subject, double radius) {
    std::vector<float> depths; // enough for a median that is good to a few percent
    for (const Sampled& window : subject.windows)
        std::ranges::copy_if(window.z, std::back_inserter(depths), [](float z) { return std::isfinite(z); });
    if (depths.empty())
        return {};
    const Look& look = subject.look;
    const Camera& camera = subject.camera;
    const bool perspective = camera.lens || depth_form(camera, subject.storage).perspective;
    const auto scale = static_cast<double>(pixel_scale(camera).x);
    const double centre = perspective && !camera.lens ? static_cast<double>(camera_rays(camera).centre_depth) : 0;
    const double pixel = (perspective ? static_cast<double>(quantile(depths)) - centre : 1) / scale,
                 across = pixel * std::hypot(camera.width, camera.height);
    if (radius < pixel / 2)
        return {text("the radius of ", number(radius),
                     " is less than half a pixel for most pixels, so that little is occluded: ", range_of(look),
                     ", where ", number(16 * pixel, 2), " would be 16 pixels")};
    if (radius > std::hypot(across, static_cast<double>(look.farthest) - static_cast<double>(look.nearest)))
        return {text("the radius of ", number(radius), " is larger than all that most pixels see: ", range_of(look),
                     ", and the view is ", number(pixel * camera.width, 2),
                     " wide in their middle; is it in scene units?")};
    if (camera.lens && camera.lens->law != LensLaw::brown) {
        constexpr double most = 2, some = 0.05; // distances, and the part of the pixels that may be nearer
        const double at_most = most * static_cast<double>(quantile(depths, some));
        if (radius > at_most)
            return {text("the radius of ", number(radius), " is more than twice the distance of ",
                         percent(static_cast<std::size_t>(std::ranges::count_if(
                                     depths, [&](float z) { return radius > most * static_cast<double>(z); })),
                                 depths.size()),
                         " of the pixels, and reaches beyond what the pinholes see that ssao cuts a lens's image into; "
                         "their visibility is too large. Give ",
                         number(0.95 * at_most, 2), " or less")};
    }
    return {};
}

std::vector<std::string> lens_doubts(const Subject& subject, const LensArguments& lens, const CircleOfConfusion& circle,
                                     Sky sky, double max_coc_px, const LensWords& words) {
    const Look& look = subject.look;
    if (lens.relative)
        return lens.focus_range ? std::vector<std::string>{} // all may be in focus
                                : circle_doubts(subject, circle, sky, max_coc_px,
                                                text(words.option("blur_px"), " is ", number(*lens.blur_px)), words);
    if (lens.circle)
        return circle_doubts(subject, circle, sky, max_coc_px,
                             text("is ", words.option("circle"), " in pixels and scene units?"), words);
    std::vector<std::string> said;
    constexpr double shortest_mm = 0.2; // no lens of a camera and no sensor is so small
    const auto check = [&](const char* option, const std::optional<double>& length) {
        if (length && *length < shortest_mm)
            said.push_back(text(words.option(option), ": ", number(*length),
                                " mm is smaller than any; if these are metres, give ", number(*length * 1000)));
    };
    check("focal_length_mm", lens.focal_length_mm);
    check("sensor_mm", lens.sensor_mm);
    if (!said.empty())
        return said;
    said = circle_doubts(subject, circle, sky, max_coc_px,
                         text("a scene unit counts as ", number(lens.mm_per_unit), " mm (", words.option("mm_per_unit"),
                              "), and the f-number is ", number(*lens.f_stop)),
                         words);
    const bool told = lens.focus && !lens.focus_at && !lens.focus_along && std::isfinite(*lens.focus);
    if (said.empty() && told && look.surfaces() > 0 && (circle.k != 0 || circle.g != 0)) {
        const auto nearest = static_cast<double>(look.nearest), farthest = static_cast<double>(look.farthest);
        const bool behind = *lens.focus > 2 * farthest && look.background == 0;
        if (behind || *lens.focus < nearest / 2)
            said.push_back(text("the focus of ", number(*lens.focus), " lies ", behind ? "behind" : "before",
                                " everything: ", range_of(look), "; ", words.option("focus_at"),
                                " X,Y focuses on what a pixel shows"));
    }
    return said;
}

std::vector<std::string> circle_doubts(const Subject& subject, const CircleOfConfusion& circle, Sky sky,
                                       double max_coc_px, const std::string& cure, const LensWords& words) {
    if (circle.k == 0 && circle.g == 0) // a pinhole
        return {};
    const Look& look = subject.look;
    const double widest = widest_shown(circle, look, sky);
    const std::size_t blurred_sky = sky == Sky::blur ? look.background : 0, circles = look.surfaces() + blurred_sky;
    std::size_t ended = width_at(circle, sky_depth) > max_coc_px ? blurred_sky : 0;
    if (widest_shown(circle, look, Sky::sharp) > max_coc_px)
        ended += count_depths(subject, [&](double z) { return std::isfinite(z) && width_at(circle, z) > max_coc_px; });
    if (circles > 0 && widest < 1)
        return {text("no circle of confusion is a pixel wide: the largest has ", number(widest, 2),
                     ", so that nothing is blurred; ", cure)};
    // A wrong unit of length leaves what is near the focus: up to half of a real image. The default limit cuts off none of it
    // under a right one. A smaller limit is a choice, and a doubtful one where it decides everything.
    const double many = max_coc_px < DofOptions{}.max_coc_px ? 0.95 : 0.5;
    if (static_cast<double>(ended) > many * static_cast<double>(circles))
        return {text(percent(ended, circles), " of the circles of confusion are cut off at ",
                     words.option("max_coc_px"), " ", number(max_coc_px), ": they are up to ", number(widest, 3),
                     " pixels wide; ", cure)};
    return {};
}

} // namespace fathom

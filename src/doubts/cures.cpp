// What would cure a fault is tried before it is told.
#include "camera/form.hpp"
#include "doubts/look.hpp"
#include "doubts/stored_values.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <type_traits>

namespace fathom {
namespace {

// As many digits as tell a float apart.
std::string shortest(double value) {
    std::string digits = number(value);
    std::istringstream stream(digits);
    stream.imbue(std::locale::classic());
    double again = 0;
    stream >> again;
    return static_cast<float>(again) == static_cast<float>(value) ? digits : number(value, 9);
}

struct Words {
    std::string operator()(double value) const { return std::isinf(value) ? "\"infinity\"" : shortest(value); }
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(const std::array<double, 2>& two) const {
        return text("[", shortest(two[0]), ", ", shortest(two[1]), "]");
    }
    std::string operator()(auto word) const { return text("\"", to_string(word), "\""); }
};

std::string in_words(const Key& key) {
    const std::string_view name = key.name;
    if (const auto* two = std::get_if<std::array<double, 2>>(&key.value); two && name == "orthographic")
        return text("\"orthographic\": {\"near\": ", shortest((*two)[0]), ", \"far\": ", shortest((*two)[1]), "}");
    const bool is_srgb = name == "gamma" && std::get<double>(key.value) == gamma_of_srgb;
    return text("\"", name, "\": ", is_srgb ? "\"srgb\"" : std::visit(Words{}, key.value));
}

template <typename Value>
std::optional<Value> value_of(const Cure& cure, std::string_view name) {
    for (const Key& key : cure.keys)
        if (key.name == name)
            return std::get<Value>(key.value);
    return std::nullopt;
}

// What a camera file with these keys describes. Packings and curves are of the file's values.
Camera cured_by(const Cure& cure, Camera camera) {
    const auto set = [&](auto Camera::*member, std::string_view name) {
        using Member = std::remove_reference_t<decltype(camera.*member)>;
        if constexpr (std::is_same_v<Member, std::optional<double>>) {
            if (const auto value = value_of<double>(cure, name))
                camera.*member = value;
        } else if (const auto value = value_of<Member>(cure, name))
            camera.*member = *value;
    };
    if (const auto encoding = value_of<Encoding>(cure, "encoding")) {
        camera.encoding = *encoding;
        camera.scale = is_metric(*encoding) ? camera.scale : 1; // such keys are refused beside others
        camera.offset = *encoding == Encoding::inverse ? camera.offset : 0;
        camera.from_near_plane = false;
        camera.along = Along::axis;
    }
    if (const auto ends = value_of<std::array<double, 2>>(cure, "orthographic")) { // in the other order
        Projection& projection = camera.projection;
        auto& m = projection.matrix;
        m.row(2) = (projection.clip_near() + projection.clip_far()) * m.row(3) - m.row(2);
        projection.known_third_row.reset();
        camera.near_plane = (*ends)[0];
        camera.far_plane = (*ends)[1];
    }
    set(&Camera::scale, "scale");
    set(&Camera::offset, "offset");
    set(&Camera::along, "along");
    set(&Camera::from_near_plane, "from_near_plane");
    set(&Camera::near_plane, "near");
    set(&Camera::far_plane, "far");
    set(&Camera::depth_range, "depth_range");
    set(&Camera::missing, "missing");
    set(&Camera::background, "background");
    set(&Camera::background_from, "background_from");
    return camera;
}

// The values as a file would hold them without a packing or a curve; nothing where a cure changes neither.
struct Rewritten {
    std::vector<std::uint16_t> codes = {};
    std::vector<float> floats = {};
    HostDepth stored = {};

    Rewritten(const Subject& subject, const Cure& cure) : stored(subject.whole) {
        const auto one_row = [&](const void* data, std::size_t bytes, Storage storage) {
            stored.data = data;
            stored.row_bytes = bytes * static_cast<std::size_t>(stored.width);
            stored.storage = storage;
        };
        const auto packing = value_of<Packing>(cure, "packing");
        const auto gamma = value_of<double>(cure, "gamma");
        if (packing == Packing::rgb_red_low || packing == Packing::rgb_red_high) {
            const bool is_bgr = subject.storage == Storage::bgr8_red_low || subject.storage == Storage::bgr8_red_high;
            const bool is_low = packing == Packing::rgb_red_low;
            stored.storage = is_bgr ? (is_low ? Storage::bgr8_red_low : Storage::bgr8_red_high)
                                    : (is_low ? Storage::rgb8_red_low : Storage::rgb8_red_high);
        } else if (packing == Packing::base_255) {
            visit_values(subject.whole, [&](float, std::uint32_t bits) {
                floats.push_back(
                    static_cast<float>((((bits & 0xff) / 255.0 + ((bits >> 8) & 0xff)) / 255 + (bits >> 16)) / 255));
            });
            one_row(floats.data(), sizeof(float), Storage::float32);
        } else if (packing) {
            visit_values(subject.whole, [&](float, std::uint32_t bits) {
                codes.push_back(unpacked_code(static_cast<std::uint16_t>(bits), *packing));
            });
            one_row(codes.data(), sizeof(std::uint16_t), Storage::uint16);
        } else if (gamma) {
            const double largest = storage_max(subject.storage),
                         again = is_metric(subject.camera.encoding) ? largest : 1;
            visit_values(subject.whole, [&](float value, std::uint32_t) {
                const double part = static_cast<double>(value) / largest;
                floats.push_back(
                    static_cast<float>(part > 0 && std::isfinite(part) ? again * linear_of(part, *gamma) : part));
            });
            one_row(floats.data(), sizeof(float), Storage::float32);
        }
    }
};

// Is the fault gone once the cure is taken? And is nothing found that was not there before, but for what a second cure mends?
bool helps(const Cure& cure, Fault fault, const Subject& subject, const std::vector<Fault>& before,
           bool is_first = true) {
    const Rewritten values(subject, cure);
    try {
        const Subject cured(cured_by(cure, subject.camera), values.stored,
                            subject.closely == Closely::some ? Closely::some : Closely::most);
        if (const auto refused = refusal(cured))
            return false;
        const std::vector<Finding> found = untried_doubts(cured);
        return std::ranges::all_of(found, [&](const Finding& each) {
            if (each.fault == fault)
                return false;
            std::vector<Fault> both = before;
            both.push_back(fault);
            const bool is_of_file = fault == Fault::planes && each.fault == Fault::filtered; // which other values hid
            return is_of_file || std::ranges::count(before, each.fault) > 0 ||
                   (is_first && std::ranges::any_of(each.cures, [&](const Cure& second) {
                        return helps(second, each.fault, cured, both, false);
                    }));
        });
    } catch (const std::invalid_argument&) { // no such camera decodes such values
        return false;
    }
}

} // namespace

const char* to_string(Fault fault) {
    constexpr std::array names{"nothing-measured", "bits",     "picture",  "planes",     "invalid", "unit", "buffer",
                               "number",           "filtered", "panorama", "projection", "range",   "lens"};
    return names.at(static_cast<std::size_t>(fault));
}

std::string in_words(const std::vector<Key>& keys) {
    std::string words;
    for (const Key& key : keys)
        words += (words.empty() ? "" : ", ") + in_words(key);
    return words;
}

std::string in_words(const Finding& finding) {
    std::string said = finding.cause;
    for (const Cure& cure : finding.cures)
        said += "; " + (!cure.words.empty() ? cure.words
                        : cure.when.empty() ? "say " + in_words(cure.keys)
                                            : cure.when + ", say " + in_words(cure.keys));
    return !finding.cures.empty() || finding.otherwise.empty() ? said : said + "; " + finding.otherwise;
}

std::vector<Finding> doubts(const Subject& subject) {
    std::vector<Finding> said;
    if (const auto refused = refusal(subject)) // whatever else is seen follows from it
        said.push_back(*refused);
    else
        said = untried_doubts(subject);
    std::vector<Fault> before;
    for (const Finding& finding : said)
        before.push_back(finding.fault);
    for (Finding& finding : said) {
        const bool had_cures = !finding.cures.empty();
        std::erase_if(finding.cures, [&](const Cure& cure) { return !helps(cure, finding.fault, subject, before); });
        if (had_cures && finding.cures.empty() && finding.otherwise.empty())
            finding.otherwise = "no key of the camera mends it alone; fathom inspect shows more";
    }
    if (std::ranges::any_of(said, [](const Finding& each) { return each.has_no_unit; })) // which look filtered between
        std::erase_if(said, [](const Finding& each) { return each.fault == Fault::filtered; });
    for (const Finding& mistake : lens_mistakes(subject.camera))
        said.push_back(mistake);
    return said;
}

} // namespace fathom

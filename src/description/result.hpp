#pragma once

#include "description/range.hpp"

#include <fathom/image.hpp>
#include <fathom/launch.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace fathom::description {

/// An option, and others: one of which it needs, or none of which may be given beside it. "space=world" is an option of this value.
struct Relation {
    const char* option;
    std::array<const char*, 7> others;
};

/// What is said of an operation beside its options and its results.
struct Said {
    using Relations = std::array<Relation, 2>;

    const char* name;
    const char* summary;
    const char* notes = "";                    ///< what the program shows below its options
    std::array<const char*, 2> arguments = {}; ///< options that a call need not name, in their order
    const char* group = "";                    ///< of the program's options
    const char* layer = "";                    ///< of an EXR to which a result of few words is appended
    Relations needing = {}, excluding = {};    ///< between options, beside those of one variant
    const char* results = nullptr;             ///< the struct of several results
    bool repairs = false;                      ///< is its depth repaired before?
    bool first_alone = false;                  ///< is the first of them given without the struct if it is all there is?
};

/// A call of one result and without arguments has nothing but options.
template <typename Visitor, typename Call>
requires(!Call::said.arguments[0] && !Call::said.results) void describe(const Visitor& v, Call& call) {
    describe(v, call.options);
}

inline ImageSize size_of(const StoredDepth& stored) {
    return {stored.image.width(), stored.image.height()};
}

/// The image that a result takes.
struct Shape {
    Element element = Element::f32;
    Layout layout = {};
    const char* sides = "H, W"; ///< in Python's words
};

inline Shape floats(const ImageSize& size, int channels) {
    return {.layout = {size.width, size.height, channels}};
}
inline Shape floats(const StoredDepth& stored, int channels) {
    return floats(size_of(stored), channels);
}
inline Shape tiles(const StoredDepth& stored, int tile_px) {
    const ImageSize size = size_of(stored);
    return {.layout = {(size.width - 1) / std::max(tile_px, 1) + 1, (size.height - 1) / std::max(tile_px, 1) + 1},
            .sides = "ceil(H / tile_px), ceil(W / tile_px)"};
}
inline Shape like(const Image& color) {
    return {color.element(), {color.width(), color.height(), color.channels()}};
}

/// What numbers a result has, its channels in an EXR, and the range that no number of it leaves, but for NaN.
struct Content {
    enum class Of { lengths, fractions, directions, light } of;
    const char* channels;
    const char* unit = ""; ///< if it has one that is not said for the whole file
    Range range = any_number;
    const char* range_words = ""; ///< what more holds of a pixel
};

constexpr Content lengths(const char* channels, const Range& range, const char* unit = "") {
    return {Content::Of::lengths, channels, unit, range};
}
constexpr Content fractions(const char* channels, const char* words = "") {
    return {Content::Of::fractions, channels, "", between(0, 1), words};
}
constexpr Content directions(const char* channels, const char* words) {
    return {Content::Of::directions, channels, "", between(-1, 1), words};
}
/// Its range is the picture's.
constexpr Content light(const char* words) {
    return {Content::Of::light, "R G B", "", any_number, words};
}

/// A result of a call: the image that it goes to, whether it is asked for, and the shape that it has then.
struct Result {
    const char* name;
    Image* image;
    bool wanted;
    Shape shape;
    Content content;
    const char* words;
};

/// The results of a call for stored depth.
template <typename Call>
std::vector<Result> results_of(Call& call, const StoredDepth& stored) {
    std::vector<Result> results;
    const auto add = [&](const char* name, Image& image, bool wanted, const Shape& shape, const Content& content,
                         const char* words) {
        results.push_back({name, &image, wanted, shape, content, words});
    };
    describe_results(add, call, stored);
    return results;
}

} // namespace fathom::description

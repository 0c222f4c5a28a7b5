// Depth from OpenEXR, with OpenEXR's own library: any part, half, float or uint, scan lines or tiles.
// What comes back is the display window, which is what a camera's projection maps, or any other rectangle: pixels that the
// data window does not reach are NaN.
#include "open.hpp"

#include "io/formats.hpp"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

namespace fathom::io {
namespace {

using Imath::Box2i;

struct Candidate {
    int part;
    std::string name;      ///< within its part
    std::string full_name; ///< with its part's name in front, when there are several parts
    Imf::PixelType type;
    bool deep;
    bool subsampled;
    std::optional<std::size_t>
        rank; ///< how well its name says that it is depth, 0 the best; none when it does not say so
};

/// The names of depth, the likeliest first. Z is OpenEXR's own name, Layer.Depth.Z and Layer.Depth.V are Blender's, V is
/// its viewer's, Y is a grey image. Distances along the ray are called distance by `linearize`.
struct DepthName {
    std::string_view name; ///< in lower case
    bool in_layer;         ///< is it depth at the end of a layer's name, too?
    bool says_depth;       ///< V and Y are any value
};
constexpr DepthName depth_names[] = {{"z", false, true},      {"depth.z", true, true},   {"v", false, false},
                                     {"depth.v", true, true}, {"depth", true, true},     {"zdepth", true, true},
                                     {"z", true, true},       {"distance", false, true}, {"y", false, false}};

std::optional<std::size_t> rank_of(const std::string& name) {
    const auto found = std::ranges::find_if(depth_names, [&](const DepthName& depth) {
        return name == depth.name || (depth.in_layer && name.ends_with("." + std::string(depth.name)));
    });
    if (found == std::end(depth_names))
        return std::nullopt;
    return static_cast<std::size_t>(found - depth_names);
}

/// Gives each channel its rank.
/// X, Y and Z side by side are a position or a normal, U and V texture coordinates. Mist is Blender's pass from 0 to 1,
/// linear.Z and what is in a layer Fathom were written by `--append`. Y is the brightness of a picture in OpenEXR, so that it is no depth
/// beside a channel that says it is, and it repeats results of Fathom that are none.
void rank(std::vector<Candidate>& channels) {
    std::set<std::pair<int, std::string>> names;
    for (const Candidate& channel : channels)
        names.emplace(channel.part, lower(channel.name));
    constexpr std::string_view results[] = {"ao",  "confidence",   "coc",   "near", "focus",
                                            "far", "disocclusion", "mixed", "min",  "max"};
    bool one_says_depth = false, one_is_result = false;
    for (Candidate& channel : channels) {
        const std::string name = lower(channel.name), layer = name.substr(0, name.rfind('.') + 1);
        const std::string last = name.substr(layer.size());
        const auto one_of = [&](std::initializer_list<const char*> ends) {
            return std::ranges::find(ends, last) != ends.end() && std::ranges::all_of(ends, [&](const char* end) {
                       return names.contains({channel.part, layer + end});
                   });
        };
        if (one_of({"x", "y", "z"}) || one_of({"u", "v"}) || layer.ends_with("mist.") || layer == "linear." ||
            layer.starts_with("fathom."))
            continue;
        channel.rank = rank_of(name);
        one_says_depth |= channel.rank && depth_names[*channel.rank].says_depth;
        one_is_result |= std::ranges::find(results, name) != std::end(results);
    }
    for (Candidate& channel : channels)
        if ((one_says_depth || one_is_result) && lower(channel.name) == "y")
            channel.rank.reset();
}

std::vector<Candidate> channels_of(const Imf::MultiPartInputFile& exr) {
    std::vector<Candidate> channels;
    for (int part = 0; part < exr.parts(); ++part) {
        const auto& header = exr.header(part);
        const auto prefix = exr.parts() > 1 && header.hasName() ? header.name() + "." : "";
        for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
            channels.push_back({
                .part = part,
                .name = c.name(),
                .full_name = prefix + c.name(),
                .type = c.channel().type,
                .deep = header.hasType() && Imf::isDeepData(header.type()),
                .subsampled = c.channel().xSampling != 1 || c.channel().ySampling != 1,
                .rank = {},
            });
    }
    rank(channels);
    return channels;
}

[[noreturn]] void refuse_unnamed(const std::filesystem::path& file, const std::vector<Candidate>& channels) {
    refuse(file, "has no channel that is named like depth; say which it is (--channel): " +
                     listed(channels, &Candidate::full_name));
}

/// R, G and B, where there is nothing else but an alpha: depth that some programs write three times, or a picture.
std::vector<Candidate> three_of(const std::vector<Candidate>& channels) {
    std::vector<Candidate> found;
    for (const char* name : {"R", "G", "B", "A"})
        std::ranges::copy_if(channels, std::back_inserter(found), [&](const auto& each) { return each.name == name; });
    const auto is_alike = [&](const Candidate& each) {
        return each.part == 0 && each.type == found.front().type && !each.deep && !each.subsampled;
    };
    if (found.size() != channels.size() || found.size() < 3 || found[2].name != "B")
        return {};
    found.resize(3);
    return std::ranges::all_of(found, is_alike) ? found : std::vector<Candidate>{};
}

const Candidate& choose(const std::filesystem::path& file, const std::vector<Candidate>& channels,
                        const std::string& wanted) {
    if (channels.empty())
        refuse(file, "has no channels; write it again");
    const Candidate* best = nullptr;
    if (!wanted.empty()) {
        for (const auto& channel : channels)
            if (!best && (channel.name == wanted || channel.full_name == wanted))
                best = &channel;
        if (!best)
            refuse(file, "has no channel \"" + wanted + "\"; it has " + listed(channels, &Candidate::full_name) +
                             ", which --channel can name");
    } else if (channels.size() == 1) {
        best = &channels.front();
    } else {
        for (const auto& channel : channels)
            if (channel.rank && (!best || *channel.rank < *best->rank))
                best = &channel;
        if (!best && three_of(channels).empty())
            refuse_unnamed(file, channels);
        if (!best)
            best = &*std::ranges::find(channels, "R", &Candidate::name);
    }
    if (best->deep)
        refuse(file, "channel \"" + best->full_name + "\" is deep (many samples a pixel); flatten the file first");
    if (best->subsampled)
        refuse(file,
               "channel \"" + best->full_name + "\" does not have one sample a pixel; write depth at full resolution");
    return *best;
}

cv::Rect rectangle(const std::filesystem::path& file, const Box2i& box, const Box2i& origin) {
    const auto extent = [](int low, int high) { return static_cast<long long>(high) - low + 1; };
    const auto width = extent(box.min.x, box.max.x), height = extent(box.min.y, box.max.y);
    check_size(file, width, height);
    const auto x = static_cast<long long>(box.min.x) - origin.min.x,
               y = static_cast<long long>(box.min.y) - origin.min.y;
    if (std::max(std::abs(x), std::abs(y)) > most_pixels)
        refuse(file, "has a data window far away from its display window; it is damaged, write it again");
    return {static_cast<int>(x), static_cast<int>(y), static_cast<int>(width), static_cast<int>(height)};
}

const char* name(Imf::PixelType type) {
    return type == Imf::HALF ? "half" : type == Imf::FLOAT ? "float" : "uint";
}

int mat_type(Imf::PixelType type) {
    return type == Imf::HALF ? CV_16FC1 : type == Imf::FLOAT ? CV_32FC1 : CV_32SC1;
}

/// Pixels that no file has: NaN.
cv::Mat nothing(cv::Size size, int type) {
    cv::Mat image(size, type);
    if (type == CV_32FC1)
        image.setTo(std::numeric_limits<float>::quiet_NaN());
    else if (type == CV_16FC1)
        cv::Mat(image.size(), CV_16UC1, image.data, image.step).setTo(0x7e00); // a half's NaN
    return image;
}

/// See `check_holds`. Half floats of PXR24 and RLE are counted as if deflate had made them.
std::uint64_t expansion_of(Imf::Compression compression) {
    switch (compression) {
    case Imf::NO_COMPRESSION:
        return 1;
    case Imf::DWAA_COMPRESSION:
    case Imf::DWAB_COMPRESSION:
        return 128 * expansion::deflate; // 64 floats of a mean of two bytes, which is deflated
    default:
        return 2 * expansion::deflate;
    }
}

/// Which pixels of a file are wanted.
cv::Rect wanted_of(const std::filesystem::path& file, const Windows& held, const ExrPixels& pixels) {
    if (!pixels.windows)
        return pixels.overscan ? held.data : cv::Rect({0, 0}, held.display);
    if (pixels.windows->display != held.display)
        refuse(file, "has a display window of " + described(held.display) + " pixels, and that of the depth is " +
                         described(pixels.windows->display) + "; both must be of the same size");
    return pixels.windows->data;
}

/// Channels of one part.
class PartReader {
public:
    PartReader(const std::filesystem::path& file, const std::vector<std::string>& names, const ExrPixels& wanted)
        : exr_(open_exr(file)), file_(file) {
        check_tiles(file, exr_);
        const auto candidates = channels_of(exr_);
        for (const std::string& name : names)
            chosen_.push_back(choose(file, candidates, name));
        const bool is_named = names.size() > 1 || !names.front().empty() || chosen_.front().rank;
        if (const auto three = three_of(candidates); !is_named && !three.empty()) {
            chosen_ = three;
            refuse_colors_ = [file, candidates] { refuse_unnamed(file, candidates); };
        }
        const int part = chosen_.front().part;
        if (std::ranges::any_of(chosen_, [&](const Candidate& channel) { return channel.part != part; }))
            refuse(file, "has the channels " + listed(names) + " in several parts; name one of them");
        if (!exr_.partComplete(part))
            refuse(file, "is incomplete: some of its rows were never written; render or copy it again");
        const auto& header = exr_.header(part);
        const auto display = rectangle(file, header.displayWindow(), header.displayWindow());
        data_ = rectangle(file, header.dataWindow(), header.displayWindow());
        corner_ = header.displayWindow().min;
        wanted_ = wanted_of(file, {data_, display.size()}, wanted);
        for (const Candidate& channel : chosen_) {
            const auto storage = channel.type == Imf::HALF    ? Storage::float16
                                 : channel.type == Imf::FLOAT ? Storage::float32
                                                              : Storage::uint24;
            if (storage == Storage::uint24 && (data_ & wanted_) != wanted_)
                refuse(file, "has integer depth and a data window smaller than its display window, and no integer says "
                             "\"nothing here\"; write depth as float");
            channels_.push_back({{}, storage, channel.full_name, {wanted_, display.size()}});
        }
        channels_.resize(refuse_colors_ ? 1 : channels_.size());
        check(header.compression());
        part_.emplace(exr_, part);
    }

    std::vector<DepthFile> read() {
        const cv::Rect seen = wanted_ & data_;
        const cv::Rect held(data_.x, seen.y, data_.width, seen.height); // whole rows of the file
        std::vector<cv::Mat> pixels;
        for (const Candidate& channel : chosen_)
            pixels.emplace_back(held.size(), mat_type(channel.type));
        if (!seen.empty())
            read(held, pixels);
        if (refuse_colors_) {
            for (const cv::Mat& plane : pixels)
                if (std::memcmp(plane.data, pixels.front().data, plane.total() * plane.elemSize()) != 0)
                    refuse_colors_();
            pixels.resize(1);
        }
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            cv::Mat& values = channels_[i].values;
            values = pixels[i];
            if (held == wanted_)
                continue;
            values = nothing(wanted_.size(), pixels[i].type());
            if (!seen.empty())
                pixels[i](seen - held.tl()).copyTo(values(seen - wanted_.tl()));
        }
        return channels_;
    }

    const Windows& windows() const { return channels_.front().windows; }

private:
    void check(Imf::Compression compression) const;
    void read(const cv::Rect& held, const std::vector<cv::Mat>& pixels);

    Imf::MultiPartInputFile exr_;
    std::optional<Imf::InputPart> part_;
    std::filesystem::path file_;
    std::vector<Candidate> chosen_;
    std::vector<DepthFile> channels_;
    std::function<void()> refuse_colors_ = {}; // where R, G and B have to be the same
    cv::Rect data_, wanted_;                   // counted from the display window's first pixel
    Imath::V2i corner_;                        // of the display window
};

/// Can the file hold what its header declares, and is a good part of what is read in the file?
void PartReader::check(Imf::Compression compression) const {
    std::uint64_t pixel_bytes = 0, widest = 0;
    for (const Candidate& channel : chosen_) {
        const std::uint64_t bytes = channel.type == Imf::HALF ? 2 : 4;
        pixel_bytes += bytes;
        widest = std::max(widest, bytes);
    }
    check_holds(file_, data_.size(), pixel_bytes, size_of_file(file_), expansion_of(compression));
    const auto pixels = [](const cv::Rect& part) {
        return static_cast<std::uint64_t>(part.width) * static_cast<std::uint64_t>(part.height);
    };
    if ((pixels(wanted_) - pixels(data_ & wanted_)) * widest > most_from_nothing)
        refuse(file_, "has a display window of " + described(wanted_.size()) + " pixels and a data window of " +
                          described(data_.size()) + ", so that nearly all of it is empty; crop the display window");
}

void PartReader::read(const cv::Rect& held, const std::vector<cv::Mat>& pixels) {
    refusing_damage(file_, [&] {
        const Imath::V2i first = corner_ + Imath::V2i(held.x, held.y);
        Imf::FrameBuffer frame;
        for (std::size_t i = 0; i < pixels.size(); ++i)
            frame.insert(chosen_[i].name, Imf::Slice::Make(chosen_[i].type, pixels[i].data, first, held.width,
                                                           held.height, pixels[i].elemSize(), pixels[i].step));
        part_->setFrameBuffer(frame);
        part_->readPixels(first.y, first.y + held.height - 1);
    });
}

} // namespace

bool begins_like_exr(const std::filesystem::path& file) {
    static constexpr Bytes::value_type magic[] = {0x76, 0x2f, 0x31, 0x01};
    check_readable(file);
    return std::ranges::equal(read_head(file, std::size(magic)), magic);
}

std::vector<DepthFile> read_exr(const std::filesystem::path& file, const std::vector<std::string>& channels,
                                const ExrPixels& pixels) {
    return refusing_damage(file, [&] { return PartReader(file, channels, pixels).read(); });
}

Windows exr_windows(const std::filesystem::path& file, const std::string& channel) {
    return refusing_damage(file, [&] { return PartReader(file, {channel}, {.overscan = true}).windows(); });
}

int exr_part_of(const std::filesystem::path& file, const std::string& channel) {
    return refusing_damage(file, [&] { return choose(file, channels_of(open_exr(file)), channel).part; });
}

std::string exr_primaries(const std::filesystem::path& file, const std::string& channel) {
    const Imf::Chromaticities srgb; // OpenEXR's default
    // Source: Academy S-2014-004 and ST 2065-1.
    const std::pair<const char*, Imf::Chromaticities> known[] = {
        {"ACEScg", {{0.713f, 0.293f}, {0.165f, 0.83f}, {0.128f, 0.044f}, {0.32168f, 0.33767f}}},
        {"ACES2065-1", {{0.7347f, 0.2653f}, {0, 1}, {0.0001f, -0.077f}, {0.32168f, 0.33767f}}}};
    const auto alike = [](const Imf::Chromaticities& a, const Imf::Chromaticities& b) {
        constexpr float rounding = 0.005f; // of what programs write
        return a.red.equalWithAbsError(b.red, rounding) && a.green.equalWithAbsError(b.green, rounding) &&
               a.blue.equalWithAbsError(b.blue, rounding);
    };
    return refusing_damage(file, [&]() -> std::string {
        const Imf::MultiPartInputFile exr = open_exr(file);
        const Imf::Header& header = exr.header(choose(file, channels_of(exr), channel).part);
        const bool has_primaries = Imf::hasChromaticities(header);
        const Imf::Chromaticities said = has_primaries ? Imf::chromaticities(header) : srgb;
        for (const auto& [name, primaries] : known)
            if (alike(said, primaries))
                return name;
        if (!alike(said, srgb))
            return "other primaries";
        // Some programs write sRGB's whatever the space is.
        for (auto each = header.begin(); each != header.end(); ++each) {
            const auto* text = dynamic_cast<const Imf::StringAttribute*>(&each.attribute());
            std::string name = lower(each.name()), value = text ? lower(text->value()) : "";
            std::erase_if(name, [](char c) { return c == '_' || c == ' '; });
            if (!name.ends_with("colorspace") && name != "colorinteropid")
                continue;
            if (value.find("acescg") != value.npos || value == "lin_ap1_scene")
                return "ACEScg";
            if (value.find("aces2065") != value.npos || value == "lin_ap0_scene")
                return "ACES2065-1";
        }
        return "";
    });
}

std::optional<std::string> ray_channel_doubt(const std::string& channel, const Camera& camera) {
    if (camera.encoding != Encoding::view_z || lower(channel.substr(channel.rfind('.') + 1)) != "distance")
        return std::nullopt;
    return "channel \"" + channel +
           "\" is called like distances along the ray, as fathom linearize --as ray-distance writes them; if they are, "
           "say \"encoding\": \"ray-distance\"";
}

std::vector<std::string> depth_channels(const std::filesystem::path& file) {
    std::vector<std::string> names;
    if (!is_file(file) || !begins_like_exr(file))
        return names;
    return refusing_damage(file, [&] {
        for (const auto& channel : channels_of(open_exr(file)))
            if (channel.rank && !channel.deep && !channel.subsampled)
                names.push_back(channel.full_name);
        return names;
    });
}

} // namespace fathom::io

namespace fathom {

std::vector<Channel> list_channels(const std::filesystem::path& file) {
    if (!io::begins_like_exr(file))
        return {};
    return io::refusing_damage(file, [&] {
        std::vector<Channel> channels;
        for (const auto& c : io::channels_of(io::open_exr(file)))
            channels.push_back({c.full_name, std::string(c.deep ? "deep " : "") + io::name(c.type)});
        return channels;
    });
}

} // namespace fathom

// What the readers of depth, colours and normals share.
#include "formats.hpp"

#include "memory.hpp"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string_view>

namespace fathom::io {

void check_size(const std::filesystem::path& file, long long width, long long height) {
    constexpr long long longest = std::numeric_limits<int>::max();
    if (width >= 1 && height >= 1 && std::max(width, height) <= longest && width <= most_pixels / height)
        return;
    refuse(file, "says it has " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels; it is damaged, or larger than the 32768 x 32768 that can be read");
}

void check_holds(const std::filesystem::path& file, cv::Size size, std::uint64_t pixel_bytes, std::uint64_t stored,
                 std::optional<std::uint64_t> expansion) {
    // of a size that `check_size` took, which is below 2^30 pixels
    const auto bytes = static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height) * pixel_bytes;
    if (expansion && bytes / *expansion > stored)
        refuse(file, "ends too early: " + described(size) + " pixels do not fit into " + std::to_string(stored) +
                         " bytes; write or copy it again");
    if (!expansion && bytes > most_from_nothing)
        refuse(file, "says it has " + described(size) + " pixels in " + std::to_string(stored) +
                         " bytes, which cannot be checked; save it with another compression");
}

Bytes inflated(View packed, std::uint64_t most, int window_bits) {
    constexpr std::uint64_t piece = 1 << 20;
    z_stream stream{};
    if (inflateInit2(&stream, window_bits) != Z_OK)
        throw std::bad_alloc();
    const std::unique_ptr<z_stream, int (*)(z_stream*)> ended(&stream, inflateEnd);
    stream.next_in = const_cast<unsigned char*>(packed.data());
    stream.avail_in = static_cast<uInt>(std::min<std::size_t>(packed.size(), std::numeric_limits<uInt>::max()));
    Bytes bytes;
    bytes.reserve(most);
    for (int status = Z_OK; status == Z_OK && bytes.size() < most;) {
        const std::size_t before = bytes.size(), more = std::min(piece, most - before);
        bytes.resize(before + more);
        stream.next_out = bytes.data() + before;
        stream.avail_out = static_cast<uInt>(more);
        status = inflate(&stream, Z_SYNC_FLUSH);
        bytes.resize(bytes.size() - stream.avail_out);
    }
    return bytes;
}

void refuse_undecoded(const std::filesystem::path& file) {
    refuse(file, "is damaged or of a kind that is not read; write it again");
}

void refuse_layer(const std::filesystem::path& file, const std::string& layer) {
    refuse(file, "is no OpenEXR file and has no layer \"" + layer + "\"; leave it out (--color-layer of the program)");
}

namespace {

/// The most bytes of a file that begins so, as far as its beginning says it.
std::uint64_t most_bytes(const Bytes& bytes) {
    constexpr double pixel_bytes = 2 * 4 * 8; // twice four doubles
    constexpr double beside = 64 << 20;       // of metadata
    constexpr std::uint64_t unknown = std::numeric_limits<std::uint64_t>::max(), jpeg = std::uint64_t{8} << 30;
    const std::string head(text_of(bytes));
    double width = 0, height = 0, channels = 1;
    const std::size_t shape = head.starts_with("\x93NUMPY") ? head.find('(') : std::string::npos;
    if (head.starts_with("II") || head.starts_with("MM") || head.starts_with("PK"))
        return unknown;
    if (head.starts_with("\xff\xd8\xff") || head.starts_with("#?"))
        return jpeg;
    if (head.starts_with("\x89PNG") && head.size() >= 24) {
        width = static_cast<double>(big_endian(View(bytes).subspan(16, 4)));
        height = static_cast<double>(big_endian(View(bytes).subspan(20, 4)));
    } else if (shape != std::string::npos) {
        if (std::sscanf(head.c_str() + shape, "(%lf ,%lf ,%lf", &height, &width, &channels) < 2)
            return unknown;
    } else if (head.starts_with('P')) {
        if (std::sscanf(head.c_str(), "P%*c%lf%lf", &width, &height) < 2) // comments may stand between them
            return unknown;
    } else if (std::isdigit(static_cast<unsigned char>(head.empty() ? '?' : head.front()))) {
        if (std::sscanf(head.c_str(), "%lf&%lf&%lf&", &width, &height, &channels) < 3)
            return 0;
    } else {
        return 0;
    }
    const double most = pixel_bytes * std::abs(width * height * channels) + beside;
    return most < 0x1p63 ? static_cast<std::uint64_t>(most) : unknown; // too many pixels are refused later
}

/// What a file is that holds images in something else, by how it begins, and how to take them out.
struct Container {
    std::string_view beginning;
    const char* what;
    std::size_t at = 0;
};
constexpr Container containers[] = {
    {"\x1f\x8b", "is packed with gzip; unpack it first (gunzip)"},
    {"\x28\xb5\x2f\xfd", "is packed with Zstandard; unpack it first (unzstd)"},
    {"\xfd\x37zXZ", "is packed with xz; unpack it first (unxz)"},
    {"BZh", "is packed with bzip2; unpack it first (bunzip2)"},
    {"\x89HDF", "is HDF5; save the array that holds depth as .npy (h5py and numpy.save)"},
    {"MATLAB 5", "is a MATLAB file; save the array that holds depth as .npy (scipy.io.loadmat and numpy.save)"},
    {"SIMPLE  =", "is FITS; save the image that holds depth as .npy (astropy and numpy.save)"},
    {"PAR1",
     "holds tables, since Parquet is no image; save the column that holds depth as .png or .npy, a file each frame"},
    {"PK\x03\x04", "is a ZIP archive and no .npz; unpack it first (unzip)"},
    {"\x1a\x45\xdf\xa3",
     "is a Matroska or WebM video; save its depth as 16-bit .png, a file each frame (ffmpeg, mkvextract)"},
    {"ftyp", "is a video or an HEIF picture; save its depth as 16-bit .png or .tif", 4},
    {"RIFF", "is a WebP picture or an AVI video; save its depth as 16-bit .png"},
    {"#ROSBAG", "is a rosbag; save its depth messages as 16-bit .png or .npy, a file each frame (cv_bridge)"},
    {"\x89MCAP", "is an MCAP recording; save its depth messages as 16-bit .png or .npy, a file each frame"},
    {"\x89PNG", "is the message of ROS's compressedDepth, with 12 bytes before a PNG; save what follows them as .png",
     12},
    {"# .PCD", "is a point cloud (PCD), not a depth image; save the depth image that it was made of"},
    {"ply\n", "is a point cloud or a mesh (PLY), not a depth image; save the depth image that it was made of"},
    {"DR", "holds depth that .dmap is OpenMVS's own form of; read it with its script MvsUtils.py and save its depth "
           "with numpy.save"},
    {"PIEH", "is Sintel's .dpt: raw floats behind 12 bytes; save them as .npy (numpy.fromfile with offset=12)"}};

/// Throws: Error for a file that is one of these.
void refuse_containers(const std::filesystem::path& file, const Bytes& head) {
    const std::string_view text = text_of(head);
    for (const auto& [beginning, what, at] : containers)
        if (text.substr(std::min(at, text.size())).starts_with(beginning))
            refuse(file, what);
}

} // namespace

PictureFile read_image(const std::filesystem::path& file, const Wanted& wanted, const ReadOptions& options) {
    constexpr std::uint64_t largest = most_pixels * 16; // four floats a pixel
    Bytes bytes = read_head(file, 4096);
    if (const std::uint64_t most = most_bytes(bytes); most > 0)
        bytes = read_file(file, std::min({most, largest, std::uint64_t{usable_memory()}}));
    if (auto array = read_npz(file, bytes, options.channel, options.memory))
        return {.image = *array};
    if (!options.channel.empty())
        refuse(file, "is no OpenEXR file and has no channel \"" + options.channel + "\"; leave --channel out");
    for (const auto read : {read_pfm, read_npy, read_colmap_map})
        if (auto image = read(file, bytes))
            return {.image = *image};
    if (auto map = read_pgm(file, bytes, options.as_counted))
        return {.image = *map};
    const std::string_view begin = text_of(bytes).substr(0, 6);
    if (begin.starts_with("\xff\xd8\xff") && !wanted.is_picture)
        refuse(file, "is a JPEG, which is not read because its losses change values; save it as .png, .tif or .exr");
    if (!begin.starts_with("#?") || wanted.is_picture)
        if (auto image = read_by_opencv(file, bytes))
            return std::move(*image);
    refuse_containers(file, bytes);
    refuse(file, std::string("is no image that holds ") + wanted.what + ", or its beginning is damaged; " +
                     wanted.what + " can be read from " + wanted.formats +
                     "; raw floats with no header become an .npy by numpy.fromfile, reshape and numpy.save");
}

cv::Mat read_exr_floats(const std::filesystem::path& file, const std::vector<std::string>& channels, const char* what,
                        const std::optional<Windows>& windows) {
    const std::vector<DepthFile> held = read_exr(file, channels, {.windows = windows});
    std::vector<cv::Mat> floats;
    for (const DepthFile& plane : held) {
        if (plane.storage != Storage::float32 && plane.storage != Storage::float16)
            refuse(file, "channel \"" + plane.channel + "\" holds integers; " + what + " are floats");
        floats.push_back(plane.values);
        if (plane.values.depth() != CV_32F) // a copy would take as much again
            plane.values.convertTo(floats.back(), CV_32F);
    }
    cv::Mat image;
    cv::merge(floats, image);
    return image;
}

void check_fills(const std::filesystem::path& file, cv::Size size, const std::optional<Windows>& windows) {
    const bool overscan = windows && windows->data != cv::Rect({0, 0}, windows->display);
    if (overscan && windows->data != cv::Rect({0, 0}, size))
        refuse(file, "is " + described(size) + ", and the depth has " + described(windows->data.size()) +
                         " pixels, with overscan; only OpenEXR holds that");
}

std::optional<int> place_of(const std::string& layer, std::initializer_list<std::string> known) {
    const std::string name = lower(layer);
    const auto place = std::find_if(known.begin(), known.end(), [&](const std::string& each) {
        return name == each || (!each.empty() && name.ends_with("." + each));
    });
    return place == known.end() ? std::nullopt : std::optional(static_cast<int>(place - known.begin()));
}

std::vector<Layer> layers_of(const std::vector<Channel>& channels, std::initializer_list<std::string_view> ends) {
    std::vector<Layer> layers;
    for (const Channel& first : channels) {
        const auto dot = first.name.rfind('.');
        const std::string front = dot == std::string::npos ? "" : first.name.substr(0, dot + 1);
        for (const std::string_view letters : ends) {
            Layer layer{front.substr(0, front.empty() ? 0 : dot), {}};
            for (const char letter : letters)
                layer.channels.push_back(front + letter);
            const bool complete = std::ranges::all_of(layer.channels, [&](const std::string& name) {
                return std::ranges::find(channels, name, &Channel::name) != channels.end();
            });
            if (first.name == layer.channels[0] && complete)
                layers.push_back(layer);
        }
    }
    return layers;
}

const Layer* layer_of(const std::vector<Layer>& layers, const std::string& wanted,
                      std::initializer_list<std::string> known) {
    const Layer* best = nullptr;
    for (const Layer& layer : layers)
        if (const auto place = place_of(layer.name, known);
            wanted.empty() ? place && (!best || *place < *place_of(best->name, known)) : layer.name == wanted)
            best = &layer;
    return best;
}

std::string described(const cv::Mat& image) {
    static constexpr const char* types[] = {"unsigned 8-bit", "signed 8-bit", "unsigned 16-bit", "signed 16-bit",
                                            "32-bit integer", "32-bit float", "64-bit float",    "16-bit float"};
    const auto channels = std::to_string(image.channels()) + (image.channels() == 1 ? " channel" : " channels");
    return std::string(types[image.depth()]) + " with " + channels;
}

bool has_colors(const cv::Mat& image) {
    return (image.channels() == 3 || image.channels() == 4) &&
           (image.depth() == CV_8U || image.depth() == CV_16U || image.depth() == CV_32F);
}

std::string described(cv::Size size) {
    return std::to_string(size.width) + " × " + std::to_string(size.height);
}

cv::Mat swap_red_and_blue(const cv::Mat& image) {
    if (image.channels() < 3)
        return image;
    cv::Mat swapped(image.size(), image.type());
    const int pairs[] = {0, 2, 1, 1, 2, 0, 3, 3};
    // cv::mixChannels crashes on halves; their bits are moved as integers.
    const auto movable = [](const cv::Mat& of) {
        return of.depth() == CV_16F ? cv::Mat(of.size(), CV_16UC(of.channels()), of.data, of.step) : of;
    };
    const cv::Mat from = movable(image);
    cv::Mat to = movable(swapped);
    cv::mixChannels(&from, 1, &to, 1, pairs, static_cast<std::size_t>(image.channels()));
    return swapped;
}

void swap_red_and_blue_of_row(cv::Mat& image, int row) {
    if (image.channels() >= 3)
        swap_red_and_blue(image.row(row)).copyTo(image.row(row));
}

} // namespace fathom::io

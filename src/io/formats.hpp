#pragma once

#include "camera_file/file.hpp"

#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// What each format can do; `read_depth` and `write_image` choose among them.
namespace fathom::io {

static_assert(std::endian::native == std::endian::little, "numbers are read as they lie in files");

using View = std::span<const unsigned char>;

inline std::string_view text_of(View bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The number that up to eight bytes are, the highest first.
inline std::uint64_t big_endian(View bytes) {
    std::uint64_t number = 0;
    for (const unsigned char each : bytes)
        number = number << 8 | each;
    return number;
}

/// Likewise, the lowest first.
inline std::uint64_t little_endian(View bytes) {
    std::uint64_t number = 0;
    for (std::size_t i = bytes.size(); i-- > 0;)
        number = number << 8 | bytes[i];
    return number;
}

/// Images beyond this are taken for damage: 32768 × 32768.
inline constexpr long long most_pixels = 1LL << 30;

/// Refuses a size that no depth image has, before memory is asked for.
void check_size(const std::filesystem::path& file, long long width, long long height);

/// How many bytes at most come out of a byte of a file, by its compression.
namespace expansion {
inline constexpr std::uint64_t deflate = 1032; ///< 258 bytes of 2 bits
inline constexpr std::uint64_t jpeg = 512;     ///< of one channel: a bit for 8 × 8 pixels
} // namespace expansion

/// Bytes of an image that no byte of its file stands for: some codecs need none for pixels that are all the same, and an
/// OpenEXR's display window may be larger than its data window. The fuzzer takes fewer.
inline std::uint64_t most_from_nothing = 1u << 30;

/// Refuses an image before memory is asked for where its pixels are more than `stored` bytes of the file can hold.
/// `expansion`: nothing where the codec has no limit.
void check_holds(const std::filesystem::path& file, cv::Size size, std::uint64_t pixel_bytes, std::uint64_t stored,
                 std::optional<std::uint64_t> expansion);

/// Refuses what cannot be read as a file.
bool begins_like_exr(const std::filesystem::path& file);

/// Which pixels of an EXR are wanted: those of the display window, those of the data window, or those of another image.
struct ExrPixels {
    bool overscan = false;
    std::optional<Windows> windows = {};
};

/// Channels of one part, an image each. An empty name is the channel that is named like depth.
std::vector<DepthFile> read_exr(const std::filesystem::path& file, const std::vector<std::string>& channels,
                                const ExrPixels& pixels);

/// Channels of an OpenEXR file that could be its depth by their names, whole names with that of the part. None of any other
/// file. Without a wish `read_depth` takes the likeliest of them.
std::vector<std::string> depth_channels(const std::filesystem::path& file);

/// What is probably wrong if depth of a channel of this name counts as the camera says.
std::optional<std::string> ray_channel_doubt(const std::string& channel, const Camera& camera);

/// The windows of the part that has a channel.
Windows exr_windows(const std::filesystem::path& file, const std::string& channel);

/// How many threads OpenEXR has beside those that read and write. Without any these do all of it themselves.
void set_exr_pool(int threads);

/// The primaries of the light in a channel's part, where its header says others than sRGB's; empty otherwise.
std::string exr_primaries(const std::filesystem::path& file, const std::string& channel);

/// The number of the part that has a channel.
int exr_part_of(const std::filesystem::path& file, const std::string& channel);

/// A picture as its file holds it, and what the file says about it.
struct PictureFile {
    cv::Mat image;             ///< 8 or 16 bits or floats; B, G, R and perhaps an alpha, or one channel
    Bytes icc = {}, exif = {}; ///< empty where there is none
    std::optional<ColorEncoding> encoding = {}; ///< where the file says so without a profile
    std::optional<bool> straight_alpha = {};    ///< likewise
    bool has_more = false;                      ///< Exif data that is not read
    std::string primaries = {};                 ///< see `PictureFormat`
    int pages = 1; ///< images of full size in a TIFF: masks and smaller copies do not count
    std::array<std::optional<double>, 2> near_and_far = {}; ///< that a PNG's text says
};

/// An image that OpenCV's codecs read (PNG, JPEG, TIFF, Radiance), or nothing when the bytes do not begin like one. The bytes may
/// change. Refused: whatever is cut short or contradicts itself, which codecs tend to fill with zeros or garbage.
std::optional<PictureFile> read_by_opencv(const std::filesystem::path& file, Bytes& bytes);

/// Likewise an image in OpenCV's order of channels (B, G, R, A).
std::optional<cv::Mat> read_pfm(const std::filesystem::path& file, const Bytes& bytes);
std::optional<cv::Mat> read_npy(const std::filesystem::path& file, const Bytes& bytes);
std::optional<cv::Mat> read_pgm(const std::filesystem::path& file, const Bytes& bytes, bool as_counted);
/// An array of an archive; the only one without a name. `memory`: bytes that it may take, 0: what this process may.
std::optional<cv::Mat> read_npz(const std::filesystem::path& file, const Bytes& bytes, const std::string& name,
                                std::size_t memory);
/// A depth or normal map of COLMAP.
std::optional<cv::Mat> read_colmap_map(const std::filesystem::path& file, const Bytes& bytes);

/// What an image is read for, and the types of files that hold such; pictures may be JPEGs and Radiance's.
struct Wanted {
    const char *what, *formats;
    bool is_picture = false;
};

/// The image of a file that is no OpenEXR; of an NPZ it may be one of several arrays. Refuses a name where there is but one image.
PictureFile read_image(const std::filesystem::path& file, const Wanted& wanted, const ReadOptions& options = {});

/// The bytes that deflated ones stand for, up to `most` and as far as they are whole. `window_bits`: zlib's, negative without a header.
Bytes inflated(View packed, std::uint64_t most, int window_bits);

/// Refuses a file whose codec failed.
[[noreturn]] void refuse_undecoded(const std::filesystem::path& file);

/// Refuses a layer of a file that has none.
[[noreturn]] void refuse_layer(const std::filesystem::path& file, const std::string& layer);

/// Pixels do not count whose alpha or confidence is below a limit, or whose uncertainty is above one; without a limit those whose value
/// is not 0.
struct IgnoredBy {
    std::optional<double> below = {}, above = {};

    bool is_limit() const { return below || above; }
};

/// Which pixels of a depth image do not count, out of a file: CV_8UC1, not 0 where a pixel does not. An alpha counts from 0 to 1, and
/// so do other integers where the limit is less than 1. `windows`: of the depth image.
/// Throws: Error for a file that cannot be read, without such a channel, or of another size than the depth.
cv::Mat ignored(const std::filesystem::path& file, const IgnoredBy& by, const Windows& windows);

/// One channel of a picture whose channels are equal. Refuses colours: a map of them has no order of distances.
cv::Mat only_channel(const std::filesystem::path& file, const cv::Mat& image);

/// Light from the numbers of a file, and back. The fourth channel, an alpha, is left alone.
void to_linear(cv::Mat& color, ColorEncoding encoding);
void from_linear(cv::Mat& color, ColorEncoding encoding);

/// Multiplies the alpha into the colours, or takes it out again; colours under an alpha of 0 become 0.
void premultiply(cv::Mat& color);
void unpremultiply(cv::Mat& color);

/// Codes of 8 or 16 bits in B, G, R order, with the format's profile and camera data.
Bytes jpeg_bytes(const cv::Mat& bgr, const PictureFormat& format);
Bytes png_bytes(const cv::Mat& bgr,
                const std::optional<PictureFormat>& format = {});       ///< without: says nothing of the codes
Bytes tiff_bytes(const cv::Mat& bgr, const PictureFormat& format = {}); ///< floats as well

/// Light in B, G, R order. Negative values and NaN become 0.
Bytes radiance_bytes(const cv::Mat& bgr);

/// Pixels without a header, by ffmpeg's name: rows from above, without gaps, R before G before B, the lowest byte first.
struct RawFormat {
    const char* name;
    int channels, bits; ///< 8 and 16 bits are codes, 32 floats
};

inline constexpr RawFormat raw_formats[] = {
    {"gray16le", 1, 16}, {"grayf32le", 1, 32}, {"rgb24", 3, 8}, {"rgbf32le", 3, 32}};

/// The pixels of an image. Codes of a picture are sRGB, unless the picture's own codes are not; those of other images are as in a
/// .png.
/// Throws: Error for an image that the format does not hold, as an alpha that is not 1.
Bytes raw_bytes(const ImageFile& image, const RawFormat& format);

/// The first row on top, the first column on the left, for an orientation of Exif or TIFF from 1 to 8.
cv::Mat upright(cv::Mat image, int orientation);

/// Channels of an EXR side by side, as floats. Refuses integers, which `what` they hold ("normals") cannot be.
cv::Mat read_exr_floats(const std::filesystem::path& file, const std::vector<std::string>& channels, const char* what,
                        const std::optional<Windows>& windows);

/// Refuses an image of a file without windows that does not fill those of a depth image.
void check_fills(const std::filesystem::path& file, cv::Size size, const std::optional<Windows>& windows);

/// What `read` returns, or a refusal when there is too little memory for what the file asks for.
template <typename Read>
auto within_memory(const std::filesystem::path& file, const Read& read) {
    constexpr const char* too_large = "asks for more memory than there is; it is damaged or too large";
    try {
        return read();
    } catch (const std::bad_alloc&) {
        refuse(file, too_large);
    } catch (const cv::Exception&) {
        refuse(file, too_large);
    }
}

/// The bytes of a file that holds `image`, a CV_32F matrix in the file's order: x, y, z or R, G, B, A.
Bytes exr_bytes(const std::filesystem::path& file, const cv::Mat& image, const WriteOptions& options);
Bytes npy_bytes(const cv::Mat& image, bool is_color);
Bytes pfm_bytes(const cv::Mat& image, bool is_color); ///< 1 or 3 channels
Bytes ply_bytes(const std::filesystem::path& file, const cv::Mat& positions, const cv::Mat& normals,
                const cv::Mat& colors); ///< positions of 3 or 4 channels; the fourth is no part of the position
/// The 16 bits of a .png: round((value × scale + offset) × 65535), 0 for NaN.
cv::Mat png_codes(const cv::Mat& image, double scale, double offset);

/// The place in a list of what a layer, or the last part of its name, is called, in any case.
std::optional<int> place_of(const std::string& layer, std::initializer_list<std::string> known);

/// Three channels of an EXR that belong together.
struct Layer {
    std::string name;                  ///< what stands before the last dot; empty for channels without one
    std::vector<std::string> channels; ///< three
};

/// All layers with channels of one of these names, such as "RGB".
std::vector<Layer> layers_of(const std::vector<Channel>& channels, std::initializer_list<std::string_view> ends);

/// The layer that is called so; without a wish the likeliest, by its place among the known names.
const Layer* layer_of(const std::vector<Layer>& layers, const std::string& wanted,
                      std::initializer_list<std::string> known);

/// An image's type for a message: "unsigned 8-bit with 3 channels".
std::string described(const cv::Mat& image);

/// Has it three channels and perhaps an alpha, of 8 or 16 bits or floats?
bool has_colors(const cv::Mat& image);

/// "640 × 480"
std::string described(cv::Size size);

/// R, G, B for B, G, R and back; a fourth channel stays, and so do images of fewer than three.
cv::Mat swap_red_and_blue(const cv::Mat& image);

/// The same of one row in place: a picture that was read needs no second one.
void swap_red_and_blue_of_row(cv::Mat& image, int row);

} // namespace fathom::io

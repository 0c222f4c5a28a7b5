// pixel_sums FILE...: a line for each file with its size, its channels and a hash of the values of its pixels.
//
// Files are read by OpenEXR and OpenCV alone, and not by the library's readers, so that a fault of a reader cannot hide the
// same fault of the writer. What a header says beside size and channels counts for nothing. All NaN count as one. A file that
// is no image is hashed as it is.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

struct Sum {
    std::string size, channels; // in words
    XXH64_hash_t hash = 0;      // of all that was added

    void add(std::span<const char> bytes) { hash = XXH3_64bits_withSeed(bytes.data(), bytes.size(), hash); }
};

// Floats whose NaN all have the same bits, as those of other threads and vectors need not.
template <typename Bits>
void make_one_nan(std::span<char> bytes, Bits infinity) {
    const Bits magnitude = static_cast<Bits>(~Bits{0} >> 1);
    for (std::size_t at = 0; at + sizeof(Bits) <= bytes.size(); at += sizeof(Bits)) {
        Bits bits;
        std::memcpy(&bits, &bytes[at], sizeof bits);
        if ((bits & magnitude) > infinity)
            std::memcpy(&bytes[at], &magnitude, sizeof bits);
    }
}

void make_one_nan_of_floats(std::span<char> bytes) {
    make_one_nan<std::uint32_t>(bytes, 0x7f800000);
}

std::string in_words(const Imath::Box2i& box) {
    const Imath::V2i size = box.size() + Imath::V2i(1, 1);
    std::string text = std::to_string(size.x) + "x" + std::to_string(size.y);
    if (box.min != Imath::V2i(0, 0))
        text += "+" + std::to_string(box.min.x) + "+" + std::to_string(box.min.y);
    return text;
}

// The data window of a channel of one part.
std::vector<char> pixels_of(Imf::InputPart& part, const std::string& channel, Imf::PixelType type) {
    const Imath::Box2i window = part.header().dataWindow();
    const auto columns = static_cast<std::size_t>(window.size().x + 1),
               rows = static_cast<std::size_t>(window.size().y + 1);
    const std::size_t size = type == Imf::HALF ? 2 : 4;
    std::vector<char> pixels(columns * rows * size);
    Imf::FrameBuffer frame;
    frame.insert(channel, Imf::Slice::Make(type, pixels.data(), window, size, columns * size));
    part.setFrameBuffer(frame);
    part.readPixels(window.min.y, window.max.y);
    if (type == Imf::HALF)
        make_one_nan<std::uint16_t>(pixels, 0x7c00);
    if (type == Imf::FLOAT)
        make_one_nan_of_floats(pixels);
    return pixels;
}

Sum of_exr(const std::string& file) {
    static const char* const types[] = {"uint", "half", "float"};
    Sum sum;
    Imf::MultiPartInputFile parts(file.c_str());
    for (int i = 0; i < parts.parts(); ++i) {
        Imf::InputPart part(parts, i);
        const Imf::Header& header = part.header();
        const std::string size = in_words(header.dataWindow()) + " of " + in_words(header.displayWindow());
        if (size != sum.size)
            sum.size += (i > 0 ? "," : "") + size;
        for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
            const Imf::PixelType type = channel.channel().type;
            sum.channels += std::string(sum.channels.empty() ? "" : ",") + channel.name() + ":" + types[type];
            sum.add(pixels_of(part, channel.name(), type));
        }
    }
    return sum;
}

Sum of_image(const std::string& file, const cv::Mat& image) {
    if (image.empty())
        throw std::runtime_error(file + " cannot be read");
    static const char* const types[] = {"u8", "s8", "u16", "s16", "s32", "float", "double", "half"};
    Sum sum{.size = std::to_string(image.cols) + "x" + std::to_string(image.rows),
            .channels = std::to_string(image.channels()) + ":" + types[image.depth()]};
    cv::Mat rows = image.clone(); // one after the other
    const std::span bytes(reinterpret_cast<char*>(rows.data), rows.total() * rows.elemSize());
    if (image.depth() == CV_32F)
        make_one_nan_of_floats(bytes);
    sum.add(bytes);
    return sum;
}

Sum of_other(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
    if (!stream)
        throw std::runtime_error(file + " cannot be read");
    Sum sum{.size = std::to_string(bytes.size()), .channels = "bytes"};
    sum.add(bytes);
    return sum;
}

Sum sum_of(const std::string& file) {
    const std::string extension = std::filesystem::path(file).extension();
    if (extension == ".exr")
        return of_exr(file);
    if (extension == ".png" || extension == ".tif" || extension == ".pfm" || extension == ".jpg" || extension == ".hdr")
        return of_image(file, cv::imread(file, cv::IMREAD_UNCHANGED));
    return of_other(file);
}

} // namespace

int main(int argc, char** argv) {
    try {
        for (int i = 1; i < argc; ++i) {
            const Sum sum = sum_of(argv[i]);
            std::printf("%s %s %s %016llx\n", argv[i], sum.size.c_str(), sum.channels.c_str(),
                        static_cast<unsigned long long>(sum.hash));
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "pixel_sums: %s\n", error.what());
        return 1;
    }
}

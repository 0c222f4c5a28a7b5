// OpenEXR with named float or half channels. The header is that of the file that the result belongs to, so that it finds
// its place in a pipeline: what a renderer said about its camera, the windows, the part's name.
#include "open.hpp"

#include "io/formats.hpp"

#include <opencv2/core.hpp>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfDeepScanLineOutputPart.h>
#include <OpenEXR/ImfDeepTiledInputPart.h>
#include <OpenEXR/ImfDeepTiledOutputPart.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfThreading.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/ImfTiledOutputPart.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <set>
#include <thread>
#include <utility>

namespace fathom::io {
namespace {

using Imath::Box2i;
using Imath::V2i;

/// Where OpenEXR writes to. It cannot throw where it writes its last bytes, so that a failure is kept.
class Stream : public Imf::OStream {
public:
    /// Has room for an image that is not compressed, with a header and what stands before each row: to grow would take as much
    /// again.
    explicit Stream(const cv::Mat& image) : OStream("results") {
        constexpr std::size_t header = 1 << 16, row = 64;
        bytes.reserve(image.total() * image.elemSize() + header + row * static_cast<std::size_t>(image.rows));
    }

    void write(const char c[], int n) override {
        const auto size = static_cast<std::size_t>(n);
        try {
            if (!failure)
                bytes.resize(std::max(bytes.size(), at_ + size));
        } catch (...) {
            failure = std::current_exception();
            throw;
        }
        if (!failure)
            std::copy_n(c, size, bytes.begin() + static_cast<std::ptrdiff_t>(at_));
        at_ += size;
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t at) override { at_ = at; }

    Bytes bytes;
    std::exception_ptr failure = {};

private:
    std::uint64_t at_ = 0;
};

Imf::Compression compression_of(ExrCompression compression) {
    static constexpr Imf::Compression compressions[] = {
        Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION, Imf::DWAA_COMPRESSION};
    return compressions[static_cast<std::size_t>(compression)];
}

// Of zlib. Its lowest level writes depth and occlusion in 0.7 times the time of OpenEXR's own, 4. Rendered frames get no
// larger, smooth ones by 5 %.
constexpr int zip_level = 1;

bool keeps_every_bit(Imf::Compression compression) {
    return compression == Imf::NO_COMPRESSION || compression == Imf::RLE_COMPRESSION ||
           compression == Imf::ZIPS_COMPRESSION || compression == Imf::ZIP_COMPRESSION ||
           compression == Imf::PIZ_COMPRESSION;
}

/// The names of a header's attributes that say how the old pixels lay in their file, or show them.
bool is_stale(const std::string& name) {
    static const std::set<std::string> stale{"channels",           "chunkCount", "compression",  "dataWindow",
                                             "lineOrder",          "preview",    "tiles",        "type",
                                             "maxSamplesPerPixel", "version",    "fathom:record"};
    return stale.contains(name);
}

/// A header for an image: that of the source where there is one.
Imf::Header header_of(cv::Size size, const WriteOptions& options) {
    const std::optional<ExrSource>& source = options.source;
    Imf::Header header(size.width, size.height);
    if (source)
        refusing_damage(source->file, [&] {
            const Imf::MultiPartInputFile exr = open_exr(source->file);
            const Imf::Header& old = exr.header(exr_part_of(source->file, source->channel));
            for (auto each = old.begin(); each != old.end(); ++each)
                if (!is_stale(each.name()))
                    header.insert(each.name(), each.attribute());
            const V2i corner = old.displayWindow().min + V2i(source->windows.data.x, source->windows.data.y);
            Box2i& display = header.displayWindow();
            if (const cv::Size& own = source->windows.display; source->is_resized)
                display.max = display.min + V2i(own.width - 1, own.height - 1);
            header.dataWindow() = Box2i(corner, corner + V2i(size.width - 1, size.height - 1));
        });
    header.compression() = compression_of(options.compression.value_or(ExrCompression::zip));
    header.zipCompressionLevel() = zip_level;
    return header;
}

/// Values as they are written.
struct Pixels {
    Pixels(const std::filesystem::path& file, const cv::Mat& floats, const WriteOptions& options)
        : image(floats), type(options.half ? Imf::HALF : Imf::FLOAT), names(options.channels) {
        if (!options.half)
            return;
        floats.convertTo(image, CV_16F);
        for (int y = 0; y < image.rows; ++y)
            for (int i = 0; i < image.cols * image.channels(); ++i)
                if (const float value = floats.ptr<float>(y)[i];
                    std::isfinite(value) && (image.ptr<std::uint16_t>(y)[i] & 0x7fff) == 0x7c00)
                    refuse(file, "pixel (" + std::to_string(i / image.channels()) + ", " + std::to_string(y) + ") is " +
                                     std::to_string(value) +
                                     ", and a half ends at 65504; write floats of 32 bits (without --half)");
    }

    void add_to(Imf::Header& header, Imf::FrameBuffer& frame) const {
        for (const std::string& name : names)
            header.channels().insert(name, Imf::Channel(type));
        const auto channels = static_cast<std::size_t>(image.channels());
        for (std::size_t i = 0; i < names.size(); ++i)
            frame.insert(names[i],
                         Imf::Slice::Make(type, image.data + i % channels * image.elemSize1(), header.dataWindow().min,
                                          image.cols, image.rows, image.elemSize(), image.step));
    }

    cv::Mat image;
    Imf::PixelType type;
    std::vector<std::string> names;
};

void write(Stream& stream, const Imf::Header& header, const Imf::FrameBuffer& frame) {
    Imf::OutputFile exr(stream, header); // its destructor completes the table of rows
    exr.setFrameBuffer(frame);
    exr.writePixels(header.dataWindow().max.y - header.dataWindow().min.y + 1);
}

/// Can the part of a file take more channels and lose nothing?
bool takes_channels(const Imf::MultiPartInputFile& exr, const Imf::Header& added) {
    const Imf::Header& header = exr.header(0);
    const Imf::ChannelList& channels = header.channels();
    bool whole = true; // has every channel one sample a pixel?
    for (auto each = channels.begin(); each != channels.end(); ++each)
        whole &= each.channel().xSampling == 1 && each.channel().ySampling == 1;
    return exr.parts() == 1 && !header.hasTileDescription() && !(header.hasType() && Imf::isDeepData(header.type())) &&
           keeps_every_bit(header.compression()) && keeps_every_bit(added.compression()) && whole &&
           header.dataWindow() == added.dataWindow();
}

/// The only part of a file and the new channels side by side.
void append_channels(Stream& stream, Imf::MultiPartInputFile& exr, const Pixels& pixels,
                     const std::optional<ExrCompression>& compression) {
    Imf::Header header = exr.header(0);
    header.erase("preview");
    header.erase("chunkCount");
    header.zipCompressionLevel() = zip_level;
    if (compression)
        header.compression() = compression_of(*compression);
    const Box2i window = header.dataWindow();
    const cv::Size size(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1);
    Imf::FrameBuffer frame;
    std::vector<cv::Mat> old;
    for (auto each = header.channels().begin(); each != header.channels().end(); ++each) {
        const Imf::PixelType type = each.channel().type;
        const cv::Mat& plane = old.emplace_back(size, type == Imf::HALF ? CV_16UC1 : CV_32SC1);
        frame.insert(each.name(), Imf::Slice::Make(type, plane.data, window, plane.elemSize(), plane.step));
    }
    Imf::InputPart part(exr, 0);
    part.setFrameBuffer(frame);
    part.readPixels(window.min.y, window.max.y);
    pixels.add_to(header, frame);
    write(stream, header, frame);
}

/// Copies a part as it is packed.
template <typename Input, typename Output>
void copy_part(Imf::MultiPartInputFile& from, Imf::MultiPartOutputFile& to, int number) {
    Input input(from, number);
    Output(to, number).copyPixels(input);
}

/// All parts of a file as they are, and the new channels as one more.
void append_part(Stream& stream, Imf::MultiPartInputFile& exr, Imf::Header header, const Pixels& pixels,
                 const std::string& name) {
    std::vector<Imf::Header> headers;
    std::set<std::string> names;
    for (int i = 0; i < exr.parts(); ++i) {
        Imf::Header& each = headers.emplace_back(exr.header(i));
        each.erase("chunkCount");
        if (!each.hasType())
            each.setType(each.hasTileDescription() ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
        if (!each.hasName())
            each.setName(exr.parts() == 1 ? "main" : "part" + std::to_string(i));
        names.insert(each.name());
    }
    std::string unique = name;
    for (int i = 2; names.contains(unique); ++i)
        unique = name + std::to_string(i);
    header.setName(unique);
    header.setType(Imf::SCANLINEIMAGE);
    Imf::FrameBuffer frame;
    pixels.add_to(header, frame);
    headers.push_back(header);

    Imf::MultiPartOutputFile out(stream, headers.data(), static_cast<int>(headers.size()));
    for (int i = 0; i < exr.parts(); ++i) {
        const std::string& type = headers[static_cast<std::size_t>(i)].type();
        if (type == Imf::SCANLINEIMAGE)
            copy_part<Imf::InputPart, Imf::OutputPart>(exr, out, i);
        else if (type == Imf::TILEDIMAGE)
            copy_part<Imf::TiledInputPart, Imf::TiledOutputPart>(exr, out, i);
        else if (type == Imf::DEEPSCANLINE)
            copy_part<Imf::DeepScanLineInputPart, Imf::DeepScanLineOutputPart>(exr, out, i);
        else
            copy_part<Imf::DeepTiledInputPart, Imf::DeepTiledOutputPart>(exr, out, i);
    }
    Imf::OutputPart part(out, exr.parts());
    part.setFrameBuffer(frame);
    part.writePixels(pixels.image.rows);
}

/// "AO" for the channel AO, "N" for N.X, N.Y and N.Z.
std::string layer_of(const std::vector<std::string>& channels) {
    return channels.front().substr(0, channels.front().rfind('.'));
}

void append(Stream& stream, const Imf::Header& header, const std::filesystem::path& file, const Pixels& pixels,
            const WriteOptions& options) {
    Imf::MultiPartInputFile exr = open_exr(options.source->file);
    check_tiles(options.source->file, exr);
    for (int i = 0; i < exr.parts(); ++i)
        if (!exr.partComplete(i))
            refuse(options.source->file, "is incomplete: some of its rows were never written; copy it again, or write "
                                         "the result alone (without --append)");
    if (!takes_channels(exr, header))
        return append_part(stream, exr, header, pixels, layer_of(pixels.names));
    for (const std::string& name : pixels.names)
        if (exr.header(0).channels().findChannel(name))
            refuse(file, "cannot have two channels \"" + printable(name) + "\", and " + options.source->file.native() +
                             " has one; append to a file without it");
    append_channels(stream, exr, pixels, options.compression);
}

} // namespace

Bytes exr_bytes(const std::filesystem::path& file, const cv::Mat& image, const WriteOptions& options) {
    Stream stream(image);
    Imf::Header header = header_of(image.size(), options);
    const Pixels pixels(file, image, options);
    if (options.source && options.source->append) {
        refusing_damage(options.source->file, // what is written goes into memory, so that only this one can fail
                        [&] { append(stream, header, file, pixels, options); });
    } else {
        Imf::FrameBuffer frame;
        pixels.add_to(header, frame);
        write(stream, header, frame);
    }
    if (stream.failure)
        std::rethrow_exception(stream.failure);
    return std::move(stream.bytes);
}

void set_exr_pool(int threads) {
    Imf::setGlobalThreadCount(threads);
}

} // namespace fathom::io

namespace fathom {

void set_exr_threads(int threads) {
    io::set_exr_pool(threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency()));
}

} // namespace fathom

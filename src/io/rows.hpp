#pragma once

#include "formats.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

/// Images row by row, from the first to the last, so that none has to fit into memory.
namespace fathom::io {

/// Channels of one part of an EXR.
class ExrRows {
public:
    virtual ~ExrRows() = default;

    /// The next rows of each channel.
    virtual std::vector<cv::Mat> read(int rows) = 0;

    virtual const std::vector<DepthFile>& channels() const = 0; ///< without values
    cv::Size size() const { return channels().front().windows.data.size(); }
};

std::unique_ptr<ExrRows> exr_rows(const std::filesystem::path& file, const std::vector<std::string>& channels,
                                  const ExrPixels& pixels, long long most = most_pixels_by_rows);

/// A TIFF whose samples are read as they are.
class TiffRows {
public:
    virtual ~TiffRows() = default;

    /// The next rows, in OpenCV's order of channels.
    virtual cv::Mat read(int rows) = 0;

    /// What the file says beside its pixels.
    virtual void read_metadata(PictureFile& picture) = 0;

    virtual cv::Size size() const = 0;
    virtual int type() const = 0;
};

/// Nothing for a file of another format, and for a TIFF that has to be turned, that libtiff turns into colours, or that is
/// packed with JPEG or WebP.
std::unique_ptr<TiffRows> tiff_rows(const std::filesystem::path& file, long long most = most_pixels_by_rows);

/// Floats of channels side by side. Refuses integers, which `what` they hold ("normals") cannot be.
cv::Mat merged_floats(const std::filesystem::path& file, const std::vector<DepthFile>& channels,
                      const std::vector<cv::Mat>& planes, const char* what);

/// A depth image, as `read_depth` reads it.
class DepthRows {
public:
    DepthRows(std::filesystem::path file, const ReadOptions& options, std::unique_ptr<ExrRows> exr,
              std::unique_ptr<TiffRows> tiff);
    ~DepthRows();

    /// The next rows. Together with the last ones it refuses what only all of them tell.
    DepthFile read(int rows);

    /// What holds for all rows; without values.
    const DepthFile& about() const { return about_; }
    cv::Size size() const { return exr_ ? exr_->size() : tiff_->size(); }

private:
    struct Seen;

    std::filesystem::path file_;
    ReadOptions options_;
    std::unique_ptr<ExrRows> exr_;
    std::unique_ptr<TiffRows> tiff_;
    DepthFile about_{{}, Storage::float32, {}};
    int at_ = 0;
    std::unique_ptr<Seen> seen_; // in the rows up to here
};

/// Nothing for a file that has to be read whole.
std::unique_ptr<DepthRows> depth_rows(const std::filesystem::path& file, const ReadOptions& options,
                                      long long most = most_pixels_by_rows);

/// All rows at once.
DepthFile whole(const std::filesystem::path& file, DepthRows& rows);

/// A picture, as `read_picture` reads it.
class PictureRows {
public:
    PictureRows(std::filesystem::path file, const ReadPictureOptions& options, std::unique_ptr<ExrRows> exr,
                std::unique_ptr<TiffRows> tiff);

    Picture read(int rows);

    const PictureFormat& format() const { return format_; }
    cv::Size size() const { return exr_ ? exr_->size() : tiff_->size(); }

private:
    std::filesystem::path file_;
    ReadPictureOptions options_;
    std::unique_ptr<ExrRows> exr_;
    std::unique_ptr<TiffRows> tiff_;
    PictureFile about_;
    PictureFormat format_;
};

/// Nothing for a file that has to be read whole.
std::unique_ptr<PictureRows> picture_rows(const std::filesystem::path& file, const ReadPictureOptions& options);

/// Where the encoded bytes of an image go.
class ByteSink {
public:
    virtual ~ByteSink() = default;
    virtual void write(std::span<const unsigned char> bytes, std::uint64_t at) = 0;
};

class MemorySink : public ByteSink {
public:
    /// Has room for an image that is not compressed, with a header and what stands before each row: to grow would take as much
    /// again.
    explicit MemorySink(const cv::Mat& image) {
        constexpr std::size_t header = 1 << 16, row = 64;
        bytes.reserve(image.total() * image.elemSize() + header + row * static_cast<std::size_t>(image.rows));
    }

    void write(std::span<const unsigned char> more, std::uint64_t at) override {
        if (at + more.size() > bytes.size())
            bytes.resize(at + more.size());
        std::copy(more.begin(), more.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
    }

    Bytes bytes;
};

/// Encodes an image whose rows come one after the other. What is left comes with `finish`.
class RowEncoder {
public:
    virtual ~RowEncoder() = default;
    virtual void write(const cv::Mat& rows) = 0;
    virtual void finish() = 0;
};

std::unique_ptr<RowEncoder> exr_encoder(ByteSink& sink, const std::filesystem::path& file, cv::Size size,
                                        const WriteOptions& options, const std::string& record = {});
/// `type`: of the image, in the file's order of channels.
std::unique_ptr<RowEncoder> tiff_encoder(ByteSink& sink, cv::Size size, int type, const PictureFormat& format);

/// The result of an operation, written as `write_images` does. It is seen only once it took its place.
class ResultRows {
public:
    /// `like`: the file and how it is written; its image has no pixels, but the type of the others.
    ResultRows(const ImageFile& like, cv::Size size);
    ~ResultRows();

    void write(const cv::Mat& rows);

    /// All rows are there. Nothing but the name is missing.
    void complete();
    void take_over();

private:
    struct Target;
    std::unique_ptr<Target> target_;
};

/// Can results of this name be written by rows?
bool takes_rows(const std::filesystem::path& file);

} // namespace fathom::io

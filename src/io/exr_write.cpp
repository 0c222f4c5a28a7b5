// OpenEXR with named 32-bit float channels, zip compressed.
#include "formats.hpp"

#include <opencv2/core.hpp>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>

#include <algorithm>

namespace fathom::io {
namespace {

/// Where OpenEXR writes to: memory, so that a full disk is noticed in one place only.
class Memory : public Imf::OStream {
public:
    explicit Memory(Bytes& bytes) : OStream("memory"), bytes_(bytes) {}

    void write(const char c[], int n) override {
        const auto end = at_ + static_cast<std::size_t>(n);
        if (end > bytes_.size())
            bytes_.resize(end);
        std::copy(c, c + n, bytes_.begin() + static_cast<std::ptrdiff_t>(at_));
        at_ = end;
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t at) override { at_ = at; }

private:
    Bytes& bytes_;
    std::size_t at_ = 0;
};

} // namespace

Bytes exr_bytes(const cv::Mat& image, const std::vector<std::string>& channels) {
    Imf::Header header(image.cols, image.rows);
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer frame;
    for (std::size_t i = 0; i < channels.size(); ++i) {
        header.channels().insert(channels[i], Imf::Channel(Imf::FLOAT));
        frame.insert(channels[i], Imf::Slice::Make(Imf::FLOAT, image.ptr<float>() + i, header.dataWindow(),
                                                   image.elemSize(), image.step));
    }
    Bytes bytes;
    Memory memory(bytes);
    {
        Imf::OutputFile exr(memory, header); // its destructor completes the table of rows
        exr.setFrameBuffer(frame);
        exr.writePixels(image.rows);
    }
    return bytes;
}

} // namespace fathom::io

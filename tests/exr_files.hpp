#pragma once

#include "io_files.hpp"

#include <opencv2/core.hpp>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfDeepScanLineOutputPart.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTiledOutputFile.h>

/// OpenEXR files whose pixels are known, written with OpenEXR's own library.
namespace fathom::test {

using Imath::Box2i;
using Imath::V2i;

struct ExrImage {
    Box2i display{{0, 0}, {6, 4}};
    Box2i data{{0, 0}, {6, 4}};
    std::vector<std::string> channels{"Z"};
    Imf::PixelType type = Imf::FLOAT;
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    std::string part = {};                       ///< its name in a file of several
    std::function<void(Imf::Header&)> more = {}; ///< adds attributes
};

/// What channel number `c` holds at a pixel: exact in a half and positive.
inline double truth(std::size_t c, int x, int y) {
    return static_cast<double>(c) * 256 + (y + 8) * 16 + x + 8;
}

inline Imf::Header header_of(const ExrImage& picture) {
    Imf::Header header(picture.display, picture.data);
    header.compression() = picture.compression;
    for (const auto& name : picture.channels)
        header.channels().insert(name, Imf::Channel(picture.type));
    if (!picture.part.empty()) {
        header.setName(picture.part);
        header.setType(Imf::SCANLINEIMAGE);
    }
    if (picture.more)
        picture.more(header);
    return header;
}

/// Pixels of a picture with the frame buffer that shows them to OpenEXR.
struct Pixels {
    std::vector<cv::Mat> planes;
    Imf::FrameBuffer frame;

    explicit Pixels(const ExrImage& picture) {
        const auto size = picture.data.size() + V2i(1, 1);
        for (std::size_t c = 0; c < picture.channels.size(); ++c) {
            cv::Mat values(size.y, size.x, CV_32FC1), plane;
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x)
                    values.at<float>(y, x) =
                        static_cast<float>(truth(c, x + picture.data.min.x, y + picture.data.min.y));
            values.convertTo(plane, picture.type == Imf::HALF ? CV_16F : picture.type == Imf::FLOAT ? CV_32F : CV_32S);
            frame.insert(picture.channels[c],
                         Imf::Slice::Make(picture.type, plane.data, picture.data, plane.elemSize(), plane.step));
            planes.push_back(plane);
        }
    }
};

inline fs::path write(const fs::path& file, const ExrImage& picture) {
    const Pixels pixels(picture);
    Imf::OutputFile exr(file.c_str(), header_of(picture));
    exr.setFrameBuffer(pixels.frame);
    exr.writePixels(picture.data.max.y - picture.data.min.y + 1);
    return file;
}

inline fs::path write(const fs::path& file, const std::vector<ExrImage>& parts) {
    std::vector<Imf::Header> headers;
    for (const auto& part : parts)
        headers.push_back(header_of(part));
    Imf::MultiPartOutputFile exr(file.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const Pixels pixels(parts[i]);
        Imf::OutputPart out(exr, static_cast<int>(i));
        out.setFrameBuffer(pixels.frame);
        out.writePixels(parts[i].data.max.y - parts[i].data.min.y + 1);
    }
    return file;
}

inline fs::path write_tiled(const fs::path& file, const ExrImage& picture) {
    const Pixels pixels(picture);
    auto header = header_of(picture);
    header.setTileDescription({4, 4, Imf::ONE_LEVEL});
    Imf::TiledOutputFile exr(file.c_str(), header);
    exr.setFrameBuffer(pixels.frame);
    exr.writeTiles(0, exr.numXTiles() - 1, 0, exr.numYTiles() - 1);
    return file;
}

/// Deep pixels, a sample each, as a file or a part.
struct DeepPixels {
    Imf::Header header{4, 3};
    std::vector<unsigned> counts = std::vector<unsigned>(12, 1);
    std::vector<float> samples = std::vector<float>(12, 2.5f);
    std::vector<float*> pointers;
    Imf::DeepFrameBuffer frame;

    DeepPixels() {
        header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
        header.setType(Imf::DEEPSCANLINE);
        header.compression() = Imf::ZIPS_COMPRESSION;
        for (auto& sample : samples)
            pointers.push_back(&sample);
        frame.insertSampleCountSlice(
            Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), sizeof(unsigned), 4 * sizeof(unsigned)));
        frame.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers.data()), sizeof(float*),
                                         4 * sizeof(float*), sizeof(float)));
    }
};

inline fs::path write_deep(const fs::path& file) {
    const DeepPixels pixels;
    Imf::DeepScanLineOutputFile exr(file.c_str(), pixels.header);
    exr.setFrameBuffer(pixels.frame);
    exr.writePixels(3);
    return file;
}

/// A part "deep" and a part "flat".
inline fs::path write_deep_and_flat(const fs::path& file) {
    const ExrImage picture{.display = {{0, 0}, {3, 2}}, .data = {{0, 0}, {3, 2}}, .part = "flat"};
    DeepPixels deep;
    deep.header.setName("deep");
    const Imf::Header headers[] = {deep.header, header_of(picture)};
    Imf::MultiPartOutputFile exr(file.c_str(), headers, 2);
    Imf::DeepScanLineOutputPart deep_part(exr, 0);
    deep_part.setFrameBuffer(deep.frame);
    deep_part.writePixels(3);
    const Pixels pixels(picture);
    Imf::OutputPart flat(exr, 1);
    flat.setFrameBuffer(pixels.frame);
    flat.writePixels(3);
    return file;
}

} // namespace fathom::test

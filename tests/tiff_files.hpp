#pragma once

#include "catch.hpp"

#include <opencv2/core.hpp>

#include <tiffio.h>

namespace fathom::test {

struct TiffForm {
    const char* mode = "w"; ///< of libtiff: l and b are byte orders, 8 is BigTIFF
    std::uint16_t compression = COMPRESSION_NONE;
    std::uint16_t predictor = PREDICTOR_NONE;
    std::uint32_t rows = 4; ///< a strip, or a side of a tile
    bool tiled = false;
    std::uint16_t orientation = ORIENTATION_TOPLEFT;
    std::function<void(TIFF*)> more = {}; ///< sets more fields, or others
};

/// A file whose fields are set, and that waits for its strips or tiles.
inline TIFF* begun_tiff(const std::filesystem::path& file, cv::Size size, int type, std::uint16_t format,
                        const TiffForm& form) {
    TIFF* tiff = TIFFOpen(file.c_str(), form.mode);
    REQUIRE(tiff);
    const int channels = CV_MAT_CN(type);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, size.width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, size.height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(CV_ELEM_SIZE1(type) * 8));
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, channels > 1 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, form.compression);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, form.orientation);
    if (form.predictor != PREDICTOR_NONE)
        TIFFSetField(tiff, TIFFTAG_PREDICTOR, form.predictor);
    TIFFSetField(tiff, form.tiled ? TIFFTAG_TILELENGTH : TIFFTAG_ROWSPERSTRIP, form.rows);
    if (form.tiled)
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, form.rows);
    if (form.more)
        form.more(tiff);
    return tiff;
}

/// Writes rows as they lie in the matrix, whatever the orientation says. Separate planes have a part of them.
inline std::filesystem::path write_tiff(const std::filesystem::path& file, const cv::Mat& image, std::uint16_t format,
                                        const TiffForm& form) {
    TIFF* tiff = begun_tiff(file, image.size(), image.type(), format, form);
    if (form.tiled) {
        const int side = static_cast<int>(form.rows);
        std::uint32_t i = 0;
        for (int y = 0; y < image.rows; y += side)
            for (int x = 0; x < image.cols; x += side) {
                cv::Mat tile(side, side, image.type(), cv::Scalar::all(7));
                const cv::Rect there(x, y, std::min(side, image.cols - x), std::min(side, image.rows - y));
                image(there).copyTo(tile(cv::Rect({}, there.size())));
                REQUIRE(TIFFWriteEncodedTile(tiff, i++, tile.data,
                                             static_cast<tmsize_t>(tile.total() * tile.elemSize())) > 0);
            }
    } else {
        std::uint16_t planes = PLANARCONFIG_CONTIG;
        TIFFGetField(tiff, TIFFTAG_PLANARCONFIG, &planes);
        for (int plane = 0; plane < (planes == PLANARCONFIG_SEPARATE ? image.channels() : 1); ++plane)
            for (int y = 0; y < image.rows; ++y) {
                cv::Mat row = image.row(y).clone(); // libtiff swaps bytes in place
                REQUIRE(TIFFWriteScanline(tiff, row.data, static_cast<std::uint32_t>(y),
                                          static_cast<std::uint16_t>(plane)) == 1);
            }
    }
    TIFFClose(tiff);
    return file;
}

} // namespace fathom::test

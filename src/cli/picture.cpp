#include "picture.hpp"

#include "codecs.hpp"
#include "each_depth.hpp"

namespace fathom::cli {

Product picture_product() {
    return {.extensions = {".exr", ".tif", ".pfm", ".png"},
            .channels = {"R", "G", "B", "A"},
            .png_scale = 1,
            .kind = ImageKind::color};
}

void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what) {
    app.add_option("--color", options.color, what + ", of the depth's size: EXR, PNG, TIFF or PFM")
        ->type_name("IMAGE")
        ->required()
        ->group("Input");
    app.add_option("--color-layer", options.color_layer,
                   "EXR layer that holds the picture\n(default: R, G, B, or *.Combined, *.beauty, or the only one)")
        ->type_name("NAME")
        ->group("Input");
}

cv::Mat picture_of(const std::filesystem::path& file, const PictureOptions& options, const StoredDepth& stored,
                   const Job& job) {
    cv::Mat color;
    {
        const StderrSilenced silenced;
        color = read_color(file, options.color_layer);
    }
    check_same_size(file, color, stored, job);
    return color;
}

} // namespace fathom::cli

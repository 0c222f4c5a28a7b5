#pragma once

#include "images.hpp"
#include "views.hpp"

#include <fathom/fathom.hpp>

#include <array>
#include <vector>

namespace fathom::bench {

/// One view at one size on a device: depth as stored, a picture, and images for what is computed from them. Several frames
/// of the same pixels in turn, so that a run finds its pixels in memory, as frames that come from elsewhere do.
class Case {
public:
    /// `stored`: values from 0 to 1, not rounded; without them the view's own. 0 frames: as many as outgrow a cache of half a
    /// gigabyte, from 2 to 16.
    Case(const Device& device, View view, const std::vector<double>& stored, int frames);
    explicit Case(const Device& device, const View& view, int frames = 0);

    const Device& device() const { return device_; }
    const View& view() const { return view_; }
    const Camera& camera() const { return view_.camera(); }
    int width() const { return camera().width; }
    int height() const { return camera().height; }

    /// Moves on to the next frame.
    void next() { current_ = (current_ + 1) % frames_.size(); }

    /// Gives all frames the images that this one has been asked for, so that none is made while time is taken.
    void complete();

    StoredDepth stored(Storage storage = Storage::float32) const; ///< float32 or uint16
    const Image& in_place();                                      ///< float32 depth, to be overwritten
    void restore();                                               ///< makes it what it was
    const Image& floats(int channels);                            ///< for a result of one, three or four floats a pixel
    DofMasks masks(bool mixed = false);                           ///< for four or five results of one float
    StoredDepth backs();                                          ///< where the solids end that the pixels show
    const Image& color();                                         ///< patches of colour unless a picture was set
    void set_color(const std::vector<float>& picture);

    /// z where this fraction of the surfaces is nearer.
    double depth_quantile(double fraction) const;
    double median_width() const; ///< width of the image, in scene units, at the median depth

    double radius_px = 0;  ///< of ssao: pixels at the median depth
    double max_coc_px = 0; ///< of dof and dof_masks: diameter of the image's max CoC
    double focus = 0;      ///< of them: depth; 0: the first third of the surfaces is nearer

    /// ssao: where its method may choose, as thick as brute force takes surfaces to be, and not as the method takes them.
    bool as_thick_as_brute_force = false;
    double brute_force_thickness() const { return radius() / 4; }

    double radius() const { return radius_px * median_width() / width(); }
    CircleOfConfusion lens() const;

private:
    struct Frame {
        Image stored, stored16, in_place, color;
        std::array<Image, 8> results; // of one, three and four channels, and five of one
    };
    const Image& result(std::size_t place, int channels);

    Device device_;
    View view_;
    std::vector<float> sorted_depth_; // of every 17th pixel that is a surface
    std::vector<float> picture_;
    Image backs_;
    std::vector<Frame> frames_;
    std::size_t current_ = 0;
};

} // namespace fathom::bench

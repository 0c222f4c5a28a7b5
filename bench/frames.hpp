#pragma once

#include <fathom/fathom.hpp>

#include <vector>

namespace fathom::bench {

/// Several frames of the same size, so that every run finds its pixels in memory and not in a cache, as frames that
/// come from elsewhere do. With one frame they are in the cache instead.
class Frames {
public:
    Frames(const Device& device, int width, int height, int count);

    int width() const { return width_; }
    int height() const { return height_; }
    const Device& device() const { return device_; }
    std::size_t count() const { return stored_.size(); }
    std::size_t current() const { return static_cast<std::size_t>(current_); }

    /// Moves on to the next frame.
    void next() { current_ = (current_ + 1) % static_cast<int>(stored_.size()); }

    const Image& stored() const { return stored_[current()]; }       ///< float32, 0 to 1
    const Image& stored16() const { return stored16_[current()]; }   ///< uint16, all codes
    const Image& in_place() const { return in_place_[current()]; }   ///< float32, to be overwritten
    const Image& result() const { return results_[current()]; }      ///< one float a pixel
    const Image& positions() const { return positions_[current()]; } ///< three floats a pixel

    /// Makes the frame that was overwritten what it was.
    void restore_in_place();

private:
    Device device_;
    int width_, height_, current_ = 0;
    std::vector<float> pattern_;
    std::vector<std::uint16_t> pattern16_;
    std::vector<Image> stored_, stored16_, in_place_, results_, positions_;
};

} // namespace fathom::bench

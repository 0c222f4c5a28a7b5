#include "errors.hpp"

#include "brute_force.hpp"
#include "lens_truth.hpp"
#include "parallel.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace fathom::bench {
namespace {

using oracle::Quad;

constexpr int stride = 7;                           // pixels from one sample to the next, where truth is cheap
constexpr double radii[] = {1.0 / 20, 2.0 / 5};     // of ssao, in widths of the image
constexpr double circles[] = {1.0 / 30, 1.0 / 120}; // of dof, in widths
constexpr int occlusion_stride = 23;                // between the pixels of brute force: every phase of 4 x 4 alike
constexpr int scene_stride = 11; // between those of rays into the scene, whose error few pixels decide
constexpr int blur_stride = 23;  // between the pixels whose lens is sampled

struct BlurSample {
    int x, y;
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
};

// A view, its truth and the results of methods in it. Truths that take long are made when they are first asked for.
class Judge {
public:
    Judge(const Device& device, const View& view)
        : view_(view), rendered_(scene::render(view.scene, view.camera())), on_(device, view, rendered_.exact, 1) {
        set_circle(circles[0]);
    }

    Case& on() { return on_; }

    Deviation error(const Method& method) {
        const std::vector<float> got = images::floats(method.run(on_));
        if (method.operation == "linearize")
            return depth_error(method, got);
        if (method.operation == "unproject")
            return position_error(got);
        if (method.operation == "dof_masks")
            return circle_error(got);
        if (method.operation == "normals")
            return normal_error(method, got);
        return blur_error(got);
    }

    /// Squares of the errors that were found last, at each sample point.
    const std::vector<double>& squares() const { return squares_; }

    /// Of ssao, against brute force over the same depth image at its thickness.
    Deviation method_error(const Method& method) {
        if (!layer_)
            layer_.emplace(view_.camera(), rendered_.z);
        if (!brute_force_)
            brute_force_ = oracle::brute_force(*layer_, rendered_.normal, on_.radius(), on_.brute_force_thickness(),
                                               oracle::sample_slices, occlusion_stride);
        return occlusion_error(method, *brute_force_, true);
    }

    /// Of ssao at the method's own thickness, against rays into the scene itself.
    Deviation scene_error(const Method& method) {
        if (!rays_)
            rays_ = oracle::ray_traced(view_.scene, view_.camera(), rendered_, on_.radius(), oracle::sample_rays,
                                       scene_stride);
        return occlusion_error(method, *rays_, false);
    }

    /// dof is run on a picture, which is made first.
    void prepare_blur() {
        if (blur_.empty())
            make_blur();
    }

    /// Sets the max CoC of dof and dof_masks.
    void set_circle(double fraction) {
        on_.max_coc_px = fraction * on_.width();
        blur_.clear();
    }

    /// Sets the radius of ssao.
    void set_radius(double fraction) {
        on_.radius_px = fraction * on_.width();
        brute_force_.reset();
        rays_.reset();
    }

private:
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(on_.width()) + static_cast<std::size_t>(x);
    }

    template <typename Each>
    std::vector<double> over_surfaces(int step, const Each& each) const {
        std::vector<double> errors;
        for (int y = step / 2; y < rendered_.height; y += step)
            for (int x = step / 2; x < rendered_.width; x += step)
                if (std::isfinite(rendered_.z[index(x, y)]))
                    errors.push_back(each(x, y));
        return errors;
    }

    Deviation depth_error(const Method& method, const std::vector<float>& got) const {
        const oracle::Truth truth(view_.subject, method.storage);
        const bool codes = method.storage == Storage::uint16;
        return summary("ulp", over_surfaces(stride, [&](int x, int y) {
                           const std::size_t i = index(x, y);
                           const double v = codes ? std::round(65535 * rendered_.exact[i])
                                                  : static_cast<double>(rendered_.stored[i]);
                           return oracle::error_in_ulp(got[i], truth.depth(v, x + 0.5, y + 0.5));
                       }));
    }

    Deviation position_error(const std::vector<float>& got) const {
        const oracle::Truth truth(view_.subject, Storage::float32);
        const oracle::Point centre = truth.centre();
        return summary("2^-24", over_surfaces(stride, [&](int x, int y) {
                           const std::size_t i = index(x, y);
                           const auto v = static_cast<double>(rendered_.stored[i]);
                           const oracle::Point exact =
                               truth.position(truth.depth(v, x + 0.5, y + 0.5), x + 0.5, y + 0.5);
                           double off = 0, distance = 0;
                           for (std::size_t k = 0; k < 3; ++k) {
                               const auto wrong = static_cast<double>(static_cast<Quad>(got[3 * i + k]) - exact[k]);
                               const auto away = static_cast<double>(exact[k] - centre[k]);
                               off += wrong * wrong;
                               distance += away * away;
                           }
                           return std::sqrt(off / distance) * 0x1p24;
                       }));
    }

    Deviation circle_error(const std::vector<float>& got) const {
        const oracle::Truth truth(view_.subject, Storage::float32);
        const CircleOfConfusion lens = on_.lens();
        return summary(
            "ulp", over_surfaces(stride, [&](int x, int y) {
                const std::size_t i = index(x, y);
                const auto z =
                    static_cast<long double>(truth.depth(static_cast<double>(rendered_.stored[i]), x + 0.5, y + 0.5));
                const long double exact = coc_at(lens, z);
                const double off = static_cast<double>(static_cast<long double>(got[i]) - exact);
                return off /
                       oracle::ulp(static_cast<Quad>(std::max(std::abs(exact), static_cast<long double>(lens.k))));
            }));
    }

    // OpenCV turns a normal by the sign of its z, which is noise on walls along the axis. That error does not count.
    Deviation normal_error(const Method& method, const std::vector<float>& got) const {
        const bool either_side = method.kind == Method::Kind::opencv;
        return summary("degrees", over_surfaces(3, [&](int x, int y) {
                           const std::size_t i = index(x, y);
                           const Eigen::Vector3d n = Eigen::Vector3f(&got[3 * i]).cast<double>();
                           const Eigen::Vector3d& exact = rendered_.normal[i];
                           if (!n.allFinite())
                               return 90.0; // any direction
                           const double angle = 2 * std::atan2((n - exact).norm(), (n + exact).norm());
                           return (either_side ? std::min(angle, std::numbers::pi - angle) : angle) * 180 /
                                  std::numbers::pi;
                       }));
    }

    Deviation occlusion_error(const Method& method, const std::vector<oracle::Sample>& truth,
                              bool as_thick_as_brute_force) {
        on_.as_thick_as_brute_force = as_thick_as_brute_force;
        const std::vector<float> got = images::floats(method.run(on_));
        const oracle::Off off = oracle::error_of(truth, got, on_.width());
        if (as_thick_as_brute_force) {
            squares_.clear();
            for (const oracle::Sample& p : truth) {
                const double error = static_cast<double>(got[index(p.x, p.y)]) - p.visibility;
                squares_.push_back(error * error);
            }
        }
        return {"visibility", off.bias, off.rmse, off.p99, off.worst, off.common, truth.size()};
    }

    // Not where the larger circle reaches beyond the image.
    void make_blur() {
        on_.set_color(picture_of(view_));
        const int margin = static_cast<int>(circles[0] * on_.width() / 2) + 1;
        for (int y = margin; y < on_.height() - margin; y += blur_stride)
            for (int x = margin; x < on_.width() - margin; x += blur_stride)
                blur_.push_back({.x = x, .y = y});
        const LensTruth truth(view_, on_.lens());
        oracle::in_parallel(blur_.size(), [&](std::size_t i) { blur_[i].color = truth.at(blur_[i].x, blur_[i].y); });
    }

    Deviation blur_error(std::vector<float> got) {
        std::vector<double> errors;
        squares_.clear();
        for (const BlurSample& sample : blur_) {
            double sum = 0;
            for (int i = 0; i < 3; ++i) {
                errors.push_back(static_cast<double>(got[3 * index(sample.x, sample.y) + static_cast<std::size_t>(i)]) -
                                 sample.color[i]);
                sum += errors.back() * errors.back();
            }
            squares_.push_back(sum / 3);
        }
        return summary("colour", errors);
    }
    const View& view_;
    scene::Rendered rendered_;
    Case on_;
    std::optional<oracle::DepthLayer> layer_;
    std::optional<std::vector<oracle::Sample>> brute_force_, rays_;
    std::vector<BlurSample> blur_;
    std::vector<double> squares_;
};

} // namespace

std::vector<Figures> errors(const Device& device, const std::vector<Method>& methods, const std::vector<View>& views,
                            const std::string& only, const std::function<void(const Figures&)>& report) {
    std::vector<Figures> rows;
    const auto add = [&](Judge& judge, const View& view, const Method& method, double radius_px) {
        if (method.fits && !method.fits(view))
            return;
        rows.push_back({.operation = method.operation,
                        .method = method.name,
                        .kind = kind_name(method.kind),
                        .storage = to_string(method.storage),
                        .scene = view.name,
                        .width = view.camera().width,
                        .height = view.camera().height,
                        .radius_px = radius_px});
        if (method.operation == "ssao") {
            if (!method.name.ends_with(backs_suffix))
                rows.back().error = judge.method_error(method);
            rows.back().scene_error = judge.scene_error(method);
        } else {
            rows.back().error = judge.error(method);
        }
        if (rows.back().error && (method.operation == "ssao" || method.operation == "dof"))
            rows.back().squares = judge.squares();
        report(rows.back());
    };
    for (const View& view : views) {
        Judge judge(device, view);
        for (const Method& method : methods) {
            if (method.kind == Method::Kind::floor || !method.matches(only) || method.operation == "ssao" ||
                method.operation == "dof")
                continue;
            add(judge, view, method, method.operation == "dof_masks" ? judge.on().max_coc_px : 0);
        }
        for (const double fraction : circles) {
            judge.set_circle(fraction);
            for (const Method& method : methods) {
                const bool is_asked = fraction == circles[0] || method.kind != Method::Kind::blender;
                if (method.operation != "dof" || !method.matches(only) || !is_asked)
                    continue;
                judge.prepare_blur();
                add(judge, view, method, judge.on().max_coc_px);
            }
        }
        for (const double fraction : radii) {
            judge.set_radius(fraction);
            for (const Method& method : methods)
                if (method.operation == "ssao" && method.matches(only))
                    add(judge, view, method, judge.on().radius_px);
        }
    }
    return rows;
}

} // namespace fathom::bench

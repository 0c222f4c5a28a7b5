#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace fathom::test {

/// A scene as the distance along a unit ray from the camera, y down and z ahead: planes, boxes, spheres, hills and leaves.
class Scene {
public:
    enum Kind { room, street, boxes, hills, bodies, foliage, kinds };

    Scene(Kind kind, std::mt19937& random) : kind_(kind), random_(&random) {
        unit_ = std::exp(number(std::log(0.5), std::log(20)));
        turned_ = Eigen::AngleAxisd(number(-0.5, 0.5), Eigen::Vector3d::UnitX()) *
                  Eigen::AngleAxisd(number(-3, 3), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(number(-0.2, 0.2), Eigen::Vector3d::UnitZ());
        const auto place = [&]() -> Eigen::Vector3d {
            const double angle = number(-0.8, 0.8), away = unit_ * number(1, 4);
            return turned_.transpose() *
                   Eigen::Vector3d(away * std::sin(angle), unit_ * number(-0.6, 0.5), away * std::cos(angle));
        };
        const int count = kind == foliage ? 400 : kind == bodies ? 12 : kind == hills ? 0 : 8;
        for (int i = 0; i < count; ++i) {
            const Eigen::Vector3d at = place();
            const double size = unit_ * (kind == foliage ? number(0.03, 0.12) : number(0.15, 0.6));
            if (kind == bodies || kind == foliage)
                spheres_.push_back({at, size});
            else
                boxes_.push_back({at - size * Eigen::Vector3d(number(0.3, 1), number(0.3, 1), number(0.3, 1)),
                                  at + size * Eigen::Vector3d(number(0.3, 1), number(0.3, 1), number(0.3, 1))});
        }
        phase_ = number(0, 6);
    }

    double distance(const Eigen::Vector3d& of_camera) const {
        const Eigen::Vector3d ray = turned_.transpose() * of_camera;
        double nearest = std::numeric_limits<double>::infinity();
        const auto add = [&](double t) {
            if (t > 0.05 * unit_)
                nearest = std::min(nearest, t);
        };
        if (kind_ == room)
            for (int axis = 0; axis < 3; ++axis)
                for (const double wall : {-2.2, 2.9})
                    add((axis == 1 ? 0.6 : 1.0) * wall * unit_ / ray[axis]);
        if (kind_ == street && ray.y() > 0)
            add(0.7 * unit_ / ray.y());
        for (const auto& [low, high] : boxes_) {
            const Eigen::Array3d a = low.array() / ray.array(), b = high.array() / ray.array();
            const double enters = a.min(b).maxCoeff(), leaves = a.max(b).minCoeff();
            if (enters < leaves)
                add(enters);
        }
        for (const auto& [middle, radius] : spheres_) {
            const double along = ray.dot(middle), beside = middle.squaredNorm() - along * along;
            if (beside < radius * radius)
                add(along - std::sqrt(radius * radius - beside));
        }
        if (kind_ == hills)
            add(hill(ray));
        return nearest > 60 * unit_ ? std::numeric_limits<double>::infinity() : nearest;
    }

    double unit() const { return unit_; }

private:
    double number(double low, double high) { return std::uniform_real_distribution(low, high)(*random_); }

    double height(double x, double z) const {
        return 0.7 - 0.25 * std::sin(x + phase_) * std::cos(0.8 * z) - 0.08 * std::sin(3.1 * x + 2.3 * z);
    }

    double hill(const Eigen::Vector3d& ray) const {
        double before = 0, t = 0.1;
        for (; t < 40; before = t, t *= 1.05)
            if (t * ray.y() > height(t * ray.x(), t * ray.z()))
                break;
        if (t >= 40)
            return std::numeric_limits<double>::infinity();
        for (int i = 0; i < 40; ++i) {
            const double middle = (before + t) / 2;
            (middle * ray.y() > height(middle * ray.x(), middle * ray.z()) ? t : before) = middle;
        }
        return unit_ * t;
    }

    Kind kind_;
    std::mt19937* random_; ///< of the constructor only
    double unit_ = 1, phase_ = 0;
    Eigen::Matrix3d turned_;
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> boxes_;
    std::vector<std::pair<Eigen::Vector3d, double>> spheres_;
};

} // namespace fathom::test

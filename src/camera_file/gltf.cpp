// The camera of a node of glTF 2.0.
//   x right, y up, -z ahead; clip range -1 to 1; the node's place is the product of its ancestors' matrices
// The Khronos Group, glTF 2.0 specification, 3.5.2, 3.10.2, 3.10.3. Its rule that a camera's scale is ignored is kept.
#include "imported.hpp"

#include "file.hpp"
#include "json_object.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace fs = std::filesystem;
using nlohmann::json;

namespace fathom::io {
namespace {

constexpr double same_length = 1e-6;   // an axis whose length differs by less is of length one
constexpr double perpendicular = 1e-4; // the cosine between two axes that are

/// The array under a key; empty where there is none.
const json& array_at(const fs::path& file, const json& gltf, const std::string& key) {
    static const json none = json::array();
    if (!gltf.contains(key))
        return none;
    if (!gltf[key].is_array())
        refuse(file, "\"" + key + "\": " + shown(gltf[key]) + " must be a list, [...]");
    return gltf[key];
}

/// An element that another one refers to by its index.
std::size_t index_in(const fs::path& file, const json& value, const json& array, const std::string& path) {
    if (!value.is_number_integer() || value < 0 || value >= array.size())
        refuse(file, "\"" + path + "\": " + shown(value) + " must be an index below " + std::to_string(array.size()));
    return value.get<std::size_t>();
}

/// A node's place within its parent.
Eigen::Matrix4d local_matrix(const JsonObject& node) {
    if (const auto columns = node.numbers("matrix", 16))
        return Eigen::Map<const Eigen::Matrix4d>(columns->data());
    Eigen::Affine3d place = Eigen::Affine3d::Identity();
    if (const auto xyz = node.numbers("translation", 3))
        place.translate(Eigen::Map<const Eigen::Vector3d>(xyz->data()));
    if (const auto xyzw = node.numbers("rotation", 4)) {
        const Eigen::Quaterniond rotation(xyzw->data());
        if (!(rotation.norm() > 0))
            node.refuse_value("rotation", "must be a quaternion, not 0");
        place.rotate(rotation.normalized());
    }
    if (const auto xyz = node.numbers("scale", 3))
        place.scale(Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(xyz->data())));
    return place.matrix();
}

/// Camera to world, without the scale.
Eigen::Matrix4d world_matrix(const fs::path& file, const json& nodes, std::size_t node) {
    std::vector<std::optional<std::size_t>> parents(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (const json& child : array_at(file, nodes[i], "children"))
            parents[index_in(file, child, nodes, "nodes[" + std::to_string(i) + "].children")] = i;
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    std::size_t depth = 0;
    for (std::optional<std::size_t> at = node; at; at = parents[*at]) {
        if (++depth > nodes.size())
            refuse(file, "has a node that is its own ancestor; export it again");
        matrix = local_matrix({file, "nodes[" + std::to_string(*at) + "]", nodes[*at]}) * matrix;
    }
    for (Eigen::Index c = 0; c < 3; ++c) {
        const double length = matrix.col(c).head<3>().norm();
        if (!(length > 0) || !std::isfinite(length))
            refuse(file,
                   "places its camera with a scale of " + shown(length) + "; apply the scale and export it again");
        if (std::abs(length - 1) > same_length)
            matrix.col(c) /= length;
    }
    const Eigen::Matrix3d axes = matrix.topLeftCorner<3, 3>();
    if (!(axes.determinant() > 0) ||
        ((axes.transpose() * axes) - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > perpendicular)
        refuse(file,
               "places its camera with a mirrored or sheared matrix; apply the parents' scale and export it again");
    return matrix;
}

/// Keys of the projection.
json projection_of(const JsonObject& camera) {
    const auto kind =
        camera.one_of<std::string>("type", {{"perspective", "perspective"}, {"orthographic", "orthographic"}});
    if (!kind || !camera.has(*kind))
        camera.refuse_missing(kind.value_or("type"), "glTF requires it");
    const JsonObject own = camera.object(*kind);
    if (*kind == "orthographic") {
        const double x = own.needed("xmag"), y = own.needed("ymag");
        return {{"orthographic",
                 {{"left", -x},
                  {"right", x},
                  {"bottom", -y},
                  {"top", y},
                  {"near", own.needed("znear")},
                  {"far", own.needed("zfar")}}}};
    }
    const auto far = own.number("zfar");
    json keys{{"fov_y_deg", own.needed("yfov") * 180 / std::numbers::pi},
              {"near", own.needed("znear")},
              {"far", far ? json(*far) : json("infinity")}};
    if (const auto aspect = own.number("aspectRatio"))
        keys["aspect"] = *aspect;
    return {{"perspective", keys}};
}

} // namespace

bool is_gltf(const json& json) {
    return json.is_object() && json.contains("asset");
}

Imported import_gltf(const fs::path& file, const json& gltf, const ImportOptions& options) {
    const json &cameras = array_at(file, gltf, "cameras"), &nodes = array_at(file, gltf, "nodes");
    if (cameras.empty())
        refuse(file, "has no camera; export it with cameras");
    std::vector<std::size_t> places; // nodes with a camera
    std::vector<std::string> names;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!nodes[i].is_object())
            refuse(file, "\"nodes[" + std::to_string(i) + "]\": " + shown(nodes[i]) + " must be an object, {...}");
        if (!nodes[i].contains("camera"))
            continue;
        const auto camera = index_in(file, nodes[i]["camera"], cameras, "nodes[" + std::to_string(i) + "].camera");
        places.push_back(i);
        const std::string own = text_at(nodes[i], "name"), of_camera = text_at(cameras[camera], "name");
        names.push_back(!own.empty() ? own : !of_camera.empty() ? of_camera : std::to_string(i));
        if (std::to_string(i) == options.node)
            names.back() = options.node;
    }
    if (places.empty())
        refuse(file, "has cameras and no node that places one; export the scene with its cameras");
    const auto place = places[chosen(file, names, options.node, {}, "camera", "--node")];
    const auto camera = nodes[place]["camera"].get<std::size_t>();
    Imported imported{.keys = projection_of({file, "cameras[" + std::to_string(camera) + "]", cameras[camera]}),
                      .otherwise = {{"encoding", "window"}}};
    imported.has_aspect = imported.keys.contains("perspective") && imported.keys["perspective"].contains("aspect");
    imported.keys["camera_to_world"] = rows_of(world_matrix(file, nodes, place));
    return imported;
}

} // namespace fathom::io

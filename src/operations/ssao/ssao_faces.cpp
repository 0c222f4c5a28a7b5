// Occlusion through a lens. A slice is the plane through a pixel's ray and a direction across it, which is a straight line in a
// pinhole's image and a curve in a lens's. So the image is cut into blocks, each of which a pinhole sees with a margin around it:
// its face. Depth goes onto faces along tangent planes, the kernels for pinholes run there, and results come back.

#include "operations/ssao/ssao_call.hpp"

#include "camera/form.hpp"
#include "lens/faces.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"
#include "operations/ssao/ssao_method.hpp"
#include "runtime/table.hpp"

#include <fathom/normals.hpp>
#include <fathom/tiles.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace fathom {
namespace {

using lens::Face;
using lens::PixelBox;

static_assert(lens::fade == params::lens_fade);

// Roundings of a face's inverse depth, in units of 2^-24 of it, besides the depth's own error: of the plane through a pixel, and
// of the place where the face looks.
constexpr float plane_roundings = 16 * 0x1p-24f;

// A face, and what of it the lens's pixels cover.
struct CoveredFace {
    Face face;
    std::vector<lens::FaceTile> tiles;
    runtime::Table blocks;
    int block_columns;

    std::size_t bytes() const {
        return sizeof(CoveredFace) + tiles.size() * sizeof(lens::FaceTile) + 4 * static_cast<std::size_t>(blocks.count);
    }
};

struct LensFaces {
    static constexpr const char* name = "faces";

    std::vector<CoveredFace> all;
    runtime::Table places; // of the pixels on their faces
    int places_across;
    std::shared_ptr<const RayMap> map;

    std::size_t bytes() const {
        std::size_t sum = 4 * static_cast<std::size_t>(places.count);
        for (const CoveredFace& each : all)
            sum += each.bytes();
        return sum;
    }
};

std::shared_ptr<const LensFaces> faces_for(const Device& device, const Camera& camera) {
    const bool along_axis = counted_along(camera) == Along::axis;
    return runtime::kept<LensFaces>(device, lens_key(camera, along_axis), [&] {
        const lens::CameraLens lens(camera);
        const std::vector<Face> all = lens::faces_of(lens, camera.width, camera.height, along_axis);
        const lens::FacePlaces places = lens::places_of(lens, camera.width, camera.height, all);
        LensFaces faces{
            {}, runtime::table(device, Element::f32, places.numbers), places.tiles_across, camera.lens->map};
        for (const Face& face : all) {
            const std::vector<lens::FaceTile> tiles = lens::tiles_of(lens, face);
            const lens::FaceBlocks blocks = lens::blocks_of(face, tiles, 1 << params::ssao_block_shift);
            faces.all.push_back({face, tiles, runtime::table(device, Element::u32, blocks.needed), blocks.columns});
        }
        return std::make_shared<const LensFaces>(std::move(faces));
    });
}

struct PositionTable : LensTable {
    static constexpr const char* name = "positions";
};

struct PositionKey {
    LensKey lens;
    std::array<std::int32_t, 8> part; // which block, and which part of its face
};

std::shared_ptr<const PositionTable> positions_for(const Device& device, const Camera& camera, const Face& face,
                                                   const PixelBox& part) {
    const bool along_axis = counted_along(camera) == Along::axis;
    const PositionKey key{lens_key(camera, along_axis),
                          {face.block.left, face.block.top, face.block.right, face.block.bottom, part.left, part.top,
                           part.right, part.bottom}};
    return runtime::kept<PositionTable>(device, key, [&] {
        const lens::FacePositions made = lens::positions_of(lens::CameraLens(camera), face, part);
        return std::make_shared<const PositionTable>(
            PositionTable{{runtime::table(device, Element::u32, made.tiles),
                           runtime::table(device, Element::f32, made.nodes), made.tiles_across, camera.lens->map}});
    });
}

// The sine of the angle that a sphere covers which decides on a pixel of this inverse distance.
double sine_of(double radius, const SsaoOptions& options, double nearest) {
    const double length = std::min(radius, longest_length) * (has_silhouettes(options) ? 1 + silhouette_most : 1);
    return length * std::max(nearest, 0.0);
}

// A face in one call: the part of its image that is looked at.
struct FaceCall {
    const Face& face;
    PixelBox part;
    const CoveredFace* covered = nullptr; // not where only bytes are counted

    Layout layout(int channels = 1) const { return {part.width(), part.height(), channels}; }

    Camera camera() const {
        const double middle = face.half;
        Camera camera;
        camera.width = camera.height = 2 * face.half;
        camera.projection = perspective(Intrinsics{face.focal, face.focal, middle, middle, camera.width, camera.height},
                                        {1, 2}, {.view_axes = ViewAxes::opencv});
        camera.encoding = Encoding::inverse;
        return camera;
    }

    StoredDepth stored(const Image& depth) const { return {depth, camera(), Storage::float32, part.left, part.top}; }
    Tile tile() const { return {camera(), Storage::float32, {part.left, part.top, part.width(), part.height()}}; }
};

// Bytes besides inputs and results: what is made of the whole depth, and on one face.
std::size_t bytes_of_planes(int width, int height) {
    return Image::allocation(Element::f32, {width, height, 4}) + inverse_depth_bytes(width, height) +
           std::size_t{4} * static_cast<std::size_t>(height) * sizeof(float);
}

SsaoOptions face_options(const SsaoOptions& options) {
    SsaoOptions on_face = options;
    on_face.normals = {};
    on_face.normals_space = Space::view;
    on_face.region.reset();
    if (thickness_as<Image>(options) || thickness_as<StoredDepth>(options))
        on_face.thickness = 0.0; // until it is on the face
    return on_face;
}

std::size_t bytes_of_face(const FaceCall& call, const SsaoOptions& options, bool with_normals) {
    const auto image = [&](int channels) { return Image::allocation(Element::f32, call.layout(channels)); };
    std::size_t sum = 2 * inverse_depth_bytes(call.part.width(), call.part.height()) + // its slopes are as large
                      bytes(call.tile(), face_options(options)) + image(1);
    if (with_normals)
        sum += image(3);
    if (thickness_as<Image>(options) || thickness_as<StoredDepth>(options))
        sum += 2 * image(1);
    if (options.confidence)
        sum += image(1);
    if (options.bent_normal)
        sum += image(3);
    return sum;
}

} // namespace

bool same_lens(const Camera& a, const Camera& b) {
    if (!a.lens || !b.lens || a.width != b.width || a.height != b.height)
        return false;
    const LensKey one = lens_key(a, false), other = lens_key(b, false);
    return one.numbers == other.numbers && one.coefficients == other.coefficients && one.map == other.map;
}

namespace {

// Columns after which a panorama begins again; 0 where it does not.
int turn_of(const Camera& camera) {
    return std::abs(lens::CameraLens(camera).turn() - camera.width) < 1e-3 ? camera.width : 0;
}

class ThroughLens {
public:
    ThroughLens(const StoredDepth& stored, double radius, const SsaoOptions& options)
        : stored_(stored), radius_(radius), options_(options), device_(stored.image.device()), scratch_(device_),
          lens_(device_, stored.camera), faces_(faces_for(device_, stored.camera)),
          fitted_(fits_normals(stored, options)), turn_(turn_of(stored.camera)) {}

    void run(const std::vector<Wanted>& results) {
        const Region region = region_of(stored_, options_);
        // In the camera's image.
        const PixelBox wanted{stored_.x + region.x, stored_.y + region.y, stored_.x + region.x + region.width,
                              stored_.y + region.y + region.height};
        const Image depth = inverse_depth(scratch_, stored_);
        const NearestTiles nearest = nearest_in_tiles(depth);
        std::vector<FaceCall> calls;
        for (const CoveredFace& each : faces_->all)
            if (!pieces_of(each.face.block, wanted).empty())
                calls.push_back({each.face, part_of_face(each, nearest), &each});
        require_budget(calls);
        make_planes(depth);
        for (const FaceCall& call : calls)
            run(call, wanted, results);
    }

private:
    static PixelBox common(const PixelBox& a, const PixelBox& b) {
        return {std::max(a.left, b.left), std::max(a.top, b.top), std::min(a.right, b.right),
                std::min(a.bottom, b.bottom)};
    }
    static bool is_empty(const PixelBox& box) { return box.width() <= 0 || box.height() <= 0; }

    PixelBox in_image() const {
        return {stored_.x, stored_.y, stored_.x + stored_.image.width(), stored_.y + stored_.image.height()};
    }

    // A part of the lens's image to which a face gives results, and the face's block, which may have gone around a panorama.
    struct Piece {
        PixelBox box, block;
    };

    // The block, and the strips right of it and below where its face's results pass over into those of other faces.
    std::vector<Piece> pieces_of(const PixelBox& block, const PixelBox& wanted) const {
        constexpr int fade = lens::fade, wide = 16; // as many columns as a vector has
        const auto [left, top, right, bottom] = block;
        std::vector<Piece> pieces;
        for (const int shift : turn_ > 0 ? std::vector{0, -turn_} : std::vector{0})
            for (const PixelBox& box : {PixelBox{left, top, right, bottom},
                                        {right, top, right + wide, bottom + fade},
                                        {left, bottom, right, bottom + fade}}) {
                const PixelBox there = common({box.left + shift, box.top, box.right + shift, box.bottom}, wanted);
                if (!is_empty(there))
                    pieces.push_back({there, {left + shift, top, right + shift, bottom}});
            }
        return pieces;
    }

    // Inverse distances of the nearest surfaces of tiles, from the one on that the depth's first pixel lies in.
    struct NearestTiles {
        int column, row, columns, rows;
        std::vector<float> values;

        double at(const lens::FaceTile& tile) const {
            const int x = tile.column - column, y = tile.row - row;
            return x >= 0 && y >= 0 && x < columns && y < rows ? values[static_cast<std::size_t>(y * columns + x)] : 0;
        }
    };

    NearestTiles nearest_in_tiles(const Image& depth) const {
        constexpr int shift = params::lens_tile_shift;
        const PixelBox image = in_image();
        NearestTiles found{image.left >> shift, image.top >> shift, 0, 0, {}};
        found.columns = ((image.right - 1) >> shift) - found.column + 1;
        found.rows = ((image.bottom - 1) >> shift) - found.row + 1;
        runtime::Scratch scratch(device_);
        const Image nearest = scratch.image(Element::f32, {found.columns, found.rows});
        params::grid_params grid = grid_parameters(depth, nearest, 0, found.columns, stored_.x, stored_.y);
        runtime::launch(
            device_, runtime::kernel(device_, "nearest_tiles", {{"V", device_.options().vector_width}, {"STREAM", 0}}),
            {static_cast<std::size_t>(found.columns), static_cast<std::size_t>(found.rows)}, depth, nearest, grid);
        found.values = runtime::on_host<float>(nearest);
        return found;
    }

    PixelBox part_of_face(const CoveredFace& covered, const NearestTiles& nearest) const {
        std::vector<double> sines;
        for (const lens::FaceTile& tile : covered.tiles)
            sines.push_back(sine_of(radius_, options_, nearest.at(tile)));
        return lens::with_margin(covered.face, covered.tiles, sines);
    }

    void require_budget(const std::vector<FaceCall>& calls) const {
        std::size_t most = 0;
        for (const FaceCall& call : calls)
            most = std::max(most, bytes_of_face(call, options_, has_normals()));
        const std::size_t needed = bytes_of_planes(stored_.image.width(), stored_.image.height()) + most;
        if (needed > budget_of(device_))
            refuse_budget(
                text("ssao of ", ImageSize{stored_.image.width(), stored_.image.height()}, " pixels through a lens"),
                needed);
    }

    bool has_normals() const { return options_.normals || fitted_; }

    void make_planes(const Image& depth) {
        const int width = stored_.image.width(), height = stored_.image.height();
        planes_ = scratch_.image(Element::f32, {width, height, 4});
        normals_ = options_.normals;
        if (fitted_) {
            normals_ = scratch_.image(Element::f32, {width, height, 4});
            normals(
                stored_, normals_,
                {.method = NormalMethod::least_squares, .channels = 4, .tolerance = std::max(options_.tolerance, 1.0)});
        }
        const InverseDepthError error = stored_error(stored_.camera, stored_.storage);
        const auto times = static_cast<float>(options_.tolerance);
        const params::lens_plane_params parameters{.radius = static_cast<float>(std::min(radius_, longest_length)),
                                                   .error_constant = error.constant * times,
                                                   .error_linear = error.linear * times,
                                                   .error_quadratic = error.quadratic * times,
                                                   .stride = to_u32(planes_.row_stride() / 4),
                                                   .given = fitted_ ? 4u : 0u};
        const int vector_width = vector_width_for(device_, width), rows = vector_width == 1 ? 1 : params::lens_rows;
        params::grid_params grid = grid_parameters(depth, planes_, 0, width, stored_.x, stored_.y);
        lens_.launch(device_,
                     runtime::kernel(
                         device_, "lens_planes",
                         lens_.with_lens({{"V", vector_width}, {"STREAM", 0}, {"PERSPECTIVE", 1}, {"GIVEN", fitted_}})),
                     range_of(width, (height - 1) / rows + 1, vector_width), depth, fitted_ ? normals_ : depth, planes_,
                     grid, parameters);
        if (const auto* back = thickness_as<StoredDepth>(options_))
            back_ = inverse_depth(scratch_, *back);
    }

    params::face_params parameters_of(const FaceCall& call, const Image& depth, int tiles) const {
        params::face_params p{};
        for (int i = 0; i < 3; ++i) {
            p.right[i] = static_cast<float>(call.face.turn(0, i) / call.face.focal);
            p.down[i] = static_cast<float>(call.face.turn(1, i) / call.face.focal);
            p.ahead[i] = static_cast<float>(call.face.turn(2, i));
        }
        p.first[0] = static_cast<float>(call.part.left + 0.5 - call.face.half);
        p.first[1] = static_cast<float>(call.part.top + 0.5 - call.face.half);
        p.pixel = static_cast<float>(1 / call.face.focal);
        p.columns = to_u32(call.part.width());
        p.rows = to_u32(call.part.height());
        p.stride = to_u32(depth.row_stride());
        p.tiles = to_u32(tiles);
        p.turn = to_u32(turn_);
        p.camera_columns = to_u32(stored_.camera.width);
        p.camera_rows = to_u32(stored_.camera.height);
        p.left = to_u32(stored_.x);
        p.top = to_u32(stored_.y);
        p.width = to_u32(stored_.image.width());
        p.height = to_u32(stored_.image.height());
        p.plane_stride = to_u32(planes_.row_stride() / 4);
        return p;
    }

    // ONTO of kernels/faces/onto_face.cl
    enum class Onto { depth, number, back, direction };

    void onto_face(const FaceCall& call, const PositionTable& table, Onto what, const Image& given, const Image& target,
                   const Image& slopes, const Eigen::Matrix3d& turn) {
        const params::face_params p = parameters_of(call, target, table.tiles_across);
        constexpr params::u32 margin = params::depth_margin_rows;
        params::onto_face_params onto{.offset = given.offset(),
                                      .target_offset = target.offset(),
                                      .stride = to_u32(given.row_stride()),
                                      .channels = to_u32(given.channels()),
                                      .turn = {},
                                      .margin = what == Onto::depth ? margin : 0u};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                onto.turn[i][j] = static_cast<float>(turn(i, j));
        const int vector_width = device_.options().vector_width;
        runtime::launch(device_,
                        runtime::kernel(device_, "onto_face",
                                        {{"V", vector_width}, {"STREAM", 0}, {"ONTO", static_cast<int>(what)}}),
                        range_of(call.part.width(),
                                 call.part.height() + static_cast<int>(onto.margin > 0 ? 2 * margin + 1 : 0),
                                 vector_width == 1 ? 1 : params::onto_face_columns),
                        table.tiles.on(device_), table.nodes.on(device_), planes_, given, target, slopes, p, onto);
    }

    void from_face(const FaceCall& call, const Piece& piece, const Region& computed, const Image& depth,
                   const Wanted& found, const Wanted& result, const PixelBox& wanted, const InverseDepthError& error) {
        const params::face_params p = parameters_of(call, depth, faces_->places_across);
        constexpr int far = 1 << 24;
        const PixelBox& block = piece.box;
        params::from_face_params from{.unit = {},
                                      .error = 4 * error.linear,
                                      .edge = 0.5f,
                                      .first_column = computed.x,
                                      .first_row = computed.y,
                                      .last_column = computed.x + computed.width - 1,
                                      .last_row = computed.y + computed.height - 1,
                                      .stride = to_u32(found.image.row_stride()),
                                      .x = to_u32(wanted.left - stored_.x),
                                      .y = to_u32(wanted.top - stored_.y),
                                      .depth_offset = to_u32(depth.offset()),
                                      .least_ahead = static_cast<float>(1.001 * lens::least_part_ahead),
                                      .left = piece.block.left - stored_.x,
                                      .top = piece.block.top - stored_.y,
                                      .right = piece.block.right - stored_.x,
                                      .bottom = piece.block.bottom - stored_.y,
                                      .fade_left = -far,
                                      .fade_top = -far,
                                      .fade_right = far};
        // Blocks to the left and above come first, and of a whole turn those on the right of the last ones.
        if (call.face.block.left > 0)
            from.fade_left = from.left;
        if (call.face.block.top > 0)
            from.fade_top = from.top;
        if (call.face.block.right == turn_)
            from.fade_right = from.right + params::lens_fade;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                from.unit[i][j] = static_cast<float>(call.face.turn(j, i));
        const int vector_width = vector_width_for(device_, block.width());
        params::grid_params grid = grid_parameters(Image(), result.image, block.left - stored_.x,
                                                   block.right - stored_.x, stored_.x, stored_.y);
        grid.height = to_u32(block.height());
        grid.y_begin = to_u32(block.top - stored_.y);
        lens_.launch(
            device_,
            runtime::kernel(
                device_, "from_face",
                lens_.with_lens({{"V", vector_width}, {"STREAM", 0}, {"OUTPUT", static_cast<int>(result.output)}})),
            range_of(block.width(), block.height(), vector_width), planes_, depth, found.image,
            faces_->places.on(device_), result.image, grid, p, from);
    }

    InverseDepthError error_on(const Face& face) const {
        const InverseDepthError stored = stored_error(stored_.camera, stored_.storage);
        return {stored.constant * static_cast<float>(face.most), stored.linear + plane_roundings,
                stored.quadratic / static_cast<float>(face.least)};
    }

    void run(const FaceCall& call, const PixelBox& wanted, const std::vector<Wanted>& results) {
        const auto table = positions_for(device_, stored_.camera, call.face, call.part);
        runtime::Scratch scratch(device_);
        const Eigen::Matrix3d straight = Eigen::Matrix3d::Identity();
        const Image depth = image_of_inverse_depth(scratch, call.part.width(), call.part.height());
        SsaoOptions options = face_options(options_);
        options.normals = image_of_inverse_depth(scratch, call.part.width(), call.part.height());
        onto_face(call, *table, Onto::depth, depth, depth, options.normals, straight);
        if (has_normals()) {
            options.normals = scratch.image(Element::f32, call.layout(3));
            Eigen::Matrix3d turn = call.face.turn;
            if (options_.normals && options_.normals_space == Space::world)
                turn *= stored_.camera.view->topLeftCorner<3, 3>().inverse().transpose();
            onto_face(call, *table, Onto::direction, normals_, options.normals, depth, turn);
        }
        if (const auto* map = thickness_as<Image>(options_)) {
            const Image there = scratch.image(Element::f32, call.layout());
            onto_face(call, *table, Onto::number, *map, there, depth, straight);
            options.thickness = there;
        } else if (thickness_as<StoredDepth>(options_)) {
            const Image there = scratch.image(Element::f32, call.layout());
            onto_face(call, *table, Onto::back, back_, there, depth, straight);
            options.thickness = call.stored(there);
        }
        const PixelBox inner = call.face.inner;
        const Region computed{inner.left - call.part.left, inner.top - call.part.top, inner.width(), inner.height()};
        options.region = computed;
        std::vector<Wanted> found;
        for (const Wanted& result : results)
            found.push_back({result.output, scratch.image(Element::f32, {computed.width, computed.height,
                                                                         channels_of(result.output)})});
        const InverseDepthError error = error_on(call.face);
        const OnFace face{error, depth, call.covered->blocks.on(device_), call.covered->block_columns};
        occlude_in_bands(call.stored(depth), radius_, options, found, &face);
        for (std::size_t i = 0; i < results.size(); ++i)
            for (const Piece& piece : pieces_of(call.face.block, wanted))
                from_face(call, piece, computed, depth, found[i], results[i], wanted, error);
    }

    const StoredDepth& stored_;
    double radius_;
    const SsaoOptions& options_;
    const Device& device_;
    runtime::Scratch scratch_;
    KernelLens lens_;
    std::shared_ptr<const LensFaces> faces_;
    bool fitted_;
    int turn_;
    Image planes_, normals_, back_;
};

} // namespace

void occlude_through_lens(const StoredDepth& stored, double radius, const SsaoOptions& options,
                          const std::vector<Wanted>& results) {
    ThroughLens(stored, radius, options).run(results);
}

std::size_t bytes_through_lens(const Tile& tile, const SsaoOptions& options) {
    const Camera& camera = tile.camera;
    const bool along_axis = counted_along(camera) == Along::axis;
    std::size_t most = 0;
    for (const Face& face : lens::faces_of(lens::CameraLens(camera), camera.width, camera.height, along_axis))
        most = std::max(most, bytes_of_face({face, lens::with_margin(face, 1)}, options, true));
    return bytes_of_planes(tile.pixels.width, tile.pixels.height) + most;
}

} // namespace fathom

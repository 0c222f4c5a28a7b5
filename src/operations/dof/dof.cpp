// Depth of field, in bands of rows: circles, planes of layer and colour, then layer by layer from front to back.

#include <fathom/dof.hpp>

#include "camera/circle_form.hpp"
#include "camera/form.hpp"
#include "description/check.hpp"
#include "description/dof.hpp"
#include "operations/bands.hpp"
#include "operations/cheapest.hpp"
#include "operations/dof/dof_aperture.hpp"
#include "operations/dof/dof_layers.hpp"
#include "operations/dof_masks/dof_masks.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/launch.hpp"
#include "runtime/scratch.hpp"
#include "runtime/table.hpp"

#include <fathom/tiles.hpp>

#include <algorithm>
#include <cmath>

namespace fathom {
namespace {

using params::u32;

// Running sums of colours up to this are off by 2^-24 of it times some hundred pixels at most.
constexpr float knee = 4;

// `balanced` guesses what lies behind a surface from what is seen up to so far beside it, pixels.
constexpr float guess_px = 8;

// Behind what has a larger circle than that it guesses less, and nothing behind twice as large ones.
constexpr double guessed_circle = 12;

float guessed_layers(const LayerScale& scale) {
    int away = 0;
    while (scale.circle(scale.middle + away) < guessed_circle)
        ++away;
    return static_cast<float>(away);
}

void check_clean_plate(const CleanPlate& clean_plate, const StoredDepth& stored, const Image& color) {
    check_stored(clean_plate.depth);
    check_picture(stored, {"the clean plate", clean_plate.color});
    const Image& depth = clean_plate.depth.image;
    check_device(stored, {"the clean plate's depth", depth});
    require(depth.width() == stored.image.width() && depth.height() == stored.image.height(),
            "the clean plate's depth is ", depth.width(), " x ", depth.height(), " pixels, the clean plate ",
            stored.image.width(), " x ", stored.image.height());
    require(clean_plate.color.channels() == color.channels(), "the clean plate has ", clean_plate.color.channels(),
            " channels, color ", color.channels());
    require(clean_plate.depth.x == stored.x && clean_plate.depth.y == stored.y,
            "the clean plate's depth is of another region than the depth");
}

std::string percent_of(double part) {
    return text(std::round(1000 * part) / 10, " %");
}

void check(const StoredDepth& stored, const Image& color, const DofOptions& options) {
    check_stored(stored);
    if (stored.camera.lens) {
        require(has_plane_in_focus(stored.camera), "the camera has the lens ", to_string(stored.camera.lens->law),
                ", whose circles of confusion have another shape in each part of the image; dof takes straight rays "
                "and brown, so undo the distortion (docs/cameras.md)");
        const double off = circle_deformation(stored.camera);
        require(off <= dof_shape_error, "the lens brown makes circles of confusion ", percent_of(off),
                " wider or narrower in some part of the image than on its axis; dof takes ",
                percent_of(dof_shape_error), " at most, so undo the distortion (docs/cameras.md)");
    }
    check_picture(stored, {"color", color}, upsample_to_picture);
    if (options.clean_plate)
        check_clean_plate(*options.clean_plate, stored, color);
    describe(description::Check{}, options);
    if (options.aperture.ratio != 1 && options.aperture.blades != 0)
        throw std::invalid_argument(description::excluding("ratio", "blades"));
    constexpr int widest = ENTRY_COLUMN_MASK * params::dof_tile_columns;
    require<ImageTooLarge>(stored.image.width() <= widest, "an image of ",
                           ImageSize{stored.image.width(), stored.image.height()}, " pixels: at most ", widest,
                           " in a row");
}

// As a float, the aspect of a circle is the same on every host: long double and its tangents are not.
float aspect_of(const Camera& camera) {
    const PixelScale pixels = pixel_scale(camera);
    return static_cast<float>(pixels.y / pixels.x);
}

params::blur_params blur_parameters(const Tile& tile, const LayerScale& scale, const DofOptions& options) {
    const Region& pixels = tile.pixels;
    const int left = pixels.x % params::dof_tile_columns, top = pixels.y % params::dof_tile_rows;
    const auto whole = [](int size, int tile) { return (size + tile - 1) / tile * tile; };
    const int columns = whole(pixels.width + left, params::dof_tile_columns);
    const int rows = whole(pixels.height + top, params::dof_tile_rows), stride = columns + 2 * params::dof_margin;
    return {.width = static_cast<u32>(pixels.width),
            .height = static_cast<u32>(pixels.height),
            .left = static_cast<u32>(left),
            .top = static_cast<u32>(top),
            .columns = static_cast<u32>(columns),
            .rows = static_cast<u32>(rows),
            .stride = static_cast<u32>(stride),
            .plane = static_cast<u32>(stride) * static_cast<u32>(rows), // of a band: it wraps for an image of many
            .middle = static_cast<u32>(scale.middle),
            .per_octave = static_cast<float>(scale.spacing.per_octave),
            .offset = static_cast<float>(scale.spacing.offset),
            .bend = static_cast<float>(scale.spacing.bend),
            .largest = static_cast<float>(options.max_coc_px),
            .knee = knee,
            .area = static_cast<float>(aperture_area(options.aperture) / 4) * aspect_of(tile.camera),
            .state_row = 0,
            .state_plane = static_cast<u32>(stride) * static_cast<u32>(rows),
            .guessed = guessed_layers(scale),
            .areas = 0};
}

params::grid_params grid(const Image& source, const Image& target) {
    return grid_parameters(source, target, 0, source.width());
}

// Planes of the state: T, colour, what is hidden and its colour, T before the layer. Then follow the part of T that is
// left to wide circles or, where accurate, the moments of T now and before the layer.
int state_planes(int channels, Quality quality) {
    return 2 * channels + 3 + (quality == Quality::accurate ? 4 : 1);
}

// Is what lies behind a pixel's surface looked for?
bool looks_behind(const DofOptions& options) {
    return std::get<Quality>(options.quality) != Quality::fast;
}

// The device's images of one band, which all bands use in turn, and what every kernel of a call is built for.
struct Blur {
    Device device;
    params::blur_params p;
    int element, vector_width;
    bool clean_plate, looks_behind;
    LayerPlanOptions plan;
    bool alone = true;           // is there one band only?
    std::size_t image_bytes = 0; // of the images below
    Image planes = {}, state = {}, tiles = {};
    Image blocks = {}, hiding = {}; // where what lies behind is looked for

    runtime::Kernel& kernel(const char* name, runtime::Defines defines, bool stream = false) const {
        defines.insert(defines.end(), {{"V", vector_width}, {"STREAM", stream}, {"CHANNELS", plan.channels}});
        return runtime::kernel(device, name, defines);
    }
    template <typename... Arguments>
    void launch(const char* name, const runtime::Defines& defines, runtime::Range range,
                const Arguments&... arguments) const {
        runtime::launch(device, kernel(name, defines), range, arguments...);
    }
    bool behind() const { return clean_plate || looks_behind; } // have pixels a second surface?
    bool accurate() const { return plan.quality == Quality::accurate; }
    std::size_t vectors(u32 columns) const { return columns / static_cast<u32>(vector_width); }
    int across() const { return static_cast<int>(p.columns) / params::dof_tile_columns; }
    int hiding_across() const { return static_cast<int>(p.columns) / params::dof_hiding_columns; }
    int down() const { return static_cast<int>(p.rows) / params::dof_tile_rows; }
    int state_rows() const { return static_cast<int>(p.state_plane / p.stride); }
};

// A sixteenth of a budget is for tables.
std::size_t without_tables(std::size_t budget) {
    return budget - budget / 16;
}

// Bytes between the passes.
struct DofBytes {
    std::size_t band = std::size_t{200} << 20;        // that the images of a band of rows take, where that is enough
    std::size_t layer = sizeof(float) * layer_floats; // that a layer's own passes hand to one another, twice
};

// Those that keep to a device's budget.
DofBytes dof_bytes(std::size_t budget) {
    DofBytes bytes;
    if (budget == 0)
        return bytes;
    bytes.layer = std::clamp(budget / 8, std::size_t{2} << 20, bytes.layer);
    const std::size_t images = without_tables(budget);
    bytes.band = std::min(bytes.band, images > 2 * bytes.layer ? images - 2 * bytes.layer : 0);
    return bytes;
}

// Throws: Error if a band's images, and what a layer's own passes hand to one another, take more than the device's budget.
void check_budget(const Device& device, const ImageSize& size, std::size_t images, std::size_t layer) {
    const std::size_t budget = device.options().memory_budget;
    constexpr std::size_t step = std::size_t{1} << 20;
    const auto fits = [&](std::size_t bytes) {
        return images + 2 * std::max(dof_bytes(bytes).layer, layer) <= without_tables(bytes);
    };
    if (budget == 0 || fits(budget))
        return;
    std::size_t enough = (budget / step + 1) * step;
    while (!fits(enough))
        enough += step;
    refuse_budget(text("dof of ", size, " pixels with circles of this size"), enough);
}

int words_of(int tiles_across, int tiles_down) {
    return static_cast<int>(TileBits{}.size()) * tiles_across * tiles_down;
}

// Of the first surfaces; or, for tiles of dof_hiding_columns, of what hides something and of what that hides.
std::vector<TileBits> tile_bits(const Blur& blur, const Image& tiles, int across, bool hiding) {
    blur.launch("dof_tiles", {{"HIDING", hiding}}, range_of(across, blur.down()), blur.planes, tiles, blur.p);
    return runtime::on_host<TileBits>(tiles.region(0, 0, words_of(across, blur.down()), 1));
}

// Gives every pixel its second surface: what lies behind it.
void look_behind(const Blur& blur, int farthest) {
    constexpr u32 side = params::dof_behind_block;
    const params::behind_params b{.block_columns = blur.p.columns / side,
                                  .block_rows = blur.p.rows / side,
                                  .farthest = static_cast<float>(farthest),
                                  .vertical = 1 / static_cast<float>(blur.plan.aspect),
                                  .most = guess_px};
    runtime::Scratch scratch(blur.device); // what a layer's passes hand to one another may take it again
    const Image inner = scratch.image(Element::f32, {static_cast<int>(blur.p.stride), static_cast<int>(blur.p.rows)});
    blur.launch("dof_inner", {}, {b.block_columns, b.block_rows}, blur.planes, inner, blur.blocks, blur.p, b);
    const char* const look = blur.accurate() ? "dof_behind" : "dof_guess";
    blur.launch(look, {{"CLEAN_PLATE", blur.clean_plate}}, {blur.p.stride / side, b.block_rows}, blur.planes, inner,
                blur.blocks, blur.p, b);
}

DofMasksOptions circle_options(const DofOptions& options) {
    return {.sky = options.sky, .max_coc_px = options.max_coc_px};
}

// The circles of a picture's pixels, as the options have them, and its planes, which take their places.
void cut_into_planes(const Blur& blur, const StoredDepth& stored, const Image& color, const CircleOfConfusion& coc,
                     const DofOptions& options, bool clean_plate) {
    const params::blur_params& p = blur.p;
    const int surface = clean_plate ? (1 + blur.plan.channels) * static_cast<int>(p.rows) : 0;
    const Image circles =
        blur.planes.region(params::dof_margin + static_cast<int>(p.left), surface + static_cast<int>(p.top),
                           stored.image.width(), stored.image.height());
    dof_masks(stored, {.coc = circles}, coc, circle_options(options));
    const runtime::Defines defines{{"ELEMENT", element_define(color.element())}, {"CLEAN_PLATE", clean_plate}};
    blur.launch("dof_planes", defines, {blur.vectors(p.stride), p.rows}, color, blur.planes, grid(color, color), p);
}

// The fragment of a nearer surface that antialiasing mixed into a farther one moves to the nearer one, or into the cleared state.
void unmix(const Blur& blur, const Image& color) {
    for (const u32 gain : {0u, 1u})
        blur.launch("dof_unmix", {{"ELEMENT", element_define(color.element())}},
                    {static_cast<std::size_t>(blur.across()), static_cast<std::size_t>(blur.down())}, blur.planes,
                    color, blur.state, blur.tiles, grid(color, color), blur.p, params::unmix_params{.gain = gain});
}

// The tiles of the first surfaces.
std::vector<TileBits> cut_into_surfaces(const Blur& blur, const StoredDepth& stored, const Image& color,
                                        const CircleOfConfusion& coc, const DofOptions& options) {
    cut_into_planes(blur, stored, color, coc, options, false);
    unmix(blur, color);
    if (options.clean_plate)
        cut_into_planes(blur, options.clean_plate->depth, options.clean_plate->color, coc, options, true);
    std::vector<TileBits> tiles = tile_bits(blur, blur.tiles, blur.across(), false);
    if (blur.looks_behind)
        look_behind(blur, farthest_layer(tiles));
    return tiles;
}

void clear(const Blur& blur) {
    const int planes = state_planes(blur.plan.channels, blur.plan.quality);
    runtime::launch(blur.device,
                    blur.kernel("dof_clear", {{"PLANES", planes}, {"WIDE", !blur.accurate()}},
                                worth_streaming(blur.state, blur.vector_width)),
                    {blur.vectors(blur.p.stride), static_cast<std::size_t>(blur.state_rows())}, blur.state, blur.p);
}

// Do the pixels that a plan's tiles see have a second surface, and is it a guess? BEHIND of the kernels.
enum class Behind { none, known, guessed };

// What the passes of a plan read, and what they hand to one another.
struct PassImages {
    Image lists, starts, spans, halves, taps, weights;
    Image strips = {}, cell_sums = {}; // of strips or cells
};

void lay_cells(const Blur& blur, const LayerPass& pass, const PassImages& images, Behind behind) {
    const runtime::Defines cell{{"FILL", pass.fill}, {"BEHIND", static_cast<int>(behind)}, {"CELL", pass.cell}};
    const Image& cells = images.strips;
    constexpr std::size_t pixels = 16; // of an item of dof_cell_layer
    blur.launch("dof_cells", cell, {pass.cells.blocks, 1}, blur.planes, blur.tiles, images.lists, cells, blur.p,
                pass.cells);
    blur.launch("dof_cell_sums", {{"FILL", pass.fill}}, {pass.cells.sum_blocks * (pass.fill ? 2u : 1u), 1}, cells,
                images.lists, images.starts, images.weights, images.cell_sums, pass.cells);
    blur.launch("dof_cell_layer", cell,
                {pass.cells.tiles * params::dof_tile_columns / pixels * params::dof_tile_rows, 1}, blur.planes,
                images.cell_sums, images.lists, blur.state, blur.p, pass.cells);
}

// Of pixels that are read directly, or of strips that a launch of their own makes.
void lay_gathered(const Blur& blur, const LayerPass& pass, const PassImages& images, Behind behind) {
    const auto of_behind = static_cast<int>(behind);
    const runtime::Range strips_range{pass.strips.tiles, static_cast<std::size_t>(params::dof_tile_rows) /
                                                             std::max(pass.strips.pitch, 1u)};
    const std::size_t pixels =
        pass.gather.tiles * blur.vectors(params::dof_tile_columns) * params::dof_tile_rows; // in vectors
    const Image& source = pass.direct ? blur.planes : images.strips;
    if (pass.parts) {
        if (!pass.direct)
            blur.launch("dof_part_strips", {{"BRIGHT", pass.bright}}, strips_range, blur.planes, images.lists,
                        images.strips, blur.p, pass.strips);
        blur.launch("dof_parts", {{"DIRECT", pass.direct}, {"BRIGHT", pass.bright}}, {pixels, 1}, source, images.lists,
                    images.starts, pass.direct ? images.taps : images.spans, images.halves, blur.state, blur.p,
                    pass.gather, pass.part);
        return;
    }
    if (!pass.direct)
        blur.launch("dof_strips", {{"FILL", pass.fill}, {"BRIGHT", pass.bright}, {"BEHIND", of_behind}}, strips_range,
                    blur.planes, blur.tiles, images.lists, images.strips, blur.p, pass.strips);
    blur.launch("dof_gather",
                {{"FILL", pass.fill}, {"BRIGHT", pass.bright}, {"DIRECT", pass.direct}, {"BEHIND", of_behind}},
                {pixels / params::dof_rows_at_once, 1}, blur.planes, blur.tiles, source, images.lists, images.starts,
                images.spans, blur.state, blur.p, pass.gather);
}

void run(const Blur& blur, const LayerPlan& plan, Behind behind) {
    if (plan.passes.empty())
        return;
    runtime::Scratch scratch(blur.device); // the next plan's launches may take it again
    const auto table = [&](Element element, auto values) {
        if (values.empty()) // no pass reads it
            values.emplace_back();
        return runtime::table(blur.device, element, values).on(blur.device);
    };
    const auto halves =
        blur.accurate() ? aperture_halves(blur.plan.aperture, blur.plan.upright) : std::vector<std::array<float, 4>>(1);
    PassImages images{.lists = table(Element::u32, plan.lists),
                      .starts = table(Element::u32, plan.starts),
                      .spans = table(Element::f32, plan.spans),
                      .halves = table(Element::f32, halves),
                      .taps = table(Element::f32, plan.taps),
                      .weights = table(Element::f32, plan.weights)};
    constexpr int row = 4096;
    const auto floats = [&](std::size_t count) {
        return scratch.image(Element::f32, {row, static_cast<int>((count + row - 1) / row) + 1});
    };
    // What each band needs differs. With as much for all of them, the pool keeps no other sizes.
    const auto room = [&](std::size_t needed) {
        return floats(blur.alone || needed == 1 ? needed : std::max(needed, blur.plan.most_floats));
    };
    const std::size_t needed = std::max(plan.strip_elements, plan.cell_elements);
    check_budget(blur.device, {static_cast<int>(blur.p.width), static_cast<int>(blur.p.height)}, blur.image_bytes,
                 sizeof(float) * needed);
    images.strips = room(needed);
    images.cell_sums = room(plan.cell_elements);
    for (const LayerPass& pass : plan.passes)
        if (pass.cell > 1)
            lay_cells(blur, pass, images, behind);
        else
            lay_gathered(blur, pass, images, behind);
}

// Blurs the rows that belong to the state, of an image that holds what they need besides.
void blur_band(Blur call, const StoredDepth& stored, const Image& color, const Image& result,
               const CircleOfConfusion& coc, const DofOptions& options) {
    clear(call);
    std::vector<TileBits> tiles = cut_into_surfaces(call, stored, color, coc, options);
    if (!any_with(tiles, area_bit))
        call.p.areas = 0; // same bits, less to read
    std::vector<TileBits> hiding;
    if (call.behind()) {
        hiding = tile_bits(call, call.hiding, call.hiding_across(), true);
        add_hidden(tiles, hiding);
        call.tiles = runtime::table(call.device, Element::u32, tiles).on(call.device);
    }
    std::vector<unsigned char> made(tiles.size());
    const auto across = static_cast<std::ptrdiff_t>(call.across());
    const auto first = made.begin() + across * (call.p.state_row / params::dof_tile_rows);
    std::fill(first, first + across * (call.state_rows() / params::dof_tile_rows), 1);
    LayerPlanOptions& plan = call.plan;
    const auto lay = [&](Behind behind) { run(call, layer_plan(tiles, call.across(), plan), behind); };
    plan.only = made;
    if (call.accurate()) { // keeps parts of the lens where something hidden is seen, and there only
        const std::vector<unsigned char> seeing = tiles_seeing(hiding, call.hiding_across(), plan);
        std::ranges::transform(made, seeing, plan.only.begin(), [](bool own, bool sees) { return own && sees; });
        lay(Behind::known);
        std::ranges::transform(made, seeing, plan.only.begin(), [](bool own, bool sees) { return own && !sees; });
        plan.open = true;
        lay(Behind::none);
    } else {
        lay(call.looks_behind ? Behind::guessed : call.clean_plate ? Behind::known : Behind::none);
    }
    call.launch("dof", {{"ELEMENT", call.element}},
                {call.vectors(call.p.columns), static_cast<std::size_t>(call.state_rows())}, call.state, color, result,
                grid(color, result), call.p);
}

LayerScale scale_of(const DofOptions& options) {
    return layer_scale(layer_spacing(std::get<Quality>(options.quality), options.aperture), options.max_coc_px);
}

// Pixels along a row beyond which nothing decides on a pixel, if no circle is larger than `widest`; but for those that a tile has.
double pixels_beyond(const DofOptions& options, double widest) {
    // What lies behind a pixel is looked for as far as a ray moves between the largest circles, and a pixel.
    const bool accurate = std::get<Quality>(options.quality) == Quality::accurate;
    const double behind = accurate ? widest + 1 : looks_behind(options) ? guess_px + 1 : 0;
    return scale_of(options).farthest_circle(widest) / 2 + behind;
}

// Planes of a band: of the surfaces that it reads, the last of them areas, of what lies behind them, and of what it lays.
struct PlaneCounts {
    int surfaces, behind, laid;
};

PlaneCounts plane_counts(int channels, const DofOptions& options) {
    const auto quality = std::get<Quality>(options.quality);
    const bool behind = looks_behind(options); // tables of blocks and tiles
    return {.surfaces = (options.clean_plate || behind ? 2 : 1) * (channels + 1) + 1,
            .behind = behind ? 1 : 0,
            .laid = state_planes(channels, quality)};
}

// Rows of tiles.
RowNeeds rows_of(const params::blur_params& whole, const PlaneCounts& planes, float aspect, double beyond) {
    constexpr int tile_rows = params::dof_tile_rows;
    const int down = static_cast<int>(whole.rows) / tile_rows,
              halo = static_cast<int>(std::ceil((beyond * static_cast<double>(aspect) + dof_halo_rows) / tile_rows));
    const auto bytes = [=, row = sizeof(float) * whole.stride * tile_rows](int read, int made) {
        return row * static_cast<std::size_t>((planes.surfaces + planes.behind) * read + planes.laid * made);
    };
    return {.begin = 0, .end = down, .height = down, .reaches = {halo}, .bytes = bytes, .least = std::max(halo / 4, 1)};
}

// Images for bands that read and make at most so many rows of tiles.
void take_images(Blur& call, runtime::Scratch& scratch, const PlaneCounts& counts, int read, int made) {
    constexpr int tile_rows = params::dof_tile_rows, block = params::dof_behind_block;
    const auto planes = [&](int count, int tiles_down) {
        return scratch.image(Element::f32, {static_cast<int>(call.p.stride), count * tile_rows * tiles_down});
    };
    call.planes = planes(counts.surfaces, read);
    call.state = planes(counts.laid, made);
    call.tiles = scratch.image(Element::u32, {words_of(call.across(), read), 1});
    if (call.behind())
        call.hiding = scratch.image(Element::u32, {words_of(call.hiding_across(), read), 1});
    if (call.looks_behind)
        call.blocks =
            scratch.image(Element::f32, {static_cast<int>(call.p.columns) / block, 4 * tile_rows * read / block + 1});
}

// Blurs a picture that has a circle somewhere, `widest` the widest one.
void blur_circles(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& coc,
                  const DofOptions& options, double widest) {
    const Device& device = stored.image.device();
    const DofBytes allowed = dof_bytes(device.options().memory_budget);
    const LayerScale scale = scale_of(options);
    const params::blur_params whole = blur_parameters(stored, scale, options);
    const float aspect = aspect_of(stored.camera);
    Blur call{.device = device,
              .p = whole,
              .element = element_define(color.element()),
              .vector_width = device.options().vector_width,
              .clean_plate = options.clean_plate.has_value(),
              .looks_behind = looks_behind(options),
              .plan = {.aperture = options.aperture,
                       .scale = scale,
                       .aspect = static_cast<double>(aspect),
                       .upright = stored.camera.rows == Rows::top_down,
                       .quality = std::get<Quality>(options.quality),
                       .channels = color.channels(),
                       .most_floats = allowed.layer / sizeof(float)}};
    constexpr int tile_rows = params::dof_tile_rows;
    const PlaneCounts counts = plane_counts(color.channels(), options);
    const RowNeeds rows_of_tiles = rows_of(whole, counts, aspect, pixels_beyond(options, widest));
    const std::vector<Band> all = bands(rows_of_tiles, allowed.band);
    call.alone = all.size() == 1;
    const int read = most_read(all), made = most_made(all);
    const std::size_t reads = rows_of_tiles.bytes(read, 0), lays = rows_of_tiles.bytes(0, made);
    const ImageSize size{stored.image.width(), stored.image.height()};
    constexpr std::size_t most = sizeof(float) << 31; // elements are counted in 32 bits
    require<ImageTooLarge>(reads < most && lays < most, "an image of ", size,
                           " pixels is too wide for circles of this size; blur it in parts");
    call.image_bytes = reads + lays;
    check_budget(device, size, call.image_bytes, 0);

    runtime::Scratch scratch(device);
    take_images(call, scratch, counts, read, made);
    const auto top = static_cast<int>(whole.top), height = stored.image.height();
    for (const Band& band : all) {
        const int first = std::max(tile_rows * band.first - top, 0),
                  rows = std::min(tile_rows * band.last - top, height) - first;
        const auto part = [&](const auto& image) { return image.region(0, first, color.width(), rows); };
        const StoredDepth here = part(stored);
        DofOptions here_options = options;
        if (options.clean_plate)
            here_options.clean_plate = CleanPlate{part(options.clean_plate->color), part(options.clean_plate->depth)};
        call.p = blur_parameters(here, scale, options);
        call.p.state_row = to_u32(tile_rows * (band.begin - band.first));
        call.p.state_plane = whole.stride * to_u32(tile_rows * (band.end - band.begin));
        call.p.areas = call.p.plane * to_u32(counts.surfaces - 1);
        blur_band(call, here, part(color), part(result), coc, here_options);
    }
}

void blur(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& coc,
          const DofOptions& options) {
    if (coc.k == 0 && coc.g == 0) {
        check_circle(coc, depth_form(straightened(stored.camera), stored.storage));
        return runtime::copy(color, result);
    }
    const auto widest = [&](const StoredDepth& depth) {
        return static_cast<double>(widest_coc(depth, coc, circle_options(options)));
    };
    const double seen = widest(stored);
    if (seen <= largest_in_focus(layer_spacing(std::get<Quality>(options.quality), options.aperture)))
        return runtime::copy(color, result);
    blur_circles(stored, color, result, coc, options,
                 options.clean_plate ? std::max(seen, widest(options.clean_plate->depth)) : seen);
}

void check_dof_result(const StoredDepth& stored, const Image& color, const Image& result, const DofOptions& options) {
    const Image none;
    check_result(stored, {"the result", result}, color.element(), {color.width(), color.height(), color.channels()},
                 {{"the stored depth", stored.image},
                  {"color", color},
                  {"the clean plate", options.clean_plate ? options.clean_plate->color : none},
                  {"the clean plate's depth", options.clean_plate ? options.clean_plate->depth.image : none}});
}

DofOptions settled(const Tile& tile, const DofOptions& options) {
    describe(description::Check{}, options);
    return std::holds_alternative<MaxError>(options.quality) ? chosen(tile, options) : options;
}

} // namespace

void dof(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& circle,
         const DofOptions& options, const Launch& launch) {
    check(stored, color, options);
    if (std::holds_alternative<MaxError>(options.quality))
        return dof(stored, color, result, circle, chosen(stored, options), launch);
    check_dof_result(stored, color, result, options);
    const runtime::Launched launched(stored.image.device(), launch);
    blur(stored, color, result, circle, options);
    launched.done();
}

Image dof(const StoredDepth& stored, const Image& color, const CircleOfConfusion& circle, const DofOptions& options,
          const Launch& launch) {
    check(stored, color, options);
    return run_into_new_images(description::DofCall{.color = color, .circle = circle, .options = options}, stored,
                               launch)
        .result;
}

Reach reach(const Tile& tile, const DofOptions& asked, double widest_coc_px) {
    const DofOptions options = settled(tile, asked);
    const double pixels = pixels_beyond(options, std::min(widest_coc_px, options.max_coc_px));
    const auto whole = [](double count) { return static_cast<int>(std::ceil(count)); };
    return {whole(pixels) + dof_halo_columns,
            whole(pixels * static_cast<double>(aspect_of(tile.camera))) + dof_halo_rows};
}

std::size_t bytes(const Tile& tile, int channels, const DofOptions& asked, double widest_coc_px) {
    const DofOptions options = settled(tile, asked);
    const RowNeeds rows =
        rows_of(blur_parameters(tile, scale_of(options), options), plane_counts(channels, options),
                aspect_of(tile.camera), pixels_beyond(options, std::min(widest_coc_px, options.max_coc_px)));
    constexpr DofBytes allowed;
    const std::vector<Band> all = bands(rows, allowed.band);
    const std::size_t images = rows.bytes(most_read(all), most_made(all)) + 2 * allowed.layer;
    return images + images / 15; // and tables
}

} // namespace fathom

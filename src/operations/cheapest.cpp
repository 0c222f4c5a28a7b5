// The cheapest method that meets a tolerance, from tables of measured errors and times that are built in.

#include "operations/cheapest.hpp"

#include "operations/ssao.hpp"
#include "require.hpp"

#include <algorithm>
#include <charconv>
#include <map>

/// By name of file: the rows of the tables in docs/performance that this file needs.
const std::map<std::string, std::string>& fathom_performance_tables();

namespace fathom {
namespace {

// Cells of a line; those with commas within stand between quotes.
std::vector<std::string> cells_of(std::string_view line) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
        if (c == '"')
            quoted = !quoted;
        else if (c == ',' && !quoted)
            cells.emplace_back();
        else if (c != '\r')
            cells.back() += c;
    }
    return cells;
}

using Row = std::map<std::string, std::string>;

std::vector<Row> rows_of(std::string_view csv) {
    std::vector<Row> rows;
    std::vector<std::string> names;
    while (!csv.empty()) {
        const std::size_t end = std::min(csv.find('\n'), csv.size());
        const std::vector<std::string> cells = cells_of(csv.substr(0, end));
        csv.remove_prefix(std::min(end + 1, csv.size()));
        if (names.empty()) {
            names = cells;
            continue;
        }
        Row& row = rows.emplace_back();
        for (std::size_t i = 0; i < std::min(names.size(), cells.size()); ++i)
            row[names[i]] = cells[i];
    }
    return rows;
}

const std::string& cell(const Row& row, const char* column) {
    const auto found = row.find(column);
    require(found != row.end(), text("a table of errors or times has no column '", column, "'"));
    return found->second;
}

// Nothing where nothing was measured. Does not depend on the locale.
std::optional<double> number(const Row& row, const char* column) {
    const std::string& digits = cell(row, column);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc() && end == digits.data() + digits.size() ? std::optional(value) : std::nullopt;
}

template <typename Value, std::size_t count>
std::optional<Value> named(std::string_view method, const std::pair<const char*, Value> (&names)[count]) {
    for (const auto& [name, value] : names)
        if (method == name)
            return value;
    return std::nullopt;
}

// What a table calls "2 x 16" has no name of its own.
bool set_slices(const std::string& method, SsaoOptions& options) {
    std::istringstream words(method);
    int slices = 0, samples = 0;
    std::string by;
    if (!(words >> slices >> by >> samples) || by != "x" || !words.eof())
        return false;
    options.slices = slices;
    options.samples = samples;
    return true;
}

constexpr std::string_view half_resolution = ", half resolution"; // behind what it is of

bool set(const std::string& method, SsaoOptions& options) {
    options.half_resolution = method.ends_with(half_resolution);
    const std::string of = method.substr(0, method.size() - (options.half_resolution ? half_resolution.size() : 0));
    const auto quality =
        named<Quality>(of, {{"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}});
    options.quality = quality.value_or(Quality::balanced);
    return quality || set_slices(of, options);
}

bool set(const std::string& method, DofOptions& options) {
    const auto quality = named<BlurQuality>(
        method,
        {{"fast", BlurQuality::fast}, {"standard", BlurQuality::standard}, {"accurate", BlurQuality::accurate}});
    options.quality = quality.value_or(BlurQuality::standard);
    return quality.has_value();
}

bool set(const std::string& method, NormalsOptions& options) {
    const auto way = named<NormalMethod>(
        method, {{"neighbours", NormalMethod::neighbours}, {"least squares", NormalMethod::least_squares}});
    options.method = way.value_or(NormalMethod::automatic);
    return way.has_value();
}

template <typename Options>
bool stands_for(const std::string& method) {
    Options options;
    return set(method, options);
}

bool is_a_choice(const Row& row) {
    const std::string &operation = cell(row, "operation"), &method = cell(row, "method");
    return cell(row, "kind") == "library" && ((operation == "ssao" && stands_for<SsaoOptions>(method)) ||
                                              (operation == "dof" && stands_for<DofOptions>(method)) ||
                                              (operation == "normals" && stands_for<NormalsOptions>(method)));
}

bool same_method(const Row& one, const Row& other) {
    return std::ranges::all_of(std::initializer_list<const char*>{"operation", "method", "storage"},
                               [&](const char* column) { return cell(one, column) == cell(other, column); });
}

void take_worse(MeasuredMethod& known, const MeasuredMethod& other) {
    if (other.error > known.error) {
        known.error = other.error;
        known.scene = other.scene;
    }
    if (other.ns_per_pixel > known.ns_per_pixel) {
        known.ns_per_pixel = other.ns_per_pixel;
        known.device = other.device;
    }
}

// What depth is as coarse as.
std::string storage_of(const StoredDepth& stored) {
    return to_string(stored.camera.depth_bits.value_or(32) <= 16 ? Storage::uint16 : stored.storage);
}

template <typename Options>
Options with_choice(const char* operation, const StoredDepth& stored, Options options) {
    set(cheapest_method(operation, stored, *options.max_error).method, options);
    options.max_error.reset();
    return options;
}

} // namespace

std::vector<Measured> measured_methods(std::string_view errors_csv, std::string_view times_csv) {
    const std::vector<Row> times = rows_of(times_csv);
    std::vector<Measured> measured;
    for (const Row& row : rows_of(errors_csv)) {
        if (!is_a_choice(row))
            continue;
        const auto time = std::ranges::find_if(times, [&](const Row& other) { return same_method(row, other); });
        const std::optional<double> error = number(row, cell(row, "operation") == "normals" ? "mean" : "rms");
        if (time == times.end() || !error || !number(*time, "ms"))
            continue;
        const double pixels = number(*time, "width").value_or(0) * number(*time, "height").value_or(0);
        const Measured found{cell(row, "operation"),
                             cell(row, "storage"),
                             {cell(row, "method"), *error, cell(row, "scene"), *number(*time, "ms") * 1e6 / pixels,
                              cell(*time, "device")}};
        const auto known = std::ranges::find_if(measured, [&](const Measured& m) {
            return m.operation == found.operation && m.storage == found.storage &&
                   m.choice.method == found.choice.method;
        });
        if (known == measured.end())
            measured.push_back(found);
        else
            take_worse(known->choice, found.choice);
    }
    return measured;
}

std::vector<MeasuredMethod> choices(std::span<const Measured> measured, std::string_view operation,
                                    std::string_view storage) {
    const bool has_storage = std::ranges::any_of(
        measured, [&](const Measured& m) { return m.operation == operation && m.storage == storage; });
    std::vector<MeasuredMethod> list;
    for (const Measured& m : measured) {
        if (m.operation != operation || (has_storage && m.storage != storage))
            continue;
        const auto known = std::ranges::find(list, m.choice.method, &MeasuredMethod::method);
        if (known == list.end())
            list.push_back(m.choice);
        else
            take_worse(*known, m.choice);
    }
    return list;
}

std::optional<MeasuredMethod> cheapest_method(std::span<const MeasuredMethod> choices, double max_error) {
    std::optional<MeasuredMethod> best;
    for (const MeasuredMethod& choice : choices) {
        const bool cheaper =
            !best || std::pair(choice.ns_per_pixel, choice.error) < std::pair(best->ns_per_pixel, best->error);
        if (choice.error <= max_error && cheaper)
            best = choice;
    }
    return best;
}

MeasuredMethod cheapest_method(const std::string& operation, const StoredDepth& stored, double max_error) {
    static const std::vector<Measured> measured =
        measured_methods(fathom_performance_tables().at("errors.csv"), fathom_performance_tables().at("presets.csv"));
    require(max_error > 0, text("max_error = ", max_error, " must be greater than 0"));
    std::vector<MeasuredMethod> list = choices(measured, operation, storage_of(stored));
    const PixelLattice half = pixel_lattice(stored, 2);
    if (half.width == 0 || half.height == 0) // a tile of an odd row or column alone
        std::erase_if(list, [](const MeasuredMethod& choice) { return choice.method.ends_with(half_resolution); });
    require(!list.empty(), text("'", operation, "' has no methods to choose from; ssao, dof and normals have"));
    const std::optional<MeasuredMethod> found = cheapest_method(list, max_error);
    if (found)
        return *found;
    const MeasuredMethod& best = *std::ranges::min_element(list, {}, &MeasuredMethod::error);
    throw std::invalid_argument(text("max_error = ", max_error, " is met by nothing that ", operation,
                                     " has: the best, ", best.method, ", is off by ", best.error,
                                     " in the scene that it is worst in, ", best.scene));
}

SsaoOptions chosen(const StoredDepth& stored, SsaoOptions options) {
    require(options.quality == Quality::balanced && !options.slices && !options.samples && !options.jitter,
            "max_error chooses the quality, slices, samples and jitter itself: give them or it");
    require(!options.half_resolution, "max_error chooses the resolution itself: give it or half_resolution");
    return with_choice("ssao", stored, std::move(options));
}

DofOptions chosen(const StoredDepth& stored, DofOptions options) {
    require(options.quality == BlurQuality::standard, "max_error chooses the quality itself: give one of the two");
    return with_choice("dof", stored, std::move(options));
}

NormalsOptions chosen(const StoredDepth& stored, NormalsOptions options) {
    require(options.method == NormalMethod::automatic, "max_error chooses the method itself: give one of the two");
    return with_choice("normals", stored, options);
}

} // namespace fathom

#include "sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>

namespace fathom::bench {

bool Comparison::takes(int& i, int argc, char** argv) {
    const std::string option = argv[i];
    if (option == "--processor-time") {
        effort.clock = Clock::processor;
        return true;
    }
    const char* const value = i + 1 < argc ? argv[i + 1] : "";
    const bool taken = (option == "--size" && std::sscanf(value, "%dx%d", &width, &height) == 2) ||
                       (option == "--rounds" && (effort.rounds = std::atoi(value)) > 0) ||
                       (option == "--seconds" && (effort.seconds = std::atof(value)) > 0) ||
                       (option == "--csv" && !(csv = value).empty());
    i += taken;
    return taken;
}

std::optional<int> Comparison::read(int argc, char** argv, const char* help, const char* of_program,
                                    std::string* program) {
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        if (program && option == of_program && i + 1 < argc) {
            *program = argv[++i];
        } else if (!takes(i, argc, argv)) {
            std::fputs(help, option == "--help" ? stdout : stderr);
            return option == "--help" ? 0 : 2;
        }
    }
    return std::nullopt;
}

namespace {

double radius_of(const Method& method, const Case& on) {
    return method.operation == "ssao" ? on.radius_px : method.operation.starts_with("dof") ? on.max_coc_px : 0;
}

// The chosen methods and their floors, interleaved.
std::vector<Figures> timed(Case& on, const std::vector<Method>& methods,
                           const std::function<bool(const Method&)>& chosen, const Effort& effort) {
    std::vector<const Method*> list;
    for (const Method& method : methods) {
        const auto same_floor = [&](const Method& other) {
            return other.kind != Method::Kind::floor && other.floor == method.floor && chosen(other);
        };
        const bool wanted = method.kind == Method::Kind::floor
                                ? std::ranges::any_of(methods, same_floor)
                                : chosen(method) && (!method.fits || method.fits(on.view()));
        if (wanted)
            list.push_back(&method);
    }
    std::vector<Figures> rows;
    std::vector<Work> work;
    for (const Method* method : list) {
        rows.push_back({.operation = method->operation,
                        .method = method->name,
                        .kind = kind_name(method->kind),
                        .storage = to_string(method->storage),
                        .scene = on.view().name,
                        .width = on.width(),
                        .height = on.height(),
                        .radius_px = radius_of(*method, on),
                        .floor = method->floor});
        const auto run = [&, method] { rows.back().bytes = bytes_of(*method, on); };
        const auto before = [&on, method] {
            on.next();
            if (method->prepare)
                method->prepare(on);
        };
        const int every = rounds_between(on.device(), {.before = before, .run = run}, effort.rounds, effort.seconds);
        work.push_back({.before = before, .run = [&on, method] { method->run(on); }, .every = every});
    }
    on.complete();
    const auto samples = measured(on.device(), work, effort.rounds, effort.clock, 0);
    std::map<std::string, double> floors;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        rows[i].seconds = samples[i];
        if (list[i]->kind == Method::Kind::floor && list[i]->name == list[i]->floor)
            floors[list[i]->name] = median(samples[i]);
    }
    for (Figures& row : rows) {
        row.floor_seconds = floors.at(row.floor);
        effort.report(row);
    }
    return rows;
}

void append(std::vector<Figures>& rows, std::vector<Figures> more) {
    rows.insert(rows.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

// The methods that take too long to be run again on images of a width or wider.
class Slow {
public:
    void learn(const std::vector<Figures>& rows, Clock clock) {
        const double limit = clock == Clock::wall ? longest_run : 2 * longest_run; // of two cores
        for (const Figures& row : rows)
            if (median(row.seconds) > limit)
                widths_.emplace(row.operation + ' ' + row.method, row.width);
    }
    bool contain(const Method& method, int width) const {
        const auto found = widths_.find(method.operation + ' ' + method.name);
        return found != widths_.end() && width >= found->second;
    }

private:
    std::map<std::string, int> widths_;
};

// Of what the page chooses the best of each operation.
bool chosen_from(const Method& method) {
    return method.kind == Method::Kind::library && method.storage == Storage::float32 &&
           method.name.find_first_of("0123456789") != 0 && !method.name.ends_with(constant_suffix) &&
           !method.name.ends_with(backs_suffix);
}

// The methods that the chart against pixels shows, one for each operation.
bool swept(const Method& method) {
    static const std::pair<const char*, const char*> names[] = {
        {"linearize", "fathom"}, {"unproject", "fathom"}, {"normals", "neighbours"},
        {"dof_masks", "fathom"}, {"ssao", "balanced"},    {"dof", "balanced"},
    };
    return method.storage == Storage::float32 && std::ranges::any_of(names, [&](const auto& each) {
               return method.operation == each.first && method.name == each.second;
           });
}

} // namespace

std::vector<Figures> presets(const Device& device, const std::vector<Method>& methods, const std::vector<View>& views,
                             const Effort& effort) {
    std::vector<Figures> rows;
    Slow slow;
    for (const View& view : views) {
        Case on(device, view);
        const bool small = view.camera().width <= error_size.first;
        const bool large = view.camera().width >= 3840;
        const auto wanted = [&](const Method& m) {
            return m.matches(effort.only) && !slow.contain(m, on.width()) && (small || !m.swept) &&
                   (!large || chosen_from(m));
        };
        const auto of = [&](const char* operation) {
            return [&wanted, operation](const Method& m) { return m.operation == operation && wanted(m); };
        };
        on.radius_px = on.width() / 20.0;
        on.max_coc_px = on.width() / 30.0;
        append(rows, timed(on, methods, wanted, effort));
        if (!large) {
            on.radius_px = 2 * on.width() / 5.0;
            append(rows, timed(on, methods, of("ssao"), effort));
            on.max_coc_px = on.width() / 120.0;
            append(rows, timed(on, methods, of("dof"), effort));
        }
        slow.learn(rows, effort.clock);
    }
    return rows;
}

std::vector<Figures> pixel_sweep(const Device& device, const std::vector<Method>& methods, double megapixels,
                                 const Effort& effort) {
    std::vector<Figures> rows;
    for (const double size : {0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0}) {
        if (size > megapixels)
            break;
        const int width = static_cast<int>(std::sqrt(size * 1e6 * 16 / 9) / 16 + 0.5) * 16;
        Case on(device, room_view(width, static_cast<int>(size * 1e6 / width + 0.5)));
        on.radius_px = 96;
        on.max_coc_px = 64;
        append(rows, timed(
                         on, methods, [&](const Method& m) { return swept(m) && m.matches(effort.only); }, effort));
    }
    return rows;
}

std::vector<Figures> radius_sweep(const Device& device, const std::vector<Method>& methods, Size size,
                                  const Effort& effort) {
    static const std::pair<const char*, double> presets[] = {
        // and the last radius for them
        {"ssao fast", 512}, {"ssao balanced", 512}, {"ssao accurate", 512},
        {"dof fast", 512},  {"dof balanced", 512},  {"dof accurate", largest_accurate_px},
    };
    std::vector<Figures> rows;
    Case on(device, room_view(size.first, size.second));
    for (const double radius : {4, 8, 16, 32, 64, 128, 256, 512}) {
        on.radius_px = on.max_coc_px = radius;
        const auto chosen = [&](const Method& m) {
            return m.matches(effort.only) && std::ranges::any_of(presets, [&](const auto& preset) {
                       return m.operation + ' ' + m.name == preset.first && radius <= preset.second;
                   });
        };
        append(rows, timed(on, methods, chosen, effort));
    }
    return rows;
}

} // namespace fathom::bench

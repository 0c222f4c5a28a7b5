// Every option that is described, with values within its range, at its ends and beyond: the library and the program accept the
// same ones. python/tests/test_options.py does so with Python's keywords. And the program's files hold what the library computes.
#include "rendered_input.hpp"

#include "cli/options.hpp"
#include "description/operations.hpp"

#include <fmt/format.h>

#include <regex>

using namespace fathom;
using namespace fathom::test;
using description::Kind;
using description::Option;
using description::Value;

namespace {

constexpr int columns = 12, rows = 9;

std::vector<double> numbers_for(const Option& option) {
    std::set<double> numbers{-1, 0, 1, 2, 0.5};
    for (const double end : {option.range.least, option.range.most})
        if (std::isfinite(end))
            numbers.insert({end - 1, std::nextafter(end, -HUGE_VAL), end, std::nextafter(end, HUGE_VAL), end + 1});
    for (const std::optional<double>& one : option.range.few)
        if (one)
            numbers.insert(*one);
    std::vector<double> all(numbers.begin(), numbers.end());
    all.insert(all.end(), {HUGE_VAL, -HUGE_VAL, std::numeric_limits<double>::quiet_NaN()});
    return all;
}

std::vector<Value> values_for(const Option& option) {
    switch (option.kind) {
    case Kind::number: {
        const std::vector<double> numbers = numbers_for(option);
        return {numbers.begin(), numbers.end()};
    }
    case Kind::point:
    case Kind::color:
    case Kind::direction:
        return {std::array{0.0, 0.0, 0.0}, std::array{0.0, 2.0, 0.0}, std::array{0.0, HUGE_VAL, 0.0},
                std::array{1.0, std::nan(""), 0.0}};
    case Kind::pixel:
        return {LensArguments::Pixel{2, 1}};
    case Kind::ray:
        return {LensArguments::AlongRay{{2, 1}, 5}, LensArguments::AlongRay{{2, 1}, HUGE_VAL},
                LensArguments::AlongRay{{2, 1}, 0}, LensArguments::AlongRay{{2, 1}, -1},
                LensArguments::AlongRay{{2, 1}, std::nan("")}};
    case Kind::choice: {
        std::vector<Value> values;
        for (std::size_t i = 0; i <= option.choices().size(); ++i) // the last one is none of them
            values.emplace_back(i);
        return values;
    }
    case Kind::flag:
        return {true, false};
    case Kind::lens:
        return {CircleOfConfusion{40, 180}, CircleOfConfusion{0, 0}, CircleOfConfusion{-1, 180},
                CircleOfConfusion{40, -1}, CircleOfConfusion{HUGE_VAL, 180}};
    case Kind::region:
        return {Region{1, 1, 4, 3}, Region{0, 0, columns, rows}, Region{0, 0, 0, 2}, Region{0, 0, 2, -1}};
    case Kind::fractions:
    case Kind::ends:
        return {std::array{0.25, 0.5}, std::array{0.0, 1.0},      std::array{0.5, 0.5},          std::array{0.5, 0.25},
                std::array{-0.5, 1.5}, std::array{0.0, HUGE_VAL}, std::array{0.0, std::nan("")}, std::array{1.5, 2.0}};
    default:
        return {};
    }
}

// May a field of this option hold the value, so that the library can be asked?
bool is_held(const Option& option, const Value& value) {
    const auto* number = std::get_if<double>(&value);
    if (option.kind == Kind::choice)
        return option.choices().size() > 1; // a type of its own where there is one
    if (!number || (!option.range.whole && !option.range.few[0]))
        return true;
    const bool is_unsigned = option.range.least >= 0 && option.range.most > std::numeric_limits<int>::max();
    return *number == std::floor(*number) && std::abs(*number) < 1e6 && (!is_unsigned || *number >= 0);
}

std::string in_words(const Option& option, const Value& value) {
    if (const auto* index = std::get_if<std::size_t>(&value))
        return *index < option.choices().size() ? option.choices()[*index] : "nonsense";
    if (const auto* yes = std::get_if<bool>(&value))
        return *yes ? "yes" : "no";
    if (const auto* circle = std::get_if<CircleOfConfusion>(&value))
        return fmt::format("{},{}", static_cast<double>(circle->k), static_cast<double>(circle->g));
    if (const auto* number = std::get_if<double>(&value))
        return fmt::format("{}", *number);
    if (const auto* pixel = std::get_if<LensArguments::Pixel>(&value))
        return fmt::format("{},{}", pixel->x, pixel->y);
    if (const auto* ray = std::get_if<LensArguments::AlongRay>(&value))
        return fmt::format("{},{},{}", ray->pixel.x, ray->pixel.y, ray->distance);
    if (const auto* region = std::get_if<Region>(&value))
        return fmt::format("{},{},{},{}", region->x, region->y, region->width, region->height);
    if (const auto* two = std::get_if<std::array<double, 2>>(&value))
        return fmt::format("{},{}", (*two)[0], (*two)[1]);
    const auto& three = std::get<std::array<double, 3>>(value);
    return fmt::format("{},{},{}", three[0], three[1], three[2]);
}

struct Scene {
    Camera camera = camera_of();
    cv::Mat depth = cv::Mat(rows, columns, CV_32F, cv::Scalar(0.9)),
            color = cv::Mat(rows, columns, CV_32FC3, cv::Scalar::all(0.5));
    StoredDepth stored{to_device(Device::open("cpu"), depth), camera, Storage::float32};
    Image picture{to_device(stored.image.device(), color)};

    static Camera camera_of() {
        return {.projection = perspective(1.0, static_cast<double>(columns) / rows, {0.5, 20}),
                .width = columns,
                .height = rows,
                .view = Eigen::Matrix4d::Identity()};
    }
};

// A call with what it needs, whatever its options.
std::shared_ptr<void> needed(const description::Operation& operation, const Image& picture) {
    std::shared_ptr<void> call = operation.make(nullptr);
    for (const Option& option : operation.options)
        if (option.kind == Kind::picture && option.required)
            operation.set(call.get(), option, picture);
        else if (option.kind == Kind::lens)
            operation.set(call.get(), option, CircleOfConfusion{40, 180});
        else if (option.kind == Kind::number && (option.required || option.name == std::string("radius")))
            operation.set(call.get(), option, 0.25);
    return call;
}

// Images for what a call gives.
std::vector<description::Result> make_results(const description::Operation& operation, void* call,
                                              const StoredDepth& stored) {
    std::vector<description::Result> wanted = operation.results_of(call, stored);
    std::erase_if(wanted, [](const description::Result& result) { return !result.wanted; });
    for (const description::Result& result : wanted)
        *result.image = Image(stored.image.device(), result.shape.element, result.shape.layout);
    return wanted;
}

// Does the library refuse exactly what is not described?
int check_library(const description::Operation& operation, const Scene& scene) {
    int checked = 0;
    for (const Option& option : operation.options)
        for (const Value& value : values_for(option)) {
            if (!is_held(option, value))
                continue;
            INFO(operation.name << ": " << option.name << " = " << in_words(option, value));
            const std::shared_ptr<void> call = needed(operation, scene.picture);
            make_results(operation, call.get(), scene.stored);
            operation.set(call.get(), option, value);
            std::string refusal;
            try {
                operation.run(call.get(), scene.stored, {});
            } catch (const std::invalid_argument& error) {
                refusal = error.what();
            }
            CHECK((refusal.starts_with(text(option.name, " = ")) && contains(refusal, " must ")) ==
                  !option.accepts(value));
            ++checked;
        }
    return checked;
}

// The same of a lens.
int check_lens(const Scene& scene) {
    int checked = 0;
    for (const Option& option : description::options_of(LensArguments{}))
        for (const Value& value : values_for(option)) {
            INFO(option.name << " = " << in_words(option, value));
            LensArguments lens{.focus = 5, .f_stop = 2, .focal_length_mm = 0.01, .sensor_mm = 36};
            if (option.kind == Kind::pixel || option.kind == Kind::ray) // another focus
                lens.focus.reset();
            option.set(lens, value);
            std::string refusal;
            try {
                circle_for(lens, scene.stored);
            } catch (const std::invalid_argument& error) {
                refusal = error.what();
            }
            const bool is_too_near = contains(refusal, "farther away than the focal length"); // of another option
            CHECK((refusal.starts_with(text(option.name, " = ")) && !is_too_near) == !option.accepts(value));
            ++checked;
        }
    return checked;
}

std::vector<Option> all_options(const description::Operation& operation) {
    std::vector<Option> all;
    for (const std::vector<Option>* listed : operation.listed())
        all.insert(all.end(), listed->begin(), listed->end());
    return all;
}

std::string command_of(const description::Operation& operation) {
    std::string command = operation.name;
    std::ranges::replace(command, '_', '-');
    return command;
}

// Values that the program takes as words, and that are not the default: each choice, and one of all others.
std::vector<Value> fitting_for(const Option& option) {
    std::vector<Value> values = values_for(option);
    if (option.kind == Kind::number)
        values.insert(values.end(), {3.0, 2.0, 0.5});
    std::erase_if(values, [&](const Value& value) { return !option.accepts(value) || option.is_default(value); });
    if (option.kind != Kind::choice && values.size() > 1)
        values.erase(values.begin(), values.end() - 1);
    return values;
}

using Given = std::vector<std::pair<const Option*, Value>>;

// With what it needs; nothing if that is an image or another result.
std::optional<Given> with_needs(const description::Operation& operation, const Option& option, const Value& value) {
    Given given{{&option, value}};
    for (const std::string_view need : option.needs) {
        const std::string_view name = need.substr(0, need.find('=')),
                               word = need.substr(std::min(name.size() + 1, need.size()));
        const auto other = std::ranges::find(operation.options, name, &Option::name);
        if (other == operation.options.end() || fitting_for(*other).empty())
            return std::nullopt;
        const auto choice =
            std::ranges::find(other->choices(), word, [](const char* each) { return std::string_view(each); });
        given.emplace_back(&*other, word.empty() ? fitting_for(*other).back()
                                                 : Value(static_cast<std::size_t>(choice - other->choices().begin())));
    }
    return given;
}

// A room and a picture of it as the program and as the library see them.
struct Room : RenderedInput {
    std::string picture_file = folder / "picture.exr";
    cv::Mat color;
    Image picture;

    Room() : RenderedInput(scene::room(), view) {
        color = filled<cv::Vec3f>(width, height, [](int x, int y) {
            return cv::Vec3f(static_cast<float>(x % 8) / 8, static_cast<float>(y % 8) / 8,
                             static_cast<float>((x + y) % 5) / 5);
        });
        write_color(picture_file, color);
        picture = to_device(stored.image.device(), color);
    }

    void run_program(const description::Operation& operation, const std::string& file, const Given& given,
                     const Arguments& more = {}) const {
        Arguments arguments{command_of(operation), input, "--camera", camera, "-o", file};
        if (arguments.front() == "dof-masks")
            arguments = joined(arguments, {"--mask", "coc"});
        if (operation.repairs)
            arguments.push_back("--invalid=keep");
        for (const Option& option : operation.options)
            if (option.kind == Kind::picture && option.required)
                arguments = joined(arguments, {"--color", picture_file});
            else if (option.kind == Kind::lens)
                arguments = joined(arguments, {"--circle", "40,180"});
            else if (option.kind == Kind::number && (option.required || option.name == std::string("radius")))
                arguments.push_back(cli::spelled(option) + "=0.25");
        for (const auto& [option, value] : given)
            arguments.push_back(cli::spelled(*option) + "=" +
                                (cli::value_spelled(*option).starts_with("ellipse:") ? "ellipse:" : "") +
                                in_words(*option, value));
        const Outcome outcome = run(joined(arguments, more)); // which may have doubts about the options
        INFO(outcome.err);
        CHECK(outcome.code == 0);
    }

    std::vector<description::Result> run_library(const description::Operation& operation,
                                                 const std::shared_ptr<void>& call, const Given& given) const {
        const auto set = [&](const Option& option, Value value) {
            if (auto* color = std::get_if<std::array<double, 3>>(&value); option.kind == Kind::color)
                std::swap((*color)[0], (*color)[2]); // the picture is B, G, R
            operation.set(call.get(), option, value);
        };
        for (const Option& option : operation.options)
            if (option.kind == Kind::color)
                set(option, *option.by_default);
        for (const auto& [option, value] : given)
            set(*option, value);
        const auto results = make_results(operation, call.get(), stored);
        operation.run(call.get(), stored, {});
        return results;
    }
};

// What an EXR holds of a result, untouched.
cv::Mat read_result(const description::Result& result, const std::string& file) {
    if (result.content.of == description::Content::Of::light)
        return read_color(file);
    std::vector<cv::Mat> channels;
    std::istringstream names(result.content.channels);
    for (std::string name; names >> name && channels.size() < static_cast<std::size_t>(result.image->channels());)
        channels.push_back(read_depth(file, {.channel = name, .overscan = true}).values);
    return merged(channels);
}

// What a header says of a member: the comment behind it, and the lines above it that have nothing else.
std::string comment_of(const std::string& header, const std::string& member) {
    std::vector<std::string> lines;
    std::istringstream text(header);
    for (std::string line; std::getline(text, line);)
        lines.push_back(line);
    const std::regex declaration("^    [A-Za-z:].*[ >]" + member + "( =.*|\\{.*)?;( *///<.*)?$"), alone("^ *///<? ?.*");
    std::string comment;
    for (std::size_t i = 0; i < lines.size(); ++i)
        if (std::regex_match(lines[i], declaration)) {
            for (std::size_t above = i; above-- > 0 && std::regex_match(lines[above], alone);)
                comment.insert(0, lines[above].substr(lines[above].find("//") + 3) + ' ');
            for (std::size_t at = i; lines[at].find("///<") != std::string::npos; ++at)
                if (at == i || std::regex_match(lines[at], alone))
                    comment += lines[at].substr(lines[at].find("///<") + 4);
                else
                    break;
        }
    return std::regex_replace(comment, std::regex(" */+<? *"), " ");
}

// The range that a comment names first, in a description's words.
std::string range_in(const std::string& comment) {
    const std::string number = "-?[0-9]+(?:\\.[0-9]+)?";
    const std::regex range(number + ", " + number + " or " + number + '|' + number + " or " + number + '|' + number +
                           " to (?:less than )?" + number + "|(?:from|above) " + number);
    std::smatch found;
    return std::regex_search(comment, found, range) ? found.str() : "";
}

} // namespace

TEST_CASE("options: the library accepts what is described, and nothing else") {
    const Scene scene;
    int checked = 0;
    for (const description::Operation& operation : description::operations())
        checked += check_library(operation, scene);
    checked += check_lens(scene);
    scene.stored.image.device().finish(); // PoCL crashes where a program ends while a kernel is still being compiled
    std::cout << "options: the library checked " << checked << " values\n";
    CHECK(checked > 100);
}

TEST_CASE("options: each reaches the library, whose result is the program's") {
    const Room room;
    const std::string file = room.folder / "out/result.exr";
    int reached = 0, seen = 0;
    for (const description::Operation& operation : description::operations()) {
        const std::shared_ptr<void> plain_call = needed(operation, room.picture);
        const cv::Mat plain = to_mat(*room.run_library(operation, plain_call, {}).front().image);
        for (const Option& option : operation.options) {
            if (option.is_image() || option.kind == Kind::result || option.kind == Kind::lens || option.required ||
                cli::spelled(option).empty() || option.name == std::string("max_error") ||
                option.name == std::string("radius"))
                continue; // a radius is given always, and test_cli_max_error.cpp has the errors
            for (const Value& value : fitting_for(option)) {
                const auto given = with_needs(operation, option, value);
                if (!given)
                    continue;
                INFO(operation.name << ' ' << cli::spelled(option) << '=' << in_words(option, value));
                room.run_program(operation, file, *given);
                const std::shared_ptr<void> call = needed(operation, room.picture);
                const auto results = room.run_library(operation, call, *given);
                const cv::Mat truth = to_mat(*results.front().image);
                CHECK(same(read_result(results.front(), file), truth));
                ++reached;
                seen += !same(truth, plain);
            }
        }
    }
    std::cout << "options: " << reached << " values reach the library, " << seen << " of them change its result\n";
    CHECK(reached >= 45);
    CHECK(seen >= 35);
}

TEST_CASE("options: the program writes every result of the library, in every format") {
    const Room room;
    const auto file = [&](const std::string& name) { return room.folder / ("out/" + name); };
    for (const description::Operation& operation : description::operations()) {
        Given all;
        Arguments files;
        for (const Option& option : operation.options)
            if (option.kind == Kind::result && !cli::spelled(option).empty()) {
                all.emplace_back(&option, true);
                files = joined(files, {cli::spelled(option), file(std::string(option.name) + ".exr")});
            }
        room.run_program(operation, file("first.exr"), {}, files);
        const std::shared_ptr<void> call = needed(operation, room.picture);
        const auto results = room.run_library(operation, call, all);
        REQUIRE(results.size() == all.size() + 1);
        for (const description::Result& result : results) {
            INFO(operation.name << ": " << result.name);
            const std::string own = file((&result == &results.front() ? "first" : result.name) + std::string(".exr"));
            CHECK(same(read_result(result, own), to_mat(*result.image)));
        }
        using Of = description::Content::Of;
        const Of of = results.front().content.of;
        const cv::Mat truth = to_mat(*results.front().image);
        for (const std::string extension : {".tif", ".pfm", ".png"}) {
            if (extension == ".png" && of != Of::fractions && of != Of::directions)
                continue;
            INFO(operation.name << extension);
            room.run_program(operation, file("first" + extension), {});
            const cv::Mat found = cv::imread(file("first" + extension), cv::IMREAD_UNCHANGED); // the first channel last
            cv::Mat expected = truth.channels() > 1 && of != Of::light
                                   ? merged({plane(truth, 2), plane(truth, 1), plane(truth, 0)})
                                   : truth;
            if (extension == ".png") {
                const double scale = of == Of::directions ? 0.5 : 1, offset = of == Of::directions ? 0.5 : 0;
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x)
                        for (int c = 0; c < truth.channels(); ++c) {
                            const auto value = static_cast<double>(expected.ptr<float>(y, x)[c]);
                            const bool nothing = std::isnan(value) ||
                                                 (of == Of::directions && cv::norm(expected.at<cv::Vec3f>(y, x)) == 0);
                            CHECK(found.ptr<std::uint16_t>(y, x)[c] ==
                                  (nothing ? 0 : std::lround((scale * value + offset) * 65535)));
                        }
            } else {
                CHECK(same(found, expected));
            }
        }
    }
}

TEST_CASE("options: a circle beside a lens, and two ways to focus, are refused where the lens becomes a circle") {
    const Scene scene;
    const auto refusal = [&](const LensArguments& lens) {
        try {
            circle_for(lens, scene.stored);
        } catch (const std::invalid_argument& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const LensArguments::Pixel middle{6, 4};
    CHECK(refusal({.circle = std::array{40.0, 180.0}}).empty());
    CHECK(refusal({.focus = 2, .circle = std::array{40.0, 180.0}}) == description::excluding("circle", "focus"));
    CHECK(refusal({.mm_per_unit = 1, .circle = std::array{40.0, 180.0}}) ==
          description::excluding("circle", "mm_per_unit"));
    CHECK(refusal({.focus = 2, .focus_at = middle, .f_stop = 2, .sensor_mm = 36}) ==
          description::excluding("focus_at", "focus"));
    CHECK(refusal({.circle = std::array{40.0, -1.0}}).starts_with("circle = (40, -1) must be two "));
    CHECK(contains(refusal({.focus = 0, .f_stop = 2, .sensor_mm = 36}), "which is at depth 0"));
}

TEST_CASE("options: those of a struct that exclude each other are refused") {
    const Scene scene;
    CHECK_THROWS_WITH(dof(scene.stored, scene.picture, {40, 180}, {.aperture = {.blades = 5, .ratio = 2}}),
                      description::excluding("ratio", "blades"));
    CHECK_THROWS_WITH(normals(scene.stored, {.method = MaxError{3}, .noise = 0.1}),
                      description::excluding("noise", "max_error"));
    CHECK_NOTHROW(dof(scene.stored, scene.picture, {40, 180}, {.aperture = {.ratio = 2}}));
    scene.stored.image.device().finish();
}

TEST_CASE("options: a range that a header says is the one that is described") {
    int compared = 0;
    for (const description::Operation& operation : description::operations()) {
        std::ifstream file(fs::path(places::sources) / "include/fathom" / (std::string(operation.name) + ".hpp"));
        const std::string header{std::istreambuf_iterator<char>(file), {}};
        REQUIRE(!header.empty());
        for (const Option& option : operation.options) {
            const std::string said = range_in(comment_of(header, option.name));
            if (option.kind != Kind::number || said.empty())
                continue;
            description::Range described = option.range; // but for the one number and infinity, which the words explain
            described.beside.reset();
            described.infinite = false;
            INFO(operation.name << ": " << option.name);
            CHECK(said == described.limits());
            ++compared;
        }
    }
    std::cout << "options: " << compared << " ranges of headers are those that are described\n";
    CHECK(compared >= 15);
}

TEST_CASE("options: the program accepts what is described, and nothing else") {
    int checked = 0;
    for (const description::Operation& operation : description::operations())
        for (const Option& option : all_options(operation)) {
            const std::string spelled = cli::spelled(option);
            if (spelled.empty())
                continue;
            const std::string before = cli::value_spelled(option).starts_with("ellipse:") ? "ellipse:" : "";
            for (const Value& value : values_for(option)) {
                const std::string command = command_of(operation);
                const std::string refusal = usage_refusal(
                    {command, "no.exr", "-o", "out.exr", spelled + "=" + before + in_words(option, value)});
                INFO(command << ' ' << spelled << '=' << in_words(option, value) << ": " << refusal);
                CHECK(contains(refusal, spelled + ": '") == !option.accepts(value));
                ++checked;
            }
        }
    std::cout << "options: the program checked " << checked << " values\n";
    CHECK(checked > 100);
}

TEST_CASE("options: the program refuses what is described as excluded, or of no use alone") {
    int checked = 0;
    for (const description::Operation& operation : description::operations()) {
        const std::vector<Option> all = all_options(operation);
        const std::string command = command_of(operation);
        const auto argument = [](const Option& option) { // a value that will do
            const std::string name = cli::spelled(option);
            if (option.kind == Kind::flag)
                return name;
            for (const Value& value : values_for(option))
                if (option.accepts(value) && !option.is_default(value)) // which says nothing
                    return name + "=" + in_words(option, value);
            return name + "=1.exr";
        };
        const auto refusal_of = [&](const std::vector<std::string>& options) {
            std::vector<std::string> words{command, "no.exr", "-o", "out.exr"};
            words.insert(words.end(), options.begin(), options.end());
            for (const char* needed : {"--color=no.exr", "--density=1"})
                if (command == "fog" || (command == "dof" && needed[2] == 'c'))
                    words.emplace_back(needed);
            return usage_refusal(words);
        };
        const auto is_own = [](const Option& option) {
            return !cli::spelled(option).empty() && cli::spelled(option) != "--aperture";
        };
        for (const Option& one : all) {
            if (!is_own(one))
                continue;
            INFO(command << ' ' << argument(one));
            if (const bool in_file = one.kind == Kind::picture; !one.needs.empty() && !in_file) {
                CHECK(contains(refusal_of({argument(one)}), cli::spelled(one) + ": is of no use without --"));
                ++checked;
            }
            for (const Option& other : all)
                if (is_own(other) && cli::spelled(one) != cli::spelled(other) &&
                    std::ranges::count(one.excludes, other.name) > 0) {
                    INFO(argument(other));
                    CHECK(contains(refusal_of({argument(one), argument(other)}), " exclude each other: give one of"));
                    ++checked;
                }
        }
    }
    std::cout << "options: the program refused " << checked << " pairs and lonely options\n";
    CHECK(checked > 30);
}

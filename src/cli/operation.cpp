// Commands of operations as their descriptions have them: options, images and results; and the methods that --max-error chooses.
#include "operation.hpp"

#include "command.hpp"

#include "cli/options/depth_options.hpp"
#include "cli/options/described.hpp"
#include "cli/options/picture.hpp"
#include "io/floats_on_host.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace fathom::cli {
namespace {

using description::Content;
using description::Kind;
using description::Option;

struct Arguments : DepthOptions {
    std::shared_ptr<void> call;
    const Option* color = nullptr; // the option of the picture
    PictureOptions picture;
    double max_error = 0;
    bool explain = false;
    std::map<std::string, std::string> files; // of more results, by their names
};

std::optional<fathom::Operation> measured(const std::string& name) {
    for (const fathom::Operation each : {fathom::Operation::ssao, fathom::Operation::dof, fathom::Operation::normals})
        if (fathom::to_string(each) == name)
            return each;
    return std::nullopt;
}

void add_options(CLI::App& app, const description::Operation& operation, Arguments& arguments) {
    const auto set = [&](const Option& option, description::Value value) {
        if (option.kind == Kind::color) { // a matrix is B, G, R
            auto& color = std::get<std::array<double, 3>>(value);
            std::swap(color[0], color[2]);
        }
        if (option.name == std::string_view("max_error"))
            arguments.max_error = std::get<double>(value);
        operation.set(arguments.call.get(), option, value);
    };
    for (const Option& option : operation.options) {
        if (option.kind == Kind::picture)
            arguments.color = &option;
        if (option.kind == Kind::color)
            set(option, option.by_default.value());
    }
    add_described_options(app, operation.options, set, operation.group, {});
    if (arguments.color)
        add_picture_options(app, arguments.picture, arguments.color->words);
    add_result_options(app, operation, arguments.files);
    if (measured(operation.name))
        add_explain(app, arguments.explain, operation.group);
}

More more_of(const description::Operation& operation, const std::shared_ptr<Arguments>& arguments) {
    More more;
    more.outputs = outputs_of(operation, arguments->call.get(), arguments->files);
    if (!arguments->color)
        return more;
    use_picture(more, arguments->picture);
    return more;
}

std::vector<std::string> words_in(const char* text) {
    return CLI::detail::split(text, ' ');
}

} // namespace

Product product_of(const description::Operation& operation, const description::Result& result) {
    if (result.content.of == Content::Of::light)
        return picture_product(operation.layer);
    Product product{.extensions = {".exr", ".tif", ".pfm", ".npy", ".png"},
                    .channels = words_in(result.content.channels),
                    .layer = operation.layer};
    if (result.content.of == Content::Of::fractions)
        product.png_scale = 1;
    if (result.content.of == Content::Of::directions)
        product.png_scale = product.png_offset = 0.5;
    return product;
}

std::vector<Output> outputs_of(const description::Operation& operation, void* call,
                               const std::map<std::string, std::string>& files) {
    for (const Option& option : operation.options)
        if (option.kind == Kind::result && files.contains(option.name))
            operation.set(call, option, true);
    std::vector<Output> outputs;
    for (const description::Result& result : operation.results_of(call, {}))
        if (const auto file = files.find(result.name); file != files.end()) {
            Product product = product_of(operation, result);
            if (!product.png_scale) // it has no --png-scale of its own
                std::erase(product.extensions, ".png");
            product.layer = "";
            outputs.push_back({spelled(result.name), file->second, product});
        }
    return outputs;
}

std::vector<Result> run(const description::Operation& operation, void* call, const StoredDepth& stored,
                        const Loaded& frame) {
    const std::vector<description::Result> results = operation.results_of(call, stored);
    std::vector<std::optional<FloatsOnHost>> made(results.size());
    for (std::size_t i = 0; i < results.size(); ++i)
        if (const Layout& layout = results[i].shape.layout; results[i].wanted)
            *results[i].image =
                made[i].emplace(stored.image.device(), cv::Size(layout.width, layout.height), layout.channels).image();
    operation.run(call, stored, {});
    std::vector<Result> all;
    for (std::size_t i = 0; i < results.size(); ++i) {
        if (!made[i])
            continue;
        const cv::Mat mat = made[i]->mat();
        if (results[i].content.of == Content::Of::directions)
            all.emplace_back(directions_for(frame.outputs[all.size()], mat));
        else
            all.emplace_back(mat);
        if (results[i].content.of == Content::Of::light)
            all.back().format = frame.images.get().picture.format;
    }
    return all;
}

std::function<int()> configure_operation(CLI::App& app, const description::Operation& operation) {
    const auto arguments = std::make_shared<Arguments>();
    arguments->call = operation.make(nullptr);
    const Product product = product_of(operation, operation.results_of(arguments->call.get(), {}).front());
    add_depth_options(app, *arguments, product);
    add_options(app, operation, *arguments);
    return [arguments, &operation] {
        // The options decide what it holds.
        const Product asked = product_of(operation, operation.results_of(arguments->call.get(), {}).front());
        return each_depth(
            *arguments, asked, more_of(operation, arguments), [&](const StoredDepth& stored, Loaded& frame) {
                if (arguments->max_error > 0)
                    explain_method(*measured(operation.name), stored, frame, arguments->max_error, arguments->explain);
                const std::shared_ptr<void> call = operation.make(arguments->call.get());
                if (arguments->color) // read by the device until the results are there
                    operation.set(call.get(), *arguments->color,
                                  to_device(stored.image.device(), frame.images.get().picture.color));
                return run(operation, call.get(), stored, frame);
            });
    };
}

// --max-error and --explain, which ssao, dof and normals share.

void add_explain(CLI::App& app, bool& explain, const std::string& group) {
    app.add_flag("--explain", explain, "print on stderr what --max-error chose, and its error")
        ->needs(app.get_option("--max-error"))
        ->group(group);
}

void explain_method(fathom::Operation operation, const StoredDepth& stored, Loaded& frame, double max_error,
                    bool explain) {
    MeasuredMethod cheapest;
    try {
        cheapest = cheapest_method(operation, stored, max_error);
    } catch (const std::invalid_argument& error) {
        const std::string message = error.what(), option = "max_error = ";
        throw Error(message.starts_with(option) ? "--max-error " + message.substr(option.size()) : message);
    }
    if (explain)
        frame.said.push_back(fmt::format("{}: {} {}: error up to {} (in the scene {})", frame.input.native(),
                                         fathom::to_string(operation), cheapest.method, number(cheapest.error),
                                         cheapest.scene));
}

} // namespace fathom::cli

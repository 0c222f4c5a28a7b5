// Targets that read text, and small binary files.
#include "reading.hpp"

#include "camera_file/file.hpp"
#include "cli/program.hpp"
#include "sequence/frames.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/import_camera.hpp>

#include <algorithm>
#include <cctype>
#include <memory>
#include <set>
#include <stdexcept>

namespace fs = std::filesystem;

namespace fathom::fuzz {
namespace {

constexpr std::size_t longest_text = 1024;

/// Uses a camera as the operations do. Values that contradict each other are refused without a file's name.
void use(const CameraFile& file) {
    try {
        depth_form(camera_for(file, 64, 48));
    } catch (const Error& refused) {
        check_line(refused.what(), "");
    } catch (const std::invalid_argument& refused) {
        check_line(refused.what(), "");
    }
}

ImportOptions options_of(unsigned choice) {
    ImportOptions options;
    if (choice & 1)
        options.preset = "encoding=view-z";
    if (choice & 2)
        options.image = "a";
    if (choice & 4)
        options.node = "0";
    options.undistorted = choice & 8;
    if (choice & 16)
        options.depth = "b/a.png";
    if (choice & 32)
        options.storage = choice & 64 ? Storage::uint16 : Storage::float32;
    return options;
}

/// Imports a camera. The camera file that says the same must be one.
void import(const fs::path& file, const ImportOptions& options, const fs::path& named) {
    read_or_refuse(named, [&] {
        const ImportedCamera camera = import_camera(file, options);
        for (const std::string& warning : camera.warnings)
            check_line(warning, "");
        use(camera);
        const auto* text = reinterpret_cast<const unsigned char*>(camera.text.data());
        const fs::path again = file_with("again.json", {text, camera.text.size()});
        read_or_refuse(again, [&] { use(read_camera(again)); });
    });
}

// Camera files, glTF and transforms.json, as files of any kind: the content decides.
void run_camera(Input input) {
    const unsigned choice = taken_choice(input);
    const fs::path file = file_with("camera.json", input);
    read_or_refuse(file, [&] { use(read_camera(file)); });
    import(file, options_of(choice), file);
}

// YAML of OpenCV and ROS.
void run_calibration(Input input) {
    const unsigned choice = taken_choice(input);
    const fs::path file = file_with("calibration.yml", input);
    import(file, options_of(choice), file);
}

// Two files: the lines of the second one follow "===".
void run_colmap(Input input) {
    const unsigned choice = taken_choice(input);
    constexpr std::string_view between = "\n===\n";
    const std::size_t at = text_of(input).find(between);
    const std::string extension = choice & 128 ? ".bin" : ".txt";
    const fs::path file = file_with("cameras" + extension, input.first(std::min(at, input.size())));
    const fs::path images = file.parent_path() / ("images" + extension);
    if (at != std::string_view::npos)
        file_with(images.filename(), input.subspan(at + between.size()));
    else
        fs::remove(images);
    import(file, options_of(choice), file.parent_path()); // either of them may be at fault
}

void run_preset(Input input) {
    try {
        use(preset_file(std::string(text_of(input))));
    } catch (const Error& refused) { // its subject is the text, as it is
        check_line(io::printable(refused.what()), "preset ");
    }
}

void run_frames(Input input) {
    constexpr std::size_t few = 1000; // as many as are allowed take a second
    try {
        const auto frames = sequence::parse_frames(text_of(input), few);
        const std::set<sequence::Frame> each(frames.begin(), frames.end());
        expect(!frames.empty() && frames.size() <= few && each.size() == frames.size(), "a frame twice, or none");
        expect(std::max(std::abs(*each.begin()), std::abs(*each.rbegin())) <= sequence::largest_frame, "a large frame");
    } catch (const std::invalid_argument& refused) {
        expect(std::string_view(refused.what()).starts_with("'"), refused.what());
    }
}

// Names with numbers. The frame of the name of a frame is that frame.
void run_pattern(Input input) {
    const unsigned choice = taken_choice(input);
    const std::string text(text_of(input));
    static constexpr sequence::Frame frames[] = {0, 1, -1, 7, 1001, -240, 99999, sequence::largest_frame};
    const sequence::Frame frame = frames[choice % std::size(frames)];
    if (const auto pattern = sequence::FramePattern::in(text)) {
        const std::string name = pattern->name(frame);
        if (const auto found = pattern->frame(name)) // nothing: two numbers beside each other have no border
            expect(pattern->name(*found) == name, "the name of another frame");
    }
    if (const auto found = sequence::FramePattern::of(text))
        expect(found->first.name(found->second) == text, "another name than that which the pattern is of");
    const std::size_t half = text.size() / 2;
    if (const auto all = sequence::FramePattern::common({text, text.substr(0, half), text.substr(half)}))
        for (const auto& [number, name] : all->second)
            expect(all->first.name(number) == name, "another name than that of a frame");
    sequence::has_glob(text);
}

void run_values(Input input) {
    const fs::path file = file_with(taken_choice(input) & 1 ? "values.csv" : "values.json", input);
    read_or_refuse(file, [&] { expect(!sequence::read_frame_values(file, "focus-distance").empty(), "no value"); });
}

// An argument in each line; the first one is the command. A new program now and then: options keep what they had.
void run_command_line(Input input) {
    static std::unique_ptr<cli::Program> program;
    static unsigned runs = 0;
    constexpr unsigned often = 512;
    if (runs++ % often == 0)
        program = std::make_unique<cli::Program>();
    std::vector<std::string> arguments{"fathom"};
    const auto many = [figures = 0](unsigned char c) mutable {
        return (figures = std::isdigit(c) ? figures + 1 : 0) > 5;
    };
    if (text_of(input).find("frames") != std::string_view::npos && std::any_of(input.begin(), input.end(), many))
        return; // ten million frames take seconds
    for (std::string_view rest = text_of(input); !rest.empty();) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        arguments.emplace_back(rest.substr(0, std::min(end, rest.find('\0')))); // which no argument holds
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    std::vector<const char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(argument.c_str());
    try {
        expect(static_cast<bool>(program->parse(static_cast<int>(argv.size()), argv.data())), "nothing to do");
    } catch (const cli::UsageError& refused) {
        expect(*refused.what() != '\0', "no message");
    } catch (const Error& refused) { // of a file of --animate
        expect(*refused.what() != '\0', "no message");
    }
}

constexpr Target targets[] = {
    {"camera", run_camera, nullptr, longest_text}, {"calibration", run_calibration, nullptr, longest_text},
    {"colmap", run_colmap, nullptr, longest_text}, {"preset", run_preset, nullptr, 256},
    {"frames", run_frames, nullptr, 64},           {"pattern", run_pattern, nullptr, 64},
    {"values", run_values, nullptr, longest_text}, {"command_line", run_command_line, nullptr, 256},
};

} // namespace

std::span<const Target> text_targets() {
    return targets;
}

} // namespace fathom::fuzz

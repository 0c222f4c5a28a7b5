// Which depth images the arguments stand for.
#include "inputs.hpp"

#include "camera_file/file.hpp"
#include "terminal/exit.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <utility>

namespace fathom::shot {

using sequence::FramePattern;

const std::vector<Input>& Inputs::all() const {
    if (all_.empty())
        for (const std::string& argument : arguments)
            if (arguments.size() == 1 || !argument.ends_with(".fathom.json")) // of a shell's *: records of --resume
                add(argument);
    return all_;
}

bool Inputs::is_sequence() const {
    return all().size() > 1 || !there_.empty() || is_piped();
}

Inputs::Shots Inputs::shots() const {
    using Alike = std::pair<std::optional<std::size_t>, std::string>; // the source, and the names
    std::map<Alike, std::vector<std::size_t>> found;
    for (std::size_t i = 0; i < all().size(); ++i) {
        const auto& [file, frame, source] = all()[i];
        const bool is_of_one = source && !there_[*source].empty();
        const auto pattern = is_of_one ? std::nullopt : FramePattern::of(file);
        found[{source, is_of_one ? "" : pattern ? pattern->first.beside_number() : file}].push_back(i);
    }
    Shots shots{{}, std::vector<std::optional<std::size_t>>(all().size())};
    for (const auto& [alike, inputs] : found) {
        const std::optional<std::size_t> source = alike.first;
        std::map<Frame, std::string> files = source ? there_[*source] : std::map<Frame, std::string>{};
        if (files.empty() && inputs.size() > 1) {
            std::vector<std::string> names;
            for (const std::size_t i : inputs)
                names.push_back(all_[i].file);
            if (const auto common = FramePattern::common(names))
                files = source ? common->second : common->first.files();
        }
        if (files.size() < 2)
            continue;
        for (const std::size_t i : inputs)
            shots.of_inputs[i] = shots.files.size();
        shots.files.push_back(std::move(files));
    }
    return shots;
}

void Inputs::add(const std::string& argument) const {
    if (io::is_folder(argument)) {
        add_files(argument, sequence::depth_files_in(argument));
    } else if (const auto pattern = FramePattern::in(argument); pattern && !io::is_there(argument)) {
        const std::map<Frame, std::string> files = pattern->files();
        if (files.empty())
            throw Error(argument + ": no frame of this name is there; check the folder, and how many figures the "
                                   "numbers have (%04d and #### mean four)");
        add_sequence(*pattern, files);
    } else if (sequence::has_glob(argument) && !io::is_there(argument)) {
        add_files(argument, sequence::matching_files(argument));
    } else if (is_pipe(argument, pipes)) {
        if (frames || arguments.size() > 1)
            throw UsageError(frames ? "--frames: a pipe has the frames that come, from 1 on; leave it out"
                                    : argument + ": is a pipe, beside which there can be no other depth");
        all_.push_back({argument, 1});
    } else {
        if (frames)
            throw UsageError(fmt::format("--frames: chooses from a sequence, and {} is a file; give the name of all "
                                         "frames, as in shot.####.exr, between quotation marks",
                                         argument));
        all_.push_back({argument, frame_of(argument)});
    }
}

void Inputs::add_files(const std::string& argument, const std::vector<std::string>& files) const {
    if (files.empty())
        throw Error(argument + ": stands for no image; check the name");
    const auto common = FramePattern::common(files);
    if (frames && !common)
        throw UsageError(fmt::format("--frames: {} holds more than one sequence; give the name of one, as in "
                                     "shot.####.exr",
                                     argument));
    if (common)
        return add_sequence(common->first, common->second);
    for (const std::string& file : files)
        all_.push_back({file, frame_of(file), there_.size()});
    there_.emplace_back();
}

void Inputs::add_sequence(const FramePattern& pattern, const std::map<Frame, std::string>& files) const {
    if (frames)
        for (const Frame frame : *frames)
            all_.push_back({pattern.name(frame), frame, there_.size()});
    else
        for (const auto& [frame, file] : files)
            all_.push_back({file, frame, there_.size()});
    there_.push_back(files);
}

std::optional<Frame> frame_of(const std::string& file) {
    const auto pattern = FramePattern::of(file);
    return pattern ? std::optional(pattern->second) : std::nullopt;
}

} // namespace fathom::shot

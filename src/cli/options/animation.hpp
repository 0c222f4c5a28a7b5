#pragma once

#include "shot/inputs.hpp"

#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace fathom::cli {

/// An option whose value changes from frame to frame.
struct Animation {
    CLI::Option* option;
    std::string file;
    std::map<Frame, std::string> values;
};

/// Adds --animate NAME=FILE. Every value of the file is parsed and checked as the option itself does it, and the first one
/// stays, so that what depends on the option can be checked before a frame is read.
void add_animate_option(CLI::App& app, std::vector<Animation>& animations);

/// The values of a frame, in the order of the animations. UsageError and Error where one is missing; `input` is named there.
std::vector<std::string> values_for(const std::vector<Animation>& animations, const Input& input);

/// Gives the options these values. Operations on other frames must not read them meanwhile.
void set_values(const std::vector<Animation>& animations, const std::vector<std::string>& values);

} // namespace fathom::cli

#pragma once

#include "command.hpp"

#include <memory>
#include <string>

namespace CLI {
class App;
class FormatterBase;
class ParseError;
} // namespace CLI

namespace fathom::cli {

/// Begins a line of an option's meaning. Others end where they are full.
inline constexpr char new_line = '\v';

/// Lays out `--help`: what it does, usage, commands or options in aligned columns, then the command's notes. Options that
/// all operations share are shown by `--help all` only.
std::shared_ptr<CLI::FormatterBase> help_layout();

/// What is wrong with the arguments, in one sentence; unknown names come with the nearest known one.
std::string explain(const CLI::App& program, const CLI::ParseError& error);

} // namespace fathom::cli

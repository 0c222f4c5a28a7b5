#pragma once

#include <map>
#include <string>

/// What is compiled from here on is this operation's.
void compile_for(const std::string& operation);

/// The longest time that a kernel of an operation took, in any of its variants: to be built and to run first, in seconds.
const std::map<std::pair<std::string, std::string>, double>& compile_seconds();

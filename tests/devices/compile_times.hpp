#pragma once

#include <map>
#include <string>

/// Seconds on the wall, or with CLOCK=processor those of all threads and of processes that have ended: a busy machine hardly
/// changes them.
double seconds_now();

/// What is compiled from here on is this operation's.
void compile_for(const std::string& operation);

/// The longest time that a kernel of an operation took, in any of its variants: to be built and to run first, in seconds.
const std::map<std::pair<std::string, std::string>, double>& compile_seconds();

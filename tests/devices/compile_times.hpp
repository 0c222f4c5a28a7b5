#pragma once

#include <map>
#include <string>

/// The longest time that a kernel took, in any of its variants: to be built and to run first, in seconds. By the kernel's name.
const std::map<std::string, double>& compile_seconds();

#pragma once

#include <nanobind/nanobind.h>

/// Functions of this module as built-in functions, whose calls cost no frame of Python's.
namespace fathom::python {

void bind_functions(nanobind::module_& module);

} // namespace fathom::python

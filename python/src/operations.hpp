#pragma once

#include <nanobind/nanobind.h>

/// `fathom.linearize` and the other operations.
namespace fathom::python {

void bind_operations(nanobind::module_& module);

} // namespace fathom::python

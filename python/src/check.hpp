#pragma once

#include <nanobind/nanobind.h>

/// `fathom.check`.
namespace fathom::python {

void bind_check(nanobind::module_& module);

} // namespace fathom::python

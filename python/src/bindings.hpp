#pragma once

#include <nanobind/nanobind.h>

/// What the files of the module add to it.
namespace fathom::python {

void bind_camera(nanobind::module_& module); ///< `fathom.Camera`
void bind_check(nanobind::module_& module);  ///< `fathom.check`
void bind_end(nanobind::module_& module);    ///< lets the interpreter's end wait
void bind_functions(
    nanobind::module_& module); ///< functions as built-in functions, whose calls cost no frame of Python's
void bind_operations(nanobind::module_& module); ///< `fathom.linearize` and the other operations

} // namespace fathom::python

#pragma once

#include <nanobind/nanobind.h>

/// Work without the interpreter's lock, also while the interpreter ends.
namespace fathom::python {

/// Gives the interpreter's lock to others for as long as it lives.
///
/// A thread that asks for the lock once the interpreter is ending is unwound by it (pthread_exit), which no destructor
/// allows: the process would abort. So the interpreter's end waits for the work that has begun, and work that a thread
/// begins later does not begin: the thread ends with the process.
class Unlocked {
public:
    Unlocked();
    ~Unlocked();
    Unlocked(const Unlocked&) = delete;
    Unlocked& operator=(const Unlocked&) = delete;

private:
    PyThreadState* state_;
};

} // namespace fathom::python

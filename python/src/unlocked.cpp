// Work without the interpreter's lock, and the interpreter's end.
#include "unlocked.hpp"

#include <atomic>
#include <chrono>
#include <thread>

namespace fathom::python {
namespace {

namespace nb = nanobind;

std::atomic<int> at_work{0};
std::atomic<bool> ending{false};
std::thread::id ended_by; // goes on working: other hooks may need it

void end_work() {
    ended_by = std::this_thread::get_id();
    ending = true;
    PyThreadState* state = PyEval_SaveThread();
    while (const int threads = at_work)
        at_work.wait(threads);
    PyEval_RestoreThread(state);
}

// Threads that worked in the parent are not there in the child.
void begin_child() {
    at_work = 0;
    ending = false;
}

} // namespace

Unlocked::Unlocked() {
    ++at_work; // before the lock is given away, so that end_work sees it
    state_ = PyEval_SaveThread();
    if (!ending || ended_by == std::this_thread::get_id())
        return;
    --at_work;
    at_work.notify_all();
    while (true)
        std::this_thread::sleep_for(std::chrono::hours(1));
}

Unlocked::~Unlocked() {
    PyEval_RestoreThread(state_);
    --at_work;
    at_work.notify_all();
}

void bind_end(nb::module_& module) {
    module.def("_end_work", end_work);
    module.def("_begin_child", begin_child);
    nb::module_::import_("atexit").attr("register")(module.attr("_end_work"));
    if (const auto os = nb::module_::import_("os"); nb::hasattr(os, "register_at_fork"))
        os.attr("register_at_fork")(nb::arg("after_in_child") = module.attr("_begin_child"));
}

} // namespace fathom::python

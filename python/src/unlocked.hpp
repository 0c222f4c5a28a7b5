#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <chrono>
#include <thread>

/// Work without the interpreter's lock, also while the interpreter ends.
namespace fathom::python {

inline std::atomic<int> at_work{0};
inline std::atomic<bool> is_ending{false};
inline std::thread::id ended_by; // goes on working: other hooks may need it

/// Gives the interpreter's lock to others for as long as it lives.
///
/// A thread that asks for the lock once the interpreter is ending is unwound by it (pthread_exit), which no destructor
/// allows: the process would abort. So the interpreter's end waits for the work that has begun, and work that a thread
/// begins later does not begin: the thread ends with the process.
class Unlocked {
public:
    Unlocked() {
        ++at_work; // before the lock is given away, so that end_work sees it
        state_ = PyEval_SaveThread();
        if (!is_ending || ended_by == std::this_thread::get_id())
            return;
        --at_work;
        at_work.notify_all();
        while (true)
            std::this_thread::sleep_for(std::chrono::hours(1));
    }
    ~Unlocked() {
        PyEval_RestoreThread(state_);
        --at_work;
        at_work.notify_all();
    }
    Unlocked(const Unlocked&) = delete;
    Unlocked& operator=(const Unlocked&) = delete;

private:
    PyThreadState* state_;
};

/// For `atexit`.
inline void end_work() {
    ended_by = std::this_thread::get_id();
    is_ending = true;
    PyThreadState* state = PyEval_SaveThread();
    while (const int threads = at_work)
        at_work.wait(threads);
    PyEval_RestoreThread(state);
}

/// In a child of `fork`, which does not have the threads that worked in the parent.
inline void begin_child() {
    at_work = 0;
    is_ending = false;
}

} // namespace fathom::python

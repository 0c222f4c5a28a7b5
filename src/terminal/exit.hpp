#pragma once

#include <stdexcept>

namespace fathom::terminal {

/// What the program says to the shell. An interrupt is 128 plus the signal's number: 130 for Ctrl-C.
enum ExitCode : int { done = 0, input_failed = 1, wrong_usage = 2, no_device = 3 };

/// The arguments contradict each other or the files that are there. Nothing was done yet.
class UsageError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Call it before there are other threads: one that it starts takes Ctrl-C, SIGTERM and SIGHUP, which end the program once `last` is
/// done.
/// A file that grows past `ulimit -f` is an error from now on, and so is a pipe that nobody reads.
void watch_interrupts(void (*last)());

/// From now on the first Ctrl-C (or SIGTERM, SIGHUP) only asks the work to stop where nothing is left half done;
/// the second ends the program at once.
void catch_interrupts();

/// What `stop_if_interrupted` throws. No std::exception, so that no file is blamed for it.
struct Interrupted {
    int signal;
};

/// Asks the work to stop as a signal does.
void interrupt(int signal);

/// Did a signal come?
bool is_interrupted();

/// Throws: Interrupted, when a signal came.
void stop_if_interrupted();

} // namespace fathom::terminal

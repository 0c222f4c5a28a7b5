// Signals set a flag, which is tested between two steps of the work.
#include "interrupt.hpp"

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace fathom::cli {
namespace {

std::atomic<int> received = 0; // read by several threads
static_assert(std::atomic<int>::is_always_lock_free);

void remember(int signal) {
    received = signal;
}

} // namespace

void catch_interrupts() {
    std::signal(SIGXFSZ, SIG_IGN);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction action {};
        sigaction(signal, nullptr, &action);
        if (action.sa_handler == SIG_IGN) // started with nohup or in the background: stays ignored
            continue;
        action = {};
        action.sa_handler = remember;
        action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
        sigaction(signal, &action, nullptr);
    }
}

bool is_interrupted() {
    return received != 0;
}

void stop_if_interrupted() {
    if (is_interrupted())
        throw Interrupted{received};
}

} // namespace fathom::cli

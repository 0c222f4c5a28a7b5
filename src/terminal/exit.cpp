// How the program is asked to end. A thread waits for signals and sets a flag, which is tested between two steps of the work.
// All others have them blocked: compilers of OpenCL kernels in this process have handlers of their own, which would delete what
// they compile.
#include "exit.hpp"

#include <atomic>
#include <csignal>
#include <system_error>
#include <thread>

#include <unistd.h>

namespace fathom::terminal {
namespace {

std::atomic<bool> asks = false; // the first signal only asks
std::atomic<int> received = 0;

[[noreturn]] void wait_for(const sigset_t& signals, void (*last)()) {
    for (;;) {
        int signal = 0;
        if (sigwait(&signals, &signal) != 0)
            continue;
        if (asks && received.exchange(signal) == 0)
            continue;
        last();
        std::signal(signal, SIG_DFL);
        pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
        kill(getpid(), signal);
    }
}

} // namespace

void watch_interrupts(void (*last)()) {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction action {};
        sigaction(signal, nullptr, &action);
        if (action.sa_handler != SIG_IGN) // started with nohup or in the background: stays ignored
            sigaddset(&signals, signal);
    }
    std::signal(SIGXFSZ, SIG_IGN); // a file that would be larger than allowed cannot be written, as on a full disk
    std::signal(SIGPIPE, SIG_IGN); // it would end the program while a file is written
    pthread_sigmask(SIG_BLOCK, &signals, nullptr); // threads that start from now on inherit it
    try {
        std::thread(wait_for, signals, last).detach();
    } catch (const std::system_error&) { // no more threads: signals end the program as ever
        pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    }
}

void catch_interrupts() {
    asks = true;
}

void interrupt(int signal) {
    int none = 0;
    received.compare_exchange_strong(none, signal);
}

bool is_interrupted() {
    return received != 0;
}

void stop_if_interrupted() {
    if (is_interrupted())
        throw Interrupted{received};
}

} // namespace fathom::terminal

// Frames through oneTBB's pipeline. Each frame in work may have a thread of its own, because a step mostly waits for other
// threads: a codec's or the device's. Where the number of threads is a limit, files and device take turns instead.
#include "memory.hpp"

#include <fathom/frames.hpp>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <list>
#include <mutex>
#include <thread>
#include <vector>

namespace fathom {
namespace {

// A frame in work.
struct Begun {
    std::size_t index;
    std::shared_ptr<void> frame;
    std::exception_ptr failure = {};
    bool was_read = false;
};

void take(const std::function<void(std::size_t, void*)>& step, Begun& begun) {
    if (begun.failure)
        return;
    try {
        step(begun.index, begun.frame.get());
    } catch (...) {
        begun.failure = std::current_exception();
    }
}

std::size_t threads_of(const FrameOptions& options) {
    return options.threads > 0 ? static_cast<std::size_t>(options.threads)
                               : std::max(1u, std::thread::hardware_concurrency());
}

// Frames in work: one is computed, `threads` are read and `threads` are written, if they fit into the memory.
std::size_t most_in_work(const FrameOptions& options, std::size_t bytes) {
    const std::size_t memory = options.memory > 0 ? options.memory : usable_memory() / 4;
    return std::clamp<std::size_t>(memory / std::max<std::size_t>(bytes, 1), 1, 2 * threads_of(options) + 1);
}

// So many threads of oneTBB, if it has them.
struct Workers {
    explicit Workers(std::size_t threads)
        : allowed(tbb::global_control::max_allowed_parallelism,
                  std::max(threads, tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))),
          arena(static_cast<int>(threads)) {}

    tbb::global_control allowed;
    tbb::task_arena arena;
};

} // namespace

std::size_t for_each_erased_frame(std::size_t count, const ErasedFrameSteps& steps, const FrameOptions& options) {
    // oneTBB 2021.8 loses what is on its way when a step throws, so that frames belong to this list. They end in order.
    std::list<Begun> in_work;
    std::mutex beginning_or_ending;
    using Token = Begun*;
    std::size_t next = 0;
    Token waiting = nullptr; // read, and not yet in work
    const auto begin = [&]() -> Token {
        if (waiting)
            return std::exchange(waiting, nullptr);
        if (next == count || (options.stop && options.stop()))
            return nullptr;
        Begun begun{next++, steps.make()};
        const std::lock_guard lock(beginning_or_ending);
        return &in_work.emplace_back(std::move(begun));
    };
    const auto read = [&](Token begun) {
        if (!std::exchange(begun->was_read, true))
            take(steps.read, *begun);
        return begun;
    };
    const auto compute = [&](Token begun) {
        take(steps.compute, *begun);
        return begun;
    };
    const auto write = [&](Token begun) {
        take(steps.write, *begun);
        return begun;
    };
    const auto report = [&](Token begun) {
        steps.report(begun->index, begun->frame.get(), begun->failure);
        begun->frame.reset();
        const std::lock_guard lock(beginning_or_ending);
        in_work.pop_front();
    };

    // The first frame that can be read says how much memory one takes.
    for (Token begun; (begun = begin()); report(begun)) {
        read(begun);
        if (!begun->failure) {
            waiting = begun;
            break;
        }
    }
    if (!waiting)
        return next;
    const std::size_t left = count - next + 1;
    const std::size_t fit = left == 1 ? 1 : most_in_work(options, steps.bytes(waiting->frame.get()));
    const std::size_t most = std::min(fit, left);
    if (most == 1) {
        while (Token begun = begin())
            report(write(compute(read(begun))));
        return next;
    }
    if (options.apart) { // half of the frames are written while the other half is read
        Workers workers(threads_of(options));
        std::vector<Token> computed;
        do {
            std::vector<Token> begun;
            for (Token one; begun.size() < fit / 2 && (one = begin());)
                begun.push_back(one);
            workers.arena.execute([&] {
                const auto write_or_read = [&](std::size_t i) {
                    i < computed.size() ? write(computed[i]) : read(begun[i - computed.size()]);
                };
                tbb::parallel_for(std::size_t{0}, computed.size() + begun.size(), write_or_read,
                                  tbb::simple_partitioner());
            });
            std::ranges::for_each(computed, report);
            std::ranges::for_each(begun, compute);
            computed = std::move(begun);
        } while (!computed.empty());
        return next;
    }

    using tbb::filter_mode;
    Workers workers(most);
    workers.arena.execute([&] {
        tbb::parallel_pipeline(most, tbb::make_filter<void, Token>(filter_mode::serial_in_order,
                                                                   [&](tbb::flow_control& flow) {
                                                                       Token begun = begin();
                                                                       if (!begun)
                                                                           flow.stop();
                                                                       return begun;
                                                                   }) &
                                         tbb::make_filter<Token, Token>(filter_mode::parallel, read) &
                                         tbb::make_filter<Token, Token>(filter_mode::serial_in_order, compute) &
                                         tbb::make_filter<Token, Token>(filter_mode::parallel, write) &
                                         tbb::make_filter<Token, void>(filter_mode::serial_in_order, report));
    });
    return next;
}

} // namespace fathom

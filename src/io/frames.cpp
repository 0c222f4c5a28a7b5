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

Begun* take(const std::function<void(std::size_t, void*)>& step, Begun* begun) {
    try {
        if (!begun->failure)
            step(begun->index, begun->frame.get());
    } catch (...) {
        begun->failure = std::current_exception();
    }
    return begun;
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

// All frames in work, and what is done with each. oneTBB 2021.8 loses what is on its way when a step throws, so that frames belong
// to this list. They end in order.
struct FramesInWork {
    const std::size_t count;
    const ErasedFrameSteps& steps;
    const FrameOptions& options;
    std::size_t next = 0;
    Begun* waiting = nullptr; // read, and not yet in work
    std::list<Begun> all = {};
    std::mutex beginning_or_ending = {};

    Begun* begin() {
        if (waiting)
            return std::exchange(waiting, nullptr);
        if (next == count || (options.stop && options.stop()))
            return nullptr;
        Begun begun{next++, steps.make()};
        const std::lock_guard lock(beginning_or_ending);
        return &all.emplace_back(std::move(begun));
    }
    Begun* read(Begun* begun) const { return std::exchange(begun->was_read, true) ? begun : take(steps.read, begun); }
    Begun* compute(Begun* begun) const { return take(steps.compute, begun); }
    Begun* write(Begun* begun) const { return take(steps.write, begun); }
    void report(Begun* begun) {
        steps.report(begun->index, begun->frame.get(), begun->failure);
        begun->frame.reset();
        const std::lock_guard lock(beginning_or_ending);
        all.pop_front();
    }
};

// So many frames are written while as many others are read.
void take_turns(FramesInWork& frames, std::size_t half) {
    Workers workers(threads_of(frames.options));
    std::vector<Begun*> computed;
    do {
        std::vector<Begun*> begun;
        for (Begun* one; begun.size() < half && (one = frames.begin());)
            begun.push_back(one);
        workers.arena.execute([&] {
            const auto write_or_read = [&](std::size_t i) {
                i < computed.size() ? frames.write(computed[i]) : frames.read(begun[i - computed.size()]);
            };
            tbb::parallel_for(std::size_t{0}, computed.size() + begun.size(), write_or_read, tbb::simple_partitioner());
        });
        std::ranges::for_each(computed, [&](Begun* each) { frames.report(each); });
        std::ranges::for_each(begun, [&](Begun* each) { frames.compute(each); });
        computed = std::move(begun);
    } while (!computed.empty());
}

void overlap(FramesInWork& frames, std::size_t most) {
    const auto begin = [&](tbb::flow_control& flow) {
        Begun* begun = frames.begin();
        if (!begun)
            flow.stop();
        return begun;
    };
    const auto read = [&](Begun* begun) { return frames.read(begun); };
    const auto compute = [&](Begun* begun) { return frames.compute(begun); };
    const auto write = [&](Begun* begun) { return frames.write(begun); };
    const auto report = [&](Begun* begun) { frames.report(begun); };
    using tbb::filter_mode, tbb::make_filter;
    Workers workers(most);
    workers.arena.execute([&] {
        tbb::parallel_pipeline(most, make_filter<void, Begun*>(filter_mode::serial_in_order, begin) &
                                         make_filter<Begun*, Begun*>(filter_mode::parallel, read) &
                                         make_filter<Begun*, Begun*>(filter_mode::serial_in_order, compute) &
                                         make_filter<Begun*, Begun*>(filter_mode::parallel, write) &
                                         make_filter<Begun*, void>(filter_mode::serial_in_order, report));
    });
}

} // namespace

std::size_t for_each_erased_frame(std::size_t count, const ErasedFrameSteps& steps, const FrameOptions& options) {
    FramesInWork frames{count, steps, options};
    // The first frame that can be read says how much memory one takes.
    while (Begun* begun = frames.begin()) {
        if (!frames.read(begun)->failure) {
            frames.waiting = begun;
            break;
        }
        frames.report(begun);
    }
    if (!frames.waiting)
        return frames.next;
    const std::size_t left = count - frames.next + 1;
    const std::size_t fit = left == 1 ? 1 : most_in_work(options, steps.bytes(frames.waiting->frame.get()));
    const std::size_t most = std::min(fit, left);
    if (most > 1 && options.apart)
        take_turns(frames, fit / 2);
    else if (most > 1)
        overlap(frames, most);
    else
        while (Begun* begun = frames.begin())
            frames.report(frames.write(frames.compute(frames.read(begun))));
    return frames.next;
}

} // namespace fathom

// The loop that all operations on depth images share.
#include "each_depth.hpp"

#include "pipes.hpp"
#include "relative.hpp"
#include "steps.hpp"
#include "telling.hpp"

#include "terminal/exit.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <limits>
#include <utility>

namespace fathom::cli {
namespace {

// Reads the first input while the driver is loaded, which takes as long, if as many threads may work as there are.
std::future<void> read_ahead(const DepthOptions& options, const Steps& steps, const std::vector<Job>& jobs,
                             const std::vector<std::size_t>& wanted, Work& first) {
    if (options.resume || options.device.threads > 0 || wanted.empty() || !jobs[wanted.front()].missing.empty())
        return {};
    static_cast<Job&>(first.frame) = jobs[wanted.front()];
    // Where the system has no more threads, it is read when it is asked for.
    return std::async(std::launch::async | std::launch::deferred, [&steps, &first] {
        const Stopwatch watch(first.times.read);
        steps.load(first);
    });
}

} // namespace

int each_depth(const DepthOptions& options, const Product& product, const More& of_command,
               const Operation& operation) {
    More more = of_command;
    if (!options.ignore.empty())
        more.companions.push_back({"--ignore", options.ignore}); // behind those that the command knows
    static_cast<void>(report_of(options));                       // refuses what contradicts itself
    std::vector<Output> outputs{{"-o", options.output, product}};
    outputs.insert(outputs.end(), more.outputs.begin(), more.outputs.end());
    Pipes pipes(options, outputs, more.companions);
    std::vector<Job> jobs = plan(options, outputs, more.companions); // of piped depth the first
    if (!options.relative.order) {                                   // what is wrong for all inputs is told once
        std::vector<Input> read_as(jobs.size());
        std::ranges::transform(jobs, read_as.begin(), &Job::read_as);
        try {
            options.camera.read(std::move(read_as));
        } catch (const Error& error) {
            std::ranges::for_each(jobs, [&](const Job& job) { announce_failure(options.report, job, error.what()); });
            throw;
        }
    }
    catch_interrupts();
    options.device.prepare(options.memory);
    std::vector<std::string> ranges;
    if (options.relative.order && !options.relative.options.range && !pipes.of_depth())
        ranges = find_ranges(options, jobs);
    std::vector<std::size_t> wanted;
    for (std::size_t i = 0; i < jobs.size(); ++i)
        if (!jobs[i].left_out)
            wanted.push_back(i);
    Steps steps(options, outputs, more, operation);
    Work first;
    std::future<void> reading;
    if (!pipes.any())
        reading = read_ahead(options, steps, jobs, wanted, first);
    const Device device = options.device.open(options.memory);
    const bool apart = options.device.takes_turns(device);
    const std::size_t most = pipes.of_depth() ? std::numeric_limits<std::size_t>::max() : wanted.size();
    if (apart)
        options.device.share_among(pipes.of_depth() ? most : jobs.size());
    pipes.open();
    steps.use(device, apart);
    Telling telling(options, outputs, jobs, device);
    telling.begin(ranges);
    const std::size_t begun = for_each_frame<Work>(
        most,
        {.read =
             [&](std::size_t n, Work& work) {
                 if (n == 0 && reading.valid()) {
                     reading.wait();
                     work = std::move(first);
                     reading.get(); // what it threw
                 } else {
                     Job& job = work.frame;
                     job = pipes.of_depth() ? plan_frame(options, outputs, more.companions, static_cast<Frame>(n) + 1)
                                            : jobs[wanted[n]];
                     if (pipes.any())
                         pipes.give(n, job);
                 }
                 steps.read(work);
             },
         .compute = [&](std::size_t, Work& work) { steps.compute(work); },
         .write = [&](std::size_t, Work& work) { steps.write(work); },
         .report =
             [&](std::size_t n, Work& work, const std::exception_ptr& failure) {
                 telling.tell(pipes.of_depth() ? n : wanted[n], work, failure);
                 if (options.output != standard_stream)
                     return;
                 if (failure) {
                     pipes.stop();
                     throw Error(fmt::format("standard output: ends before frame {}, which failed", n + 1));
                 }
                 write_to_stdout(work.raw);
             },
         .bytes = [&](const Work& work) { return steps.bytes(work); }},
        {.threads = options.device.threads, .apart = apart, .memory = options.memory, .stop = [&] {
             return is_interrupted() || telling.has_no_place() || (pipes.any() && !pipes.next());
         }});
    telling.sum_up();
    if (begun < most)
        stop_if_interrupted();
    pipes.check_end(most);
    return telling.finish() ? done : input_failed;
}

} // namespace fathom::cli

// for_each_frame: every frame once, steps in order where they are promised to be, no more frames in work than the memory
// allows, failures that stay with their frame.
#include "catch.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>

#include <atomic>
#include <mutex>

namespace {

constexpr int patience_ms = 20000; // for another thread

// What a frame holds: how often it was read, computed and written. Counts its own kind.
struct Frame {
    Frame() { ++living; }
    ~Frame() { --living; }
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

    static inline std::atomic<int> living = 0;
    int read = 0, computed = 0, written = 0;
};

// How many are in a step at the same time, at most.
class Busy {
public:
    class Entered {
    public:
        explicit Entered(Busy& busy) : busy_(busy) {
            const int now = ++busy_.now_;
            for (int most = busy_.most_; now > most && !busy_.most_.compare_exchange_weak(most, now);) {
            }
        }
        ~Entered() { --busy_.now_; }
        Entered(const Entered&) = delete;
        Entered& operator=(const Entered&) = delete;

    private:
        Busy& busy_;
    };
    int most() const { return most_; }

private:
    std::atomic<int> now_ = 0, most_ = 0;
};

void wait_ms(double ms) {
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(ms));
}

std::vector<std::size_t> first_numbers(std::size_t count) {
    std::vector<std::size_t> numbers(count);
    std::iota(numbers.begin(), numbers.end(), std::size_t{0});
    return numbers;
}

} // namespace

TEST_CASE("frames: every frame goes through every step once, computed and reported in order") {
    const std::size_t count = GENERATE(std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{100});
    const int threads = GENERATE(1, 2, 7);
    const bool apart = GENERATE(false, true);
    std::vector<std::size_t> computed, reported;
    Busy computing, reporting;
    const auto step_ms = [](std::size_t index, unsigned step) { // another one each time, so that frames overtake
        return 0.5 * static_cast<double>(std::minstd_rand(static_cast<unsigned>(index) * 3 + step + 1)() % 4);
    };
    const std::size_t begun = fathom::for_each_frame<Frame>(
        count,
        {.read =
             [&](std::size_t i, Frame& frame) {
                 wait_ms(step_ms(i, 0));
                 ++frame.read;
             },
         .compute =
             [&](std::size_t i, Frame& frame) {
                 const Busy::Entered entered(computing);
                 wait_ms(step_ms(i, 1));
                 computed.push_back(i);
                 frame.computed += frame.read;
             },
         .write =
             [&](std::size_t i, Frame& frame) {
                 wait_ms(step_ms(i, 2));
                 frame.written += frame.computed;
             },
         .report =
             [&](std::size_t i, Frame& frame, const std::exception_ptr& failure) {
                 const Busy::Entered entered(reporting);
                 reported.push_back(frame.read == 1 && frame.written == 1 && !failure ? i : count);
             }},
        {.threads = threads, .apart = apart});
    CHECK(begun == count);
    CHECK(computed == first_numbers(count));
    CHECK(reported == first_numbers(count));
    CHECK(computing.most() <= 1);
    CHECK(reporting.most() <= 1);
    CHECK(Frame::living == 0);
}

TEST_CASE("frames: steps of different frames overlap") {
    // Each of the steps waits for another frame's: without overlap none would ever go on.
    std::atomic<std::size_t> reads = 0, computes = 0;
    constexpr std::size_t count = 6;
    std::atomic<bool> late = false;
    const auto wait_for = [&](const auto& reached) {
        for (int i = 0; !reached(); ++i, wait_ms(1))
            if (i > patience_ms) {
                late = true;
                return;
            }
    };
    fathom::for_each_frame<Frame>(
        count,
        {.read = [&](std::size_t, Frame&) { ++reads; },
         .compute =
             [&](std::size_t i, Frame&) {
                 wait_for([&] { return reads > std::min(i + 1, count - 1); }); // the next one is read
                 ++computes;
             },
         .write =
             [&](std::size_t i, Frame&) {
                 wait_for([&] { return computes > std::min(i + 1, count - 1); }); // the next one is computed
             }},
        {.threads = 2});
    CHECK_FALSE(late);
}

TEST_CASE("frames: apart, as many as there are threads are read and written, and none while one is computed") {
    const int threads = GENERATE(1, 2, 4);
    Busy files;
    std::atomic<bool> computing = false, together = false;
    // On a busy machine a thread may start late: a frame in the middle waits for another one.
    const auto use_files = [&](std::size_t index, Frame&) {
        const Busy::Entered entered(files);
        together = together || computing;
        wait_ms(3);
        for (int waited = 0; index == 5 && threads > 1 && files.most() < 2 && waited < 1000; ++waited)
            wait_ms(1);
        together = together || computing;
    };
    const auto compute = [&](std::size_t, Frame&) {
        computing = true;
        wait_ms(1);
        computing = false;
    };
    fathom::for_each_frame<Frame>(20, {.read = use_files, .compute = compute, .write = use_files},
                                  {.threads = threads, .apart = true});
    CHECK_FALSE(together);
    CHECK(files.most() <= threads);
    CHECK(files.most() >= std::min(threads, 2));
}

TEST_CASE("frames: no more of them are in work than the memory holds, nor than threads need") {
    const bool apart = GENERATE(false, true);
    constexpr std::size_t frame_bytes = 1000;
    struct Case {
        std::size_t memory;
        int threads, most;
    };
    const Case the = GENERATE(Case{1, 4, 1}, Case{1999, 4, 1}, Case{2000, 4, 2}, Case{3500, 4, 3}, Case{1000000, 1, 3},
                              Case{1000000, 4, 9});
    int most = 0;
    std::mutex guard;
    const auto look = [&](std::size_t i, Frame&) {
        for (int ms = 0; !apart && i == 0 && Frame::living < std::min(the.most, 2) && ms < patience_ms; ++ms)
            wait_ms(1); // a second frame begins while the first one is in work
        const std::lock_guard locked(guard);
        most = std::max(most, Frame::living.load());
    };
    fathom::for_each_frame<Frame>(60,
                                  {.compute = look, .write = look, .bytes = [&](const Frame&) { return frame_bytes; }},
                                  {.threads = the.threads, .apart = apart, .memory = the.memory});
    INFO(the.memory << " bytes, " << the.threads << " threads, apart " << apart);
    CHECK(most <= the.most);
    CHECK(most >= std::min(the.most, 2));
}

TEST_CASE("frames: the first frame that can be read says how much memory one takes") {
    std::vector<std::size_t> asked;
    std::atomic<int> reading = 0, most = 0;
    fathom::for_each_frame<Frame>(20,
                                  {.read =
                                       [&](std::size_t i, Frame& frame) {
                                           if (i < 2)
                                               throw std::runtime_error("damaged");
                                           frame.read = static_cast<int>(i);
                                           most = std::max(most.load(), ++reading);
                                           wait_ms(1);
                                           --reading;
                                       },
                                   .bytes =
                                       [&](const Frame& frame) {
                                           asked.push_back(static_cast<std::size_t>(frame.read));
                                           return std::size_t{100};
                                       }},
                                  {.threads = 4, .memory = 100});
    CHECK(asked == std::vector<std::size_t>{2});
    CHECK(most == 1);
}

TEST_CASE("frames: a step that throws ends its frame only, and report gets what it threw") {
    constexpr std::size_t count = 40;
    const int failing = GENERATE(0, 1, 2); // the step
    const std::size_t memory = GENERATE(std::size_t{0}, std::size_t{1});
    const bool apart = GENERATE(false, true);
    const auto is_bad = [](std::size_t i) { return i % 7 == 0 || i == count - 1; };
    std::vector<int> steps(count, 0);
    const auto step = [&](int number) {
        return [&, number](std::size_t i, Frame&) {
            ++steps[i];
            if (number == failing && is_bad(i))
                throw fathom::Error("bad frame " + std::to_string(i));
        };
    };
    std::vector<std::string> reported;
    const std::size_t begun =
        fathom::for_each_frame<Frame>(count,
                                      {.read = step(0),
                                       .compute = step(1),
                                       .write = step(2),
                                       .report =
                                           [&](std::size_t i, Frame&, const std::exception_ptr& failure) {
                                               std::string text = "done " + std::to_string(i);
                                               try {
                                                   if (failure)
                                                       std::rethrow_exception(failure);
                                               } catch (const fathom::Error& error) {
                                                   text = error.what();
                                               }
                                               reported.push_back(text);
                                           }},
                                      {.threads = 3, .apart = apart, .memory = memory});
    CHECK(begun == count);
    REQUIRE(reported.size() == count);
    for (std::size_t i = 0; i < count; ++i) {
        CHECK(reported[i] == (is_bad(i) ? "bad frame " : "done ") + std::to_string(i));
        CHECK(steps[i] == (is_bad(i) ? failing + 1 : 3));
    }
}

TEST_CASE("frames: what is no std::exception reaches report, too, and no frame need succeed") {
    int failures = 0;
    CHECK(fathom::for_each_frame<Frame>(
              5, {.read = [](std::size_t, Frame&) { throw 7; },
                  .report = [&](std::size_t, Frame&,
                                const std::exception_ptr& failure) { failures += failure != nullptr; }}) == 5);
    CHECK(failures == 5);
}

TEST_CASE("frames: a stop finishes the frames in work, and begins no other") {
    constexpr std::size_t count = 1000;
    const std::size_t memory = GENERATE(std::size_t{0}, std::size_t{1});
    const bool apart = GENERATE(false, true);
    std::atomic<bool> stop = false;
    std::atomic<std::size_t> read = 0, written = 0;
    std::vector<std::size_t> reported;
    const std::size_t begun = fathom::for_each_frame<Frame>(
        count,
        {.read = [&](std::size_t, Frame&) { ++read; },
         .compute =
             [&](std::size_t i, Frame&) {
                 if (i == 10)
                     stop = true;
             },
         .write = [&](std::size_t, Frame&) { ++written; },
         .report = [&](std::size_t i, Frame&, const std::exception_ptr&) { reported.push_back(i); }},
        {.threads = 2, .apart = apart, .memory = memory, .stop = [&] { return stop.load(); }});
    CHECK(begun >= 11);
    CHECK(begun <= 11 + 5); // 2 · threads + 1 are in work
    CHECK(read == begun);
    CHECK(written == begun);
    CHECK(reported == first_numbers(begun));
}

TEST_CASE("frames: what report throws ends all work and comes out") {
    const std::size_t memory = GENERATE(std::size_t{0}, std::size_t{1});
    const bool apart = GENERATE(false, true);
    std::vector<std::size_t> reported;
    std::atomic<std::size_t> read = 0;
    CHECK_THROWS_WITH(fathom::for_each_frame<Frame>(1000,
                                                    {.read = [&](std::size_t, Frame&) { ++read; },
                                                     .report =
                                                         [&](std::size_t i, Frame&, const std::exception_ptr&) {
                                                             reported.push_back(i);
                                                             if (i == 3)
                                                                 throw std::runtime_error("enough");
                                                         }},
                                                    {.threads = 2, .apart = apart, .memory = memory}),
                      "enough");
    CHECK(reported == first_numbers(4));
    CHECK(read < 1000);
    CHECK(Frame::living == 0);
}

TEST_CASE("frames: steps may be left out, and a frame stays in its thread when it is the only one") {
    CHECK(fathom::for_each_frame<Frame>(3, {}) == 3);
    std::set<std::thread::id> threads;
    const auto step = [&](std::size_t, Frame&) { threads.insert(std::this_thread::get_id()); };
    CHECK(fathom::for_each_frame<Frame>(1, {.read = step, .compute = step, .write = step}) == 1);
    CHECK(threads == std::set{std::this_thread::get_id()});
}

TEST_CASE("frames: a step may take frames of its own through steps") {
    constexpr std::size_t outer = 6, inner = 20;
    std::vector<std::vector<std::size_t>> reported(outer);
    const auto nested = [&](std::size_t i, Frame&) {
        fathom::for_each_frame<Frame>(
            inner, {.read = [](std::size_t, Frame&) { wait_ms(0.2); },
                    .report = [&, i](std::size_t k, Frame&, const std::exception_ptr&) { reported[i].push_back(k); }});
    };
    std::vector<std::size_t> order;
    SECTION("in compute") {
        fathom::for_each_frame<Frame>(
            outer, {.compute = nested,
                    .report = [&](std::size_t i, Frame&, const std::exception_ptr&) { order.push_back(i); }});
    }
    SECTION("in write") {
        fathom::for_each_frame<Frame>(
            outer,
            {.write = nested, .report = [&](std::size_t i, Frame&, const std::exception_ptr&) { order.push_back(i); }});
    }
    CHECK(order == first_numbers(outer));
    for (const std::vector<std::size_t>& each : reported)
        CHECK(each == first_numbers(inner));
}

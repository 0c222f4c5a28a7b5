// Processes that share a shot (--share): each frame is made once, also if some of them are killed, stopped, have wrong clocks
// or equal process numbers. The truth is the run of a single process.
#include "program.hpp"

#include "sequence/claim.hpp"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <thread>

using namespace fathom::test;
using namespace std::chrono_literals;
using fathom::sequence::Claim;
using Contents = std::map<std::string, std::string>;
using Steady = std::chrono::steady_clock;

namespace {

constexpr auto lease = 2s;
constexpr double renewed_after = 0.25; // of a lease, at the latest: a killed process may have renewed that long ago

// Waits until something is so.
void await(const std::function<bool()>& condition) {
    const auto begin = Steady::now();
    while (!condition()) {
        REQUIRE(Steady::now() - begin < std::chrono::seconds(patience_s));
        std::this_thread::sleep_for(1ms);
    }
}

// Bars before a wall, which differ from frame to frame.
struct Shot {
    Folder folder;
    int count;
    std::string camera = camera_file(folder);

    explicit Shot(int frames, cv::Size size = {240, 160}) : count(frames) {
        for (int frame = 1; frame <= count; ++frame) {
            cv::Mat depth(size, CV_32FC1);
            for (int y = 0; y < size.height; ++y)
                for (int x = 0; x < size.width; ++x)
                    depth.at<float>(y, x) =
                        0.5f + 0.1f * static_cast<float>(x / 6 % 2) + 0.001f * static_cast<float>(frame);
            fathom::write_image(folder / fmt::format("shot.{:04}.pfm", frame), depth);
        }
    }

    std::string result(int frame) const { return folder / fmt::format("out/ao.{:04}.exr", frame); }
    std::string claim(int frame) const { return result(frame) + ".claim"; }
    std::string log(const std::string& who) const { return folder / (who + ".jsonl"); }

    Arguments command(const std::string& who, const Arguments& more) const {
        return joined({"ssao", folder / "shot.####.pfm", "--camera", camera, "-o", folder / "out/ao.####.exr",
                       "--confidence", folder / "out/conf.####.pfm", "--radius", "0.2", "--log", log(who)},
                      more);
    }
    Arguments shared(const std::string& who) const {
        return command(who, {"--share", "--lease", std::to_string(lease.count())});
    }

    Contents contents() const {
        Contents contents;
        for (const auto& entry : fs::directory_iterator(folder / "out"))
            contents[entry.path().filename().string()] = content(entry.path());
        return contents;
    }
    // Without what a process that stands still, or has died, is in the middle of. It may have made a frame, and not yet have
    // removed its claim.
    Contents results() const {
        Contents all = contents();
        std::erase_if(all, [](const auto& each) { return each.first.starts_with(".fathom-"); });
        for (int frame = 1; frame <= count; ++frame)
            if (fs::exists(result(frame)))
                all.erase(fs::path(claim(frame)).filename().string());
        return all;
    }
    bool has_claim() const {
        return std::ranges::any_of(fs::directory_iterator(folder / "out"),
                                   [](const auto& entry) { return entry.path().extension() == ".claim"; });
    }
    std::size_t claims() const {
        std::size_t claims = 0;
        for (int frame = 1; frame <= count; ++frame)
            claims += fs::exists(claim(frame));
        return claims;
    }

    // What a process on its own makes of it. The results are gone afterwards.
    Contents alone() const {
        check_done(run(command("alone", {"--resume"})));
        Contents made = contents();
        for (const auto& [name, bytes] : made)
            fs::remove(folder / ("out/" + name));
        REQUIRE(made.size() == 2 * static_cast<std::size_t>(count));
        return made;
    }

    // How often each frame has a status in these logs.
    std::map<int, int> times(const std::string& status, const std::vector<std::string>& logs) const {
        std::map<int, int> times;
        for (const std::string& who : logs)
            for (std::istringstream stream(content(log(who))); stream;) {
                std::string text;
                if (!std::getline(stream, text))
                    break;
                const auto line = nlohmann::json::parse(text);
                if (line.contains("status") && line.at("status") == status)
                    ++times[line.at("frame").get<int>()];
            }
        return times;
    }
    std::map<int, int> each_once() const {
        std::map<int, int> once;
        for (int frame = 1; frame <= count; ++frame)
            once[frame] = 1;
        return once;
    }
};

// Frames that a process of the test has claimed, so that others wait for them.
std::vector<std::unique_ptr<Claim>> claim_all(const Shot& shot) {
    std::vector<std::unique_ptr<Claim>> claims;
    for (int frame = 1; frame <= shot.count; ++frame)
        claims.push_back(Claim::take(shot.claim(frame), lease));
    return claims;
}

bool waits(const Run& run) {
    return run.out().find("for other processes; ") != std::string::npos;
}

// Processes that begin at the same time make each frame once.
void check_made_once(const Shot& shot, const std::vector<Arguments>& before) {
    const Contents truth = shot.alone();
    std::vector<std::unique_ptr<Claim>> gate = claim_all(shot);
    std::vector<std::unique_ptr<Run>> runs;
    std::vector<std::string> logs;
    for (std::size_t i = 0; i < before.size(); ++i) {
        logs.push_back(std::to_string(i));
        runs.push_back(std::make_unique<Run>(shot.shared(logs.back()), Surroundings{.before = before[i]}));
    }
    for (const auto& run : runs)
        await([&] { return waits(*run) || !run->is_running(); });
    std::this_thread::sleep_for(lease); // in which nobody takes a claim over
    for (const auto& claim : gate)
        CHECK(claim->still_mine());
    gate.clear();
    for (const auto& run : runs)
        check_done(run->outcome());
    CHECK(shot.times("made", logs) == shot.each_once());
    CHECK(shot.contents() == truth);
    for (const std::string& log : logs)
        std::cout << "process " << log << " made " << shot.times("made", {log}).size() << " of " << shot.count
                  << " frames\n";
}

// Stops a process while it has claimed frames that it has not made, and has made some.
void stop_with_claims(const Shot& shot, const Run& run) {
    await([&] { return fs::exists(shot.result(shot.count / 4)); });
    for (bool stopped = false; !stopped;) {
        await([&] { return shot.has_claim(); });
        run.send(SIGSTOP);
        std::this_thread::sleep_for(20ms);
        for (int frame = 1; frame <= shot.count; ++frame)
            stopped |= fs::exists(shot.claim(frame)) && !fs::exists(shot.result(frame));
        if (!stopped)
            run.send(SIGCONT);
    }
}

// Root reads and writes everything while it has this right.
Arguments unprivileged() {
    return geteuid() == 0 ? Arguments{"setpriv", "--bounding-set=-dac_override,-dac_read_search"} : Arguments{};
}

} // namespace

TEST_CASE("share: four processes make each frame once") {
    check_made_once(Shot(40), {{}, {}, {}, {}});
}

TEST_CASE("share: a finished shot is kept by all") {
    const Shot shot(3);
    const Contents truth = shot.alone();
    check_done(run(shot.shared("a")));
    check_done(run(shot.shared("b")));
    CHECK(shot.times("made", {"a"}) == shot.each_once());
    CHECK(shot.times("kept", {"b"}) == shot.each_once());
    CHECK(shot.contents() == truth);
}

TEST_CASE("share: a finished shot in a folder that cannot be written is kept") {
    const Shot shot(3);
    const Contents truth = shot.alone();
    check_done(run(shot.shared("a")));
    fs::permissions(shot.folder / "out", fs::perms::owner_write, fs::perm_options::remove);
    check_done(run(shot.shared("b"), {.before = unprivileged()}));
    CHECK(shot.times("kept", {"b"}) == shot.each_once());
    const Outcome refused = run(joined(shot.shared("c"), {"--falloff", "0.3"}), {.before = unprivileged()});
    check_refused(refused, 1, "cannot be made: "); // what is not finished cannot be claimed there
    fs::permissions(shot.folder / "out", fs::perms::owner_write, fs::perm_options::add);
    CHECK(shot.contents() == truth);
}

TEST_CASE("share: the frames of a killed process are made by the others after the lease") {
    const Shot shot(48);
    const Contents truth = shot.alone();
    Run killed(shot.shared("killed"));
    stop_with_claims(shot, killed);
    killed.send(SIGKILL);
    CHECK(killed.outcome().code == 128 + SIGKILL);
    const auto begin = Steady::now();
    std::map<int, int> left;
    for (int frame = 1; frame <= shot.count; ++frame)
        if (!fs::exists(shot.result(frame)))
            left[frame] = 1;
    Run first(shot.shared("first")), second(shot.shared("second"));
    check_done(first.outcome());
    check_done(second.outcome());
    CHECK(Steady::now() - begin > lease * (1 - renewed_after));
    CHECK(shot.times("made", {"first", "second"}) == left);
    CHECK(shot.results() == truth);
}

TEST_CASE("share: the claim of a finished frame is removed when it is older than the lease") {
    const Shot shot(3);
    const Contents truth = shot.alone();
    check_done(run(shot.shared("a")));
    write(shot.claim(1), "{}");
    std::this_thread::sleep_for(lease + 100ms);
    write(shot.claim(2), "{}");
    write(shot.folder / "out/other.exr.claim", "{}");
    fs::last_write_time(shot.folder / "out/other.exr.claim", fs::file_time_type::clock::now() - 1h);
    check_done(run(shot.shared("b")));
    CHECK(!fs::exists(shot.claim(1)));
    CHECK(fs::remove(shot.claim(2)));
    CHECK(fs::remove(shot.folder / "out/other.exr.claim")); // another shot's
    CHECK(shot.contents() == truth);
}

TEST_CASE("share: a process that is stopped past the lease and woken does no harm") {
    const Shot shot(48);
    const Contents truth = shot.alone();
    Run stopped(shot.shared("stopped"));
    stop_with_claims(shot, stopped);
    const std::size_t claims = shot.claims();
    check_done(run(shot.shared("other")));
    CHECK(shot.results() == truth);
    stopped.send(SIGCONT);
    const Outcome outcome = stopped.outcome();
    CHECK(outcome.code == 0);
    CHECK(shot.contents() == truth);
    const auto made = shot.times("made", {"stopped", "other"});
    std::cout << "the stopped process had claimed " << claims << " frames\n" << outcome.err;
    for (int frame = 1; frame <= shot.count; ++frame) {
        INFO(frame);
        REQUIRE(made.contains(frame));
        CHECK(made.at(frame) <= 2); // it may have been stopped between its last check and the commit
    }
}

TEST_CASE("share: wrong clocks lead to no early takeover") {
    if (is_missing({"faketime", "-f", "+1h"}, "faketime is not installed"))
        return;
    check_made_once(Shot(30), {{}, {"faketime", "-f", "+1h"}, {"faketime", "-f", "-1h"}});
}

TEST_CASE("share: a process with a wrong clock renews its claims") {
    for (const std::string shift : {"+1h", "-1h"}) {
        const Arguments before{"faketime", "-f", shift};
        if (is_missing(before, "faketime is not installed"))
            return;
        const Shot shot(1, {1200, 800});
        Run slow(joined(shot.shared("slow"), {"--quality", "accurate"}), {.before = before});
        await([&] { return fs::exists(shot.claim(1)) || !slow.is_running(); });
        const auto begin = Steady::now();
        await([&] {
            const bool others = Claim::take(shot.claim(1), 1s) != nullptr; // half of its lease
            CHECK((!others || fs::exists(shot.result(1))));
            return fs::exists(shot.result(1)) || others || !slow.is_running();
        });
        std::cout << "a frame that took " << std::chrono::duration<double>(Steady::now() - begin).count() << " s\n";
        check_done(slow.outcome());
        CHECK(shot.times("made", {"slow"}) == shot.each_once());
    }
}

TEST_CASE("share: equal process numbers in two containers") {
    const Arguments container{"unshare", "--pid", "--fork", "--kill-child", "--mount-proc"};
    if (is_missing(container, "no new pid namespace is permitted here (unshare --pid)"))
        return;
    const Shot shot(30);
    check_made_once(shot, {container, container});
    const auto process = [&](const std::string& who) {
        return nlohmann::json::parse(content(shot.log(who)).substr(0, content(shot.log(who)).find('\n')))
            .at("run")
            .at("process")
            .get<int>();
    };
    CHECK(process("0") == process("1"));
}

TEST_CASE("share: an interrupted process gives its claims back") {
    for (const int signal : {SIGINT, SIGTERM}) {
        const Shot shot(24);
        const Contents truth = shot.alone();
        Run interrupted(shot.shared("a"));
        await([&] { return shot.has_claim(); });
        interrupted.send(signal);
        CHECK(interrupted.outcome().code == 128 + signal);
        const Contents made = shot.contents();
        CHECK(made.size() == 2 * shot.times("made", {"a"}).size());
        CHECK(std::ranges::includes(truth, made)); // no claim, no half file, no temporary one
        std::cout << "interrupted by " << signal << " after " << made.size() / 2 << " of " << shot.count << " frames\n";
    }
    const Shot shot(2); // also while it waits for others
    std::vector<std::unique_ptr<Claim>> claims = claim_all(shot);
    Run waiting(shot.shared("a"));
    await([&] { return waits(waiting); });
    waiting.send(SIGTERM);
    CHECK(waiting.outcome().code == 128 + SIGTERM);
    CHECK(claims.front()->still_mine());
}

TEST_CASE(
    "share: a claim that cannot be read for a moment is asked for again, and one that never can fails its frame") {
    const bool for_good = GENERATE(false, true);
    const Shot shot(2);
    std::vector<std::unique_ptr<Claim>> claims = claim_all(shot);
    Run waiting(shot.shared("a"), {.before = unprivileged()});
    await([&] { return waits(waiting); });
    fs::permissions(shot.claim(1), fs::perms::none);
    std::this_thread::sleep_for(100ms);
    CHECK(waiting.is_running());
    claims.back().reset();
    if (!for_good) {
        fs::permissions(shot.claim(1), fs::perms::owner_all);
        claims.clear();
        check_done(waiting.outcome());
        CHECK(shot.times("made", {"a"}) == shot.each_once());
        return;
    }
    const Outcome outcome = waiting.outcome();
    check_refused(outcome, 1, shot.claim(1) + ": cannot be read: ");
    CHECK(shot.times("made", {"a"}) == std::map<int, int>{{2, 1}});
    fs::permissions(shot.claim(1), fs::perms::owner_all);
}

namespace {

/// The processor time of all threads of a process.
std::chrono::nanoseconds processor_time(const Run& run) {
    clockid_t clock{};
    timespec time{};
    if (clock_getcpuclockid(run.process(), &clock) != 0 || clock_gettime(clock, &time) != 0)
        return {};
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

/// Has a process stopped, or ended?
bool stands_still(const Run& run) {
    siginfo_t info{};
    const auto process = static_cast<id_t>(run.process());
    return waitid(P_PID, process, &info, WSTOPPED | WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0;
}

} // namespace

TEST_CASE("share: a frame whose claim is lost before the commit is not written") {
    const Shot shot(1, {1200, 800});
    const Arguments slowly{"--quality", "accurate"};
    check_done(run(joined(shot.command("alone", {"--resume"}), slowly)));
    const Contents truth = shot.contents();
    for (const auto& [name, bytes] : truth)
        fs::remove(shot.folder / ("out/" + name));
    // On a busy machine the frame may be made before this process sees its claim: then once more.
    std::unique_ptr<Run> started;
    for (int left = 20; left > 0; --left) {
        started = std::make_unique<Run>(joined(shot.shared("a"), slowly));
        await([&] { return fs::exists(shot.claim(1)) || !started->is_running(); });
        const auto begun = processor_time(*started); // to take the claim needs next to none, and the frame much more
        await([&] { return processor_time(*started) > begun + 30ms || !started->is_running(); });
        started->send(SIGSTOP);
        await([&] { return stands_still(*started); }); // its threads may go on until then
        if (started->is_running() && !fs::exists(shot.result(1)))
            break;
        started.reset();
        for (const auto& [name, bytes] : shot.contents())
            fs::remove(shot.folder / ("out/" + name));
        fs::remove(shot.log("a"));
    }
    REQUIRE(started);
    Run& loser = *started;
    write(shot.folder / "foreign", "{\"host\":\"another\"}\n");
    fs::rename(shot.folder / "foreign", shot.claim(1));
    loser.send(SIGCONT);
    await([&] { return loser.err().find(": is not written, because") != std::string::npos || !loser.is_running(); });
    CHECK_FALSE(fs::exists(shot.result(1)));
    const Outcome outcome = loser.outcome(); // it takes the frame over once the claim is old
    CHECK(outcome.code == 0);
    CHECK(outcome.err.starts_with("fathom: warning: " + shot.result(1) + ": is not written, because"));
    CHECK(shot.times("made", {"a"}) == shot.each_once());
    CHECK(shot.contents() == truth);
}

TEST_CASE("share: a frame that fails is tried once by each process") {
    const Shot shot(3);
    write(shot.folder / "shot.0002.pfm", "no image");
    for (const std::string who : {"a", "b"}) {
        check_one_failed(run(shot.shared(who)), 3, shot.folder / "shot.0002.pfm", "");
        CHECK(shot.times("failed", {who}) == std::map<int, int>{{2, 1}});
        CHECK(!shot.has_claim());
    }
}

TEST_CASE("share: claims that cannot be made, and options that do not fit") {
    const Shot shot(1);
    check_refused(run({"ssao", shot.folder / "shot.####.pfm", "--camera", shot.camera, "--radius", "0.2", "--share",
                       "-o", "/sys/ao.####.exr"}), // also root makes no file there
                  1, "/sys/ao.0001.exr.claim: cannot be made: ");
    check_refused(run(shot.command("a", {"--lease", "5"})), 2, "--lease");
    check_refused(run(shot.command("a", {"--share", "--lease", "0"})), 2, "--lease");
}

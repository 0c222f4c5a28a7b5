// Claims on frames, with leases of a part of a second: who gets one, when others may take it, and that a claim that lives is
// never taken.
#include "program.hpp"

#include "sequence/claim.hpp"

#include <nlohmann/json.hpp>

#include <sys/stat.h>

#include <array>
#include <atomic>
#include <barrier>
#include <csignal>
#include <functional>
#include <thread>
#include <utility>

using namespace fathom::sequence;
using namespace fathom::test;
using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Steady = std::chrono::steady_clock;

namespace {

constexpr milliseconds lease = 1s, long_lease = 60s;
constexpr milliseconds tick = 10ms; // the kernel stamps files with a clock of at most this step (CONFIG_HZ=100)

void set_age(const fs::path& file, nanoseconds age) {
    const std::int64_t changed = (server_now(file.parent_path()) - age).count();
    const timespec time{changed / 1'000'000'000, changed % 1'000'000'000};
    const std::array<timespec, 2> both{time, time};
    REQUIRE(utimensat(AT_FDCWD, file.c_str(), both.data(), 0) == 0);
}

// One letter, from one process to another.
class Pipe {
public:
    Pipe() { REQUIRE(pipe(ends_.data()) == 0); }
    ~Pipe() {
        close(ends_[0]);
        close(ends_[1]);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;

    void say(char letter) const { CHECK(::write(ends_[1], &letter, 1) == 1); }
    char hear() const {
        char letter = 0;
        CHECK(::read(ends_[0], &letter, 1) == 1);
        return letter;
    }

private:
    std::array<int, 2> ends_{};
};

// Another process. What it does last is to wait for its end.
class Other {
public:
    explicit Other(const std::function<void()>& act) : process_(fork()) {
        if (process_ != 0)
            return;
        alarm(patience_s);
        act();
        while (true)
            pause();
    }
    ~Other() {
        if (process_ > 0)
            end();
    }
    Other(const Other&) = delete;
    Other& operator=(const Other&) = delete;

    void send(int signal) const { kill(process_, signal); }
    void end() {
        send(SIGKILL);
        waitpid(std::exchange(process_, 0), nullptr, 0);
    }

private:
    pid_t process_;
};

// A process that claims, and then says what is asked: does it still have the claim (m), or gave it back (r).
std::function<void()> claimer(const fs::path& file, const Pipe& asked, const Pipe& said) {
    return [=, &asked, &said] {
        std::unique_ptr<Claim> claim = Claim::take(file, lease);
        said.say(claim ? 'y' : 'n');
        for (char what = 0; (what = asked.hear()) != 0;) {
            if (what == 'r')
                claim.reset();
            said.say(claim && claim->still_mine() ? 'y' : 'n');
        }
    };
}

bool ask(const Pipe& asked, const Pipe& said, char what) {
    asked.say(what);
    return said.hear() == 'y';
}

std::unique_ptr<Claim> take_when_free(const fs::path& file) {
    std::unique_ptr<Claim> claim;
    for (int i = 0; i < 1000 && !(claim = Claim::take(file, lease)); ++i)
        std::this_thread::sleep_for(10ms);
    REQUIRE(claim);
    return claim;
}

bool is_renewed_since(const fs::path& file, const SeenClaim& seen) {
    const std::optional<SeenClaim> now = find_claim(file);
    return now && now->changed > seen.changed;
}

} // namespace

TEST_CASE("a frame is claimed once, and again when the claim was given back", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/ao.0001.exr.claim";
    std::unique_ptr<Claim> first = Claim::take(file, lease);
    REQUIRE(first);
    CHECK(first->still_mine());
    CHECK(!Claim::take(file, lease));
    CHECK(Claim::take(folder / "out/ao.0002.exr.claim", lease));
    const auto members = nlohmann::json::parse(content(file));
    CHECK(members.at("process") == getpid());
    CHECK(!members.at("host").get<std::string>().empty());
    CHECK(members.at("random").get<std::string>().size() == 32);
    first.reset();
    CHECK(folder.results().empty());
    const std::unique_ptr<Claim> second = Claim::take(file, lease);
    REQUIRE(second);
    CHECK(nlohmann::json::parse(content(file)).at("random") != members.at("random"));
}

TEST_CASE("a claim's age is the difference of two times of the files' server", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    write(file, "somebody\n");
    set_age(file, lease - 100ms);
    CHECK(!Claim::take(file, lease));
    set_age(file, -1h); // a server whose clock was put back
    CHECK(!Claim::take(file, lease));
    CHECK(content(file) == "somebody\n");
    set_age(file, lease + tick);
    const std::unique_ptr<Claim> claim = Claim::take(file, lease);
    REQUIRE(claim);
    CHECK(claim->still_mine());
    CHECK(folder.results() == std::vector<std::string>{"a.claim"});
}

TEST_CASE("a claim without words counts by its age", "[claim]") { // its owner was killed before it wrote them
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    write(file, "");
    CHECK(!Claim::take(file, lease));
    set_age(file, 2 * lease);
    CHECK(Claim::take(file, lease));
}

TEST_CASE("a claim is renewed several times in a lease", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    const std::unique_ptr<Claim> claim = Claim::take(file, lease);
    REQUIRE(claim);
    constexpr int leases = 2;
    int renewals = 0;
    SeenClaim last = *find_claim(file);
    const auto begin = Steady::now();
    while (Steady::now() - begin < leases * lease) {
        std::this_thread::sleep_for(5ms);
        CHECK(!Claim::take(file, lease));
        const bool renewed = is_renewed_since(file, last);
        renewals += renewed;
        if (renewed)
            last = *find_claim(file);
    }
    CHECK(renewals >= 4 * leases); // a quarter of the lease at most
    CHECK(claim->still_mine());
}

TEST_CASE("the claim of a killed process is taken after the lease, and not before", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    const Pipe asked, said;
    Other other(claimer(file, asked, said));
    REQUIRE(said.hear() == 'y');
    other.end();
    const nanoseconds last = find_claim(file)->changed;
    const std::unique_ptr<Claim> claim = take_when_free(file);
    CHECK(find_claim(file)->changed - last > lease);
    CHECK(claim->still_mine());
    CHECK(folder.results() == std::vector<std::string>{"a.claim"});
}

TEST_CASE("a stopped process has lost its claim when it wakes, and leaves that of its successor alone", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    const Pipe asked, said;
    const Other other(claimer(file, asked, said));
    REQUIRE(said.hear() == 'y');
    CHECK(ask(asked, said, 'm'));
    other.send(SIGSTOP);
    const std::unique_ptr<Claim> claim = take_when_free(file);
    const SeenClaim mine = *find_claim(file);
    other.send(SIGCONT);
    CHECK(!ask(asked, said, 'm'));
    CHECK(!ask(asked, said, 'r'));
    CHECK(claim->still_mine());
    CHECK(find_claim(file)->content == mine.content);
}

TEST_CASE("a stopped process whose claim nobody wanted has it still", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    const Pipe asked, said;
    const Other other(claimer(file, asked, said));
    REQUIRE(said.hear() == 'y');
    other.send(SIGSTOP);
    const SeenClaim before = *find_claim(file);
    std::this_thread::sleep_for(2 * lease);
    CHECK(!is_renewed_since(file, before));
    other.send(SIGCONT);
    for (int i = 0; i < 1000 && !is_renewed_since(file, before); ++i)
        std::this_thread::sleep_for(5ms);
    CHECK(ask(asked, said, 'm'));
    CHECK(!Claim::take(file, lease));
}

TEST_CASE("a claim that is removed or replaced is lost", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    std::unique_ptr<Claim> claim = Claim::take(file, lease);
    REQUIRE(claim);
    fs::remove(file);
    CHECK(!claim->still_mine());
    write(file, "somebody\n");
    CHECK(!claim->still_mine());
    claim.reset();
    CHECK(content(file) == "somebody\n");
}

TEST_CASE("of many that want a stale claim one gets it", "[claim]") {
    const Folder folder;
    constexpr int rounds = 100, threads = 8;
    for (int round = 0; round < rounds; ++round) {
        const fs::path file = folder / ("out/" + std::to_string(round) + ".claim");
        write(file, "somebody\n");
        set_age(file, long_lease + tick);
        std::atomic<int> taken = 0;
        std::barrier all(threads);
        {
            std::vector<std::jthread> runners;
            for (int i = 0; i < threads; ++i)
                runners.emplace_back([&] {
                    all.arrive_and_wait();
                    const std::unique_ptr<Claim> claim = Claim::take(file, long_lease);
                    taken += claim != nullptr;
                    all.arrive_and_wait();
                });
        }
        CHECK(taken == 1);
        CHECK(Claim::take(file, long_lease));
    }
    CHECK(folder.results().empty());
}

TEST_CASE("the guard of a takeover has the same name on all machines", "[claim]") {
    CHECK(takeover_of("shot/foobar") == fs::path("shot/.fathom-claim-85944171f73967e8.tmp")); // FNV-1a as published
}

TEST_CASE("a process that is killed while it takes a claim over keeps others from it for a lease", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    write(file, "somebody\n");
    write(takeover_of(file), "killed\n");
    set_age(file, 2 * lease);
    CHECK(!Claim::take(file, lease));
    set_age(takeover_of(file), lease + tick);
    CHECK(take_when_free(file)->still_mine());
    CHECK(folder.results().empty());
    write(takeover_of(file), "killed\n");
    remove_left_claims(folder / "out", {}, lease);
    CHECK(folder.results().size() == 1);
    set_age(takeover_of(file), lease + tick);
    remove_left_claims(folder / "out", {}, lease);
    CHECK(folder.results().empty());
}

TEST_CASE("whoever was slow to take a stale claim leaves its new owner's alone", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    write(file, "somebody\n");
    set_age(file, 2 * lease);
    const SeenClaim stale = *find_claim(file); // seen by a process that then sleeps
    const std::unique_ptr<Claim> claim = Claim::take(file, lease);
    REQUIRE(claim);
    CHECK(!remove_claim(file, stale));
    CHECK(claim->still_mine());
    CHECK(folder.results() == std::vector<std::string>{"a.claim"});
    const SeenClaim before = *find_claim(file);
    for (int i = 0; i < 1000 && !is_renewed_since(file, before); ++i)
        std::this_thread::sleep_for(5ms);
    CHECK(is_renewed_since(file, before)); // the claim that was put back is renewed, too
}

TEST_CASE("a stale claim whose owner wakes and renews it in time stays", "[claim]") {
    const Folder folder;
    const fs::path file = folder / "out/a.claim";
    write(file, "somebody\n");
    set_age(file, 2 * lease);
    const SeenClaim stale = *find_claim(file);
    write(file, "somebody\n");
    CHECK(!remove_claim(file, stale));
    CHECK(content(file) == "somebody\n");
    CHECK(!remove_claim(folder / "out/none.claim", stale));
    CHECK(folder.results() == std::vector<std::string>{"a.claim"});
    CHECK(remove_claim(file, *find_claim(file)));
    CHECK(folder.results().empty());
}

TEST_CASE("a claim that cannot be made is an error in one line", "[claim]") {
    const Folder folder;
    const auto refused = [](const std::string& file, const std::string& said) {
        INFO(file);
        CHECK_THROWS_WITH(Claim::take(file, lease),
                          ContainsSubstring(file + ": cannot be made: ") && ContainsSubstring(said));
    };
    refused("/sys/a.claim", "every process that shares a shot must read and write in this folder"); // also for root
    refused(folder / ("out/" + std::string(250, 'x') + ".claim"), "choose a shorter name");
    const Pipe said;
    const Other full([&] {
        const rlimit none{0, 0}; // what a full disk looks like
        setrlimit(RLIMIT_FSIZE, &none);
        signal(SIGXFSZ, SIG_IGN);
        bool told = false;
        try {
            Claim::take(folder / "out/a.claim", lease);
        } catch (const std::exception& error) {
            const std::string line = error.what();
            told = line.starts_with((folder / "out/a.claim") + ": cannot be made: ") &&
                   line.ends_with("; free some space or write elsewhere") && line.find('\n') == std::string::npos;
        }
        said.say(told ? 'y' : 'n');
    });
    CHECK(said.hear() == 'y');
    CHECK(folder.results().empty());
}

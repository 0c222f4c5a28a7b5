// Frames that other processes have claimed are asked for again and again: file systems of networks send no word.
#include "share.hpp"

#include "interrupt.hpp"

#include <fathom/error.hpp>

#include <algorithm>
#include <map>
#include <set>
#include <thread>

namespace fs = std::filesystem;

namespace fathom::cli {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

fs::path claim_file(const Job& job) {
    return fs::path(job.outputs.front()) += ".claim";
}

std::unique_ptr<sequence::Claim> claim(const Job& job, milliseconds lease) {
    return sequence::Claim::take(claim_file(job), lease);
}

void check_claim(const sequence::Claim* claim) {
    if (claim && !claim->still_mine())
        throw ClaimLost{};
}

std::vector<std::size_t> take_free(std::vector<std::size_t>& waiting, const std::vector<Job>& jobs,
                                   milliseconds lease) {
    constexpr milliseconds shortest{20}, longest{1000};
    constexpr int patience = 5;
    std::vector<std::size_t> free;
    std::map<std::size_t, int> failures; // one after the other
    for (milliseconds pause = shortest; !waiting.empty() && free.empty();
         pause = std::min({2 * pause, longest, lease / 4})) {
        std::this_thread::sleep_for(pause);
        if (is_interrupted())
            return {};
        std::map<fs::path, nanoseconds> now; // in each folder: asking for it makes a file
        const auto is_free = [&](std::size_t i) {
            const fs::path file = claim_file(jobs[i]), folder = file.parent_path();
            try {
                const auto seen = sequence::find_claim(file);
                if (seen && !now.contains(folder))
                    now[folder] = sequence::server_now(folder);
                failures.erase(i);
                return !seen || now[folder] - seen->changed > lease;
            } catch (const Error&) { // networks have bad moments; who claims the frame is told what lasts
                return ++failures[i] == patience;
            }
        };
        const auto rest = std::stable_partition(waiting.begin(), waiting.end(), is_free);
        free.assign(waiting.begin(), rest);
        waiting.erase(waiting.begin(), rest);
    }
    return free;
}

void remove_left_claims(const std::vector<Job>& jobs, milliseconds lease) {
    std::map<fs::path, std::set<fs::path>> claims; // names in each folder
    for (const Job& job : jobs)
        if (!job.outputs.empty())
            claims[claim_file(job).parent_path()].insert(claim_file(job).filename());
    for (const auto& [folder, names] : claims)
        try {
            sequence::remove_left_claims(folder, names, lease);
        } catch (const std::exception&) { // the shot is finished all the same
        }
}

} // namespace fathom::cli

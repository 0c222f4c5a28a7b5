#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>

namespace fathom::sequence {

/// How long a claim counts after it was last renewed.
inline constexpr std::chrono::seconds default_lease{120};

/// A claim's file as somebody found it.
struct SeenClaim {
    std::string content;
    std::chrono::nanoseconds changed; ///< when it was last written, by the clock of the file's server

    bool operator==(const SeenClaim&) const = default;
};

/// The file by which a process keeps others from taking over the same claim. It is there for moments only.
std::filesystem::path takeover_of(const std::filesystem::path& claim);

/// The file of a claim; none: nobody has claimed. Throws: Error where it is there and cannot be read.
std::optional<SeenClaim> find_claim(const std::filesystem::path& file);

/// The time on the clock that stamps the files of a folder. Throws: Error where no file can be made there.
std::chrono::nanoseconds server_now(const std::filesystem::path& folder);

/// Removes a claim if it is still as it was seen, and says whether it did. Of several processes that try only one does. A
/// claim that has changed since stays, or is put back.
bool remove_claim(const std::filesystem::path& file, const SeenClaim& seen);

/// Removes what killed processes left in a folder: the temporary files of claiming, and those of the named claims that are
/// older than a lease.
void remove_left_claims(const std::filesystem::path& folder, const std::set<std::filesystem::path>& claims,
                        std::chrono::milliseconds lease);

/// The right to make a file, which several processes on several machines share: a file of its own that only one of them can
/// make (O_EXCL). It holds the host, the process and a random number. Its age is measured by the clock of the file's server
/// alone, so clocks of machines do not matter. A thread renews it several times in a lease; once nobody did for a whole
/// lease, others take it.
class Claim {
public:
    /// Null: another process holds it.
    /// Throws: Error where the file cannot be made, with the reason.
    static std::unique_ptr<Claim> take(const std::filesystem::path& file, std::chrono::milliseconds lease);

    /// Gives it back: removes the file, unless somebody else took it.
    ~Claim();
    Claim(const Claim&) = delete;
    Claim& operator=(const Claim&) = delete;

    /// Is the file still there as this process wrote it, and no older than a lease? To be asked right before what the claim
    /// protects. A process that sleeps in between, for longer than a lease, may still come second: what it does then must
    /// do no harm.
    bool still_mine() const;

private:
    Claim(std::filesystem::path file, std::string content, std::chrono::milliseconds lease);
    void renew_until_end() const noexcept;
    void renew() const noexcept;
    bool is_mine(const std::optional<SeenClaim>& seen) const { return seen && seen->content == content_; }

    std::filesystem::path file_;
    std::string content_;
    std::chrono::milliseconds lease_;
    int end_; ///< ends the heartbeat
    std::thread heartbeat_;
};

} // namespace fathom::sequence

#pragma once

#include "outputs.hpp"

#include "sequence/claim.hpp"

#include <chrono>
#include <cstddef>
#include <memory>
#include <vector>

/// The frames of a shot that several processes share.
namespace fathom::cli {

/// Ends a frame that another process has taken over. No std::exception, so that no file is blamed for it.
struct ClaimLost {};

/// The file that claims a frame.
std::filesystem::path claim_file(const Job& job);

/// Claims a frame, beside the result that commits it; null: another process has claimed it.
std::unique_ptr<sequence::Claim> claim(const Job& job, std::chrono::milliseconds lease);

/// Throws: ClaimLost where another process has taken the frame over, or may have.
void check_claim(const sequence::Claim* claim);

/// Of jobs that other processes have claimed, takes those out that may be free now. Waits until there is one, or until the
/// program is interrupted: then it gives none.
std::vector<std::size_t> take_free(std::vector<std::size_t>& waiting, const std::vector<Job>& jobs,
                                   std::chrono::milliseconds lease);

/// Removes what killed processes left beside the results.
void remove_left_claims(const std::vector<Job>& jobs, std::chrono::milliseconds lease);

} // namespace fathom::cli

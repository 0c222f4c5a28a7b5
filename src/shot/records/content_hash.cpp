// Hashes that tell contents apart, but not against somebody who wants two to be the same.
// Source: xxHash, https://github.com/Cyan4973/xxHash/blob/dev/doc/xxhash_spec.md
#include "content_hash.hpp"

#include "camera_file/file.hpp"

#include <fmt/format.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <memory>

namespace fathom::cli {
namespace {

class Hash {
public:
    Hash() { XXH3_128bits_reset(state_.get()); }
    void add(const void* bytes, std::size_t count) {
        if (count > 0)
            XXH3_128bits_update(state_.get(), bytes, count);
    }
    std::string text() const {
        const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
        return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
    }

private:
    struct Free {
        void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
    };
    std::unique_ptr<XXH3_state_t, Free> state_{XXH3_createState()};
};

} // namespace

std::string content_hash(std::span<const std::span<const unsigned char>> parts) {
    Hash hash;
    for (const auto& part : parts)
        hash.add(part.data(), part.size());
    return hash.text();
}

std::string hash_of_files(const std::vector<std::filesystem::path>& files) {
    Hash hash;
    for (const std::filesystem::path& file : files)
        io::read_parts(file, [&](std::span<const unsigned char> part) { hash.add(part.data(), part.size()); });
    return hash.text();
}

} // namespace fathom::cli

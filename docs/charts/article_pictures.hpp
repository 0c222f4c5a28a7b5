#pragma once

#include <filesystem>

/// The pictures of docs/research.md.
namespace fathom::charts {

void draw_lengyel(const std::filesystem::path& folder);
void draw_kooima(const std::filesystem::path& folder);
void draw_goldberg(const std::filesystem::path& folder);

} // namespace fathom::charts

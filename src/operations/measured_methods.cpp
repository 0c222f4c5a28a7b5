// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 1.421431327160494, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 9.438850308641975, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 1.4171730324074074, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "least squares", 3.35697, "corridor", 9.53930362654321, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "fast", 0.00960765, "railings", 46.49686535493827, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "balanced", 0.00959793, "railings", 187.5679976851852, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "accurate", 0.00720253, "plan", 1386.1014660493827, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast", 0.183829, "railings", 19.06274112654321, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced", 0.0447341, "terrain", 45.52035108024691, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate", 0.0488869, "terrain", 148.92602237654322, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 8", 0.155022, "railings", 20.69285300925926, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 16", 0.0804198, "railings", 28.220148533950617, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "2 x 32", 0.0457228, "terrain", 86.54465663580247, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 32", 0.0519784, "terrain", 161.78530092592592, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64", 0.0516735, "terrain", 292.0621141975309, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast, half resolution", 0.188739, "railings", 7.277777777777778, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced, half resolution", 0.0597886, "terrain", 13.777874228395062, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate, half resolution", 0.0674512, "terrain", 39.46252893518518, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0799275, "railings", 9.959780092592593, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0594838, "terrain", 19.03559027777778, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0668111, "terrain", 63.198302469135804, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
    };
    return table;
}
// clang-format on

} // namespace fathom

// Preloaded into a program: std::random_device counts 0, 1, 2 … so that a test knows the names that are made of it.
#include <atomic>
#include <random>

std::random_device::result_type std::random_device::_M_getval() {
    static std::atomic<result_type> next = 0;
    return next++;
}

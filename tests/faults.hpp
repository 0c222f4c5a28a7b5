#pragma once

#include "catch.hpp"

#include <mutex>

/// Faults of a long run, which many threads may find: each is one line with the number of times that it was seen. One is enough
/// to fail the test in which this goes out of scope.
class Faults {
public:
    Faults() = default;
    ~Faults() {
        for (const auto& [fault, times] : faults_)
            UNSCOPED_INFO(times << " times: " << fault);
        CHECK(faults_.empty());
    }
    Faults(const Faults&) = delete;
    Faults& operator=(const Faults&) = delete;

    void add(const std::string& fault) {
        const std::lock_guard lock(mutex_);
        ++faults_[fault];
    }
    void check(bool good, const std::string& fault) {
        if (!good)
            add(fault);
    }

private:
    std::mutex mutex_;
    std::map<std::string, int> faults_;
};

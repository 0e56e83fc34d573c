#pragma once

// What the tests of the hazard checker's rules share: things that have no conflict yet, and what is found in a list.

#include "hazard_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace glint::test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr auto read_after_write = "hazard.read_after_write";
constexpr auto write_after_read = "hazard.write_after_read";
constexpr auto write_after_write = "hazard.write_after_write";

inline std::vector<std::string> ids(const std::vector<Error>& findings) {
    std::vector<std::string> names;
    for (const Error& finding : findings) names.emplace_back(finding.id());
    return names;
}

class HazardChecker : public testing::Test {
protected:
    /// What one list on the main queue is found to do wrong.
    std::vector<std::string> judged(const List& list, Queue queue = Queue::Main, const std::vector<Wait>& waits = {}) {
        findings = judge(checker, queue, ++values[static_cast<size_t>(queue)], {list}, waits);
        return ids(findings);
    }

    null::HazardChecker checker = makeChecker();
    std::vector<Error> findings;
    uint64_t values[detail::queue_count] = {};

    Thing a{.id = 1, .name = "a"};
    Thing b{.id = 2, .name = "b"};
    Thing c{.id = 3, .name = "c"};
    Thing image{.id = 4, .mips = 1, .layers = 1, .name = "image"};
    Thing atlas{.id = 5, .mips = 3, .layers = 2, .name = "atlas"};

    static constexpr StageMask compute = detail::bit(Stage::Compute);
    static constexpr StageMask copy = detail::bit(Stage::Copy);
    static constexpr StageMask fragment = detail::bit(Stage::Fragment);
    static constexpr StageMask color = detail::bit(Stage::ColorTarget);
};

}  // namespace glint::test

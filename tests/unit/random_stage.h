#pragma once

// Ray-tracing shaders of random control flow with traces anywhere in it, the same for the same seed everywhere.

#include <fmt/format.h>

#include <random>
#include <string>

namespace glint::test {

/// Writes statements over uint a, b, c, d and uint t[3]; look(x) traces a ray that x chooses and gives a number.
class RandomStage {
public:
    explicit RandomStage(uint32_t seed) : random_(seed) {}

    /// void work(inout uint a, ..., inout uint t[3]) or, for `main` to hold, its statements alone.
    std::string statements(int count, int depth) {
        std::string text;
        for (int i = 0; i < count; i++) text += statement(depth);
        return text;
    }

private:
    uint32_t pick(uint32_t count) { return static_cast<uint32_t>(random_() % count); }
    std::string variable() { return pick(6) ? std::string(1, "abcd"[pick(4)]) : fmt::format("t[{} % 3u]", value()); }
    std::string value() { return pick(5) ? std::string(1, "abcd"[pick(4)]) : fmt::format("{}u", pick(9)); }
    std::string expression() {
        static constexpr const char* forms[] = {"{} * 3u + {}", "({} ^ {}) + 1u", "{} - {}", "min({}, {} + 7u)"};
        return fmt::format(fmt::runtime(forms[pick(4)]), value(), pick(3) ? value() : "t[1]");
    }
    std::string condition() {
        switch (pick(6)) {
            case 0: return fmt::format("{} % 3u == 0u && look({}) % 2u == 0u", value(), value());
            case 1: return fmt::format("look({}) % 3u != 0u", value());
            default: return fmt::format("({} & 3u) {} {}u", value(), pick(2) ? "!=" : "==", pick(4));
        }
    }
    /// In braces. Loops' bodies may leave them early.
    std::string block(int depth) {
        std::string text = "{\n";
        if (loops_ && pick(3) == 0) text += fmt::format("if ({}) {};\n", condition(), pick(2) ? "break" : "continue");
        text += statements(1 + static_cast<int>(pick(2)), depth - 1);
        return text + "}\n";
    }
    std::string loop(int depth) {
        const std::string i = fmt::format("i{}", names_++);
        loops_++;
        std::string text;
        switch (pick(3)) {
            case 0:
                text = fmt::format("for (uint {0} = 0u; {0} < {1}u; {0}++) {2}", i, 1 + pick(3), block(depth));
                break;
            case 1:
                text = fmt::format("for (uint {0} = 0u; {0} < 2u; {0}++, {1} = look({0})) {2}", i, variable(),
                                   block(depth));
                break;
            default:
                text = fmt::format("uint {0} = 3u;\ndo {1} while (--{0} > 0u && {2});\n", i, block(depth), condition());
        }
        loops_--;
        return text;
    }
    std::string choice(int depth) {
        // A `continue` is the loop's, a `break` would be the switch's.
        const int loops = loops_;
        loops_ = 0;
        std::string text = fmt::format("switch ({} % 4u) {{\n", value());
        for (uint32_t i = 0; i < 3; i++)
            text += fmt::format("case {}u: {}{}", i, block(depth), pick(2) ? "break;\n" : "");
        text += "default: " + block(depth) + "}\n";
        loops_ = loops;
        return text;
    }
    std::string statement(int depth) {
        switch (depth > 0 ? pick(10) : pick(4)) {
            case 0:
            case 1: return fmt::format("{} = {};\n", variable(), expression());
            case 2: return fmt::format("{} += look({});\n", variable(), value());
            case 3: return fmt::format("{} = twice(a, {});\n", variable(), pick(2) ? "b" : "d");
            case 4:
            case 5: return fmt::format("if ({}) {}", condition(), block(depth));
            case 6: return fmt::format("if ({}) {}else {}", condition(), block(depth), block(depth));
            case 7: return choice(depth);
            default: return loop(depth);
        }
    }

    std::mt19937 random_;
    int loops_ = 0;
    int names_ = 0;
};

}  // namespace glint::test

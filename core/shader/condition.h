#pragma once

// For sources only: the part of the preprocessor that knows which lines of a shader count.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace glint::shader {

/// Macros that only the compiler knows (GL_EXT_..., __VERSION__) make a condition neither true nor false here.
enum class Truth : uint8_t { No, Maybe, Yes };
constexpr Truth negated(Truth truth) { return static_cast<Truth>(2 - static_cast<int>(truth)); }

/// The macros defined so far and the #if groups that are open.
class Conditions {
public:
    /// A group that is open, where it began.
    struct Group {
        std::string file;
        uint32_t line = 0;
        Truth outer = Truth::Yes;    ///< of the text around it
        Truth taken = Truth::No;     ///< whether a branch has been taken so far
        Truth current = Truth::Yes;  ///< of the branch that is open, the outer text included
        bool has_else = false;
    };

    /// Whether the text at this point counts.
    Truth active() const { return groups_.empty() ? Truth::Yes : groups_.back().current; }

    /// `definition` is what follows #define: "NAME", "NAME value", "NAME(a, b) value".
    void define(std::string_view definition);
    void undefine(std::string_view name);
    Truth isDefined(std::string_view name) const;
    /// The text of a macro without parameters, if it is certain.
    std::optional<std::string_view> valueOf(std::string_view name) const;
    /// The expression of #if and #elif. One that cannot be understood is Maybe: the compiler has the last word.
    Truth evaluate(std::string_view expression) const;

    void open(Truth condition, std::string file, uint32_t line);
    /// #elif and #else; false if no group is open or its #else has gone by.
    bool next(std::string_view expression);
    bool otherwise();
    bool close();

    const std::vector<Group>& groups() const { return groups_; }

private:
    struct Macro {
        Truth defined = Truth::No;
        bool plain = true;  ///< no parameters, and the value is certain
        std::string value;
    };

    friend class Expression;

    std::map<std::string, Macro, std::less<>> macros_;
    std::vector<Group> groups_;
};

}  // namespace glint::shader

#include "condition.h"

#include <algorithm>
#include <charconv>

namespace glint::shader {

namespace {

bool isNameStart(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isName(char c) { return isNameStart(c) || isDigit(c); }

Truth both(Truth a, Truth b) { return std::min(a, b); }
Truth either(Truth a, Truth b) { return std::max(a, b); }

/// Names that the compiler defines without the text saying so.
bool isPredefined(std::string_view name) {
    return name.starts_with("GL_") || name.starts_with("__") || name == "VULKAN";
}

struct Token {
    enum class Kind : uint8_t { Number, Name, Operator, Unknown, End };
    Kind kind = Kind::End;
    int64_t value = 0;
    std::string_view text;
};

void tokenize(std::string_view text, std::vector<Token>& tokens) {
    static constexpr std::string_view pairs[] = {"||", "&&", "==", "!=", "<=", ">=", "<<", ">>"};
    for (size_t i = 0; i < text.size();) {
        const char c = text[i];
        size_t length = 1;
        Token token{.kind = Token::Kind::Unknown, .value = 0, .text = {}};
        if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
            i++;
            continue;
        }
        if (isNameStart(c)) {
            while (i + length < text.size() && isName(text[i + length])) length++;
            token.kind = Token::Kind::Name;
        } else if (isDigit(c)) {
            while (i + length < text.size() && isName(text[i + length])) length++;
            std::string_view digits = text.substr(i, length);
            if (digits.ends_with('u') || digits.ends_with('U')) digits.remove_suffix(1);
            int base = 10;
            if (digits.starts_with("0x") || digits.starts_with("0X")) {
                digits.remove_prefix(2);
                base = 16;
            } else if (digits.size() > 1 && digits[0] == '0') {
                base = 8;
            }
            const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), token.value, base);
            if (error == std::errc() && end == digits.data() + digits.size()) token.kind = Token::Kind::Number;
        } else {
            for (std::string_view pair : pairs)
                if (text.substr(i).starts_with(pair)) length = 2;
            if (length == 2 || std::string_view("|&^<>+-*/%!~()").find(c) != std::string_view::npos)
                token.kind = Token::Kind::Operator;
        }
        token.text = text.substr(i, length);
        tokens.push_back(token);
        i += length;
    }
}

int precedence(std::string_view op) {
    if (op == "||") return 1;
    if (op == "&&") return 2;
    if (op == "|") return 3;
    if (op == "^") return 4;
    if (op == "&") return 5;
    if (op == "==" || op == "!=") return 6;
    if (op == "<" || op == ">" || op == "<=" || op == ">=") return 7;
    if (op == "<<" || op == ">>") return 8;
    if (op == "+" || op == "-") return 9;
    if (op == "*" || op == "/" || op == "%") return 10;
    return 0;
}

/// The value of an expression, or none where it depends on what is not known.
using Value = std::optional<int64_t>;

Value apply(std::string_view op, Value left, Value right) {
    // These two are certain as soon as one side settles them.
    if (op == "||") {
        if ((left && *left) || (right && *right)) return 1;
        if (left && right) return 0;
        return {};
    }
    if (op == "&&") {
        if ((left && !*left) || (right && !*right)) return 0;
        if (left && right) return 1;
        return {};
    }
    if (!left || !right) return {};
    // In unsigned arithmetic, where an overflow is no undefined behaviour.
    const int64_t a = *left, b = *right;
    const uint64_t ua = static_cast<uint64_t>(a), ub = static_cast<uint64_t>(b);
    if (op == "|") return a | b;
    if (op == "^") return a ^ b;
    if (op == "&") return a & b;
    if (op == "==") return a == b;
    if (op == "!=") return a != b;
    if (op == "<") return a < b;
    if (op == ">") return a > b;
    if (op == "<=") return a <= b;
    if (op == ">=") return a >= b;
    if (op == "+") return static_cast<int64_t>(ua + ub);
    if (op == "-") return static_cast<int64_t>(ua - ub);
    if (op == "*") return static_cast<int64_t>(ua * ub);
    if (op == "<<" && b >= 0 && b < 64) return static_cast<int64_t>(ua << b);
    if (op == ">>" && b >= 0 && b < 64) return a >> b;
    if (op == "/" && b != 0 && !(b == -1 && a == INT64_MIN)) return a / b;
    if (op == "%" && b != 0 && b != -1) return a % b;
    return {};
}

}  // namespace

/// One expression after macro replacement, parsed by precedence climbing.
class Expression {
public:
    Expression(const Conditions& conditions, std::string_view text) : conditions_(conditions) {
        std::vector<Token> raw;
        tokenize(text, raw);
        std::vector<std::string_view> hidden;
        replace(raw, hidden);
        tokens_.push_back({});
    }

    Truth truth() {
        const Value value = parse(1, 0);
        if (failed_ || !value || peek().kind != Token::Kind::End) return Truth::Maybe;
        return *value ? Truth::Yes : Truth::No;
    }

private:
    static constexpr size_t max_tokens = 4096;
    static constexpr int max_depth = 64;

    void replace(const std::vector<Token>& raw, std::vector<std::string_view>& hidden) {
        for (size_t i = 0; i < raw.size() && tokens_.size() < max_tokens; i++) {
            const Token& token = raw[i];
            if (token.kind != Token::Kind::Name) {
                tokens_.push_back(token);
                continue;
            }
            if (token.text == "defined") {
                const bool bracket = i + 1 < raw.size() && raw[i + 1].text == "(";
                const size_t name = i + (bracket ? 2 : 1);
                const size_t last = name + (bracket ? 1 : 0);
                if (last >= raw.size() || raw[name].kind != Token::Kind::Name || (bracket && raw[last].text != ")")) {
                    failed_ = true;
                    return;
                }
                pushTruth(conditions_.isDefined(raw[name].text));
                i = last;
                continue;
            }
            const auto macro = conditions_.macros_.find(token.text);
            if (macro == conditions_.macros_.end()) {
                // A name that nobody defined counts as 0.
                pushTruth(isPredefined(token.text) ? Truth::Maybe : Truth::No);
            } else if (macro->second.defined == Truth::No) {
                pushTruth(Truth::No);
            } else if (macro->second.defined == Truth::Maybe || !macro->second.plain ||
                       std::find(hidden.begin(), hidden.end(), token.text) != hidden.end()) {
                tokens_.push_back({.kind = Token::Kind::Unknown, .value = 0, .text = {}});
            } else {
                std::vector<Token> inner;
                tokenize(macro->second.value, inner);
                hidden.push_back(token.text);
                replace(inner, hidden);
                hidden.pop_back();
            }
        }
    }

    void pushTruth(Truth truth) {
        if (truth == Truth::Maybe)
            tokens_.push_back({.kind = Token::Kind::Unknown, .value = 0, .text = {}});
        else
            tokens_.push_back({.kind = Token::Kind::Number, .value = truth == Truth::Yes, .text = {}});
    }

    const Token& peek() const { return tokens_[next_]; }

    Value parse(int least, int depth) {
        Value left = parseUnary(depth);
        while (!failed_ && peek().kind == Token::Kind::Operator) {
            const std::string_view op = peek().text;
            const int level = precedence(op);
            if (level < least) break;
            next_++;
            left = apply(op, left, parse(level + 1, depth + 1));
        }
        return left;
    }

    Value parseUnary(int depth) {
        const Token token = peek();
        if (token.kind == Token::Kind::End || depth > max_depth) {
            failed_ = true;
            return {};
        }
        next_++;
        if (token.kind == Token::Kind::Number) return token.value;
        if (token.kind == Token::Kind::Unknown) return {};
        if (token.text == "(") {
            const Value value = parse(1, depth + 1);
            if (peek().text != ")")
                failed_ = true;
            else
                next_++;
            return value;
        }
        if (token.text == "+" || token.text == "-" || token.text == "!" || token.text == "~") {
            const Value value = parseUnary(depth + 1);
            if (!value) return {};
            if (token.text == "-") return static_cast<int64_t>(0 - static_cast<uint64_t>(*value));
            if (token.text == "!") return !*value;
            if (token.text == "~") return ~*value;
            return value;
        }
        failed_ = true;
        return {};
    }

    const Conditions& conditions_;
    std::vector<Token> tokens_;
    size_t next_ = 0;
    bool failed_ = false;
};

void Conditions::define(std::string_view definition) {
    size_t length = 0;
    while (length < definition.size() && isName(definition[length])) length++;
    if (length == 0 || active() == Truth::No) return;
    Macro& macro = macros_[std::string(definition.substr(0, length))];
    const std::string_view value = definition.substr(length);
    // Defined perhaps, over a former value perhaps: the name may still be certain, the value is not.
    macro.plain = !value.starts_with('(') && active() == Truth::Yes;
    macro.defined = either(macro.defined, active());
    macro.value = value;
}

void Conditions::undefine(std::string_view name) {
    if (active() == Truth::No) return;
    Macro& macro = macros_[std::string(name)];
    macro.defined = both(macro.defined, negated(active()));
    macro.plain = false;
}

Truth Conditions::isDefined(std::string_view name) const {
    const auto macro = macros_.find(name);
    if (macro != macros_.end()) return macro->second.defined;
    return isPredefined(name) ? Truth::Maybe : Truth::No;
}

std::optional<std::string_view> Conditions::valueOf(std::string_view name) const {
    const auto macro = macros_.find(name);
    if (macro == macros_.end() || macro->second.defined != Truth::Yes || !macro->second.plain) return {};
    return macro->second.value;
}

Truth Conditions::evaluate(std::string_view expression) const { return Expression(*this, expression).truth(); }

void Conditions::open(Truth condition, std::string file, uint32_t line) {
    const Truth outer = active();
    groups_.push_back({.file = std::move(file),
                       .line = line,
                       .outer = outer,
                       .taken = condition,
                       .current = both(outer, condition),
                       .has_else = false});
}

bool Conditions::next(std::string_view expression) {
    if (groups_.empty() || groups_.back().has_else) return false;
    const Truth free = negated(groups_.back().taken);
    const Truth condition = free == Truth::No ? Truth::No : both(free, evaluate(expression));
    Group& group = groups_.back();
    group.current = both(group.outer, condition);
    group.taken = either(group.taken, condition);
    return true;
}

bool Conditions::otherwise() {
    if (groups_.empty() || groups_.back().has_else) return false;
    Group& group = groups_.back();
    group.has_else = true;
    group.current = both(group.outer, negated(group.taken));
    return true;
}

bool Conditions::close() {
    if (groups_.empty()) return false;
    groups_.pop_back();
    return true;
}

}  // namespace glint::shader

#include "condition.h"
#include "shader_source.h"

#include <glint/base/format_error.h>

#include <algorithm>
#include <charconv>
#include <set>

namespace glint::shader {

namespace {

constexpr size_t max_depth = 32;
constexpr size_t max_text = 64u << 20;

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v'; }

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
    while (!text.empty() && isBlank(text.back())) text.remove_suffix(1);
    return text;
}

/// Length of a backslash and line break at this point, 0 if there is none.
size_t continuation(std::string_view text) {
    if (text.starts_with("\\\n")) return 2;
    return text.starts_with("\\\r\n") ? 3 : 0;
}

/// One line with the lines that continue it, its line break included.
std::string_view logicalLine(std::string_view text) {
    size_t end = 0;
    for (;;) {
        end = text.find('\n', end);
        if (end == std::string_view::npos) return text;
        end++;
        const bool joined =
            (end >= 2 && text[end - 2] == '\\') || (end >= 3 && text[end - 2] == '\r' && text[end - 3] == '\\');
        if (!joined) return text.substr(0, end);
    }
}

/// What a line holds besides comments.
struct Scan {
    size_t hash = std::string_view::npos;  ///< where the # of a directive stands
    std::string directive;                 ///< what follows it, in one line and without comments
};

Scan scanLine(std::string_view raw, bool& in_comment) {
    Scan scan;
    if (!in_comment && raw.find('#') == std::string_view::npos && raw.find('/') == std::string_view::npos) return scan;
    bool has_code = false;
    for (size_t i = 0; i < raw.size();) {
        if (const size_t skip = continuation(raw.substr(i))) {
            i += skip;
        } else if (in_comment) {
            in_comment = !raw.substr(i).starts_with("*/");
            i += in_comment ? 1 : 2;
        } else if (raw.substr(i).starts_with("//")) {
            break;
        } else if (raw.substr(i).starts_with("/*")) {
            in_comment = true;
            scan.directive += ' ';
            i += 2;
        } else {
            size_t length = 1;
            if (raw[i] == '"') length = std::min(raw.find('"', i + 1), raw.size() - 1) - i + 1;
            if (!has_code && !isBlank(raw[i])) {
                has_code = true;
                if (raw[i] == '#') scan.hash = i;
            } else if (scan.hash != std::string_view::npos) {
                scan.directive += raw.substr(i, length);
            }
            i += length;
        }
    }
    return scan;
}

class Preprocessor {
public:
    explicit Preprocessor(const ShaderSource& source) : source_(source) {}

    Expected<Preprocessed> run() {
        if (trimmed(source_.text).empty())
            return unexpected(sourceError(source_, ErrorCode::ShaderCompile, "shader.empty", "the shader has no text"));
        Expected<std::vector<Macro>> macros = collectMacros(source_);
        if (!macros) return unexpected(macros.error());
        for (const Macro& macro : *macros) conditions_.define(macro.name + " " + macro.value);

        Included root{.name = source_.name,
                      .identity = diskIdentity(source_.name),
                      .text = std::shared_ptr<const std::string>(std::shared_ptr<void>(), &source_.text),
                      .origin = Included::Origin::Disk,
                      .stamp = source_.name.empty() ? FileStamp{} : stampFile(source_.name)};
        const uint32_t index = sourceIndex(displayName(source_));
        noteFile(root);
        if (Error error = expand(root, index)) return unexpected(std::move(error));

        std::string defines;
        for (const Macro& macro : *macros) defines += fmt::format("#define {} {}\n", macro.name, macro.value);
        std::string text = version_.empty() ? "#version 460\n" : fmt::format("#version {}\n", version_);
        if (takesExtensions())
            text += extensionLines(source_.stage, usesExplicitTypes(body_) || usesExplicitTypes(defines));
        if (!defines.empty()) text += lineDirective(1, sourceIndex("<macros>")) + defines;
        text += lineDirective(1, index);
        result_.text = std::move(text) + body_;
        return std::move(result_);
    }

private:
    /// Where the text that is being read comes from; #line moves `shift` and `source`.
    struct Place {
        const Included* file = nullptr;
        uint32_t source = 0;
        uint32_t line = 1;   ///< of the file
        uint32_t shift = 0;  ///< what #line adds, modulo 2^32
        uint32_t shown() const { return line + shift; }
    };

    Error fail(const char* id, const Place& place, std::string message) const {
        return sourceError(source_, ErrorCode::ShaderCompile, id, std::move(message), result_.sources[place.source],
                           place.shown());
    }

    uint32_t sourceIndex(const std::string& name) {
        const auto found = std::find(result_.sources.begin(), result_.sources.end(), name);
        const auto index = static_cast<uint32_t>(found - result_.sources.begin());
        if (found == result_.sources.end()) result_.sources.push_back(name);
        return index;
    }

    void noteFile(const Included& file) {
        if (file.stamp.time < 0) return;
        if (std::find(result_.files.begin(), result_.files.end(), file.stamp.path) != result_.files.end()) return;
        result_.files.push_back(file.stamp.path);
        result_.stamps.push_back(file.stamp);
    }

    /// Says that the next line is this one. Before GLSL 3.30 the directive named its own line instead.
    std::string lineDirective(uint32_t line, uint32_t source) const {
        const bool old =
            version_ == "140" || version_ == "150" || version_.starts_with("140 ") || version_.starts_with("150 ");
        return fmt::format("#line {} {}\n", old ? line - 1 : line, source);
    }

    bool takesExtensions() const {
        uint32_t number = 460;
        std::from_chars(version_.data(), version_.data() + version_.size(), number);
        return number >= 450 && version_.find("es") == std::string::npos;
    }

    Error expand(const Included& file, uint32_t source) {
        std::string_view text = *file.text;
        if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
        Place place{.file = &file, .source = source};
        stack_.push_back(&file);
        const size_t groups = conditions_.groups().size();
        bool guarded = false;
        bool in_comment = false;
        uint32_t comment_line = 0;

        while (!text.empty()) {
            const std::string_view raw = logicalLine(text);
            text.remove_prefix(raw.size());
            if (raw.find('\0') != std::string_view::npos)
                return fail("shader.preprocess", place, "the text holds a zero byte");
            if (body_.size() + raw.size() > max_text)
                return fail("shader.preprocess", place, "the shader with its includes exceeds 64 MiB");
            if (!in_comment) comment_line = place.shown();
            const Scan scan = scanLine(raw, in_comment);
            const auto lines = static_cast<uint32_t>(std::count(raw.begin(), raw.end(), '\n'));
            bool replaced = false;
            if (scan.hash != std::string_view::npos) {
                const size_t out = body_.size();
                body_ += raw.substr(0, scan.hash);
                if (Error error = direct(scan.directive, place, lines, groups, guarded, replaced)) return error;
                if (!replaced) body_.resize(out);
            }
            place.line += lines;
            if (!replaced) {
                body_ += raw;
            } else {
                body_ += '\n';
                body_ += lineDirective(place.shown(), place.source);
                if (in_comment) body_ += "/*";
            }
        }

        if (in_comment) {
            place.line = comment_line - place.shift;
            return fail("shader.preprocess", place, "this comment is not closed");
        }
        if (conditions_.groups().size() > groups) {
            const Conditions::Group& group = conditions_.groups().back();
            return sourceError(source_, ErrorCode::ShaderCompile, "shader.preprocess", "this #if has no #endif",
                               group.file, group.line);
        }
        // The first line break may only end a line that asks to be continued.
        body_ += guarded ? "\n\n#endif\n" : "\n\n";
        stack_.pop_back();
        return {};
    }

    /// Follows one directive. Where it puts something else in its place, `replaced` is set.
    Error direct(std::string_view directive, Place& place, uint32_t lines, size_t outer_groups, bool& guarded,
                 bool& replaced) {
        directive = trimmed(directive);
        size_t length = 0;
        while (length < directive.size() && directive[length] >= 'a' && directive[length] <= 'z') length++;
        const std::string_view name = directive.substr(0, length);
        const std::string_view rest = trimmed(directive.substr(length));
        const Truth active = conditions_.active();
        const std::string& shown_file = result_.sources[place.source];
        const bool inside = conditions_.groups().size() > outer_groups;

        if (name == "if") {
            conditions_.open(active == Truth::No ? Truth::No : conditions_.evaluate(rest), shown_file, place.shown());
        } else if (name == "ifdef" || name == "ifndef") {
            const Truth defined = conditions_.isDefined(rest);
            conditions_.open(name == "ifdef" ? defined : negated(defined), shown_file, place.shown());
        } else if (name == "elif") {
            if (!inside || !conditions_.next(rest)) return fail("shader.preprocess", place, "#elif without #if");
        } else if (name == "else") {
            if (!inside || !conditions_.otherwise()) return fail("shader.preprocess", place, "#else without #if");
        } else if (name == "endif") {
            if (!inside || !conditions_.close()) return fail("shader.preprocess", place, "#endif without #if");
        } else if (name == "include") {
            replaced = true;
            if (active != Truth::No) return include(rest, place);
        } else if (active == Truth::No) {
            return {};
        } else if (name == "define") {
            conditions_.define(rest);
        } else if (name == "undef") {
            conditions_.undefine(rest);
        } else if (name == "error" && active == Truth::Yes) {
            return fail("shader.preprocess", place, fmt::format("#error {}", rest));
        } else if (name == "version") {
            if (stack_.size() > 1) return fail("shader.preprocess", place, "#version may stand in the main file only");
            if (!version_.empty()) return fail("shader.preprocess", place, "#version is given twice");
            version_ = rest;
            replaced = true;
        } else if (name == "line") {
            return moveLine(rest, place, lines, replaced);
        } else if (name == "pragma" && rest == "once" && !inside) {
            // What the compiler would have to know when it takes or leaves a branch that holds the include.
            const std::string guard = fmt::format("GLINT_ONCE_{}", onceIndex(place.file->identity));
            body_ += fmt::format("\n#ifndef {0}\n#define {0}", guard);
            if (active == Truth::Yes) once_.insert(place.file->identity);
            guarded = true;
            replaced = true;
        }
        return {};
    }

    Error moveLine(std::string_view rest, Place& place, uint32_t lines, bool& replaced) {
        uint32_t number = 0;
        const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
        if (error != std::errc()) return {};
        std::string_view file = trimmed(rest.substr(static_cast<size_t>(end - rest.data())));
        if (file.size() >= 2 && file.front() == '"' && file.back() == '"') file = file.substr(1, file.size() - 2);
        if (!file.empty()) place.source = sourceIndex(std::string(file));
        place.shift = number - place.line - lines;
        replaced = true;
        return {};
    }

    Error include(std::string_view rest, const Place& place) {
        if (const std::optional<std::string_view> value = conditions_.valueOf(rest)) rest = trimmed(*value);
        const char close = rest.starts_with('<') ? '>' : '"';
        if (rest.size() < 3 || (rest[0] != '"' && rest[0] != '<') || rest.find(close, 1) != rest.size() - 1)
            return fail("shader.preprocess", place, fmt::format("#include takes \"file\" or <file>, not '{}'", rest));
        const std::string_view name = rest.substr(1, rest.size() - 2);

        Expected<std::optional<Included>> found = findInclude(source_, name, close == '"', *place.file);
        if (!found) return fail("shader.include", place, found.error().message());
        if (!*found) {
            std::string message = describeMissing(name, close == '"', *place.file);
            if (conditions_.active() == Truth::Yes) return fail("shader.include", place, std::move(message));
            // Only the compiler knows whether this branch counts.
            body_ += "\n" + lineDirective(place.shown(), place.source) + "#error " + message;
            return {};
        }
        const Included& file = **found;
        noteFile(file);
        if (once_.contains(file.identity)) return {};
        if (stack_.size() > max_depth) return fail("shader.include", place, describeDepth(file));
        const uint32_t index = sourceIndex(file.name);
        body_ += "\n" + lineDirective(1, index);
        return expand(file, index);
    }

    std::string describeMissing(std::string_view name, bool quoted, const Included& from) const {
        std::string places;
        const auto add = [&](const std::string& place) { places += (places.empty() ? "" : ", ") + place; };
        if (quoted && from.origin == Included::Origin::Disk) {
            const std::string folder = std::filesystem::path(from.name).parent_path().string();
            add(folder.empty() ? "the working directory" : folder);
        }
        for (const std::filesystem::path& folder : source_.include_paths) add(folder.string());
        add("the SDK's shaders (glint/...)");
        return fmt::format("cannot find include '{}' in {}", name, places);
    }

    /// Why includes nest so deeply that `file` cannot be taken.
    std::string describeDepth(const Included& file) const {
        std::vector<const Included*> chain = stack_;
        chain.push_back(&file);
        for (auto first = chain.begin(); first != chain.end(); ++first) {
            const auto again = std::find_if(
                first + 1, chain.end(), [&](const Included* entry) { return entry->identity == (*first)->identity; });
            if (again == chain.end()) continue;
            std::string cycle;
            for (auto entry = first; entry != again; ++entry) cycle += (*entry)->name + " -> ";
            return fmt::format("include cycle: {}{}", cycle, (*again)->name);
        }
        return fmt::format("includes are nested more than {} deep", max_depth);
    }

    size_t onceIndex(const std::string& identity) {
        const auto found = std::find(guards_.begin(), guards_.end(), identity);
        const auto index = static_cast<size_t>(found - guards_.begin());
        if (found == guards_.end()) guards_.push_back(identity);
        return index;
    }

    const ShaderSource& source_;
    Conditions conditions_;
    Preprocessed result_;
    std::string body_;
    std::string version_;
    std::vector<const Included*> stack_;
    std::set<std::string> once_;
    std::vector<std::string> guards_;
};

}  // namespace

Expected<Preprocessed> preprocess(const ShaderSource& source) { return Preprocessor(source).run(); }

}  // namespace glint::shader

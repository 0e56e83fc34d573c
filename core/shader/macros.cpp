#include "shader_source.h"

#include <glint/base/format_error.h>
#include <glint/base/log.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <shared_mutex>

namespace glint {

namespace {

struct Globals {
    std::shared_mutex mutex;
    std::map<std::string, std::string, std::less<>> macros;
};

Globals& globals() {
    // Never destroyed: background compilations may still run while static objects are.
    static Globals& instance = *new Globals;
    return instance;
}

std::string_view trimmed(std::string_view text) {
    const size_t first = text.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

/// Why a macro cannot be defined, or nothing.
std::optional<std::string> findMacroFault(const shader::Macro& macro) {
    const auto is_name = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    };
    if (macro.name.empty()) return fmt::format("a macro of value '{}' has no name", macro.value);
    if (!std::all_of(macro.name.begin(), macro.name.end(), is_name) || (macro.name[0] >= '0' && macro.name[0] <= '9'))
        return fmt::format("'{}' is no name for a macro: letters, digits and underscores only", macro.name);
    if (macro.name.starts_with("GL_") || macro.name == "defined")
        return fmt::format("the macro name '{}' is reserved by GLSL", macro.name);
    if (macro.value.find_first_of("\n\r\\") != std::string::npos)
        return fmt::format("the value of macro '{}' has more than one line", macro.name);
    return {};
}

}  // namespace

void setShaderMacro(std::string_view name, std::string_view value) {
    std::unique_lock lock(globals().mutex);
    globals().macros.insert_or_assign(std::string(trimmed(name)), std::string(trimmed(value)));
}

void removeShaderMacro(std::string_view name) {
    std::unique_lock lock(globals().mutex);
    if (const auto found = globals().macros.find(trimmed(name)); found != globals().macros.end())
        globals().macros.erase(found);
}

void clearShaderMacros() {
    std::unique_lock lock(globals().mutex);
    globals().macros.clear();
}

namespace shader {

Expected<std::vector<Macro>> collectMacros(const ShaderSource& source) {
    std::vector<Macro> macros;
    {
        std::shared_lock lock(globals().mutex);
        for (const auto& [name, value] : globals().macros) macros.push_back({name, value});
    }
    const size_t global_count = macros.size();
    const auto fail = [&](std::string message) {
        return unexpected(Error::inFile(ErrorCode::ShaderCompile, "shader.macro", std::move(message),
                                        displayName(source), 0, std::string(trimmed(source.macros))));
    };

    std::string_view rest = source.macros;
    while (!rest.empty()) {
        const size_t end = std::min(rest.find(';'), rest.size());
        const std::string_view part = trimmed(rest.substr(0, end));
        rest.remove_prefix(std::min(end + 1, rest.size()));
        if (part.empty()) continue;
        const size_t equal = std::min(part.find('='), part.size());
        Macro macro{std::string(trimmed(part.substr(0, equal))),
                    std::string(trimmed(part.substr(std::min(equal + 1, part.size()))))};
        const auto same =
            std::find_if(macros.begin(), macros.end(), [&](const Macro& m) { return m.name == macro.name; });
        if (same == macros.end()) {
            macros.push_back(std::move(macro));
        } else if (static_cast<size_t>(same - macros.begin()) < global_count) {
            same->value = std::move(macro.value);
        } else if (same->value != macro.value) {
            return fail(
                fmt::format("macro '{}' is given twice, as '{}' and as '{}'", macro.name, same->value, macro.value));
        }
    }
    for (const Macro& macro : macros)
        if (std::optional<std::string> fault = findMacroFault(macro)) return fail(std::move(*fault));
    return macros;
}

std::string describeMacros(const std::vector<Macro>& macros) {
    std::string text;
    for (const Macro& macro : macros) {
        if (!text.empty()) text += "; ";
        text += macro.name;
        if (!macro.value.empty()) text += "=" + macro.value;
    }
    return text;
}

std::string displayName(const ShaderSource& source) {
    return source.name.empty() ? fmt::format("<{} shader>", toString(source.stage)) : source.name;
}

Error sourceError(const ShaderSource& source, ErrorCode code, const char* id, std::string message, std::string file,
                  uint32_t line) {
    const Expected<std::vector<Macro>> macros = collectMacros(source);
    return Error::inFile(code, id, std::move(message), file.empty() ? displayName(source) : std::move(file), line,
                         macros ? describeMacros(*macros) : source.macros);
}

void logWarning(const Error& error) {
    // The log adds the id itself.
    const std::string text = error.text();
    log(LogLevel::Warning, error.id(), std::string_view(text).substr(0, text.rfind(" [")));
}

}  // namespace shader

}  // namespace glint

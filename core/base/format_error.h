#pragma once

// For sources only: errors with fmt's formatting. Public headers include <glint/base/error.h>.

#include <glint/base/error.h>

#include <fmt/format.h>

namespace glint {

/// makeError(where, code, id, "storage buffer {} has {} bytes", i, size)
template <class... Args>
Error makeError(std::source_location where, ErrorCode code, const char* id, fmt::format_string<Args...> format,
                Args&&... args) {
    return Error(code, id, fmt::format(format, std::forward<Args>(args)...), {}, where);
}

/// The same without a line of the caller: for pure functions, whose caller adds it with Error::at.
template <class... Args>
Error makeError(ErrorCode code, const char* id, fmt::format_string<Args...> format, Args&&... args) {
    return Error::inFile(code, id, fmt::format(format, std::forward<Args>(args)...), {}, 0);
}

}  // namespace glint

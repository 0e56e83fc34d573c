#pragma once

#include <glint/base/error.h>

namespace glint {

/// The outcome of an action: true on success, otherwise it carries the error.
class [[nodiscard]] Status {
public:
    /// Success.
    Status() = default;
    /// Failure if `error` holds one, otherwise success.
    Status(Error error) : error_(std::move(error)) {}

    explicit operator bool() const { return !error_; }
    const Error& error() const { return error_; }

private:
    Error error_;
};

}  // namespace glint

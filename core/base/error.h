#pragma once

#include <cstdint>
#include <memory>
#include <source_location>
#include <string>
#include <string_view>

namespace glint {

/// What kind of failure it was. The code tells a program what to do, the id tells it which message it is.
enum class ErrorCode : uint8_t {
    None,             ///< no error
    InvalidArgument,  ///< the call breaks a stated rule
    OutOfRange,       ///< a value exceeds a size or a limit
    Unsupported,      ///< the adapter, driver or build cannot do it
    OutOfMemory,      ///< host or device memory ran out
    DeviceLost,       ///< the device stopped answering
    ShaderCompile,    ///< a shader did not pass one of the shader steps
    Io,               ///< a file could not be read or written
    Internal,         ///< a defect of Glint or of the driver
};

/// "InvalidArgument", "OutOfRange", ...
const char* toString(ErrorCode code);

/// An error: what went wrong, with which values and limits, on which object, called from which line.
/// A cheap value (one shared pointer to constant data); copies share. Thread-safe to read.
class Error {
public:
    /// No error.
    Error() = default;

    /// `id` is the stable name of the message, such as "buffer.size_zero"; every id is listed in docs/errors.md.
    /// `object` is the debug name of the object concerned, empty if it has none.
    Error(ErrorCode code, const char* id, std::string message, std::string object = {},
          std::source_location where = std::source_location::current());

    /// An error in a file that is not C++: a shader, a mesh. `context` says under which conditions ("GROUP_SIZE=64").
    static Error inFile(ErrorCode code, const char* id, std::string message, std::string file, uint32_t line,
                        std::string context = {});

    /// The same error seen from another line of the caller's program.
    Error at(std::source_location where) const;
    /// The same error with the debug name of an object.
    Error named(std::string object) const;

    explicit operator bool() const { return data_ != nullptr; }

    ErrorCode code() const;
    /// Stable id of the message, "" if there is no error.
    std::string_view id() const;
    /// The message alone.
    const std::string& message() const;
    const std::string& object() const;
    const std::string& file() const;
    uint32_t line() const;
    const std::string& context() const;

    /// "hello.cpp:14: dispatch: storage 0 'Values' of kernel 'scale' needs at least 64 bytes, ... [bind.storage_size]"
    std::string text() const;
    /// The same without the id.
    std::string summary() const;

private:
    struct Data;
    std::shared_ptr<const Data> data_;
};

}  // namespace glint

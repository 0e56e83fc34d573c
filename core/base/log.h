#pragma once

#include <functional>
#include <string_view>

namespace glint {

/// How much a message matters.
enum class LogLevel { Verbose, Info, Warning, Error };

/// Receives messages that concern no device: the shader cache, file loading. Called from any thread.
using LogCallback = std::function<void(LogLevel level, std::string_view id, std::string_view text)>;

/// Replaces the receiver; an empty one restores the default, which writes warnings and errors to stderr.
void setLogCallback(LogCallback callback);

/// Sends a message to the receiver.
void log(LogLevel level, std::string_view id, std::string_view text);

}  // namespace glint

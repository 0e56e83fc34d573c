#include <glint/base/error.h>

#include <fmt/format.h>

namespace glint {

struct Error::Data {
    ErrorCode code = ErrorCode::None;
    const char* id = "";
    std::string message;
    std::string object;
    std::string file;
    std::string context;
    uint32_t line = 0;
};

namespace {

const std::string empty;

std::string fileName(std::string_view path) { return std::string(path.substr(path.find_last_of('/') + 1)); }

}  // namespace

const char* toString(ErrorCode code) {
    switch (code) {
        case ErrorCode::None: return "None";
        case ErrorCode::InvalidArgument: return "InvalidArgument";
        case ErrorCode::OutOfRange: return "OutOfRange";
        case ErrorCode::Unsupported: return "Unsupported";
        case ErrorCode::OutOfMemory: return "OutOfMemory";
        case ErrorCode::DeviceLost: return "DeviceLost";
        case ErrorCode::ShaderCompile: return "ShaderCompile";
        case ErrorCode::Io: return "Io";
        case ErrorCode::Internal: return "Internal";
    }
    return "Unknown";
}

Error::Error(ErrorCode code, const char* id, std::string message, std::string object, std::source_location where)
    : data_(std::make_shared<Data>(Data{.code = code,
                                        .id = id,
                                        .message = std::move(message),
                                        .object = std::move(object),
                                        .file = fileName(where.file_name()),
                                        .context = {},
                                        .line = where.line()})) {}

Error Error::inFile(ErrorCode code, const char* id, std::string message, std::string file, uint32_t line,
                    std::string context) {
    Error error;
    error.data_ = std::make_shared<Data>(Data{.code = code,
                                              .id = id,
                                              .message = std::move(message),
                                              .object = {},
                                              .file = std::move(file),
                                              .context = std::move(context),
                                              .line = line});
    return error;
}

Error Error::at(std::source_location where) const {
    // An error that already names a file (a shader's line) keeps it: that is where the user has to look.
    if (!data_ || !data_->file.empty()) return *this;
    Data data = *data_;
    data.file = fileName(where.file_name());
    data.line = where.line();
    Error error;
    error.data_ = std::make_shared<Data>(std::move(data));
    return error;
}

Error Error::named(std::string object) const {
    if (!data_) return *this;
    Data data = *data_;
    data.object = std::move(object);
    Error error;
    error.data_ = std::make_shared<Data>(std::move(data));
    return error;
}

ErrorCode Error::code() const { return data_ ? data_->code : ErrorCode::None; }
std::string_view Error::id() const { return data_ ? data_->id : ""; }
const std::string& Error::message() const { return data_ ? data_->message : empty; }
const std::string& Error::object() const { return data_ ? data_->object : empty; }
const std::string& Error::file() const { return data_ ? data_->file : empty; }
uint32_t Error::line() const { return data_ ? data_->line : 0; }
const std::string& Error::context() const { return data_ ? data_->context : empty; }

std::string Error::text() const { return data_ ? fmt::format("{} [{}]", summary(), data_->id) : std::string(); }

std::string Error::summary() const {
    if (!data_) return {};
    std::string text;
    if (!data_->file.empty()) {
        text += data_->file;
        if (data_->line) text += fmt::format(":{}", data_->line);
        if (!data_->context.empty()) text += fmt::format(" ({})", data_->context);
        text += ": ";
    }
    return text + data_->message;
}

}  // namespace glint

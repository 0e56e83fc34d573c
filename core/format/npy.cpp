#include <glint/format/npy.h>

#include "npy_header.h"

#include <glint/base/format_error.h>

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>

namespace glint {

uint64_t NpyHeader::elementSize() const {
    uint64_t size = 0;
    for (const NpyField& field : fields) size += static_cast<uint64_t>(field.size) * field.count;
    return size;
}

uint64_t NpyHeader::elements() const {
    uint64_t count = 1;
    for (const uint64_t dimension : shape) count *= dimension;
    return count;
}

std::string describe(const NpyHeader& header) {
    const auto typeName = [](const NpyField& field) {
        constexpr std::array names = {"bool", "int", "uint", "float"};
        if (field.kind == NpyField::Kind::Padding) return fmt::format("{} bytes", field.size);
        std::string text = names[static_cast<size_t>(field.kind)];
        if (field.kind != NpyField::Kind::Bool) text += std::to_string(field.size * 8);
        if (field.count != 1) text += fmt::format("[{}]", field.count);
        return text;
    };
    std::string text;
    for (const NpyField& field : header.fields) {
        if (!text.empty()) text += ", ";
        text += (field.name.empty() ? std::string() : field.name + ": ") + typeName(field);
    }
    if (header.fields.size() != 1 || !header.fields[0].name.empty()) text = "{" + text + "}";
    return fmt::format("{} [{}]", text, fmt::join(header.shape, ", "));
}

Expected<NpyArray> decodeNpy(std::span<const std::byte> bytes, uint64_t limit) {
    const Expected<npy::Extent> extent = npy::findHeader(bytes);
    if (!extent) return unexpected(extent.error());
    const auto truncated = [&](uint64_t wanted) {
        return unexpected(
            makeError(ErrorCode::Io, "npy.truncated", "the file ends at byte {} of {}", bytes.size(), wanted));
    };
    if (extent->end > bytes.size()) return truncated(extent->end);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()) + extent->begin,
                                extent->end - extent->begin);
    Expected<npy::Parsed> parsed = npy::parseHeader(text, extent->begin);
    if (!parsed) return unexpected(parsed.error());

    const uint64_t size = parsed->header.elements() * parsed->header.elementSize();
    if (size > limit)
        return unexpected(makeError(ErrorCode::OutOfRange, "npy.too_large", "{} has {} bytes, the limit is {}",
                                    describe(parsed->header), size, limit));
    const std::span<const std::byte> elements = bytes.subspan(extent->end);
    if (elements.size() < size) return truncated(extent->end + size);
    if (elements.size() > size)
        return unexpected(makeError(ErrorCode::Io, "npy.trailing", "byte {}: {} bytes follow the last element",
                                    extent->end + size, elements.size() - size));
    NpyArray array{std::move(parsed->header), {elements.begin(), elements.end()}};
    npy::swapFields(array.header, parsed->swapped, array.data);
    return array;
}

Expected<std::vector<std::byte>> encodeNpy(const NpyHeader& header, std::span<const std::byte> data) {
    Expected<std::vector<std::byte>> bytes = npy::makeHeader(header);
    if (!bytes) return bytes;
    if (data.size() != header.elements() * header.elementSize())
        return unexpected(
            makeError(ErrorCode::InvalidArgument, "npy.data_size", "{} bytes for {}", data.size(), describe(header)));
    bytes->insert(bytes->end(), data.begin(), data.end());
    return bytes;
}

// -------------------------------------------------------------------------------------------------------- reader

namespace {

/// Errors of the pure functions know no file.
Error inFile(const Error& error, const std::string& name) {
    return Error::inFile(error.code(), error.id().data(), error.message(), name, 0);
}

}  // namespace

Expected<NpyReader> NpyReader::open(const std::filesystem::path& path) {
    NpyReader reader;
    reader.name_ = path.string();
    reader.file_.reset(std::fopen(path.c_str(), "rb"));
    struct stat status = {};
    if (!reader.file_ || ::fstat(::fileno(reader.file_.get()), &status) != 0)
        return unexpected(
            makeError(ErrorCode::Io, "file.open", "cannot open '{}': {}", reader.name_, std::strerror(errno)));
    if (S_ISDIR(status.st_mode))
        return unexpected(makeError(ErrorCode::Io, "file.open", "cannot read '{}': it is a directory", reader.name_));

    std::FILE* file = reader.file_.get();
    std::vector<std::byte> bytes(npy::prefix_size);
    bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file));
    const Expected<npy::Extent> extent = npy::findHeader(bytes);
    if (!extent) return unexpected(inFile(extent.error(), reader.name_));
    const size_t have = bytes.size();
    if (extent->end > have) {
        bytes.resize(extent->end);
        const size_t count = std::fread(bytes.data() + have, 1, extent->end - have, file);
        if (count != extent->end - have)
            return unexpected(inFile(
                makeError(ErrorCode::Io, "npy.truncated", "the file ends at byte {} of {}", have + count, extent->end),
                reader.name_));
    } else if (extent->end < have) {
        // A header of version 1 so short that it lies within the prefix is malformed, whatever follows.
        bytes.resize(extent->end);
    }
    Expected<npy::Parsed> parsed = npy::parseHeader(
        {reinterpret_cast<const char*>(bytes.data()) + extent->begin, extent->end - extent->begin}, extent->begin);
    if (!parsed) return unexpected(inFile(parsed.error(), reader.name_));
    reader.header_ = std::move(parsed->header);
    reader.swapped_ = std::move(parsed->swapped);
    reader.remaining_ = reader.header_.elements();

    const uint64_t wanted = extent->end + reader.remaining_ * reader.header_.elementSize();
    const auto size = static_cast<uint64_t>(status.st_size);
    if (S_ISREG(status.st_mode) && size < wanted)
        return unexpected(inFile(
            makeError(ErrorCode::Io, "npy.truncated", "the file ends at byte {} of {}", size, wanted), reader.name_));
    if (S_ISREG(status.st_mode) && size > wanted)
        return unexpected(inFile(makeError(ErrorCode::Io, "npy.trailing", "byte {}: {} bytes follow the last element",
                                           wanted, size - wanted),
                                 reader.name_));
    return reader;
}

Expected<uint64_t> NpyReader::read(std::span<std::byte> destination) {
    const uint64_t element = header_.elementSize();
    const uint64_t count = std::min<uint64_t>(destination.size() / element, remaining_);
    destination = destination.first(count * element);
    if (count == 0) return 0;
    if (std::fread(destination.data(), 1, destination.size(), file_.get()) != destination.size()) {
        if (std::ferror(file_.get()))
            return unexpected(
                makeError(ErrorCode::Io, "file.read", "cannot read '{}': {}", name_, std::strerror(errno)));
        return unexpected(inFile(
            makeError(ErrorCode::Io, "npy.truncated", "the file ends within its last {} elements", remaining_), name_));
    }
    remaining_ -= count;
    npy::swapFields(header_, swapped_, destination);
    return count;
}

// -------------------------------------------------------------------------------------------------------- writer

struct NpyWriter::State {
    std::filesystem::path path;
    std::filesystem::path temporary;
    NpyHeader header;
    uint64_t written = 0;  ///< elements
    std::FILE* file = nullptr;

    State() = default;
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() { discard(); }

    void discard() {
        if (!file) return;
        std::fclose(file);
        file = nullptr;
        ::unlink(temporary.c_str());
    }
    Status fail(int reason) {
        discard();
        return makeError(ErrorCode::Io, "file.write", "cannot write '{}': {}", path.string(), std::strerror(reason));
    }
    Status put(std::span<const std::byte> bytes) {
        if (bytes.empty() || std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size()) return {};
        return fail(errno);
    }
};

NpyWriter::NpyWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
NpyWriter::NpyWriter(NpyWriter&&) noexcept = default;
NpyWriter& NpyWriter::operator=(NpyWriter&&) noexcept = default;
NpyWriter::~NpyWriter() = default;

Expected<NpyWriter> NpyWriter::create(const std::filesystem::path& path, const NpyHeader& header) {
    const Expected<std::vector<std::byte>> bytes = npy::makeHeader(header);
    if (!bytes) return unexpected(bytes.error());
    static std::atomic<uint32_t> counter = 0;
    auto state = std::make_unique<State>();
    state->path = path;
    state->header = header;
    state->temporary = path.string() + fmt::format(".{}.{}.npy.tmp", ::getpid(), counter.fetch_add(1));
    // A folder would fail the rename at the very end, a device such as /dev/null would be replaced by it.
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
        return unexpected(
            makeError(ErrorCode::Io, "file.create", "cannot create '{}': it is no regular file", path.string()));
    state->file = std::fopen(state->temporary.c_str(), "wb");
    if (!state->file)
        return unexpected(
            makeError(ErrorCode::Io, "file.create", "cannot create '{}': {}", path.string(), std::strerror(errno)));
    if (Status status = state->put(*bytes); !status) return unexpected(status.error());
    return NpyWriter(std::move(state));
}

Status NpyWriter::write(std::span<const std::byte> elements) {
    const uint64_t size = state_->header.elementSize();
    const uint64_t left = state_->header.elements() - state_->written;
    if (!state_->file || elements.size() % size != 0 || elements.size() / size > left)
        return makeError(ErrorCode::InvalidArgument, "npy.data_size", "{} bytes where {} elements of {} bytes are left",
                         elements.size(), left, size);
    state_->written += elements.size() / size;
    return state_->put(elements);
}

Status NpyWriter::close() {
    if (!state_->file || state_->written != state_->header.elements()) {
        state_->discard();
        return makeError(ErrorCode::InvalidArgument, "npy.data_size", "{} elements were written of {}", state_->written,
                         describe(state_->header));
    }
    std::FILE* file = std::exchange(state_->file, nullptr);
    const bool closed = std::fclose(file) == 0;
    if (closed && std::rename(state_->temporary.c_str(), state_->path.c_str()) == 0) return {};
    const int reason = errno;
    ::unlink(state_->temporary.c_str());
    return makeError(ErrorCode::Io, "file.write", "cannot write '{}': {}", state_->path.string(),
                     std::strerror(reason));
}

}  // namespace glint

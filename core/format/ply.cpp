#include <glint/format/ply.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <set>

namespace glint {

namespace {

constexpr std::string_view blanks = " \t\r\n";

struct TypeName {
    std::string_view name;
    PlyType type;
};
constexpr std::array<TypeName, 16> type_names = {{{"char", PlyType::Int8},
                                                  {"int8", PlyType::Int8},
                                                  {"uchar", PlyType::Uint8},
                                                  {"uint8", PlyType::Uint8},
                                                  {"short", PlyType::Int16},
                                                  {"int16", PlyType::Int16},
                                                  {"ushort", PlyType::Uint16},
                                                  {"uint16", PlyType::Uint16},
                                                  {"int", PlyType::Int32},
                                                  {"int32", PlyType::Int32},
                                                  {"uint", PlyType::Uint32},
                                                  {"uint32", PlyType::Uint32},
                                                  {"float", PlyType::Float32},
                                                  {"float32", PlyType::Float32},
                                                  {"double", PlyType::Float64},
                                                  {"float64", PlyType::Float64}}};

bool isFloat(PlyType type) { return type == PlyType::Float32 || type == PlyType::Float64; }

std::string_view textOf(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// What an error message quotes of a file.
std::string_view excerpt(std::string_view text) { return text.substr(0, 100); }

/// Calls `visit` with a zero of the type.
template <class Visit>
auto withType(PlyType type, Visit&& visit) {
    switch (type) {
        case PlyType::Int8: return visit(int8_t{});
        case PlyType::Uint8: return visit(uint8_t{});
        case PlyType::Int16: return visit(int16_t{});
        case PlyType::Uint16: return visit(uint16_t{});
        case PlyType::Int32: return visit(int32_t{});
        case PlyType::Uint32: return visit(uint32_t{});
        case PlyType::Float64: return visit(double{});
        case PlyType::Float32: break;
    }
    return visit(float{});
}

template <class T, bool Swap>
T load(const std::byte* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    if constexpr (Swap && sizeof(T) == 2) value = std::bit_cast<T>(__builtin_bswap16(std::bit_cast<uint16_t>(value)));
    if constexpr (Swap && sizeof(T) == 4) value = std::bit_cast<T>(__builtin_bswap32(std::bit_cast<uint32_t>(value)));
    if constexpr (Swap && sizeof(T) == 8) value = std::bit_cast<T>(__builtin_bswap64(std::bit_cast<uint64_t>(value)));
    return value;
}

template <bool Swap, class To>
void gather(PlyType type, const std::byte* from, size_t from_stride, size_t count, To* to, size_t to_stride) {
    withType(type, [&]<class From>(From) {
        for (size_t i = 0; i < count; i++)
            to[i * to_stride] = static_cast<To>(load<From, Swap>(from + i * from_stride));
    });
}

/// Reads `count` values that lie `from_stride` bytes apart.
template <class To>
void gather(PlyEncoding encoding, PlyType type, const std::byte* from, size_t from_stride, size_t count, To* to,
            size_t to_stride) {
    if ((encoding == PlyEncoding::BigEndian) == (std::endian::native == std::endian::big))
        gather<false>(type, from, from_stride, count, to, to_stride);
    else
        gather<true>(type, from, from_stride, count, to, to_stride);
}

/// The lines of a header, and what they say.
class HeaderParser {
public:
    HeaderParser(std::span<const std::byte> file, const std::string& name, uint64_t size)
        : text_(textOf(file)), name_(name), size_(std::max<uint64_t>(size, file.size())) {}

    Expected<PlyHeader> parse() {
        if (!text_.starts_with("ply\n") && !text_.starts_with("ply\r"))
            return unexpected(error("ply.header", "no PLY file: it does not begin with a line 'ply'"));
        // CR alone ends the lines of some old files; then the first byte of the data may well be an LF.
        line_end_ = text_[3] == '\r' && !text_.starts_with("ply\r\n") ? '\r' : '\n';
        takeLine();
        bool has_format = false;
        while (true) {
            if (at_ == text_.size())
                return unexpected(error("ply.header", "the header does not end: there is no line 'end_header'"));
            rest_ = takeLine();
            const std::string_view keyword = takeWord();
            Status status;
            if (keyword == "comment" || keyword == "obj_info") continue;
            if (keyword == "end_header") break;
            if (keyword == "format" && !has_format) {
                status = parseFormat();
                has_format = true;
            } else if (keyword == "element") {
                status = parseElement();
            } else if (keyword == "property" && !header_.elements.empty()) {
                status = parseProperty();
            } else {
                status = error("ply.header", "'{}' is no line of a header, or not at this place", excerpt(keyword));
            }
            if (status && !takeWord().empty())
                status = error("ply.header", "the line goes on after its end, with '{}'", excerpt(rest_));
            if (!status) return unexpected(status.error());
        }
        if (!has_format) return unexpected(error("ply.header", "the header has no line 'format'"));
        header_.size = at_;
        if (Status status = checkCounts(); !status) return unexpected(status.error());
        return std::move(header_);
    }

private:
    template <class... Args>
    Error error(const char* id, fmt::format_string<Args...> format, Args&&... args) const {
        return Error::inFile(ErrorCode::Io, id, fmt::format(format, std::forward<Args>(args)...), name_, line_);
    }

    std::string_view takeLine() {
        line_++;
        std::string_view line = text_.substr(at_, text_.find(line_end_, at_) - at_);
        at_ = std::min(at_ + line.size() + 1, text_.size());
        return line;
    }

    std::string_view takeWord() {
        rest_.remove_prefix(std::min(rest_.find_first_not_of(blanks), rest_.size()));
        const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
        rest_.remove_prefix(word.size());
        return word;
    }

    Status parseFormat() {
        const std::string_view format = takeWord();
        if (format == "ascii")
            header_.encoding = PlyEncoding::Ascii;
        else if (format == "binary_little_endian")
            header_.encoding = PlyEncoding::LittleEndian;
        else if (format == "binary_big_endian")
            header_.encoding = PlyEncoding::BigEndian;
        else
            return error("ply.header", "there is no format '{}'", excerpt(format));
        if (const std::string_view version = takeWord(); version != "1.0")
            return error("ply.header", "version '{}' is not known, only 1.0 is", excerpt(version));
        return {};
    }

    Status parseElement() {
        PlyElement element;
        element.name = takeWord();
        const std::string_view count = takeWord();
        const char* end = count.data() + count.size();
        const auto [rest, failure] = std::from_chars(count.data(), end, element.count);
        if (rest != end || failure != std::errc())
            return error("ply.header", "element '{}' has the count '{}'", excerpt(element.name), excerpt(count));
        if (!element_names_.insert(element.name).second)
            return error("ply.header", "element '{}' stands there twice", excerpt(element.name));
        header_.elements.push_back(std::move(element));
        property_names_.clear();
        return {};
    }

    Status parseProperty() {
        PlyElement& element = header_.elements.back();
        PlyProperty property;
        std::string_view type = takeWord();
        property.is_list = type == "list";
        if (property.is_list) {
            const std::string_view count_type = takeWord();
            if (!parseType(count_type, property.count_type) || isFloat(property.count_type))
                return error("ply.header", "a list of element '{}' has a length of type '{}'", excerpt(element.name),
                             excerpt(count_type));
            type = takeWord();
        }
        if (!parseType(type, property.type))
            return error("ply.header", "a property of element '{}' has the type '{}'", excerpt(element.name),
                         excerpt(type));
        property.name = takeWord();
        if (property.name.empty() || !property_names_.insert(property.name).second)
            return error("ply.header", "element '{}' has a property without name, or '{}' twice", excerpt(element.name),
                         excerpt(property.name));
        property.offset = element.stride;
        // A line of the header has more bytes than its value, so 32 bits suffice for files of less than 4 GiB of
        // header.
        element.stride += sizeOf(property.is_list ? property.count_type : property.type);
        element.has_list |= property.is_list;
        element.properties.push_back(std::move(property));
        return {};
    }

    static bool parseType(std::string_view word, PlyType& type) {
        const auto* found =
            std::find_if(type_names.begin(), type_names.end(), [&](const TypeName& each) { return each.name == word; });
        if (found == type_names.end()) return false;
        type = found->type;
        return true;
    }

    Status checkCounts() const {
        uint64_t left = size_ - at_;
        for (const PlyElement& element : header_.elements) {
            // A number of a text is a digit and what parts it from the next; nothing need follow the last one.
            const bool is_text = header_.encoding == PlyEncoding::Ascii;
            const uint64_t size = is_text ? 2 * element.properties.size() : element.stride;
            const uint64_t room = left + (is_text ? 1 : 0);
            if (size != 0 && element.count > room / size)
                return Error::inFile(ErrorCode::Io, "ply.truncated",
                                     fmt::format("{} records of element '{}' take {} bytes each or more, and from byte "
                                                 "{} on the file has {} for them",
                                                 element.count, excerpt(element.name), size, size_ - left, left),
                                     name_, 0);
            left -= std::min(left, element.count * size);
        }
        return {};
    }

    std::string_view text_;
    const std::string& name_;
    uint64_t size_ = 0;  // of the whole file
    char line_end_ = '\n';
    size_t at_ = 0;
    uint32_t line_ = 0;
    std::string_view rest_;  // of the line
    PlyHeader header_;
    std::set<std::string> element_names_;
    std::set<std::string> property_names_;  // of the last element
};

}  // namespace

uint32_t sizeOf(PlyType type) {
    return withType(type, [](auto zero) { return static_cast<uint32_t>(sizeof zero); });
}

const PlyProperty* PlyElement::find(std::string_view property) const {
    const auto found = std::find_if(properties.begin(), properties.end(),
                                    [&](const PlyProperty& each) { return each.name == property; });
    return found == properties.end() ? nullptr : &*found;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
    const auto found =
        std::find_if(elements.begin(), elements.end(), [&](const PlyElement& each) { return each.name == element; });
    return found == elements.end() ? nullptr : &*found;
}

Expected<PlyHeader> parsePlyHeader(std::span<const std::byte> file, const std::string& name, uint64_t size) {
    return HeaderParser(file, name, size).parse();
}

PlyReader::PlyReader(std::span<const std::byte> file, const PlyHeader& header, const std::string& name)
    : file_(file),
      encoding_(header.encoding),
      name_(name),
      at_(file.data() + header.size),
      end_(file.data() + file.size()) {}

Status PlyReader::readColumns(const PlyElement& element, std::span<const Column> columns) {
    if (encoding_ == PlyEncoding::Ascii || element.has_list) return readRecords(element, columns, nullptr, nullptr);
    if (element.stride != 0 && element.count > static_cast<uint64_t>(end_ - at_) / element.stride)
        return place(makeError(ErrorCode::Io, "ply.truncated", "{} records of {} bytes do not fit into the {} left",
                               element.count, element.stride, end_ - at_),
                     element, 0);
    readBlocks(element, columns);
    return {};
}

Status PlyReader::readLists(const PlyElement& element, const PlyProperty& list, const ListVisitor& visit) {
    return readRecords(element, {}, &list, &visit);
}

void PlyReader::readBlocks(const PlyElement& element, std::span<const Column> columns) {
    // Column by column, in blocks that stay in the cache: no decision is made for a single value.
    constexpr uint64_t block = 256;
    for (uint64_t first = 0; first < element.count && !columns.empty(); first += block)
        for (const Column& column : columns)
            gather(encoding_, column.property->type, at_ + first * element.stride + column.property->offset,
                   element.stride, std::min(block, element.count - first), column.values + first * column.stride,
                   column.stride);
    at_ += element.count * element.stride;
}

Status PlyReader::readRecords(const PlyElement& element, std::span<const Column> columns, const PlyProperty* list,
                              const ListVisitor* visit) {
    if (element.properties.empty()) return {};
    std::vector<const Column*> targets(element.properties.size());
    for (const Column& column : columns) targets[column.property - element.properties.data()] = &column;
    std::vector<double> values;
    for (uint64_t record = 0; record < element.count; record++) {
        for (size_t k = 0; k < targets.size(); k++) {
            const PlyProperty& property = element.properties[k];
            double value = 0.0;
            if (!property.is_list) {
                if (!(targets[k] ? readValues(property.type, 1, &value) : skipValues(property.type, 1)))
                    return failure(element, record, property);
                if (targets[k]) targets[k]->values[record * targets[k]->stride] = static_cast<float>(value);
                continue;
            }
            if (!readValues(property.count_type, 1, &value)) return failure(element, record, property);
            if (!(value >= 0.0 && value <= static_cast<double>(room(property.type)) && value == std::trunc(value)))
                return place(makeError(ErrorCode::Io, "ply.list_length",
                                       "the list '{}' has the length {}, and the file has room for {}",
                                       excerpt(property.name), value, room(property.type)),
                             element, record);
            const auto length = static_cast<size_t>(value);
            if (&property != list) {
                if (!skipValues(property.type, length)) return failure(element, record, property);
                continue;
            }
            if (values.size() < length) values.resize(length);
            if (!readValues(property.type, length, values.data())) return failure(element, record, property);
            if (Status status = (*visit)(record, std::span(values).first(length)); !status)
                return place(status.error(), element, record);
        }
    }
    return {};
}

bool PlyReader::readValues(PlyType type, size_t count, double* values) {
    if (encoding_ != PlyEncoding::Ascii) {
        if (room(type) < count) return false;
        const size_t size = sizeOf(type);
        gather(encoding_, type, at_, size, count, values, 1);
        at_ += count * size;
        return true;
    }
    for (size_t i = 0; i < count; i++) {
        const std::string_view word = takeWord();
        const std::string_view digits = word.starts_with('+') && !word.starts_with("+-") ? word.substr(1) : word;
        const char* end = digits.data() + digits.size();
        const auto [rest, failed] = std::from_chars(digits.data(), end, values[i]);
        if (rest != end || failed != std::errc()) {
            bad_word_ = word;
            return false;
        }
    }
    return true;
}

bool PlyReader::skipValues(PlyType type, size_t count) {
    if (encoding_ != PlyEncoding::Ascii) {
        if (room(type) < count) return false;
        at_ += count * sizeOf(type);
        return true;
    }
    for (size_t i = 0; i < count; i++)
        if (takeWord().empty()) return false;
    return true;
}

/// The next word of a text; empty at the end of the file.
std::string_view PlyReader::takeWord() {
    const auto isBlank = [](std::byte byte) {
        const auto c = static_cast<char>(byte);
        return c == ' ' || c == '\n' || c == '\r' || c == '\t';
    };
    while (at_ != end_ && isBlank(*at_)) at_++;
    const std::byte* begin = at_;
    while (at_ != end_ && !isBlank(*at_)) at_++;
    return textOf({begin, at_});
}

/// How many values the rest of the file could hold.
uint64_t PlyReader::room(PlyType type) const {
    const auto left = static_cast<uint64_t>(end_ - at_);
    return encoding_ == PlyEncoding::Ascii ? left / 2 : left / sizeOf(type);
}

Error PlyReader::place(const Error& error, const PlyElement& element, uint64_t record) const {
    if (encoding_ != PlyEncoding::Ascii)
        return Error::inFile(
            error.code(), error.id().data(),
            fmt::format("{} {}, before byte {}: {}", excerpt(element.name), record, position(), error.message()), name_,
            0);
    const std::string_view before = textOf({file_.data(), at_});
    auto lines = std::count(before.begin(), before.end(), '\n');
    if (lines == 0) lines = std::count(before.begin(), before.end(), '\r');
    return Error::inFile(error.code(), error.id().data(),
                         fmt::format("{} {}: {}", excerpt(element.name), record, error.message()), name_,
                         static_cast<uint32_t>(lines + 1));
}

Error PlyReader::failure(const PlyElement& element, uint64_t record, const PlyProperty& property) const {
    if (bad_word_.empty())
        return place(
            makeError(ErrorCode::Io, "ply.truncated", "the file ends before property '{}'", excerpt(property.name)),
            element, record);
    return place(makeError(ErrorCode::Io, "ply.value", "property '{}' has '{}' for a number", excerpt(property.name),
                           excerpt(bad_word_)),
                 element, record);
}

}  // namespace glint

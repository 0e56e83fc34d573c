#include "npy_header.h"

#include <glint/base/format_error.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>

namespace glint::npy {

namespace {

constexpr std::string_view magic = "\x93NUMPY";
constexpr uint64_t max_bytes = 1ull << 62;
constexpr size_t max_dimensions = 32;
constexpr size_t max_fields = 1024;
constexpr uint64_t max_element = 1u << 16;
constexpr char native_order = std::endian::native == std::endian::little ? '<' : '>';

/// What Python would read the header's text as.
struct Value {
    enum class Type : uint8_t { Text, Number, Bool, Tuple, List, Dictionary } type = Type::Text;
    size_t offset = 0;
    std::string text;
    uint64_t number = 0;  ///< or 0 and 1
    bool is_negative = false;
    std::vector<Value> items;  ///< of a dictionary: key, value, key, value
};

const char* toString(Value::Type type) {
    constexpr std::array names = {"a string", "a number", "a bool", "a tuple", "a list", "a dictionary"};
    return names[static_cast<size_t>(type)];
}

/// Thrown within this file: one way out of the nested functions below.
struct Refusal {
    Error error;
};

template <class... Args>
[[noreturn]] void refuse(const char* id, size_t offset, fmt::format_string<Args...> format, Args&&... args) {
    throw Refusal{
        makeError(ErrorCode::Io, id, "byte {}: {}", offset, fmt::format(format, std::forward<Args>(args)...))};
}

void appendUtf8(std::string& text, uint32_t code) {
    if (code < 0x80) {
        text += static_cast<char>(code);
    } else if (code < 0x800) {
        text += static_cast<char>(0xc0 | code >> 6);
        text += static_cast<char>(0x80 | (code & 0x3f));
    } else {
        text += static_cast<char>(0xe0 | code >> 12);
        text += static_cast<char>(0x80 | (code >> 6 & 0x3f));
        text += static_cast<char>(0x80 | (code & 0x3f));
    }
}

/// Python literals, as far as NumPy writes them.
class Parser {
public:
    Parser(std::string_view text, size_t offset) : text_(text), offset_(offset) {}

    Value parse() {
        Value value = parseValue(0);
        skipSpace();
        if (place_ != text_.size()) refuse("npy.header", here(), "'{}' follows the dictionary", text_[place_]);
        return value;
    }

private:
    static constexpr int max_depth = 8;

    size_t here() const { return offset_ + place_; }
    void skipSpace() {
        while (place_ < text_.size() && std::strchr(" \t\r\n", text_[place_]) && text_[place_]) place_++;
    }
    char peek() const { return place_ < text_.size() ? text_[place_] : '\0'; }
    bool take(char c) {
        skipSpace();
        if (place_ >= text_.size() || text_[place_] != c) return false;
        place_++;
        return true;
    }
    bool takeWord(std::string_view word) {
        if (!text_.substr(place_).starts_with(word)) return false;
        place_ += word.size();
        return true;
    }

    Value parseValue(int depth) {
        skipSpace();
        if (depth > max_depth) refuse("npy.header", here(), "brackets nest deeper than {}", max_depth);
        if (place_ >= text_.size()) refuse("npy.header", here(), "the header ends within the dictionary");
        Value value;
        value.offset = here();
        const char first = peek();
        if (first == '\'' || first == '"') {
            place_++;
            value.text = parseText(first);
        } else if (first == '-' || (first >= '0' && first <= '9')) {
            parseNumber(value);
        } else if (takeWord("True") || takeWord("False")) {
            value.type = Value::Type::Bool;
            value.number = first == 'T';
        } else if (take('(')) {
            parseItems(value, ')', depth);
        } else if (take('[')) {
            value.type = Value::Type::List;
            parseItems(value, ']', depth);
        } else if (take('{')) {
            value.type = Value::Type::Dictionary;
            parseItems(value, '}', depth);
        } else {
            refuse("npy.header", here(), "character {:#04x} begins no value", static_cast<unsigned char>(first));
        }
        return value;
    }

    void parseItems(Value& value, char end, int depth) {
        const bool is_tuple = value.type == Value::Type::Text;
        if (is_tuple) value.type = Value::Type::Tuple;
        bool ended_by_comma = false;
        while (!take(end)) {
            if (!value.items.empty() && !ended_by_comma) refuse("npy.header", here(), "',' or '{}' is missing", end);
            value.items.push_back(parseValue(depth + 1));
            if (value.type == Value::Type::Dictionary) {
                if (!take(':')) refuse("npy.header", here(), "':' is missing");
                value.items.push_back(parseValue(depth + 1));
            }
            ended_by_comma = take(',');
        }
        // (x) is x to Python.
        if (is_tuple && value.items.size() == 1 && !ended_by_comma) {
            Value only = std::move(value.items[0]);
            value = std::move(only);
        }
    }

    void parseNumber(Value& value) {
        value.type = Value::Type::Number;
        value.is_negative = peek() == '-';
        if (value.is_negative) place_++;
        const char* begin = text_.data() + place_;
        const auto [end, failure] = std::from_chars(begin, text_.data() + text_.size(), value.number);
        if (end == begin) refuse("npy.header", value.offset, "'-' without a number");
        if (failure != std::errc()) refuse("npy.shape", value.offset, "a number of 2^64 or more");
        place_ += static_cast<size_t>(end - begin);
        if (peek() == 'L') place_++;  // a long integer of Python 2
    }

    std::string parseText(char quote) {
        std::string text;
        const size_t begin = here() - 1;
        for (;;) {
            if (place_ >= text_.size() || text_[place_] == '\n') refuse("npy.header", begin, "a string without end");
            const char c = text_[place_++];
            if (c == quote) return text;
            if (c == '\\')
                parseEscape(text);
            else
                text += c;
        }
    }

    void parseEscape(std::string& text) {
        const size_t begin = here() - 1;
        const char c = peek();
        place_++;
        const size_t digits = c == 'x' ? 2 : c == 'u' ? 4 : 0;
        if (c == '\\' || c == '\'' || c == '"') {
            text += c;
        } else if (digits && place_ + digits <= text_.size()) {
            uint32_t code = 0;
            const char* first = text_.data() + place_;
            const auto [end, failure] = std::from_chars(first, first + digits, code, 16);
            if (failure != std::errc() || end != first + digits || code < 0x20)
                refuse("npy.header", begin, "a malformed escape");
            appendUtf8(text, code);
            place_ += digits;
        } else {
            refuse("npy.header", begin, "an escape that is not read here");
        }
    }

    std::string_view text_;
    size_t offset_;
    size_t place_ = 0;
};

struct Scalar {
    NpyField field;
    bool swapped = false;
};

Scalar parseScalar(const Value& value) {
    if (value.type != Value::Type::Text)
        refuse("npy.type", value.offset, "{} where a type such as '<f4' belongs", toString(value.type));
    const std::string_view text = value.text;
    const auto unsupported = [&] { refuse("npy.type", value.offset, "elements of type '{}' are not read", text); };
    if (text.size() < 3) unsupported();
    const char order = text[0];
    if (!std::strchr("<>|=", order)) unsupported();
    Scalar scalar;
    switch (text[1]) {
        case 'b': scalar.field.kind = NpyField::Kind::Bool; break;
        case 'i': scalar.field.kind = NpyField::Kind::Int; break;
        case 'u': scalar.field.kind = NpyField::Kind::Uint; break;
        case 'f': scalar.field.kind = NpyField::Kind::Float; break;
        case 'V': scalar.field.kind = NpyField::Kind::Padding; break;
        default: unsupported();
    }
    uint32_t& size = scalar.field.size;
    const auto [end, failure] = std::from_chars(text.data() + 2, text.data() + text.size(), size);
    if (failure != std::errc() || end != text.data() + text.size()) unsupported();
    scalar.swapped = (order == '<' || order == '>') && order != native_order && size > 1;
    return scalar;
}

/// Whether numbers of this kind come in this size.
bool isSound(const NpyField& field) {
    switch (field.kind) {
        case NpyField::Kind::Bool: return field.size == 1;
        case NpyField::Kind::Int:
        case NpyField::Kind::Uint: return field.size == 1 || field.size == 2 || field.size == 4 || field.size == 8;
        case NpyField::Kind::Float: return field.size == 2 || field.size == 4 || field.size == 8;
        case NpyField::Kind::Padding: return field.size >= 1 && field.count == 1 && field.name.empty();
    }
    return false;
}

/// Why elements cannot have these fields; empty if they can. With the overall sizes that this file promises.
std::string faultOf(const std::vector<NpyField>& fields) {
    if (fields.empty()) return "an element without fields";
    if (fields.size() > max_fields) return fmt::format("{} fields, the limit is {}", fields.size(), max_fields);
    uint64_t size = 0;
    bool has_number = false;
    for (size_t i = 0; i < fields.size(); i++) {
        const NpyField& field = fields[i];
        if (!isSound(field) || field.count == 0)
            return fmt::format("field {} '{}' of {} bytes times {}", i, field.name, field.size, field.count);
        has_number = has_number || field.kind != NpyField::Kind::Padding;
        size += static_cast<uint64_t>(field.size) * field.count;
        if (size > max_element) return fmt::format("an element of more than {} bytes", max_element);
        if (fields.size() == 1 && field.name.empty() && field.count != 1) return "a plain array of runs";
        if (fields.size() == 1 || field.kind == NpyField::Kind::Padding) continue;
        if (field.name.empty()) return fmt::format("field {} has no name", i);
        for (size_t k = 0; k < i; k++)
            if (fields[k].name == field.name) return fmt::format("two fields are named '{}'", field.name);
    }
    return has_number ? std::string() : "an element of padding only";
}

/// Why an array cannot have this shape; empty if it can.
std::string faultOf(const std::vector<uint64_t>& shape, uint64_t element_size) {
    if (shape.size() > max_dimensions)
        return fmt::format("{} dimensions, the limit is {}", shape.size(), max_dimensions);
    // A dimension of 0 hides none that is too large.
    uint64_t bytes = element_size;
    for (const uint64_t dimension : shape) {
        if (dimension > max_bytes / bytes) return "more than 2^62 bytes of elements";
        bytes *= std::max<uint64_t>(dimension, 1);
    }
    return {};
}

void parseStructure(const Value& list, Parsed& parsed) {
    if (list.items.size() > max_fields)
        refuse("npy.type", list.offset, "{} fields, the limit is {}", list.items.size(), max_fields);
    for (const Value& item : list.items) {
        const bool is_field = item.type == Value::Type::Tuple && (item.items.size() == 2 || item.items.size() == 3);
        if (!is_field) refuse("npy.type", item.offset, "a field is no tuple of a name and a type");
        if (item.items[0].type != Value::Type::Text)
            refuse("npy.type", item.items[0].offset, "{} where a field's name belongs", toString(item.items[0].type));
        Scalar scalar = parseScalar(item.items[1]);
        scalar.field.name = item.items[0].text;
        if (item.items.size() == 3) {
            const Value& run = item.items[2];
            const Value* count = &run;
            if (run.type == Value::Type::Tuple && run.items.size() == 1) count = &run.items[0];
            if (count->type != Value::Type::Number || count->is_negative || count->number > max_element)
                refuse("npy.type", run.offset, "the shape of field '{}' is not one number", scalar.field.name);
            scalar.field.count = static_cast<uint32_t>(count->number);
        }
        parsed.header.fields.push_back(std::move(scalar.field));
        parsed.swapped.push_back(scalar.swapped);
    }
}

void parseType(const Value& value, Parsed& parsed) {
    if (value.type == Value::Type::List) {
        parseStructure(value, parsed);
    } else {
        Scalar scalar = parseScalar(value);
        parsed.header.fields.push_back(std::move(scalar.field));
        parsed.swapped.push_back(scalar.swapped);
    }
    if (const std::string fault = faultOf(parsed.header.fields); !fault.empty())
        refuse("npy.type", value.offset, "{}", fault);
    const bool is_named = !parsed.header.fields[0].name.empty();
    if (value.type == Value::Type::List && parsed.header.fields.size() == 1 && !is_named)
        refuse("npy.type", value.offset, "field 0 has no name");
}

void parseShape(const Value& value, Parsed& parsed) {
    if (value.type != Value::Type::Tuple) refuse("npy.shape", value.offset, "{} is no shape", toString(value.type));
    for (const Value& item : value.items) {
        if (item.type != Value::Type::Number || item.is_negative)
            refuse("npy.shape", item.offset, "a dimension is no number of 0 or more");
        parsed.header.shape.push_back(item.number);
    }
    if (const std::string fault = faultOf(parsed.header.shape, parsed.header.elementSize()); !fault.empty())
        refuse("npy.shape", value.offset, "{}", fault);
}

Parsed parseDictionary(const Value& root) {
    if (root.type != Value::Type::Dictionary)
        refuse("npy.header", root.offset, "{} where a dictionary belongs", toString(root.type));
    constexpr std::array<std::string_view, 3> names = {"descr", "fortran_order", "shape"};
    std::array<const Value*, 3> values = {};
    for (size_t i = 0; i < root.items.size(); i += 2) {
        const Value& key = root.items[i];
        const auto name = std::find(names.begin(), names.end(), key.text);
        if (key.type != Value::Type::Text || name == names.end())
            refuse("npy.header", key.offset, "the key is none of descr, fortran_order and shape");
        const Value*& value = values[static_cast<size_t>(name - names.begin())];
        if (value) refuse("npy.header", key.offset, "a second '{}'", key.text);
        value = &root.items[i + 1];
    }
    for (size_t i = 0; i < names.size(); i++)
        if (!values[i]) refuse("npy.header", root.offset, "'{}' is missing", names[i]);

    Parsed parsed;
    parseType(*values[0], parsed);
    parseShape(*values[2], parsed);
    if (values[1]->type != Value::Type::Bool)
        refuse("npy.header", values[1]->offset, "fortran_order is {}", toString(values[1]->type));
    const auto wide = std::count_if(parsed.header.shape.begin(), parsed.header.shape.end(),
                                    [](uint64_t dimension) { return dimension > 1; });
    if (values[1]->number && wide > 1 && parsed.header.elements() > 0)
        refuse("npy.fortran_order", values[1]->offset, "columns first: save numpy.ascontiguousarray(a) instead");
    return parsed;
}

std::string typeText(const NpyField& field) {
    const char kind = "biufV"[static_cast<size_t>(field.kind)];
    const bool has_order = field.size > 1 && field.kind != NpyField::Kind::Padding;
    return fmt::format("'{}{}{}'", has_order ? native_order : '|', kind, field.size);
}

std::string quotedName(std::string_view name) {
    std::string text = "'";
    for (const char c : name) {
        if (c == '\'' || c == '\\') text += '\\';
        text += c;
    }
    return text + "'";
}

}  // namespace

Expected<Extent> findHeader(std::span<const std::byte> bytes) {
    const auto at = [&](size_t i) { return std::to_integer<uint32_t>(bytes[i]); };
    if (bytes.size() < magic.size() || std::memcmp(bytes.data(), magic.data(), magic.size()) != 0)
        return unexpected(makeError(ErrorCode::Io, "npy.magic", "the file does not begin as .npy files do"));
    if (bytes.size() < 8)
        return unexpected(makeError(ErrorCode::Io, "npy.truncated", "the file ends at byte {}", bytes.size()));
    if (at(6) < 1 || at(6) > 3 || at(7) != 0)
        return unexpected(
            makeError(ErrorCode::Io, "npy.version", "version {}.{} is none of 1.0, 2.0 and 3.0", at(6), at(7)));
    const size_t begin = at(6) == 1 ? 10 : 12;
    if (bytes.size() < begin)
        return unexpected(makeError(ErrorCode::Io, "npy.truncated", "the file ends at byte {}", bytes.size()));
    uint64_t length = at(8) | at(9) << 8;
    if (begin == 12) length |= static_cast<uint64_t>(at(10) | at(11) << 8) << 16;
    if (length > max_header)
        return unexpected(
            makeError(ErrorCode::Io, "npy.header", "a header of {} bytes, the limit is {}", length, max_header));
    return Extent{begin, begin + static_cast<size_t>(length)};
}

Expected<Parsed> parseHeader(std::string_view text, size_t offset) {
    try {
        return parseDictionary(Parser(text, offset).parse());
    } catch (const Refusal& refusal) { return unexpected(refusal.error); }
}

Expected<std::vector<std::byte>> makeHeader(const NpyHeader& header) {
    if (const std::string fault = faultOf(header.fields); !fault.empty())
        return unexpected(makeError(ErrorCode::InvalidArgument, "npy.type", "{}", fault));
    if (const std::string fault = faultOf(header.shape, header.elementSize()); !fault.empty())
        return unexpected(makeError(ErrorCode::InvalidArgument, "npy.shape", "{}", fault));

    std::string text = "{'descr': ";
    bool is_ascii = true;
    if (header.fields.size() == 1 && header.fields[0].name.empty()) {
        text += typeText(header.fields[0]);
    } else {
        text += '[';
        for (const NpyField& field : header.fields) {
            for (const char c : field.name) {
                if (static_cast<unsigned char>(c) < 0x20)
                    return unexpected(makeError(ErrorCode::InvalidArgument, "npy.type",
                                                "a field's name holds the control character {:#04x}",
                                                static_cast<unsigned char>(c)));
                is_ascii = is_ascii && static_cast<unsigned char>(c) < 0x80;
            }
            text += fmt::format("({}, {}", quotedName(field.name), typeText(field));
            if (field.count != 1) text += fmt::format(", ({},)", field.count);
            text += "), ";
        }
        text.resize(text.size() - 2);
        text += ']';
    }
    text += fmt::format(", 'fortran_order': False, 'shape': ({}{}), }}", fmt::join(header.shape, ", "),
                        header.shape.size() == 1 ? "," : "");

    // Elements begin at a multiple of 64, so that the file can be mapped.
    const bool is_short = is_ascii && text.size() + 64 < 65536;
    const size_t begin = is_short ? 10 : 12;
    text.append(63 - (begin + text.size()) % 64, ' ');
    text += '\n';
    if (text.size() > max_header)
        return unexpected(makeError(ErrorCode::InvalidArgument, "npy.type", "names of {} bytes, the limit is {}",
                                    text.size(), max_header));
    std::vector<std::byte> bytes(begin + text.size());
    std::memcpy(bytes.data(), magic.data(), magic.size());
    bytes[6] = std::byte{static_cast<uint8_t>(is_short ? 1 : is_ascii ? 2 : 3)};
    for (size_t i = 8; i < begin; i++) bytes[i] = std::byte{static_cast<uint8_t>(text.size() >> (i - 8) * 8)};
    std::memcpy(bytes.data() + begin, text.data(), text.size());
    return bytes;
}

void swapFields(const NpyHeader& header, const std::vector<bool>& swapped, std::span<std::byte> elements) {
    if (std::find(swapped.begin(), swapped.end(), true) == swapped.end()) return;
    for (size_t place = 0; place < elements.size();) {
        for (size_t i = 0; i < header.fields.size(); i++) {
            const NpyField& field = header.fields[i];
            for (uint32_t k = 0; k < field.count; k++, place += field.size)
                if (swapped[i]) std::reverse(&elements[place], &elements[place] + field.size);
        }
    }
}

}  // namespace glint::npy

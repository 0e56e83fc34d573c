#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint {

/// Types of the values in a PLY file: `char`, `uchar`, ... `double` or `int8`, `uint8`, ... `float64` there.
enum class PlyType : uint8_t { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float32, Float64 };

/// Bytes of a value in a binary file.
uint32_t sizeOf(PlyType type);

/// How the values of a PLY file are written.
enum class PlyEncoding : uint8_t { Ascii, LittleEndian, BigEndian };

/// One value, or one list of values, of each record of an element.
struct PlyProperty {
    std::string name;
    PlyType type = PlyType::Float32;  ///< of the value, or of each value of a list
    bool is_list = false;
    PlyType count_type = PlyType::Uint8;  ///< of a list's length; never a float
    uint32_t offset = 0;                  ///< bytes from a binary record's begin if every list before it is empty
    bool operator==(const PlyProperty&) const = default;
};

/// A table of a PLY file, such as its vertices.
struct PlyElement {
    std::string name;
    uint64_t count = 0;     ///< records
    uint32_t stride = 0;    ///< bytes of a binary record if every list in it is empty
    bool has_list = false;  ///< if not, all records have `stride` bytes
    std::vector<PlyProperty> properties;

    /// The property of that name, or null.
    const PlyProperty* find(std::string_view property) const;
};

/// What stands before the data of a PLY file.
struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::Ascii;
    std::vector<PlyElement> elements;  ///< in the order of their data; no name twice
    size_t size = 0;                   ///< bytes; the data follow

    /// The element of that name, or null.
    const PlyElement* find(std::string_view element) const;
};

/// Reads the header of a PLY file of format 1.0, whose lines end in LF, CR LF or CR. The file is known to be long
/// enough for the counts of its elements with every list empty, so nobody is led to make room for more than the file
/// can hold. `name` names the file in errors, which have the line. Where `file` is but the begin of a file, `size` is
/// that of the whole. Errors: "ply.header" (no PLY file; a line, a type or a count that cannot be read; a name twice in
/// one place), "ply.truncated".
Expected<PlyHeader> parsePlyHeader(std::span<const std::byte> file, const std::string& name, uint64_t size = 0);

/// Reads the data of a PLY file: each element in turn, in the order of the header. Values are handed over in the types
/// given here, whatever their type in the file; float64 and 32-bit integers are rounded to nearest where that is
/// float32. Bytes after the last element are passed over. `file`, `header` and `name` have to outlive the reader.
///
/// Errors of all of its functions: "ply.truncated", "ply.value" (text that is no number), "ply.list_length" (negative,
/// no integer, or more than the rest of the file could hold). They name the file, the element, the record and the line
/// of a text or the byte of a binary file.
class PlyReader {
public:
    PlyReader(std::span<const std::byte> file, const PlyHeader& header, const std::string& name);

    /// Where the values of a property go: that of record i to `values[i * stride]`.
    struct Column {
        const PlyProperty* property = nullptr;  ///< of the element that is read; no list
        float* values = nullptr;
        size_t stride = 1;
    };

    /// The values of a record's list. An error ends the reading, and is given the place of the record.
    using ListVisitor = std::function<Status(uint64_t record, std::span<const double> values)>;

    /// Reads some properties of all records.
    Status readColumns(const PlyElement& element, std::span<const Column> columns);
    /// Reads one list of all records. Takes at most 8 bytes for each byte of the file.
    Status readLists(const PlyElement& element, const PlyProperty& list, const ListVisitor& visit);
    Status skip(const PlyElement& element) { return readColumns(element, {}); }

    /// Bytes from the begin of the file to the next element; what seek() takes.
    size_t position() const { return static_cast<size_t>(at_ - file_.data()); }
    void seek(size_t position) { at_ = file_.data() + position; }

private:
    Status readRecords(const PlyElement& element, std::span<const Column> columns, const PlyProperty* list,
                       const ListVisitor* visit);
    void readBlocks(const PlyElement& element, std::span<const Column> columns);
    bool readValues(PlyType type, size_t count, double* values);
    bool skipValues(PlyType type, size_t count);
    std::string_view takeWord();
    uint64_t room(PlyType type) const;
    Error place(const Error& error, const PlyElement& element, uint64_t record) const;
    Error failure(const PlyElement& element, uint64_t record, const PlyProperty& property) const;

    std::span<const std::byte> file_;
    PlyEncoding encoding_;
    const std::string& name_;
    const std::byte* at_;
    const std::byte* end_;
    std::string_view bad_word_;  // what could not be read as a number; empty: the file has ended
};

}  // namespace glint

#pragma once

#include <glint/base/expected.h>
#include <glint/base/status.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace glint {

/// One number of an array's element, or a run of them.
struct NpyField {
    enum class Kind : uint8_t { Bool, Int, Uint, Float, Padding };
    std::string name;  ///< empty for padding, and for the only field of a plain array
    Kind kind = Kind::Float;
    uint32_t size = 4;   ///< bytes of one number: 1, 2, 4 or 8; for floats not 1, for bools 1
    uint32_t count = 1;  ///< numbers one after the other: a field of the shape (count,)

    /// The field that holds a C++ number.
    template <class T>
    static NpyField of(std::string name = {}, uint32_t count = 1) {
        static_assert(std::is_arithmetic_v<T> && sizeof(T) <= 8);
        const Kind kind = std::is_same_v<T, bool>       ? Kind::Bool
                          : std::is_floating_point_v<T> ? Kind::Float
                          : std::is_signed_v<T>         ? Kind::Int
                                                        : Kind::Uint;
        return {std::move(name), kind, sizeof(T), count};
    }
    static NpyField padding(uint32_t bytes) { return {{}, Kind::Padding, bytes, 1}; }
    bool operator==(const NpyField&) const = default;
};

/// What an array is: the type of its elements and its shape. A plain array has one field without a name, of one
/// number; all others are structured.
struct NpyHeader {
    std::vector<NpyField> fields;
    std::vector<uint64_t> shape;  ///< in C order; empty for a single element

    /// Bytes of one element.
    uint64_t elementSize() const;
    /// Elements: the product of the shape.
    uint64_t elements() const;
    bool operator==(const NpyHeader&) const = default;
};

/// "float32 [100, 8]", "{t: float32, hit: bool, 3 bytes} [100]".
std::string describe(const NpyHeader& header);

/// An array in memory. The numbers are in this machine's byte order, elements tightly packed.
struct NpyArray {
    /// Largest number of bytes of an array, unless the caller says otherwise.
    static constexpr uint64_t default_limit = 1ull << 34;

    NpyHeader header;
    std::vector<std::byte> data;

    /// The numbers of a plain array of T; empty for any other array.
    template <class T>
    std::span<const T> values() const {
        if (header.fields.size() != 1 || header.fields[0] != NpyField::of<T>()) return {};
        return {reinterpret_cast<const T*>(data.data()), data.size() / sizeof(T)};
    }
    bool operator==(const NpyArray&) const = default;
};

// NumPy's .npy files, versions 1.0, 2.0 and 3.0: bool, signed and unsigned integers of 1 to 8 bytes, floats of 2 to 8
// bytes, in either byte order, and structures of those with padding and one-dimensional runs. What is written is of
// version 1.0 where that can hold it, in this machine's byte order.
//
// Errors of reading name the byte: "npy.magic" (no such file), "npy.version", "npy.header" (malformed, a key missing or
// too many, longer than 1 MiB), "npy.type" (complex numbers, text, objects, dates, nested structures; more than 1024
// fields or 64 KiB an element), "npy.shape" (more than 32 dimensions, negative ones, more than 2^62 bytes),
// "npy.fortran_order" (unless at most one dimension is larger than 1), "npy.truncated", "npy.trailing" (bytes after the
// last element), "npy.too_large" (more than `limit` bytes of elements).
// Errors of writing: "npy.type", "npy.shape", "npy.data_size" (not as many bytes as the shape says).

/// A file's bytes to an array. Never allocates more than the bytes hold.
Expected<NpyArray> decodeNpy(std::span<const std::byte> bytes, uint64_t limit = NpyArray::default_limit);

/// An array to a file's bytes.
Expected<std::vector<std::byte>> encodeNpy(const NpyHeader& header, std::span<const std::byte> data);

/// Reads an array piece by piece.
class NpyReader {
public:
    /// Opens a file and reads its header. That a regular file is as long as its header says is checked at once.
    /// Errors: "file.open", "file.read", and those above.
    static Expected<NpyReader> open(const std::filesystem::path& path);

    const NpyHeader& header() const { return header_; }
    uint64_t remaining() const { return remaining_; }  ///< elements not yet read

    /// Reads the next elements, as many as `destination` has whole room for and the array still has; returns how many.
    /// Errors: "file.read", "npy.truncated".
    Expected<uint64_t> read(std::span<std::byte> destination);

private:
    struct Closer {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    NpyReader() = default;

    std::unique_ptr<std::FILE, Closer> file_;
    std::string name_;
    NpyHeader header_;
    std::vector<bool> swapped_;  ///< fields in the other byte order
    uint64_t remaining_ = 0;
};

/// Writes an array piece by piece. The final name never holds half of it: a temporary beside it is renamed by close(),
/// and removed if the writer goes before that.
class NpyWriter {
public:
    /// Errors: "file.create", "file.write", and those of writing above.
    static Expected<NpyWriter> create(const std::filesystem::path& path, const NpyHeader& header);
    NpyWriter(NpyWriter&&) noexcept;
    NpyWriter& operator=(NpyWriter&&) noexcept;
    ~NpyWriter();

    /// Appends whole elements. Errors: "file.write", "npy.data_size" (a part of an element, or more than the shape
    /// has).
    Status write(std::span<const std::byte> elements);
    /// Ends the file and gives it its name. Errors: "file.write", "npy.data_size" (elements are missing).
    Status close();

private:
    struct State;
    explicit NpyWriter(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace glint

#include <glint/format/gltf.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/format/detail/gltf_scene.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>

namespace glint {

namespace {

using detail::GltfAccessors;
using detail::GltfBudget;
using detail::gltfError;
using detail::GltfPath;
using nlohmann::json;

using Bytes = std::vector<std::byte>;

/// The JSON text of a document, and the binary chunk of a GLB.
struct Chunks {
    std::string_view text;
    std::span<const std::byte> binary;
};

uint32_t word(std::span<const std::byte> bytes, size_t offset) {
    uint32_t value = 0;
    for (size_t k = 0; k < 4; k++) value |= static_cast<uint32_t>(bytes[offset + k]) << (8 * k);
    return value;
}

/// glTF 2.0, section 4.4. (tinygltf's own reader takes a chunk that ends 8 bytes beyond the file.)
Expected<Chunks> splitGlb(std::span<const std::byte> bytes) {
    const auto malformed = [](const std::string& reason) {
        return unexpected(makeError(ErrorCode::Io, "gltf.glb", "{}", reason));
    };
    if (bytes.size() < 20) return malformed(fmt::format("{} bytes are too few for a header and a chunk", bytes.size()));
    if (const uint32_t version = word(bytes, 4); version != 2)
        return unexpected(makeError(ErrorCode::Unsupported, "gltf.version",
                                    "the file is GLB of version {}; this reader reads 2", version));
    const uint64_t length = word(bytes, 8);
    if (length > bytes.size())
        return malformed(fmt::format("the header promises {} bytes, there are {}", length, bytes.size()));
    constexpr uint32_t json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;
    Chunks chunks;
    size_t index = 0;
    for (uint64_t offset = 12; offset + 8 <= length; index++) {
        const uint64_t size = word(bytes, offset);
        const uint32_t type = word(bytes, offset + 4);
        offset += 8;
        if (size > length - offset)
            return malformed(fmt::format("chunk {} has {} bytes from byte {}, the file ends at byte {}", index, size,
                                         offset, length));
        const std::span<const std::byte> content = bytes.subspan(offset, size);
        if ((index == 0) != (type == json_chunk))
            return malformed(
                fmt::format("chunk {} is of type {:#x}: the first one, and no other, is JSON", index, type));
        if (index == 0) chunks.text = {reinterpret_cast<const char*>(content.data()), content.size()};
        if (index == 1 && type == binary_chunk) chunks.binary = content;
        offset += size;
    }
    return chunks;
}

Expected<json> parseJson(std::string_view text) {
    try {
        return json::parse(text.begin(), text.end());
    } catch (const json::parse_error& error) {
        // Its message repeats the place, and names the library's own rules.
        return unexpected(makeError(ErrorCode::Io, "gltf.json", "the text is no JSON from byte {} on: {}", error.byte,
                                    std::string_view(error.what()).substr(0, 200)));
    } catch (const std::exception& error) {
        return unexpected(makeError(ErrorCode::Io, "gltf.json", "the text is no JSON: {}",
                                    std::string_view(error.what()).substr(0, 200)));
    }
}

int hexDigit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// The relative path that a URI names, or nothing if it could lead out of the document's folder.
std::string decodePath(std::string_view uri) {
    std::string path;
    for (size_t i = 0; i < uri.size(); i++) {
        char c = uri[i];
        if (c == '%') {
            if (i + 2 >= uri.size() || hexDigit(uri[i + 1]) < 0 || hexDigit(uri[i + 2]) < 0) return {};
            c = static_cast<char>(16 * hexDigit(uri[i + 1]) + hexDigit(uri[i + 2]));
            i += 2;
        }
        if (c == '\\' || c == ':' || (static_cast<unsigned char>(c) < 0x20)) return {};
        path += c;
    }
    if (path.starts_with('/') || ("/" + path + "/").find("/../") != std::string::npos) return {};
    return path;
}

class GltfReading {
public:
    explicit GltfReading(const GltfOptions& options) : options_(options), budget_(options.limit) {}

    Expected<Scene> read(std::span<const std::byte> bytes) {
        Chunks chunks{{reinterpret_cast<const char*>(bytes.data()), bytes.size()}, {}};
        if (chunks.text.starts_with("glTF")) {
            Expected<Chunks> split = splitGlb(bytes);
            if (!split) return unexpected(split.error());
            chunks = *split;
        }
        if (chunks.text.size() > std::min<uint64_t>(options_.limit, UINT32_MAX))
            return unexpected(makeError(ErrorCode::OutOfRange, "gltf.too_large", "{} bytes of JSON, the limit is {}",
                                        chunks.text.size(), options_.limit));
        Expected<json> document = parseJson(chunks.text);
        if (!document) return unexpected(document.error());
        if (Status status = detail::checkGltf(*document, budget_); !status) return unexpected(status.error());

        if (Status status = readBuffers(*document, chunks.binary); !status) return unexpected(status.error());
        // tinygltf decodes both in ways that cannot be bounded.
        const json images = takeArray(*document, "images");
        takeArray(*document, "buffers");
        if (Status status = readModel(*document); !status) return unexpected(status.error());

        const GltfAccessors accessors(model_, buffers_, budget_);
        Expected<Scene> scene = detail::makeGltfScene(model_, accessors, budget_, root_);
        if (!scene) return scene;
        if (Status status = readImages(images, accessors, *scene); !status) return unexpected(status.error());
        return scene;
    }

private:
    static json takeArray(json& document, const char* name) {
        const auto found = document.find(name);
        if (found == document.end()) return json::array();
        json array = std::move(*found);
        document.erase(found);
        return array;
    }

    Status readModel(const json& document) {
        std::string error, warning;
        try {
            const std::string text = document.dump();
            tinygltf::TinyGLTF library;
            if (library.LoadASCIIFromString(&model_, &error, &warning, text.data(), static_cast<unsigned>(text.size()),
                                            {}))
                return {};
        } catch (const std::exception& exception) { error = exception.what(); }
        return makeError(ErrorCode::Io, "gltf.library", "tinygltf refuses the document: {}", error.substr(0, 200));
    }

    /// What a URI names.
    Expected<Bytes> fetch(const std::string& uri, const GltfPath& path) {
        if (uri.starts_with("data:")) {
            std::vector<unsigned char> content;
            std::string type;
            bool is_decoded = false;
            try {
                is_decoded = tinygltf::DecodeDataURI(&content, type, uri, 0, false);
            } catch (const std::exception&) {}
            if (!is_decoded)
                return unexpected(gltfError(path, ErrorCode::Io, "gltf.uri",
                                            "'{}...' holds no base64 data of a type that glTF has", uri.substr(0, 60)));
            if (Status status = budget_.take(path, content.size(), 1); !status) return unexpected(status.error());
            const auto decoded = std::as_bytes(std::span(content));
            return Bytes(decoded.begin(), decoded.end());
        }
        const std::string name = decodePath(uri);
        if (name.empty())
            return unexpected(gltfError(path, ErrorCode::Io, "gltf.uri",
                                        "'{}' names no file beside or below the document", uri.substr(0, 100)));
        if (!options_.read)
            return unexpected(gltfError(path, ErrorCode::Io, "gltf.uri",
                                        "'{}' is another file, and there is nothing to read it with",
                                        uri.substr(0, 100)));
        Expected<Bytes> content = options_.read(name, budget_.left());
        if (!content) {
            const Error& error = content.error();
            return unexpected(Error::inFile(error.code(), error.id().data(),
                                            fmt::format("{}: {}", path.text(), error.message()), {}, 0));
        }
        if (Status status = budget_.take(path, content->size(), 1); !status) return unexpected(status.error());
        return content;
    }

    Status readBuffers(const json& document, std::span<const std::byte> binary) {
        const auto buffers = document.find("buffers");
        if (buffers == document.end()) return {};
        const GltfPath list = root_ / "buffers";
        for (size_t i = 0; i < buffers->size(); i++) {
            const json& buffer = (*buffers)[i];
            const GltfPath path = list / i;
            std::span<const std::byte> bytes = binary;
            if (buffer.contains("uri")) {
                Expected<Bytes> content = fetch(buffer["uri"].get<std::string>(), path / "uri");
                if (!content) return content.error();
                // The vectors may move, what they hold does not.
                bytes = contents_.emplace_back(std::move(*content));
            } else if (i > 0 || binary.data() == nullptr) {
                return gltfError(path, ErrorCode::Io, "gltf.missing",
                                 "there is no 'uri', and no binary chunk to take its place");
            }
            const auto length = buffer["byteLength"].get<uint64_t>();
            if (length > bytes.size())
                return gltfError(path, ErrorCode::Io, "gltf.buffer_size", "{} bytes are promised, there are {}", length,
                                 bytes.size());
            buffers_.push_back(bytes.first(length));
        }
        return {};
    }

    Status readImages(const json& images, const GltfAccessors& accessors, Scene& scene) {
        const GltfPath list = root_ / "images";
        scene.images.reserve(images.size());
        for (size_t i = 0; i < images.size(); i++) {
            const json& source = images[i];
            const GltfPath path = list / i;
            SceneImage& image = scene.images.emplace_back();
            image.name = source.value("name", std::string());
            if (!options_.with_images) continue;
            Bytes content;
            std::span<const std::byte> bytes;
            if (source.contains("uri")) {
                Expected<Bytes> fetched = fetch(source["uri"].get<std::string>(), path / "uri");
                if (!fetched) return fetched.error();
                content = std::move(*fetched);
                bytes = content;
            } else {
                const Expected<std::span<const std::byte>> view =
                    accessors.view(source["bufferView"].get<int>(), path / "bufferView");
                if (!view) return view.error();
                bytes = *view;
            }
            Expected<Image> decoded = decode(bytes, path);
            if (!decoded) return decoded.error();
            if (Status status = budget_.take(path, decoded->bytes().size(), 1); !status) return status;
            image.image = std::move(*decoded);
        }
        return {};
    }

    Expected<Image> decode(std::span<const std::byte> bytes, const GltfPath& path) const {
        const std::string_view start(reinterpret_cast<const char*>(bytes.data()), std::min<size_t>(bytes.size(), 4));
        Expected<Image> image;
        if (start == "\x89PNG")
            image = decodePng(bytes, budget_.left());
        else if (start.starts_with("\xff\xd8\xff"))
            image = decodeJpeg(bytes, budget_.left());
        else
            return unexpected(gltfError(path, ErrorCode::Unsupported, "gltf.image_format",
                                        "the {} bytes begin neither as PNG nor as JPEG", bytes.size()));
        if (image) return image;
        const Error& error = image.error();
        return unexpected(
            Error::inFile(error.code(), error.id().data(), fmt::format("{}: {}", path.text(), error.message()), {}, 0));
    }

    const GltfOptions& options_;
    GltfBudget budget_;
    const GltfPath root_{nullptr, options_.name, 0};
    std::vector<Bytes> contents_;
    std::vector<std::span<const std::byte>> buffers_;
    tinygltf::Model model_;
};

}  // namespace

Expected<Scene> parseGltf(std::span<const std::byte> bytes, const GltfOptions& options) {
    Expected<Scene> scene = GltfReading(options).read(bytes);
    if (scene) return scene;
    const Error& error = scene.error();
    return unexpected(Error::inFile(error.code(), error.id().data(), error.message(), options.name, 0));
}

Expected<Scene> Scene::load(const std::filesystem::path& path, uint64_t limit, bool with_images) {
    const Expected<std::vector<std::byte>> bytes = readFile(path, limit);
    if (!bytes) return unexpected(bytes.error());
    GltfOptions options;
    options.name = path.filename().string();
    options.limit = limit;
    options.with_images = with_images;
    options.read = [folder = path.parent_path()](const std::string& name, uint64_t most) {
        return readFile(folder / name, most);
    };
    return parseGltf(*bytes, options);
}

}  // namespace glint

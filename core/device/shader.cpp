#include <glint/device/shader.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/device/detail/object.h>

#include <algorithm>
#include <cstring>
#include <mutex>

namespace glint {

namespace {

using detail::ShaderObject;
using Where = std::source_location;

static_assert(static_cast<int>(Shader::TypeVertex) == static_cast<int>(ShaderStage::Vertex) &&
              static_cast<int>(Shader::TypeMesh) == static_cast<int>(ShaderStage::Mesh) &&
              static_cast<int>(Shader::TypeCallable) == static_cast<int>(ShaderStage::Callable));

std::mutex folder_mutex;

std::vector<std::filesystem::path>& folders() {
    static std::vector<std::filesystem::path> list;
    return list;
}

std::vector<std::filesystem::path> currentFolders() {
    std::lock_guard lock(folder_mutex);
    return folders();
}

/// The file as given or in one of the folders; as given if there is none.
std::filesystem::path findFile(const std::filesystem::path& path) {
    std::error_code ignored;
    if (path.is_absolute() || std::filesystem::exists(path, ignored)) return path;
    for (const std::filesystem::path& folder : currentFolders())
        if (std::filesystem::exists(folder / path, ignored)) return folder / path;
    return path;
}

ShaderSource describe(Shader::Type type, ShaderSource::Language language, std::string_view name,
                      std::string_view macros = {}) {
    ShaderSource source;
    source.language = language;
    source.stage = static_cast<ShaderStage>(type);
    source.name = name;
    source.macros = macros;
    source.include_paths = currentFolders();
    return source;
}

/// Reads the source's file again, if it came from one, and compiles it.
Error compileObject(ShaderObject& shader) {
    ShaderSource& source = shader.source;
    if (source.stage >= ShaderStage::Count)
        return makeError(ErrorCode::InvalidArgument, "shader.type", "there is no shader type {}",
                         static_cast<int>(source.stage));
    if (!shader.file.path.empty()) {
        shader.file = stampFile(shader.file.path);
        Expected<std::vector<std::byte>> bytes = readFile(shader.file.path, 1ull << 30);
        if (!bytes) return bytes.error();
        if (source.language == ShaderSource::Language::SPIRV) {
            if (bytes->size() % sizeof(uint32_t) != 0)
                return Error::inFile(ErrorCode::ShaderCompile, "shader.validate",
                                     fmt::format("{} bytes are no whole number of SPIR-V words", bytes->size()),
                                     source.name, 0);
            source.words.resize(bytes->size() / sizeof(uint32_t));
            if (!bytes->empty()) std::memcpy(source.words.data(), bytes->data(), bytes->size());
        } else {
            source.text.assign(reinterpret_cast<const char*>(bytes->data()), bytes->size());
        }
    }
    Expected<CompiledShader> compiled = compileShader(source);
    if (!compiled) return compiled.error();
    shader.compiled = std::move(*compiled);
    return {};
}

Shader finish(ShaderSource source, const std::filesystem::path& file, Where where) {
    auto* object = new ShaderObject;
    Shader shader(object);
    object->setName(source.name);
    object->source = std::move(source);
    object->file.path = file;
    if (Error error = compileObject(*object))
        object->fail(error.at(where).named(object->name()));
    else
        object->setReady();
    return shader;
}

Shader load(Shader::Type type, ShaderSource::Language language, std::string_view path, std::string_view macros,
            Where where) {
    const std::filesystem::path file = findFile(path);
    return finish(describe(type, language, file.string(), macros), file, where);
}

const ShaderObject* ready(const Shader& shader) {
    return shader ? static_cast<const ShaderObject*>(shader.object()) : nullptr;
}

}  // namespace

Shader Shader::loadGLSL(Type type, std::string_view path, std::string_view macros, Where where) {
    return load(type, ShaderSource::Language::GLSL, path, macros, where);
}

Shader Shader::loadSPIRV(Type type, std::string_view path, Where where) {
    return load(type, ShaderSource::Language::SPIRV, path, {}, where);
}

Shader Shader::createGLSL(Type type, std::string_view text, std::string_view macros, std::string_view name,
                          Where where) {
    ShaderSource source = describe(type, ShaderSource::Language::GLSL, name, macros);
    source.text = text;
    return finish(std::move(source), {}, where);
}

Shader Shader::createSPIRV(Type type, std::span<const uint32_t> words, std::string_view name, Where where) {
    ShaderSource source = describe(type, ShaderSource::Language::SPIRV, name);
    source.words.assign(words.begin(), words.end());
    return finish(std::move(source), {}, where);
}

Shader Shader::createAssembly(Type type, std::string_view text, std::string_view name, Where where) {
    ShaderSource source = describe(type, ShaderSource::Language::Assembly, name);
    source.text = text;
    return finish(std::move(source), {}, where);
}

Shader::Type Shader::getType() const {
    return object_ ? static_cast<Type>(static_cast<const ShaderObject*>(object_)->source.stage) : TypeVertex;
}

const Reflection& Shader::getReflection() const {
    static const Reflection empty;
    const ShaderObject* shader = ready(*this);
    return shader ? shader->compiled.reflection : empty;
}

std::span<const uint32_t> Shader::getWords() const {
    const ShaderObject* shader = ready(*this);
    return shader ? std::span<const uint32_t>(shader->compiled.words) : std::span<const uint32_t>();
}

Shader Shader::reloaded(Where where) const {
    if (!object_) return *this;
    const auto* old = static_cast<const ShaderObject*>(object_);
    return finish(old->source, old->file.path, where);
}

void Shader::setMacro(std::string_view name, int value) { setShaderMacro(name, std::to_string(value)); }
void Shader::setMacro(std::string_view name, std::string_view value) { setShaderMacro(name, value); }
void Shader::removeMacro(std::string_view name) { removeShaderMacro(name); }
void Shader::clearMacros() { clearShaderMacros(); }
void Shader::setInclude(std::string_view name, std::string_view text) { setShaderInclude(name, text); }
void Shader::setCache(std::string_view folder, uint64_t limit) { setShaderCache(folder, limit); }

void Shader::addPath(std::string_view folder) {
    std::lock_guard lock(folder_mutex);
    std::vector<std::filesystem::path>& list = folders();
    if (!folder.empty() && std::find(list.begin(), list.end(), folder) == list.end()) list.emplace_back(folder);
}

}  // namespace glint

#include "ray_query_linker.h"
#include "shader_source.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <map>
#include <mutex>

namespace glint::shader {

namespace {

constexpr uint32_t version_1_3 = 0x10300;
constexpr uint32_t version_1_4 = 0x10400;

ShaderSource librarySource(const TracingRewrite& tracing, uint32_t queries) {
    ShaderSource source;
    source.stage = ShaderStage::Compute;
    source.name = fmt::format("<library {}>", tracing.library);
    source.text = fmt::format("#include <{}>\nvoid main() {{}}\n", tracing.library);
    source.macros = fmt::format("GLINT_TRACING_SET={}; GLINT_TRACING_QUERIES={}; {}", tracing.set,
                                std::max(queries, 1u), tracing.macros);
    return source;
}

/// A defect of the library, however it shows.
Error libraryError(const ShaderSource& source, const Error& error) {
    return sourceError(source, ErrorCode::Internal, "shader.tracing_internal",
                       fmt::format("the library '{}': {}", source.tracing.library, error.text()));
}

/// The compiled library; one of each text and version is kept.
Expected<std::shared_ptr<const SpirvModule>> compiledLibrary(const TracingRewrite& tracing, uint32_t queries,
                                                             uint32_t version) {
    static std::mutex& mutex = *new std::mutex;
    static auto& known = *new std::map<std::pair<std::string, uint32_t>, std::shared_ptr<const SpirvModule>>;

    const ShaderSource source = librarySource(tracing, queries);
    Expected<Preprocessed> text = preprocess(source);
    if (!text) return unexpected(text.error());
    const std::pair<std::string, uint32_t> key(text->text, version);
    {
        std::lock_guard lock(mutex);
        if (const auto found = known.find(key); found != known.end()) return found->second;
    }
    Expected<std::vector<uint32_t>> words = compileLibrary(source, *text, version);
    if (!words) return unexpected(words.error());
    if (const std::optional<std::string> fault = findFault(*words))
        return unexpected(makeError(ErrorCode::Internal, "shader.tracing_internal", "{}", *fault));
    Expected<SpirvModule> module = SpirvModule::parse(*words);
    if (!module) return unexpected(module.error());
    auto result = std::make_shared<const SpirvModule>(std::move(*module));
    std::lock_guard lock(mutex);
    // Few forms exist; only somebody who writes a library makes more.
    if (known.size() >= 16) known.clear();
    known[key] = result;
    return std::shared_ptr<const SpirvModule>(std::move(result));
}

bool isStructure(const ShaderResource& resource) { return resource.element == SlotKind::Tracing; }

}  // namespace

Expected<Preprocessed> preprocessLibrary(const TracingRewrite& tracing) {
    return preprocess(librarySource(tracing, 1));
}

Expected<std::vector<uint32_t>> rewriteRayQueries(const ShaderSource& source, std::span<const uint32_t> words,
                                                  Reflection& reflection) {
    const auto fail = [&](ErrorCode code, const char* id, std::string message) {
        return unexpected(sourceError(source, code, id, std::move(message)));
    };
    if (!reflection.uses_ray_query &&
        std::none_of(reflection.resources.begin(), reflection.resources.end(), isStructure))
        return std::vector<uint32_t>(words.begin(), words.end());
    if (reflection.stage >= ShaderStage::RayGen)
        return fail(ErrorCode::Unsupported, "shader.tracing_stage",
                    fmt::format("the software engine answers ray queries, not the {} stage of ray-tracing pipelines",
                                toString(reflection.stage)));
    for (const ShaderResource& resource : reflection.resources)
        if (resource.set >= source.tracing.set)
            return fail(ErrorCode::OutOfRange, "shader.tracing_set",
                        fmt::format("'{}' is in set {}; with ray queries in software, sets from {} on are Glint's own",
                                    resource.name, resource.set, source.tracing.set));

    Expected<SpirvModule> user = SpirvModule::parse(words);
    if (!user) return unexpected(libraryError(source, user.error()));
    const Expected<std::shared_ptr<const SpirvModule>> library = compiledLibrary(
        source.tracing, countRayQueries(*user), user->version < version_1_4 ? version_1_3 : version_1_4);
    if (!library) return unexpected(libraryError(source, library.error()));
    Expected<SpirvModule> linked =
        linkRayQueries(std::move(*user), reflection.entry, executionModel(reflection.stage), **library);
    if (!linked) return fail(linked.error().code(), linked.error().id().data(), linked.error().message());

    std::vector<uint32_t> result = linked->words();
    if (std::optional<std::string> fault = findFault(result))
        return fail(ErrorCode::Internal, "shader.tracing_internal",
                    fmt::format("the rewritten module is not valid: {}\n{}", *fault, disassemble(result)));
    Expected<Reflection> made = reflectValid(result, reflection.stage, reflection.entry);
    if (!made) return unexpected(libraryError(source, made.error()));

    for (ShaderResource& structure : reflection.resources) {
        if (!isStructure(structure)) continue;
        const auto block =
            std::find_if(made->resources.begin(), made->resources.end(), [&](const ShaderResource& item) {
                return item.set == structure.set && item.binding == structure.binding;
            });
        // An unused one may have gone with the other entry points of the module.
        structure.descriptor = block != made->resources.end() ? block->kind : SlotKind::Uniform;
    }
    std::copy_if(made->resources.begin(), made->resources.end(), std::back_inserter(reflection.hidden),
                 [&](const ShaderResource& resource) { return resource.set == source.tracing.set; });
    reflection.uses_ray_query = made->uses_ray_query;
    reflection.uses_addresses = made->uses_addresses;
    reflection.uses_float64 = made->uses_float64;
    reflection.uses_int64 = made->uses_int64;
    reflection.uses_subgroups = made->uses_subgroups;
    return result;
}

}  // namespace glint::shader

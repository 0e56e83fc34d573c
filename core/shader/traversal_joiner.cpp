#include "traversal_joiner.h"

#include "shader_cache.h"
#include "shader_source.h"
#include "traversal_linker.h"
#include "traversal_skeleton.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

constexpr uint32_t version_1_4 = 0x10400;

Error internalError(const TraversalSource& source, std::string_view what) {
    return makeError(ErrorCode::Internal, "shader.tracing_internal", "the joined pipeline '{}': {}", source.name, what);
}

bool has(const SpirvModule& module, uint32_t opcode) {
    return std::ranges::any_of(module.functions, [&](const Instructions& function) {
        return std::ranges::any_of(function, [&](const Instruction& item) { return item.opcode == opcode; });
    });
}

Expected<SpirvModule> stageModule(const TraversalSource::Stage& stage) {
    Expected<std::vector<uint32_t>> fixed = fixConstants(stage.words, stage.constants);
    if (!fixed) return unexpected(fixed.error());
    Expected<SpirvModule> module = SpirvModule::parse(*fixed);
    // What may be cut at its traces has to be one function.
    if (!module || !has(*module, spv::OpTraceRayKHR) || !has(*module, spv::OpFunctionCall)) return module;
    fixed = inlineFunctions(*fixed);
    if (!fixed) return unexpected(fixed.error());
    return SpirvModule::parse(*fixed);
}

/// From the cache if it is there: a compiler of GLSL takes longer to start than all the rest does.
Expected<std::vector<uint32_t>> skeletonWords(const ShaderSource& skeleton) {
    const Expected<Preprocessed> text = preprocess(skeleton);
    if (!text) return unexpected(text.error());
    const Hash key = hashText(text->text, hashText("skeleton", toolHash()));
    if (std::optional<CompiledShader> known = loadFromCache(key)) return std::move(known->words);
    Expected<std::vector<uint32_t>> words = compileLibrary(skeleton, *text, version_1_4);
    if (!words) return words;
    CompiledShader made;
    made.words = *words;
    storeInCache(key, made);
    return words;
}

}  // namespace

Expected<std::vector<uint32_t>> joinTraversal(const TraversalSource& source) {
    std::vector<SpirvModule> modules;
    for (const TraversalSource::Stage& stage : source.stages) {
        Expected<SpirvModule> module = stageModule(stage);
        if (!module) return unexpected(internalError(source, module.error().message()));
        modules.push_back(std::move(*module));
    }
    const auto makeSkeleton = [&](const SkeletonNeeds& needs) -> Expected<SpirvModule> {
        Expected<std::vector<uint32_t>> words = skeletonWords(skeletonSource(source, needs));
        if (!words) return unexpected(words.error());
        return SpirvModule::parse(*words);
    };
    Expected<SpirvModule> linked = linkTraversal(source, std::move(modules), makeSkeleton);
    if (!linked) {
        if (linked.error().code() == ErrorCode::Internal || linked.error().code() == ErrorCode::ShaderCompile)
            return unexpected(internalError(source, linked.error().text()));
        return unexpected(linked.error());
    }
    std::vector<uint32_t> words = linked->words();
    if (const std::optional<std::string> fault = findFault(words))
        return unexpected(internalError(source, fmt::format("{}\n{}", *fault, disassemble(words))));
    return words;
}

}  // namespace glint::shader

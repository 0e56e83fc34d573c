#include <glint/shader/convert.h>

#include "shader_source.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>
#include <spirv_cross/spirv_glsl.hpp>
#include <spirv_cross/spirv_hlsl.hpp>
#include <spirv_cross/spirv_msl.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <map>
#include <string_view>
#include <tuple>

namespace glint {

const char* toString(ShadingLanguage language) {
    static constexpr const char* names[] = {"Vulkan GLSL", "GLSL", "ESSL", "HLSL", "MSL"};
    return language < ShadingLanguage::Count ? names[static_cast<size_t>(language)] : "unknown";
}

namespace shader {

namespace {

using spirv_cross::CompilerGLSL;
using spirv_cross::CompilerHLSL;
using spirv_cross::CompilerMSL;
using spirv_cross::Resource;

template <class Visit>
void forEachInstruction(std::span<const uint32_t> words, Visit&& visit) {
    for (size_t i = 5; i < words.size();) {
        const size_t length = words[i] >> 16;
        if (length == 0 || length > words.size() - i) return;
        visit(words[i] & 0xffffu, words.subspan(i, length));
        i += length;
    }
}

/// Ray flags and masks that SPIRV-Cross leaves out of MSL; nothing if every query has no flags and the full mask.
std::string droppedRayArguments(std::span<const uint32_t> words) {
    std::map<uint32_t, uint32_t> constants;
    std::string dropped;
    forEachInstruction(words, [&](uint32_t opcode, std::span<const uint32_t> instruction) {
        if (opcode == spv::OpConstant && instruction.size() == 4) constants[instruction[2]] = instruction[3];
        if (opcode == spv::OpConstantNull && instruction.size() == 3) constants[instruction[2]] = 0;
        if (opcode != spv::OpRayQueryInitializeKHR || instruction.size() < 5) return;
        const auto flags = constants.find(instruction[3]);
        const auto mask = constants.find(instruction[4]);
        if (flags == constants.end() || flags->second != 0) dropped = "ray flags";
        if (mask == constants.end() || (mask->second & 0xffu) != 0xffu) dropped = "a ray's mask";
    });
    return dropped;
}

bool usesPrintf(std::span<const uint32_t> words) {
    bool found = false;
    forEachInstruction(words, [&](uint32_t opcode, std::span<const uint32_t> instruction) {
        if (opcode != spv::OpExtInstImport || instruction.size() < 3) return;
        const char* name = reinterpret_cast<const char*>(&instruction[2]);
        const std::string_view text(name, ::strnlen(name, (instruction.size() - 2) * sizeof(uint32_t)));
        found = found || text == "NonSemantic.DebugPrintf";
    });
    return found;
}

/// What about the shader the language cannot say; empty if nothing.
std::string refusalOf(const Reflection& reflection, std::span<const uint32_t> words, ShadingLanguage language) {
    if (language == ShadingLanguage::VulkanGLSL) return {};
    const bool is_gl = language == ShadingLanguage::GLSL || language == ShadingLanguage::ESSL;
    switch (reflection.stage) {
        case ShaderStage::Vertex:
        case ShaderStage::Fragment:
        case ShaderStage::Compute: break;
        case ShaderStage::Control:
        case ShaderStage::Evaluate:
        case ShaderStage::Geometry:
            if (!is_gl) return fmt::format("the {} stage", toString(reflection.stage));
            break;
        default: return fmt::format("the {} stage", toString(reflection.stage));
    }
    if (reflection.uses_ray_query && is_gl) return "ray queries";
    if (reflection.uses_ray_query && language == ShadingLanguage::MSL) {
        if (std::string dropped = droppedRayArguments(words); !dropped.empty()) return dropped;
    }
    if (reflection.uses_addresses && language != ShadingLanguage::MSL) return "buffer addresses";
    for (const ShaderResource& resource : reflection.resources)
        if (resource.count == 0 && is_gl) return fmt::format("the table '{}' of unknown length", resource.name);
    if (usesPrintf(words)) return "printf";
    return {};
}

/// OpenGL has no sets, and one space of bindings for each of these.
enum class GLSpace : uint8_t { Uniform, Storage, Sampler, Image, Count };

/// Numbers the resources of each space one after the other.
void renumber(CompilerGLSL& compiler) {
    struct Entry {
        std::tuple<uint32_t, uint32_t, uint32_t, uint32_t> order;
        GLSpace space;
        uint32_t id;
        uint32_t count;
    };
    std::vector<Entry> entries;
    const auto decoration = [&](uint32_t id, spv::Decoration which) { return compiler.get_decoration(id, which); };
    const auto add = [&](GLSpace space, uint32_t id, uint32_t place, uint32_t sampler) {
        uint32_t count = 1;
        for (const uint32_t length : compiler.get_type_from_variable(id).array) count *= std::max(length, 1u);
        const auto second = [&](spv::Decoration which) { return sampler ? decoration(sampler, which) : 0; };
        entries.push_back({{decoration(place, spv::DecorationDescriptorSet), decoration(place, spv::DecorationBinding),
                            second(spv::DecorationDescriptorSet), second(spv::DecorationBinding)},
                           space,
                           id,
                           count});
    };
    const spirv_cross::ShaderResources all = compiler.get_shader_resources();
    for (const Resource& item : all.uniform_buffers) add(GLSpace::Uniform, item.id, item.id, 0);
    for (const Resource& item : all.storage_buffers) add(GLSpace::Storage, item.id, item.id, 0);
    for (const Resource& item : all.sampled_images) add(GLSpace::Sampler, item.id, item.id, 0);
    for (const Resource& item : all.storage_images) add(GLSpace::Image, item.id, item.id, 0);
    for (const auto& joined : compiler.get_combined_image_samplers()) {
        add(GLSpace::Sampler, joined.combined_id, joined.image_id, joined.sampler_id);
        compiler.set_name(joined.combined_id,
                          compiler.get_name(joined.image_id) + "_" + compiler.get_name(joined.sampler_id));
    }
    // Texel buffers that are read without a sampler keep their own variable.
    for (const Resource& item : all.separate_images)
        if (compiler.get_type(item.base_type_id).image.dim == spv::DimBuffer)
            add(GLSpace::Sampler, item.id, item.id, 0);

    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.order < b.order; });
    std::array<uint32_t, static_cast<size_t>(GLSpace::Count)> next = {};
    for (const Entry& entry : entries) {
        compiler.unset_decoration(entry.id, spv::DecorationDescriptorSet);
        compiler.set_decoration(entry.id, spv::DecorationBinding, next[static_cast<size_t>(entry.space)]);
        next[static_cast<size_t>(entry.space)] += entry.count;
    }
}

std::string convertGLSL(CompilerGLSL& compiler, ShadingLanguage language) {
    CompilerGLSL::Options options = compiler.get_common_options();
    options.version = language == ShadingLanguage::ESSL ? 320 : 460;
    options.es = language == ShadingLanguage::ESSL;
    options.vulkan_semantics = language == ShadingLanguage::VulkanGLSL;
    options.vertex.fixup_clipspace = language != ShadingLanguage::VulkanGLSL;
    options.fragment.default_float_precision = CompilerGLSL::Options::Highp;
    compiler.set_common_options(options);
    if (language != ShadingLanguage::VulkanGLSL) {
        compiler.build_dummy_sampler_for_combined_images();
        compiler.build_combined_image_samplers();
        renumber(compiler);
    }
    return compiler.compile();
}

std::string convertHLSL(CompilerHLSL& compiler, const Reflection& reflection) {
    CompilerHLSL::Options options = compiler.get_hlsl_options();
    options.shader_model = reflection.uses_ray_query ? 65 : 60;
    options.support_nonzero_base_vertex_base_instance = true;
    compiler.set_hlsl_options(options);
    // The number of groups is no input there: it comes in a constant buffer that the program fills.
    compiler.remap_num_workgroups_builtin();
    return compiler.compile();
}

std::string convertMSL(CompilerMSL& compiler) {
    CompilerMSL::Options options = compiler.get_msl_options();
    options.set_msl_version(2, 4);
    compiler.set_msl_options(options);
    return compiler.compile();
}

}  // namespace

Expected<std::string> convert(const ShaderSource& source, std::span<const uint32_t> words, ShadingLanguage language) {
    const auto refused = [&](const std::string& reason) {
        return unexpected(sourceError(source, ErrorCode::Unsupported, "shader.convert",
                                      fmt::format("no faithful {} for {}", toString(language), reason)));
    };
    if (language >= ShadingLanguage::Count) return refused("a language that is not known");
    std::vector<uint32_t> native = nativeWords(words);
    if (Status status = validate(source, native); !status) return unexpected(status.error());
    const Expected<Reflection> reflection = reflectValid(native, source.stage, source.entry);
    if (!reflection)
        return unexpected(
            sourceError(source, ErrorCode::ShaderCompile, "shader.reflect", reflection.error().message()));
    if (const std::string reason = refusalOf(*reflection, native, language); !reason.empty()) return refused(reason);
    const auto start = [&](auto&& compiler) -> auto& {
        compiler.set_entry_point(source.entry, static_cast<spv::ExecutionModel>(executionModel(source.stage)));
        return compiler;
    };
    try {
        if (language == ShadingLanguage::HLSL) {
            CompilerHLSL compiler(std::move(native));
            return convertHLSL(start(compiler), *reflection);
        }
        if (language == ShadingLanguage::MSL) {
            CompilerMSL compiler(std::move(native));
            return convertMSL(start(compiler));
        }
        CompilerGLSL compiler(std::move(native));
        return convertGLSL(start(compiler), language);
    } catch (const std::exception& exception) { return refused(fmt::format("this shader: {}", exception.what())); }
}

}  // namespace shader

}  // namespace glint

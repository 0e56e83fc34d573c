#include "shader_source.h"
#include "spirv_module.h"

#include <glint/base/format_error.h>

#include <spirv_cross/spirv_cross.hpp>

#include <algorithm>
#include <exception>

namespace glint {

namespace {

using spirv_cross::SPIRType;

/// SPIRV-Cross with its evaluation of constants opened.
class Module : public spirv_cross::Compiler {
public:
    using Compiler::Compiler;
    using Compiler::evaluate_constant_u32;
    using Compiler::ir;
};

/// What SPIRV-Cross parses but Glint has no place for; turned into an error before it leaves this file.
struct Refusal : std::exception {
    explicit Refusal(std::string message) : text(std::move(message)) {}
    const char* what() const noexcept override { return text.c_str(); }
    std::string text;
};

std::optional<ShaderStage> stageOf(spv::ExecutionModel model) {
    switch (model) {
        case spv::ExecutionModelVertex: return ShaderStage::Vertex;
        case spv::ExecutionModelTessellationControl: return ShaderStage::Control;
        case spv::ExecutionModelTessellationEvaluation: return ShaderStage::Evaluate;
        case spv::ExecutionModelGeometry: return ShaderStage::Geometry;
        case spv::ExecutionModelFragment: return ShaderStage::Fragment;
        case spv::ExecutionModelGLCompute: return ShaderStage::Compute;
        case spv::ExecutionModelTaskEXT: return ShaderStage::Task;
        case spv::ExecutionModelMeshEXT: return ShaderStage::Mesh;
        case spv::ExecutionModelRayGenerationKHR: return ShaderStage::RayGen;
        case spv::ExecutionModelMissKHR: return ShaderStage::RayMiss;
        case spv::ExecutionModelClosestHitKHR: return ShaderStage::Closest;
        case spv::ExecutionModelAnyHitKHR: return ShaderStage::FirstHit;
        case spv::ExecutionModelIntersectionKHR: return ShaderStage::Intersection;
        case spv::ExecutionModelCallableKHR: return ShaderStage::Callable;
        default: return {};
    }
}

/// Elements of an array with all its dimensions, 1 for no array, 0 for an unknown length.
uint32_t elementCount(const Module& module, const SPIRType& type) {
    uint64_t count = 1;
    for (size_t i = 0; i < type.array.size(); i++) {
        const uint32_t length =
            type.array_size_literal[i] ? type.array[i] : module.evaluate_constant_u32(type.array[i]);
        count = std::min<uint64_t>(count * length, UINT32_MAX);
    }
    return static_cast<uint32_t>(count);
}

/// Bytes of all components, as if they were packed.
uint32_t componentBytes(const Module& module, const SPIRType& type) {
    uint64_t size = 0;
    if (type.basetype == SPIRType::Struct) {
        for (const spirv_cross::TypeID member : type.member_types) {
            const SPIRType& part = module.get_type(member);
            // A pointer may lead back to the structure it stands in.
            size += part.pointer ? 8 : componentBytes(module, part);
        }
    } else {
        const uint32_t width = type.basetype == SPIRType::Boolean ? 32 : type.width;
        size = static_cast<uint64_t>(width / 8) * type.vecsize * type.columns;
    }
    return static_cast<uint32_t>(std::min<uint64_t>(size * elementCount(module, type), UINT32_MAX));
}

std::optional<RayVariable::Kind> rayKind(spv::StorageClass storage) {
    switch (storage) {
        case spv::StorageClassRayPayloadKHR: return RayVariable::Kind::Payload;
        case spv::StorageClassIncomingRayPayloadKHR: return RayVariable::Kind::IncomingPayload;
        case spv::StorageClassCallableDataKHR: return RayVariable::Kind::Callable;
        case spv::StorageClassIncomingCallableDataKHR: return RayVariable::Kind::IncomingCallable;
        case spv::StorageClassHitAttributeKHR: return RayVariable::Kind::Attribute;
        default: return {};
    }
}

/// Ids that instructions of functions name.
std::vector<uint32_t> idsOfFunctions(const shader::SpirvModule& parts) {
    std::vector<uint32_t> ids;
    for (const shader::Instructions& function : parts.functions)
        for (const shader::Instruction& instruction : function)
            for (const uint16_t place : instruction.ids) ids.push_back(instruction.words[place]);
    std::sort(ids.begin(), ids.end());
    return ids;
}

std::vector<RayCall> callsOf(const shader::SpirvModule& parts) {
    std::vector<RayCall> calls;
    const auto add = [&](bool is_callable, uint32_t index) {
        const auto constant = std::ranges::find_if(parts.globals, [&](const shader::Instruction& item) {
            return item.opcode == spv::OpConstant && item.result() == index;
        });
        calls.push_back({is_callable, constant == parts.globals.end() ? RayCall::unknown : constant->operands()[0]});
    };
    for (const shader::Instructions& function : parts.functions)
        for (const shader::Instruction& instruction : function) {
            if (instruction.opcode == spv::OpTraceRayKHR) add(false, instruction.operands()[5]);
            if (instruction.opcode == spv::OpExecuteCallableKHR) add(true, instruction.operands()[0]);
        }
    return calls;
}

bool hasRowMajor(const Module& module, const SPIRType& block) {
    for (uint32_t i = 0; i < block.member_types.size(); i++) {
        const SPIRType& member = module.get_type(block.member_types[i]);
        if (member.columns > 1 && module.has_member_decoration(block.self, i, spv::DecorationRowMajor)) return true;
        // A pointer may lead back to the block it stands in.
        if (member.basetype == SPIRType::Struct && !member.pointer && hasRowMajor(module, member)) return true;
    }
    return false;
}

void describeBlock(const Module& module, const SPIRType& block, ShaderResource& resource) {
    resource.size = static_cast<uint32_t>(module.get_declared_struct_size(block));
    const auto last = static_cast<uint32_t>(block.member_types.size() - 1);
    const SPIRType& tail = module.get_type(block.member_types[last]);
    if (!tail.array.empty() && tail.array_size_literal.back() && tail.array.back() == 0)
        resource.stride = module.type_struct_member_array_stride(block, last);
    resource.has_row_major = hasRowMajor(module, block);
    resource.has_lone_matrix = resource.kind == SlotKind::Uniform && block.member_types.size() == 1 &&
                               tail.columns > 1 && tail.array.empty() && !resource.has_row_major;
}

ImageDimension dimensionOf(const SPIRType::ImageType& image, const std::string& name) {
    switch (image.dim) {
        case spv::Dim2D:
            if (image.ms && image.arrayed) throw Refusal(fmt::format("'{}' is a multisampled array image", name));
            if (image.ms) return ImageDimension::Image2DMultisample;
            return image.arrayed ? ImageDimension::Image2DArray : ImageDimension::Image2D;
        case spv::Dim3D: return ImageDimension::Image3D;
        case spv::DimCube: return image.arrayed ? ImageDimension::CubeArray : ImageDimension::Cube;
        case spv::DimBuffer: return ImageDimension::None;
        default: throw Refusal(fmt::format("'{}' is a one-dimensional or rectangle image", name));
    }
}

class Reader {
public:
    Reader(const Module& module, Reflection& reflection) : module_(module), reflection_(reflection) {}

    void read() {
        readResources();
        readConstants();
        readCapabilities();
        const ShaderStage stage = reflection_.stage;
        if (stage == ShaderStage::Compute || stage == ShaderStage::Task || stage == ShaderStage::Mesh) readGroupSize();
        if (stage == ShaderStage::Task || stage == ShaderStage::Mesh) readMesh();
    }

    void readRayVariables(std::span<const uint32_t> words) {
        const Expected<shader::SpirvModule> parts = shader::SpirvModule::parse(words);
        if (!parts) return;
        reflection_.ray_calls = callsOf(*parts);
        const std::vector<uint32_t> used = idsOfFunctions(*parts);
        module_.ir.for_each_typed_id<spirv_cross::SPIRVariable>(
            [&](uint32_t id, const spirv_cross::SPIRVariable& variable) {
                const SPIRType& type = module_.get_type(variable.basetype);
                if (variable.storage == spv::StorageClassShaderRecordBufferKHR)
                    reflection_.record_size = static_cast<uint32_t>(module_.get_declared_struct_size(type));
                const std::optional<RayVariable::Kind> kind = rayKind(variable.storage);
                if (!kind || !std::binary_search(used.begin(), used.end(), id)) return;
                reflection_.ray_variables.push_back({*kind, module_.get_name(id), componentBytes(module_, type)});
            });
    }

private:
    static constexpr uint32_t max_set = 65535;  ///< no device comes near

    void readResources() {
        const spirv_cross::ShaderResources all = module_.get_shader_resources();
        if (!all.subpass_inputs.empty())
            throw Refusal(fmt::format("'{}' is a subpass input", all.subpass_inputs[0].name));
        add(all.uniform_buffers, SlotKind::Uniform);
        add(all.storage_buffers, SlotKind::Storage);
        add(all.sampled_images, SlotKind::Texture);
        add(all.separate_images, SlotKind::Texture);
        add(all.separate_samplers, SlotKind::Sampler);
        add(all.storage_images, SlotKind::Surface);
        add(all.acceleration_structures, SlotKind::Tracing);
        std::stable_sort(reflection_.resources.begin(), reflection_.resources.end(),
                         [](const ShaderResource& a, const ShaderResource& b) {
                             return a.set != b.set ? a.set < b.set : a.binding < b.binding;
                         });
        for (const spirv_cross::Resource& block : all.push_constant_buffers)
            reflection_.push_size =
                std::max(reflection_.push_size,
                         static_cast<uint32_t>(module_.get_declared_struct_size(module_.get_type(block.base_type_id))));
        if (reflection_.stage == ShaderStage::Vertex) addVariables(all.stage_inputs, reflection_.inputs);
        if (reflection_.stage == ShaderStage::Fragment) addVariables(all.stage_outputs, reflection_.outputs);
    }

    void add(const spirv_cross::SmallVector<spirv_cross::Resource>& list, SlotKind kind) {
        for (const spirv_cross::Resource& item : list) {
            const SPIRType& type = module_.get_type(item.type_id);
            ShaderResource resource;
            resource.kind = kind;
            resource.name = module_.get_name(item.id);
            resource.set = module_.get_decoration(item.id, spv::DecorationDescriptorSet);
            resource.binding = module_.get_decoration(item.id, spv::DecorationBinding);
            if (resource.set > max_set) throw Refusal(fmt::format("'{}' is in set {}", resource.name, resource.set));
            resource.count = elementCount(module_, type);
            resource.stages = stageBit(reflection_.stage);
            if (kind == SlotKind::Uniform || kind == SlotKind::Storage) {
                resource.instance = resource.name;
                if (!module_.get_name(item.base_type_id).empty()) resource.name = module_.get_name(item.base_type_id);
                describeBlock(module_, module_.get_type(item.base_type_id), resource);
            } else if (kind == SlotKind::Texture || kind == SlotKind::Surface) {
                resource.dimension = dimensionOf(type.image, resource.name);
                resource.combined = type.basetype == SPIRType::SampledImage;
                if (type.image.dim == spv::DimBuffer) {
                    resource.kind = SlotKind::Texel;
                    resource.combined = false;
                    resource.texel_storage = kind == SlotKind::Surface;
                }
            }
            if (kind == SlotKind::Storage || kind == SlotKind::Surface) {
                const spirv_cross::Bitset flags = kind == SlotKind::Storage ? module_.get_buffer_block_flags(item.id)
                                                                            : module_.get_decoration_bitset(item.id);
                resource.read = !flags.get(spv::DecorationNonReadable);
                resource.write = !flags.get(spv::DecorationNonWritable);
            }
            resource.element = resource.kind;
            resource.descriptor = resource.kind;
            if (resource.count == 0) resource.kind = SlotKind::Table;
            reflection_.resources.push_back(std::move(resource));
        }
    }

    void addVariables(const spirv_cross::SmallVector<spirv_cross::Resource>& list, std::vector<ShaderVariable>& out) {
        for (const spirv_cross::Resource& item : list) {
            const SPIRType& type = module_.get_type(item.type_id);
            if (type.basetype == SPIRType::Struct)
                throw Refusal(fmt::format("'{}' is a block or a structure", item.name));
            ShaderVariable variable;
            variable.name = module_.get_name(item.id);
            variable.components = type.vecsize;
            switch (type.basetype) {
                case SPIRType::SByte:
                case SPIRType::Short:
                case SPIRType::Int:
                case SPIRType::Int64: variable.type = ShaderVariable::Type::Int; break;
                case SPIRType::UByte:
                case SPIRType::UShort:
                case SPIRType::UInt:
                case SPIRType::UInt64: variable.type = ShaderVariable::Type::Uint; break;
                default: variable.type = ShaderVariable::Type::Float; break;
            }
            const uint32_t first = module_.get_decoration(item.id, spv::DecorationLocation);
            const uint64_t count = static_cast<uint64_t>(elementCount(module_, type)) * type.columns;
            // Far more than any device has; the rest of a longer one could not be used.
            for (uint32_t i = 0; i < std::min<uint64_t>(count, 256); i++) {
                variable.location = first + i;
                out.push_back(variable);
            }
        }
        std::stable_sort(out.begin(), out.end(),
                         [](const ShaderVariable& a, const ShaderVariable& b) { return a.location < b.location; });
    }

    void readConstants() {
        for (const spirv_cross::SpecializationConstant& item : module_.get_specialization_constants()) {
            const spirv_cross::SPIRConstant& value = module_.get_constant(item.id);
            SpecializationConstant constant;
            switch (module_.get_type(value.constant_type).basetype) {
                case SPIRType::Boolean: constant.type = SpecializationConstant::Type::Bool; break;
                case SPIRType::Int: constant.type = SpecializationConstant::Type::Int; break;
                case SPIRType::UInt: constant.type = SpecializationConstant::Type::Uint; break;
                case SPIRType::Float: constant.type = SpecializationConstant::Type::Float; break;
                default: continue;
            }
            constant.id = item.constant_id;
            constant.name = module_.get_name(item.id);
            constant.default_value = value.scalar();
            reflection_.constants.push_back(std::move(constant));
        }
        // glslang makes a nameless constant of local_size_x_id, beside the one that the text may declare for the same
        // id.
        std::vector<SpecializationConstant>& list = reflection_.constants;
        std::sort(list.begin(), list.end(), [](const SpecializationConstant& a, const SpecializationConstant& b) {
            return a.id != b.id ? a.id < b.id : a.name > b.name;
        });
        list.erase(
            std::unique(list.begin(), list.end(),
                        [](const SpecializationConstant& a, const SpecializationConstant& b) { return a.id == b.id; }),
            list.end());
    }

    void readGroupSize() {
        std::array<spirv_cross::SpecializationConstant, 3> parts = {};
        const uint32_t built_in = module_.get_work_group_size_specialization_constants(parts[0], parts[1], parts[2]);
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t& size = reflection_.group_size[i];
            // A constant decorated WorkgroupSize goes before the execution mode.
            size = built_in ? module_.get_constant(built_in).scalar(0, i)
                            : module_.get_execution_mode_argument(spv::ExecutionModeLocalSize, i);
            if (parts[i].id == 0) continue;
            size = module_.get_constant(parts[i].id).scalar();
            reflection_.group_constants[i] = parts[i].constant_id;
        }
    }

    void readMesh() {
        if (reflection_.stage == ShaderStage::Mesh) {
            reflection_.mesh_vertices = module_.get_execution_mode_argument(spv::ExecutionModeOutputVertices);
            reflection_.mesh_primitives = module_.get_execution_mode_argument(spv::ExecutionModeOutputPrimitivesEXT);
        }
        module_.ir.for_each_typed_id<spirv_cross::SPIRVariable>(
            [&](uint32_t, const spirv_cross::SPIRVariable& variable) {
                if (variable.storage != spv::StorageClassTaskPayloadWorkgroupEXT) return;
                reflection_.payload_size =
                    std::max(reflection_.payload_size, componentBytes(module_, module_.get_type(variable.basetype)));
            });
    }

    void readCapabilities() {
        for (const spv::Capability capability : module_.get_declared_capabilities()) {
            switch (capability) {
                case spv::CapabilityRayQueryKHR: reflection_.uses_ray_query = true; break;
                case spv::CapabilityPhysicalStorageBufferAddresses: reflection_.uses_addresses = true; break;
                case spv::CapabilityFloat64: reflection_.uses_float64 = true; break;
                case spv::CapabilityInt64: reflection_.uses_int64 = true; break;
                case spv::CapabilityShaderLayer:
                case spv::CapabilityShaderViewportIndex:
                case spv::CapabilityShaderViewportIndexLayerEXT:
                    reflection_.uses_layer =
                        reflection_.stage == ShaderStage::Vertex || reflection_.stage == ShaderStage::Evaluate;
                    break;
                case spv::CapabilityGroupNonUniform:
                case spv::CapabilityGroupNonUniformVote:
                case spv::CapabilityGroupNonUniformArithmetic:
                case spv::CapabilityGroupNonUniformBallot:
                case spv::CapabilityGroupNonUniformShuffle:
                case spv::CapabilityGroupNonUniformShuffleRelative:
                case spv::CapabilityGroupNonUniformClustered:
                case spv::CapabilityGroupNonUniformQuad:
                case spv::CapabilitySubgroupBallotKHR:
                case spv::CapabilitySubgroupVoteKHR: reflection_.uses_subgroups = true; break;
                default: break;
            }
        }
    }

    const Module& module_;
    Reflection& reflection_;
};

/// `stage` may be Count: the first entry point of that name, or the first of all.
Expected<Reflection> readModule(std::span<const uint32_t> words, ShaderStage stage, std::string_view entry) {
    try {
        std::optional<shader::EntryPoint> chosen;
        std::optional<ShaderStage> found;
        for (const shader::EntryPoint& point : shader::entryPoints(words)) {
            if (!entry.empty() && point.name != entry) continue;
            found = stageOf(static_cast<spv::ExecutionModel>(point.model));
            if (stage != ShaderStage::Count && found != stage) continue;
            chosen = point;
            break;
        }
        if (!chosen) throw Refusal(fmt::format("there is no entry point '{}'", entry));
        if (!found) throw Refusal(fmt::format("entry point '{}' is for no stage that Glint knows", chosen->name));
        Module module(words.data(), words.size());
        module.set_entry_point(std::string(chosen->name), static_cast<spv::ExecutionModel>(chosen->model));
        Reflection reflection;
        reflection.stage = *found;
        reflection.entry = chosen->name;
        Reader reader(module, reflection);
        reader.read();
        if (*found >= ShaderStage::RayGen) reader.readRayVariables(words);
        return reflection;
    } catch (const std::exception& exception) {
        return unexpected(makeError(ErrorCode::ShaderCompile, "shader.reflect", "{}", exception.what()));
    }
}

}  // namespace

const char* toString(RayVariable::Kind kind) {
    switch (kind) {
        case RayVariable::Kind::Payload: return "payload";
        case RayVariable::Kind::IncomingPayload: return "incoming payload";
        case RayVariable::Kind::Callable: return "callable data";
        case RayVariable::Kind::IncomingCallable: return "incoming callable data";
        case RayVariable::Kind::Attribute: return "hit attribute";
    }
    return "unknown";
}

Expected<Reflection> reflect(std::span<const uint32_t> words, std::string_view entry) {
    const std::vector<uint32_t> native = shader::nativeWords(words);
    if (const std::optional<std::string> fault = shader::findFault(native))
        return unexpected(makeError(ErrorCode::ShaderCompile, "shader.reflect", "{}", *fault));
    return readModule(native, ShaderStage::Count, entry);
}

Expected<Reflection> shader::reflectValid(std::span<const uint32_t> words, ShaderStage stage, std::string_view entry) {
    return readModule(words, stage, entry);
}

}  // namespace glint

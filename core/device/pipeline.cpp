#include <glint/device/pipeline.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>

#include <algorithm>
#include <optional>

namespace glint {

namespace detail {

namespace {

constexpr uint32_t max_attributes = 16;
constexpr uint32_t max_vertex_stride = 2048;

/// The type a shader has to declare for a format, or None if it can declare neither input nor output of it.
FormatType shaderType(ShaderVariable::Type type) {
    switch (type) {
        case ShaderVariable::Type::Float: return FormatType::Float;
        case ShaderVariable::Type::Int: return FormatType::Int;
        case ShaderVariable::Type::Uint: return FormatType::Uint;
    }
    return FormatType::None;
}

const char* toString(FormatType type) {
    switch (type) {
        case FormatType::None: return "none";
        case FormatType::Float: return "float";
        case FormatType::Int: return "int";
        case FormatType::Uint: return "uint";
        case FormatType::Depth: return "depth";
    }
    return "unknown";
}

/// Vulkan wants attributes aligned to one component, or to the whole word of a packed format.
uint32_t attributeAlignment(Format format) {
    if (format == FormatRGBu10Au2n || format == FormatRGBf11f11f10 || format == FormatRGBEu9e5) return 4;
    const FormatInfo& info = formatInfo(format);
    return info.block_size / std::max<uint32_t>(info.components, 1);
}

}  // namespace

Error PipelineObject::checkStages(const Stages& stages, Where where) const {
    const auto has = [&](ShaderStage stage) { return stages.find(stage) != nullptr; };
    const auto lacks = [&](const char* what) {
        return problem(where, ErrorCode::InvalidArgument, "program.stage", what);
    };
    const bool has_vertices = has(ShaderStage::Vertex) || has(ShaderStage::Control) || has(ShaderStage::Evaluate) ||
                              has(ShaderStage::Geometry);
    if (has(ShaderStage::Mesh) && has_vertices)
        return lacks("a mesh shader takes the place of vertex, control, evaluate and geometry shaders");
    if (has(ShaderStage::Task) && !has(ShaderStage::Mesh)) return lacks("there is a task shader and no mesh shader");
    if (!has(ShaderStage::Vertex) && !has(ShaderStage::Mesh)) return lacks("there is no vertex or mesh shader");
    if (!desc.color_formats.empty() && !has(ShaderStage::Fragment))
        return lacks("there are colour formats and no fragment shader");
    const bool patches = desc.primitive == Primitive::Patch;
    if (has(ShaderStage::Control) != patches || has(ShaderStage::Evaluate) != patches)
        return lacks("control and evaluate shaders and PrimitivePatch belong together");
    return {};
}

Error PipelineObject::checkMesh(const Stages& stages, Where where) const {
    const Reflection& mesh = *stages.find(ShaderStage::Mesh);
    const Reflection* const task = stages.find(ShaderStage::Task);
    const Features& limits = device()->features();
    if (!attributes.empty())
        return problem(where, ErrorCode::InvalidArgument, "pipeline.attribute",
                       fmt::format("a mesh shader reads no attributes, {} were added", attributes.size()));
    if (mesh.payload_size != 0 && (!task || task->payload_size != mesh.payload_size))
        return problem(where, ErrorCode::InvalidArgument, "pipeline.payload",
                       task ? fmt::format("the mesh shader reads a payload of {} bytes, the task shader writes {}",
                                          mesh.payload_size, task->payload_size)
                            : "the mesh shader reads a payload, and there is no task shader");
    const auto beyond = [&](const char* what, uint64_t has, uint32_t limit) {
        if (has <= limit) return Error();
        return problem(where, ErrorCode::OutOfRange, "pipeline.mesh",
                       fmt::format("{} {}, the device takes {}", has, what, limit));
    };
    for (size_t i = 0; i < stages.shaders.size(); i++) {
        const Reflection& stage = stages.shaders[i]->compiled.reflection;
        const bool is_task = stage.stage == ShaderStage::Task;
        if (!is_task && stage.stage != ShaderStage::Mesh) continue;
        const std::array<uint32_t, 3> size = stages.groupSize(i);
        if (Error error =
                beyond(is_task ? "threads in a group of the task shader" : "threads in a group of the mesh shader",
                       static_cast<uint64_t>(size[0]) * size[1] * size[2],
                       is_task ? limits.maxTaskThreads : limits.maxMeshThreads))
            return error;
    }
    if (Error error = beyond("vertices of a mesh shader", mesh.mesh_vertices, limits.maxMeshVertices)) return error;
    if (Error error = beyond("primitives of a mesh shader", mesh.mesh_primitives, limits.maxMeshPrimitives))
        return error;
    return beyond("bytes of a task shader's payload", task ? task->payload_size : 0, limits.maxTaskPayload);
}

Error PipelineObject::checkAttributes(const Reflection& vertex, Where where) const {
    for (const ShaderVariable& input : vertex.inputs) {
        if (input.location >= desc.attributes.size())
            return problem(where, ErrorCode::InvalidArgument, "pipeline.attribute",
                           fmt::format("the vertex shader reads '{}' at location {}, there are {} attributes",
                                       input.name, input.location, desc.attributes.size()));
        const FormatInfo& info = formatInfo(desc.attributes[input.location].format);
        if (info.type != shaderType(input.type))
            return problem(where, ErrorCode::InvalidArgument, "pipeline.attribute",
                           fmt::format("the vertex shader reads '{}' at location {} as {}, its format {} is {}",
                                       input.name, input.location, toString(shaderType(input.type)), info.name,
                                       toString(info.type)));
    }
    return {};
}

Error PipelineObject::checkTargets(const PipelineDesc& complete, const Reflection* fragment, Where where) const {
    const std::vector<Format>& formats = complete.color_formats;
    if (formats.empty() && complete.depth_format == FormatUnknown)
        return problem(where, ErrorCode::InvalidArgument, "pipeline.format", "there is no colour and no depth format");
    uint32_t written = 0;
    if (fragment) {
        for (const ShaderVariable& output : fragment->outputs) {
            const Format format = output.location < formats.size() ? formats[output.location] : FormatUnknown;
            if (format == FormatUnknown)
                return problem(where, ErrorCode::InvalidArgument, "pipeline.format",
                               fmt::format("the fragment shader writes '{}' to target {}, which has no format",
                                           output.name, output.location));
            if (formatInfo(format).type != shaderType(output.type))
                return problem(where, ErrorCode::InvalidArgument, "pipeline.format",
                               fmt::format("the fragment shader writes '{}' to target {} as {}, its format {} is {}",
                                           output.name, output.location, toString(shaderType(output.type)),
                                           glint::toString(format), toString(formatInfo(format).type)));
            written |= 1u << output.location;
        }
    }
    for (uint32_t i = 0; i < formats.size(); i++) {
        if (formats[i] == FormatUnknown) continue;
        const BlendDesc& blend = complete.blends[i];
        if (blend.write_mask != 0 && !(written & (1u << i)))
            return problem(where, ErrorCode::InvalidArgument, "pipeline.output",
                           fmt::format("target {} would be written with undefined values: the fragment shader has no "
                                       "output there, and the colour mask is not ColorMaskNone",
                                       i));
        const FormatType type = formatInfo(formats[i]).type;
        if (blend.enabled && type != FormatType::Float)
            return problem(where, ErrorCode::InvalidArgument, "pipeline.blend",
                           fmt::format("target {} of format {} cannot be blended", i, glint::toString(formats[i])));
    }
    return {};
}

Error PipelineObject::checkState(const PipelineDesc& complete, Where where) const {
    const FormatInfo& depth = formatInfo(complete.depth_format);
    if (complete.depth_test && !depth.depth)
        return problem(where, ErrorCode::InvalidArgument, "pipeline.depth",
                       "there is a depth test and no depth format");
    if (complete.hasStencilTest() && !depth.stencil)
        return problem(where, ErrorCode::InvalidArgument, "pipeline.stencil",
                       fmt::format("there is a stencil test, the depth format {} has no stencil", depth.name));
    if (complete.fill == FillMode::Line)
        if (Error error = missing(where, FeatureWireframe, "FillModeLine")) return error;
    if (complete.depth_clamp)
        if (Error error = missing(where, FeatureDepthClamp, "setDepthClamp")) return error;
    return {};
}

Expected<std::unique_ptr<Native>> PipelineObject::createNative(const Stages& stages, Where where) {
    if (Error error = checkStages(stages, where)) return unexpected(error);
    const Reflection* const vertex = stages.find(ShaderStage::Vertex);
    PipelineDesc complete = desc;
    complete.blends.resize(complete.color_formats.size());
    for (size_t i = 0; i < complete.blends.size(); i++)
        if (complete.color_formats[i] == FormatUnknown) complete.blends[i].write_mask = 0;
    complete.depth_write = complete.depth_write && complete.depth_test;
    complete.layout = &layout;
    complete.name = name();
    complete.stages.clear();
    for (size_t i = 0; i < stages.shaders.size(); i++) complete.stages.push_back(stages.desc(i));
    if (Error error = vertex ? checkAttributes(*vertex, where) : checkMesh(stages, where)) return unexpected(error);
    if (Error error = checkTargets(complete, stages.find(ShaderStage::Fragment), where)) return unexpected(error);
    if (Error error = checkState(complete, where)) return unexpected(error);

    // What no input reads need not be fetched.
    PipelineDesc used = complete;
    std::erase_if(used.attributes, [&](const VertexAttribute& attribute) {
        return std::ranges::none_of(vertex->inputs,
                                    [&](const auto& input) { return input.location == attribute.location; });
    });
    auto made = device()->backend->createPipeline(used);
    if (!made) return unexpected(made.error().at(where).named(name()));
    // The stages' words and constants go with `stages`.
    complete.stages.clear();
    desc = std::move(complete);
    has_mesh = !vertex;
    return std::move(*made);
}

}  // namespace detail

namespace {

using detail::PipelineObject;

PipelineObject* configurable(detail::Object* object, Pipeline::Where where) {
    auto* pipeline = static_cast<PipelineObject*>(object);
    return pipeline && pipeline->configurable(where) ? pipeline : nullptr;
}

void fail(PipelineObject& pipeline, Pipeline::Where where, ErrorCode code, const char* id, std::string_view message) {
    pipeline.fail(pipeline.problem(where, code, id, message));
}

/// The enumerations of the public header stand in the order of the back end's. `last` guards against values cast from
/// elsewhere.
template <class To, class From>
bool convert(PipelineObject& pipeline, To& to, From from, From last, Pipeline::Where where) {
    if (from > last) {
        fail(pipeline, where, ErrorCode::InvalidArgument, "pipeline.value",
             fmt::format("there is no such state: {} of 0 to {}", static_cast<int>(from), static_cast<int>(last)));
        return false;
    }
    to = static_cast<To>(from);
    return true;
}

static_assert(static_cast<int>(Pipeline::PrimitivePatch) == static_cast<int>(detail::Primitive::Patch));
static_assert(static_cast<int>(Pipeline::FillModeLine) == static_cast<int>(detail::FillMode::Line));
static_assert(static_cast<int>(Pipeline::CullModeFront) == static_cast<int>(detail::CullMode::Front));
static_assert(static_cast<int>(Pipeline::FrontModeCW) == static_cast<int>(detail::FrontMode::Clockwise));
static_assert(static_cast<int>(Pipeline::DepthFuncAlways) == static_cast<int>(Compare::Always));
static_assert(static_cast<int>(Pipeline::BlendOpMax) == static_cast<int>(detail::BlendOperation::Maximum));
static_assert(static_cast<int>(Pipeline::BlendFuncInvFactor) == static_cast<int>(detail::BlendFactor::InvConstant));
static_assert(static_cast<int>(Pipeline::StencilOpDecrSat) == static_cast<int>(detail::StencilOperation::Decrement));

bool checkIndex(PipelineObject& pipeline, uint32_t index, Pipeline::Where where) {
    const uint32_t limit = std::min(pipeline.device()->features().maxTargets, detail::max_targets);
    if (index < limit) return true;
    fail(pipeline, where, ErrorCode::OutOfRange, "pipeline.target",
         fmt::format("colour target {}, the device has {}", index, limit));
    return false;
}

/// Nothing, and the error is kept, if a value is none of its type.
std::optional<detail::StencilFace> stencilFace(PipelineObject& pipeline, Pipeline::DepthFunc func,
                                               Pipeline::StencilOp fail, Pipeline::StencilOp depth_fail,
                                               Pipeline::StencilOp pass, Pipeline::Where where) {
    detail::StencilFace face;
    if (func == Pipeline::DepthFuncNone) return face;
    face.test = true;
    if (!convert(pipeline, face.compare, func, Pipeline::DepthFuncAlways, where) ||
        !convert(pipeline, face.fail, fail, Pipeline::StencilOpDecrSat, where) ||
        !convert(pipeline, face.depth_fail, depth_fail, Pipeline::StencilOpDecrSat, where) ||
        !convert(pipeline, face.pass, pass, Pipeline::StencilOpDecrSat, where))
        return std::nullopt;
    return face;
}

detail::BlendDesc* blendOf(PipelineObject* pipeline, uint32_t index, Pipeline::Where where) {
    if (!pipeline || !checkIndex(*pipeline, index, where)) return nullptr;
    auto& blends = pipeline->desc.blends;
    if (blends.size() <= index) blends.resize(index + 1);
    return &blends[index];
}

/// One of a target's two equations. Without blending a colour replaces the old one.
void setEquation(PipelineObject& pipeline, detail::BlendDesc& blend, bool alpha, Pipeline::BlendOp op,
                 Pipeline::BlendFunc source, Pipeline::BlendFunc destination, Pipeline::Where where) {
    if (op == Pipeline::BlendOpNone) {
        op = Pipeline::BlendOpAdd;
        source = Pipeline::BlendFuncOne;
        destination = Pipeline::BlendFuncZero;
    } else {
        blend.enabled = true;
    }
    convert(pipeline, alpha ? blend.alpha_operation : blend.color_operation, op, Pipeline::BlendOpMax, where);
    convert(pipeline, alpha ? blend.alpha_source : blend.color_source, source, Pipeline::BlendFuncInvFactor, where);
    convert(pipeline, alpha ? blend.alpha_destination : blend.color_destination, destination,
            Pipeline::BlendFuncInvFactor, where);
}

/// Whether a Target can hold the format.
bool checkFormat(PipelineObject& pipeline, Format format, bool depth, Pipeline::Where where) {
    if (format == FormatUnknown) return true;
    const bool kind = format < FormatCount && formatInfo(format).depth == depth;
    if (kind && (pipeline.device()->backend->formatSupport(format, Texture::Type2D) & Texture::FlagTarget)) return true;
    fail(pipeline, where, kind ? ErrorCode::Unsupported : ErrorCode::InvalidArgument, "pipeline.format",
         fmt::format("format {} is {}", formatInfo(format).name,
                     kind    ? "no target on this device"
                     : depth ? "no depth format"
                             : "no colour format"));
    return false;
}

}  // namespace

void Pipeline::addAttribute(Attribute attribute, Format format, uint32_t buffer, uint32_t offset, uint32_t stride,
                            uint32_t rate, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (!pipeline) return;
    detail::PipelineDesc& desc = pipeline->desc;
    const uint32_t location = static_cast<uint32_t>(desc.attributes.size());
    const FormatInfo& info = formatInfo(format);
    const uint32_t alignment = detail::attributeAlignment(format);
    const auto refuse = [&](ErrorCode code, std::string_view message) {
        fail(*pipeline, where, code, "pipeline.attribute", fmt::format("attribute {}: {}", location, message));
    };
    if (location >= detail::max_attributes || buffer >= detail::max_attributes)
        return refuse(ErrorCode::OutOfRange, fmt::format("there are at most {} attributes and {} vertex buffers",
                                                         detail::max_attributes, detail::max_attributes));
    if (format == FormatUnknown || !pipeline->device()->backend->vertexFormatSupport(format))
        return refuse(ErrorCode::Unsupported, fmt::format("format {} is no vertex format on this device", info.name));
    if (stride == 0 || stride > detail::max_vertex_stride || offset > stride || info.block_size > stride - offset)
        return refuse(ErrorCode::OutOfRange, fmt::format("{} bytes at offset {} in a stride of {}, which is at most {}",
                                                         info.block_size, offset, stride, detail::max_vertex_stride));
    if (offset % alignment != 0 || stride % alignment != 0)
        return refuse(ErrorCode::InvalidArgument,
                      fmt::format("offset {} and stride {} are no multiples of {}, as {} asks for", offset, stride,
                                  alignment, info.name));
    if (rate > 1) return refuse(ErrorCode::OutOfRange, fmt::format("rate {} of 0 (vertex) and 1 (instance)", rate));
    if (desc.vertex_buffers.size() <= buffer) desc.vertex_buffers.resize(buffer + 1);
    detail::VertexBuffer& slot = desc.vertex_buffers[buffer];
    if (slot.stride != 0 && (slot.stride != stride || slot.rate != rate))
        return refuse(ErrorCode::InvalidArgument,
                      fmt::format("vertex buffer {} has stride {} and rate {} already, now {} and {}", buffer,
                                  slot.stride, slot.rate, stride, rate));
    slot = {.stride = stride, .rate = rate};
    desc.attributes.push_back({.location = location, .format = format, .buffer = buffer, .offset = offset});
    pipeline->attributes.push_back({attribute, format, buffer, offset, stride, rate});
}

std::vector<Pipeline::VertexAttribute> Pipeline::getAttributes() const {
    return object_ ? static_cast<PipelineObject*>(object_)->attributes : std::vector<VertexAttribute>();
}

void Pipeline::setPrimitive(PrimitiveType primitive, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (pipeline) convert(*pipeline, pipeline->desc.primitive, primitive, PrimitivePatch, where);
}

void Pipeline::setFillMode(FillModeType mode, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (pipeline) convert(*pipeline, pipeline->desc.fill, mode, FillModeLine, where);
}

void Pipeline::setCullMode(CullModeType mode, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (pipeline) convert(*pipeline, pipeline->desc.cull, mode, CullModeFront, where);
}

void Pipeline::setFrontMode(FrontModeType mode, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (pipeline) convert(*pipeline, pipeline->desc.front, mode, FrontModeCW, where);
}

void Pipeline::setDepthFunc(DepthFunc func, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (!pipeline) return;
    pipeline->desc.depth_test = func != DepthFuncNone;
    if (func != DepthFuncNone) convert(*pipeline, pipeline->desc.depth_compare, func, DepthFuncAlways, where);
}

void Pipeline::setDepthMask(bool write, Where where) {
    if (PipelineObject* pipeline = configurable(object_, where)) pipeline->desc.depth_write = write;
}

void Pipeline::setDepthBias(float bias, float slope, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (!pipeline) return;
    pipeline->desc.depth_bias = bias;
    pipeline->desc.depth_slope = slope;
}

void Pipeline::setDepthClamp(bool enabled, Where where) {
    if (PipelineObject* pipeline = configurable(object_, where)) pipeline->desc.depth_clamp = enabled;
}

void Pipeline::setStencilFunc(DepthFunc func, StencilOp fail, StencilOp depth_fail, StencilOp pass, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    const auto face = pipeline ? stencilFace(*pipeline, func, fail, depth_fail, pass, where) : std::nullopt;
    if (face) pipeline->desc.stencil_front = pipeline->desc.stencil_back = *face;
}

void Pipeline::setStencilFrontFunc(DepthFunc func, StencilOp fail, StencilOp depth_fail, StencilOp pass, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    const auto face = pipeline ? stencilFace(*pipeline, func, fail, depth_fail, pass, where) : std::nullopt;
    if (face) pipeline->desc.stencil_front = *face;
}

void Pipeline::setStencilBackFunc(DepthFunc func, StencilOp fail, StencilOp depth_fail, StencilOp pass, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    const auto face = pipeline ? stencilFace(*pipeline, func, fail, depth_fail, pass, where) : std::nullopt;
    if (face) pipeline->desc.stencil_back = *face;
}

void Pipeline::setStencilMask(uint8_t read, uint8_t write, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (!pipeline) return;
    pipeline->desc.stencil_read_mask = read;
    pipeline->desc.stencil_write_mask = write;
}

void Pipeline::setBlend(BlendOp op, BlendFunc source, BlendFunc destination, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (!pipeline) return;
    auto& blends = pipeline->desc.blends;
    blends.resize(detail::max_targets);
    for (detail::BlendDesc& blend : blends) {
        blend.enabled = false;
        setEquation(*pipeline, blend, false, op, source, destination, where);
        setEquation(*pipeline, blend, true, op, source, destination, where);
    }
}

void Pipeline::setBlendColor(uint32_t index, BlendOp op, BlendFunc source, BlendFunc destination, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (auto* blend = blendOf(pipeline, index, where))
        setEquation(*pipeline, *blend, false, op, source, destination, where);
}

void Pipeline::setBlendAlpha(uint32_t index, BlendOp op, BlendFunc source, BlendFunc destination, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (auto* blend = blendOf(pipeline, index, where))
        setEquation(*pipeline, *blend, true, op, source, destination, where);
}

void Pipeline::setColorMask(uint8_t mask, uint32_t index, Where where) {
    if (auto* blend = blendOf(configurable(object_, where), index, where)) blend->write_mask = mask & ColorMaskAll;
}

void Pipeline::setColorFormat(Format format, uint32_t index, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (!pipeline || !checkIndex(*pipeline, index, where) || !checkFormat(*pipeline, format, false, where)) return;
    std::vector<Format>& formats = pipeline->desc.color_formats;
    if (formats.size() <= index) formats.resize(index + 1, FormatUnknown);
    formats[index] = format;
    while (!formats.empty() && formats.back() == FormatUnknown) formats.pop_back();
}

void Pipeline::setDepthFormat(Format format, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (pipeline && checkFormat(*pipeline, format, true, where)) pipeline->desc.depth_format = format;
}

void Pipeline::setMultisample(uint32_t samples, Where where) {
    PipelineObject* pipeline = configurable(object_, where);
    if (!pipeline) return;
    const uint32_t limit = pipeline->device()->features().maxTextureSamples;
    const bool known = samples == 1 || samples == 2 || samples == 4 || samples == 8;
    if (known && samples <= limit)
        pipeline->desc.samples = samples;
    else
        fail(*pipeline, where, known ? ErrorCode::OutOfRange : ErrorCode::InvalidArgument, "pipeline.samples",
             fmt::format("{} samples of 1, 2, 4 or 8, the device has {}", samples, limit));
}

void Pipeline::setAlphaToCoverage(bool enabled, Where where) {
    if (PipelineObject* pipeline = configurable(object_, where)) pipeline->desc.alpha_to_coverage = enabled;
}

}  // namespace glint

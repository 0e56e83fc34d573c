// Ray-tracing pipelines in software: their stages joined into one kernel, and the buffers that it reads.

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/shader/shader_source.h>
#include <glint/shader/traversal_joiner.h>

#include <algorithm>
#include <cstring>
#include <deque>

namespace glint::detail {

namespace {

/// Rays of a group. Where eight neighbours in a row run together, as on CPUs, its shape does not matter to them, and
/// rows may be long.
constexpr std::array<uint32_t, 3> joinedGroupSize(bool is_cpu) {
    return is_cpu ? std::array<uint32_t, 3>{32, 2, 1} : std::array<uint32_t, 3>{8, 8, 1};
}

/// Joins stages; those that are refused once more as they were before optimisation, where they are GLSL. Optimisers
/// move what may stand in few places, such as the end of a shader, and a module fresh from the compiler knows its
/// lines.
Expected<std::vector<uint32_t>> joinStages(shader::TraversalSource source, const ProgramObject::Stages& stages) {
    Expected<std::vector<uint32_t>> joined = shader::joinTraversal(source);
    if (joined || joined.error().code() != ErrorCode::Unsupported) return joined;
    std::deque<std::vector<uint32_t>> modules;
    for (size_t i = 0; i < stages.shaders.size(); i++) {
        const ShaderSource& text = stages.shaders[i]->source;
        if (text.language != ShaderSource::Language::GLSL) continue;
        const Expected<shader::Preprocessed> preprocessed = shader::preprocess(text);
        if (!preprocessed) continue;
        Expected<std::vector<uint32_t>> words = shader::compileWithLines(text, *preprocessed);
        if (!words) continue;
        source.stages[i].words = modules.emplace_back(std::move(*words));
        source.stages[i].entry = text.entry;
    }
    if (modules.empty()) return joined;
    return shader::joinTraversal(source);
}

}  // namespace

/// The table as shaders/tracing/pipeline.h reads it.
std::vector<uint32_t> TraversalObject::recordWords() const {
    std::vector<uint32_t> words(4 * ray_tables);
    for (size_t t = 0; t < ray_tables; t++) {
        const uint32_t count = countRecords(static_cast<RayTable>(t));
        size_t data = 0;
        for (const Record& record : records[t]) data = std::max(data, record.data.size());
        const size_t stride = 1 + (data + 3) / 4;
        words[4 * t] = static_cast<uint32_t>(words.size());
        words[4 * t + 1] = static_cast<uint32_t>(stride);
        words[4 * t + 2] = count;
        for (uint32_t i = 0; i < count; i++) {
            const size_t place = words.size();
            words.resize(place + stride);
            words[place] = records[t].empty() ? i : records[t][i].group;
            if (!records[t].empty() && !records[t][i].data.empty())
                std::memcpy(&words[place + 1], records[t][i].data.data(), records[t][i].data.size());
        }
    }
    return words;
}

Status TraversalObject::join(const Stages& stages, Where where) {
    static_assert(static_cast<int>(RayTable::Generation) == shader::TraversalSource::Generation &&
                  static_cast<int>(RayTable::Miss) == shader::TraversalSource::Miss &&
                  static_cast<int>(RayTable::Hit) == shader::TraversalSource::Hit &&
                  static_cast<int>(RayTable::Callable) == shader::TraversalSource::Callable);
    shader::TraversalSource source;
    source.name = name();
    source.recursion_depth = recursion_depth;
    source.callable_depth = callable_depth;
    source.set = layout.set_count;
    source.binding = 0;
    source.group_size = joinedGroupSize(device()->info().cpu);
    for (size_t i = 0; i < stages.shaders.size(); i++) {
        const StageDesc stage = stages.desc(i);
        auto& made = source.stages.emplace_back();
        made.stage = stage.stage;
        made.name = stages.shaders[i]->source.name;
        made.words = stage.words;
        made.entry = stage.entry;
        for (const SpecializationValue& constant : stage.constants)
            made.constants.emplace_back(constant.id, constant.value);
    }
    for (size_t t = 0; t < ray_tables; t++)
        for (const TraversalDesc::Group& group : groups[t])
            source.groups[t].push_back({group.general, group.closest, group.first_hit, group.intersection});
    const Expected<std::vector<uint32_t>> words = joinStages(std::move(source), stages);
    if (!words) return words.error().at(where).named(name());

    auto shader = Ref<ShaderObject>::adopt(new ShaderObject);
    shader->setName(name());
    shader->source.language = ShaderSource::Language::SPIRV;
    shader->source.stage = ShaderStage::Compute;
    shader->source.name = name();
    shader->source.words = std::move(*words);
    // The stages have been optimised. Doing it again took a sixth of the time to 06_hello_traversal's first frame on
    // lavapipe, and its frames took as long without.
    shader->source.optimize = false;
    Expected<CompiledShader> compiled = compileShader(shader->source);
    if (!compiled) return compiled.error().at(where).named(name());
    shader->compiled = std::move(*compiled);
    shader->setReady();
    auto kernel = Ref<KernelObject>::adopt(new KernelObject(device()));
    kernel->setName(name());
    kernel->joined_resources = layout.resources;
    kernel->shaders.push_back(std::move(shader));
    if (Status status = kernel->create(where); !status) return status;
    // What is reloaded has the same records.
    if (Status status = joined_records ? Status() : createJoinedBuffers(where); !status) return status;
    joined = std::move(kernel);
    return {};
}

Status TraversalObject::createJoinedBuffers(Where where) {
    const Features& features = device()->features();
    const std::vector<uint32_t> table = recordWords();
    if (const uint64_t size = table.size() * sizeof(uint32_t); size > features.maxStorageSize)
        return problem(
            where, ErrorCode::OutOfRange, "traversal.record_table",
            fmt::format("its tables of records have {} bytes, the device binds {}", size, features.maxStorageSize));
    NativeBufferDesc desc;
    desc.size = table.size() * sizeof(uint32_t);
    desc.flags = Buffer::FlagStorage;
    desc.name = "records";
    Expected<Ref<BufferObject>> buffer = device()->createInternal(desc, where);
    if (!buffer) return buffer.error();
    Expected<Ref<BufferObject>> staging = device()->createStaging(desc.size, false, where);
    if (!staging) return staging.error();
    std::memcpy((*staging)->nativeBuffer()->mapped, table.data(), desc.size);
    Status copied = device()->playNow(
        "records", where, [&](RecorderCore& core) { core.copyBuffer(**buffer, 0, **staging, 0, desc.size); });
    if (!copied) return copied;

    NativeBufferDesc launch_desc;
    launch_desc.size = JoinedLaunch::rays(features) + JoinedLaunch::rays_size;
    launch_desc.flags = Buffer::FlagStorage | Buffer::FlagUniform | Buffer::FlagIndirect;
    launch_desc.name = "launch";
    Expected<Ref<BufferObject>> launch = device()->createInternal(launch_desc, where);
    if (!launch) return launch.error();
    joined_records = std::move(*buffer);
    joined_launch = std::move(*launch);
    return {};
}

}  // namespace glint::detail

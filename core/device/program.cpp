#include <glint/device/program.h>

#include <glint/base/format_error.h>
#include <glint/base/thread_pool.h>
#include <glint/device/detail/device_object.h>

#include <algorithm>
#include <bit>
#include <condition_variable>
#include <tuple>

namespace glint {

namespace detail {

namespace {

using Type = SpecializationConstant::Type;

/// More slots of one kind than any device has.
constexpr uint32_t max_slots = 4096;
/// Of one array in the software engine: a uniform block of references holds no more everywhere.
constexpr uint32_t max_tracings = 1024;
/// Of one program; back ends make room for as many of the largest.
constexpr size_t max_tables = 4;

const char* toString(Type type) {
    switch (type) {
        case Type::Bool: return "bool";
        case Type::Int: return "int";
        case Type::Uint: return "uint";
        case Type::Float: return "float";
    }
    return "unknown";
}

/// Integers may stand for each other where both read the bits as the same number.
bool fits(const ProgramObject::Constant& constant, Type type) {
    if (constant.type == type) return true;
    const bool integers =
        constant.type != Type::Float && constant.type != Type::Bool && type != Type::Float && type != Type::Bool;
    return integers && constant.value <= INT32_MAX;
}

/// Lists that were recorded before a reload were checked against the old layout, so all of it has to stay.
bool sameResource(const ShaderResource& a, const ShaderResource& b) {
    const auto parts = [](const ShaderResource& r) {
        return std::tie(r.kind, r.element, r.name, r.instance, r.set, r.binding, r.count, r.size, r.stride, r.read,
                        r.write, r.combined, r.texel_storage, r.dimension, r.stages, r.aliases);
    };
    return parts(a) == parts(b);
}

bool sameLayout(const BindingLayout& a, const BindingLayout& b) {
    return a.push_size == b.push_size && a.push_stages == b.push_stages &&
           std::ranges::equal(a.resources, b.resources, sameResource);
}

/// Has queries, or structures that a driver's would answer.
bool asksRays(const Reflection& stage) {
    return stage.uses_ray_query || std::ranges::any_of(stage.resources, [](const ShaderResource& resource) {
               return resource.descriptor == SlotKind::Tracing;
           });
}

std::vector<FileStamp> gatherStamps(const std::vector<Ref<ShaderObject>>& shaders) {
    std::vector<FileStamp> stamps;
    for (const Ref<ShaderObject>& shader : shaders) {
        const std::vector<FileStamp>& read = shader->compiled.stamps;
        stamps.insert(stamps.end(), read.begin(), read.end());
        if (!shader->file.path.empty()) stamps.push_back(shader->file);
    }
    return stamps;
}

}  // namespace

/// A createAsync, shared by the program and its task in the pool. The task does not keep the program alive: else the
/// message callback could be called, and the device closed, long after the user has let go of both.
struct ProgramObject::Creation {
    enum class Step : uint8_t { Queued, Running, Done };

    Creation(ProgramObject* owner, Where line) : program(owner), where(line) {}

    /// Whoever comes first does the work, so that waiting within a task of the pool cannot block.
    void run() {
        {
            std::lock_guard lock(mutex);
            if (step != Step::Queued) return;
            step = Step::Running;
        }
        if (Status status = program->build(where); !status) program->fail(status.error());
        {
            std::lock_guard lock(mutex);
            step = Step::Done;
        }
        done.notify_all();
    }

    void wait() {
        std::unique_lock lock(mutex);
        done.wait(lock, [this] { return step == Step::Done; });
    }

    /// Nobody wants the program any more.
    void abandon() {
        {
            std::lock_guard lock(mutex);
            if (step == Step::Queued) step = Step::Done;
        }
        wait();
    }

    std::mutex mutex;
    std::condition_variable done;
    Step step = Step::Queued;
    ProgramObject* const program;
    const Where where;
};

const Reflection* ProgramObject::Stages::find(ShaderStage stage) const {
    for (const Ref<ShaderObject>& shader : shaders)
        if (shader->source.stage == stage) return &shader->compiled.reflection;
    return nullptr;
}

StageDesc ProgramObject::Stages::desc(size_t index) const {
    const ShaderObject& shader = *shaders[index];
    return {.stage = shader.source.stage,
            .words = shader.compiled.words,
            .entry = shader.compiled.reflection.entry,
            .constants = constants[index]};
}

std::array<uint32_t, 3> ProgramObject::Stages::groupSize(size_t index) const {
    const Reflection& shader = shaders[index]->compiled.reflection;
    std::array<uint32_t, 3> size = shader.group_size;
    for (size_t i = 0; i < size.size(); i++)
        for (const SpecializationValue& constant : constants[index])
            if (constant.id == shader.group_constants[i]) size[i] = constant.value;
    return size;
}

Error ProgramObject::problem(Where where, ErrorCode code, const char* id, std::string_view message) const {
    return makeError(where, code, id, "{}: {}", label(), message).named(name());
}

Error ProgramObject::missing(Where where, FeatureMask features, std::string_view what) const {
    const FeatureMask absent = features & ~device()->features().mask;
    if (!absent) return {};
    const DeviceInfo& info = device()->info();
    return problem(where, ErrorCode::Unsupported, "program.feature",
                   fmt::format("{} needs {}, which {}", what, featureNames(absent),
                               (info.features & absent) == absent
                                   ? fmt::format("the device on {} was made without", info.name)
                                   : fmt::format("{} does not offer", info.name)));
}

bool ProgramObject::configurable(Where where) {
    const ObjectState now = state();
    if (now == ObjectState::Building && !creation_) return true;
    if (now != ObjectState::Failed)
        device()->report(problem(where, ErrorCode::InvalidArgument, "program.created", "create() was called already"));
    return false;
}

void ProgramObject::addShader(Ref<ShaderObject> shader) {
    const ShaderStage stage = shader->source.stage;
    std::erase_if(shaders, [&](const auto& old) { return old->source.stage == stage; });
    shaders.push_back(std::move(shader));
}

Status ProgramObject::create(Where where) {
    if (!configurable(where)) {
        if (state() == ObjectState::Failed) return error();
        return problem(where, ErrorCode::InvalidArgument, "program.created", "create() was called already");
    }
    if (Status status = build(where); !status) return fail(status.error());
    return {};
}

void ProgramObject::createAsync(Where where) {
    if (!configurable(where)) return;
    creation_ = std::make_shared<Creation>(this, where);
    ThreadPool::shared().submit([creation = creation_] { creation->run(); });
}

void ProgramObject::waitCreated() {
    if (!creation_) return;
    creation_->run();
    creation_->wait();
}

void ProgramObject::lastRelease() {
    if (creation_) creation_->abandon();
}

Status ProgramObject::build(Where where) {
    stamps_ = gatherStamps(shaders);
    Expected<std::vector<Ref<ShaderObject>>> compiled = forEngine(shaders, where);
    if (!compiled) return compiled.error();
    Expected<Stages> stages = specialize(std::move(*compiled), where);
    if (!stages) return stages.error();
    Expected<BindingLayout> merged = mergeStages(*stages, where);
    if (!merged) return merged.error();

    layout = std::move(*merged);
    for (const auto* resources : {&layout.resources, &layout.hidden})
        for (const ShaderResource& resource : *resources) {
            first_element.push_back(element_count);
            first_uniform.push_back(uniform_elements);
            element_count += resource.descriptorCount();
            if (resource.descriptor == SlotKind::Uniform) uniform_elements += resource.descriptorCount();
        }
    // It may run before any structure is built.
    if (!layout.hidden.empty())
        if (const auto memory = device()->heap()->allocate(1, where); !memory) return memory.error();
    Expected<std::unique_ptr<Native>> made = createNative(*stages, where);
    if (!made) return made.error();
    native = std::move(*made);
    setReady();
    return {};
}

Status ProgramObject::reload(bool& changed, Where where) {
    waitCreated();
    if (state() != ObjectState::Ready) {
        if (Error kept = error()) return kept;
        return problem(where, ErrorCode::InvalidArgument, "program.not_created", "reload() before create()");
    }
    if (!filesChanged(stamps_)) return {};
    // A broken file is tried once, not at every call until it is repaired.
    for (FileStamp& stamp : stamps_) stamp = stampFile(stamp.path);

    std::vector<Ref<ShaderObject>> compiled;
    for (const Ref<ShaderObject>& shader : shaders) {
        if (!filesChanged(gatherStamps({shader}))) {
            compiled.push_back(shader);
            continue;
        }
        shader->retain();
        const Shader fresh = Shader(shader.get()).reloaded(where);
        if (!fresh) return fresh.error();
        compiled.emplace_back(static_cast<ShaderObject*>(fresh.object()));
    }
    stamps_ = gatherStamps(compiled);
    Expected<std::vector<Ref<ShaderObject>>> played = forEngine(compiled, where);
    if (!played) return played.error();
    Expected<Stages> stages = specialize(std::move(*played), where);
    if (!stages) return stages.error();
    Expected<BindingLayout> merged = mergeStages(*stages, where);
    if (!merged) return merged.error();
    if (!sameLayout(layout, *merged))
        return problem(where, ErrorCode::InvalidArgument, "program.layout_changed",
                       "the changed files declare other resources or push constants; only a new program can have them");
    Expected<std::unique_ptr<Native>> made = createNative(*stages, where);
    if (!made) return made.error();
    device()->replaceNative(*this, std::move(*made));
    shaders = std::move(compiled);
    changed = true;
    return {};
}

Expected<std::vector<Ref<ShaderObject>>> ProgramObject::forEngine(const std::vector<Ref<ShaderObject>>& compiled,
                                                                  Where where) const {
    std::vector<Ref<ShaderObject>> result = compiled;
    const TracingHeap* const heap = device()->heap();
    if (!heap) return result;
    for (Ref<ShaderObject>& shader : result) {
        const Reflection& reflection = shader->compiled.reflection;
        if (!asksRays(reflection) || reflection.stage >= ShaderStage::RayGen) continue;
        if (Error error = checkFeatures(reflection, where)) return unexpected(error);
        ShaderSource source = shader->source;
        source.tracing = heap->rewrite();
        Expected<CompiledShader> rewritten = compileShader(source);
        if (!rewritten) return unexpected(rewritten.error().at(where).named(name()));
        auto object = Ref<ShaderObject>::adopt(new ShaderObject);
        object->source = std::move(source);
        object->compiled = std::move(*rewritten);
        object->setReady();
        shader = std::move(object);
    }
    return result;
}

Expected<ProgramObject::Stages> ProgramObject::specialize(std::vector<Ref<ShaderObject>> compiled, Where where) const {
    Stages stages;
    stages.shaders = std::move(compiled);
    stages.constants.resize(stages.shaders.size());
    for (const Constant& constant : constants) {
        const std::string title = constant.name.empty() ? fmt::format("{}", constant.id) : "'" + constant.name + "'";
        bool found = false;
        for (size_t i = 0; i < stages.shaders.size(); i++) {
            for (const SpecializationConstant& declaration : stages.shaders[i]->compiled.reflection.constants) {
                if (constant.name.empty() ? declaration.id != constant.id : declaration.name != constant.name) continue;
                if (!fits(constant, declaration.type))
                    return unexpected(problem(where, ErrorCode::InvalidArgument, "program.constant_type",
                                              fmt::format("specialisation constant {} is declared as {}, given as {}",
                                                          title, toString(declaration.type), toString(constant.type))));
                found = true;
                std::erase_if(stages.constants[i], [&](const auto& value) { return value.id == declaration.id; });
                stages.constants[i].push_back({declaration.id, constant.value});
            }
        }
        if (!found)
            return unexpected(problem(where, ErrorCode::InvalidArgument, "program.constant",
                                      fmt::format("no stage declares specialisation constant {}", title)));
    }
    return stages;
}

Expected<BindingLayout> ProgramObject::mergeStages(const Stages& stages, Where where) const {
    std::vector<const Reflection*> reflections;
    for (const Ref<ShaderObject>& shader : stages.shaders) {
        reflections.push_back(&shader->compiled.reflection);
        if (Error error = checkFeatures(*reflections.back(), where)) return unexpected(error);
    }
    const Reflection joined = joinedDeclarations(stages);
    if (!joined_resources.empty()) reflections.push_back(&joined);
    Expected<BindingLayout> merged = mergeLayouts(reflections);
    if (!merged) return unexpected(merged.error().at(where).named(name()));
    for (const ShaderResource& resource : merged->resources)
        if (Error error = checkResource(resource, where)) return unexpected(error);
    if (Error error = checkTables(*merged, where)) return unexpected(error);
    if (const uint32_t limit = device()->features().maxPushSize; merged->push_size > limit)
        return unexpected(
            problem(where, ErrorCode::OutOfRange, "program.push_size",
                    fmt::format("{} bytes of push constants, the device has {}", merged->push_size, limit)));
    if (Error error = checkSlots(*merged, where)) return unexpected(error);
    return merged;
}

Reflection ProgramObject::joinedDeclarations(const Stages& stages) const {
    Reflection result;
    result.stage = ShaderStage::Compute;
    result.resources = joined_resources;
    for (ShaderResource& resource : result.resources) {
        resource.stages = stageBit(ShaderStage::Compute);
        if (resource.kind != SlotKind::Tracing) continue;
        if (device()->heap()) resource.descriptor = SlotKind::Uniform;
        for (const Ref<ShaderObject>& shader : stages.shaders)
            for (const ShaderResource& other : shader->compiled.reflection.resources)
                if (other.set == resource.set && other.binding == resource.binding)
                    resource.descriptor = other.descriptor;
    }
    return result;
}

Error ProgramObject::checkFeatures(const Reflection& stage, Where where) const {
    FeatureMask needed = 0;
    if (stage.stage >= ShaderStage::RayGen) {
        needed |= FeatureRayTracing;
        if (stage.uses_ray_query) needed |= FeatureComputeTracing;
    } else if (asksRays(stage)) {
        needed |= stage.stage == ShaderStage::Compute ? FeatureComputeTracing : FeatureFragmentTracing;
    }
    if (stage.uses_addresses) needed |= FeatureBufferAddress;
    if (stage.uses_float64) needed |= FeatureShaderf64;
    if (stage.uses_int64) needed |= FeatureShaderu64;
    if (stage.uses_layer) needed |= FeatureVertexLayer;
    if (stage.stage == ShaderStage::Geometry) needed |= FeatureGeometryShader;
    if (stage.stage == ShaderStage::Task || stage.stage == ShaderStage::Mesh) needed |= FeatureMeshShader;
    if (stage.stage == ShaderStage::Control || stage.stage == ShaderStage::Evaluate) needed |= FeatureTessellation;
    for (const ShaderResource& resource : stage.resources) {
        if (resource.dimension == ImageDimension::CubeArray) needed |= FeatureCubeArray;
        if (resource.kind != SlotKind::Table) continue;
        if (resource.element == SlotKind::Texture) needed |= FeatureTextureTable;
        if (resource.element == SlotKind::Storage) needed |= FeatureBufferTable;
    }
    return missing(where, needed, fmt::format("the {} shader", glint::toString(stage.stage)));
}

Error ProgramObject::checkResource(const ShaderResource& resource, Where where) const {
    const bool is_table = resource.kind == SlotKind::Table;
    if (is_table && ((resource.element != SlotKind::Texture && resource.element != SlotKind::Storage) ||
                     resource.combined || resource.dimension == ImageDimension::Image2DMultisample))
        return problem(where, ErrorCode::Unsupported, "program.table",
                       fmt::format("'{}' is an array of unknown length; tables hold textures without samplers or "
                                   "samples (texture2D), and storage blocks",
                                   resource.name));
    if (!is_table && (resource.count == 0 || resource.count > max_slots))
        return problem(
            where, ErrorCode::OutOfRange, "program.array",
            fmt::format("'{}' has {} elements, at most {} can be bound", resource.name, resource.count, max_slots));
    if (resource.isRewritten() && resource.descriptor != SlotKind::Uniform)
        return problem(where, ErrorCode::OutOfRange, "program.array",
                       fmt::format("'{}' has {} structures, at most {} can be bound", resource.name, resource.count,
                                   max_tracings));
    const uint64_t limit = device()->features().maxUniformSize;
    if (resource.kind == SlotKind::Uniform && resource.size > limit)
        return problem(
            where, ErrorCode::OutOfRange, "program.uniform_size",
            fmt::format("uniform block '{}' has {} bytes, the device takes {}", resource.name, resource.size, limit));
    return {};
}

Error ProgramObject::checkTables(const BindingLayout& merged, Where where) const {
    const std::vector<uint32_t>& tables = merged.slots[static_cast<size_t>(SlotKind::Table)];
    if (tables.size() > max_tables)
        return problem(where, ErrorCode::OutOfRange, "program.table",
                       fmt::format("{} tables, a program has at most {}", tables.size(), max_tables));
    for (const uint32_t index : tables) {
        const ShaderResource& table = merged.resources[index];
        for (const auto* resources : {&merged.resources, &merged.hidden})
            for (const ShaderResource& other : *resources)
                if (&other != &table && other.set == table.set)
                    return problem(where, ErrorCode::InvalidArgument, "program.table",
                                   fmt::format("table '{}' has to be alone in set {}, where '{}' is, too", table.name,
                                               table.set, other.name));
    }
    return {};
}

Error ProgramObject::checkSlots(const BindingLayout& merged, Where where) const {
    for (size_t k = 0; k < declared.size(); k++) {
        if (declared[k] < 0) continue;
        const SlotKind kind = static_cast<SlotKind>(k);
        const std::vector<uint32_t>& slots = merged.slots[k];
        if (slots.size() > masks[k].size())
            return problem(where, ErrorCode::InvalidArgument, "program.slots",
                           fmt::format("{} {} slots are declared, the shaders have {}", masks[k].size(),
                                       glint::toString(kind), slots.size()));
        for (size_t i = 0; i < slots.size(); i++) {
            const ShaderResource& resource = merged.resources[slots[i]];
            const ShaderMask hidden = resource.stages & ~masks[k][i];
            if (!hidden) continue;
            const ShaderStage stage = static_cast<ShaderStage>(std::countr_zero(hidden));
            return problem(where, ErrorCode::InvalidArgument, "program.mask",
                           fmt::format("{} slot {} '{}' is used by the {} shader, which its mask leaves out",
                                       glint::toString(kind), i, resource.name, glint::toString(stage)));
        }
    }
    return {};
}

}  // namespace detail

namespace {

using detail::ProgramObject;
using Type = SpecializationConstant::Type;

ProgramObject* configurable(detail::Object* object, Program::Where where) {
    auto* program = static_cast<ProgramObject*>(object);
    return program && program->configurable(where) ? program : nullptr;
}

void setConstant(detail::Object* object, ProgramObject::Constant constant, Program::Where where) {
    ProgramObject* program = configurable(object, where);
    if (program) program->constants.push_back(std::move(constant));
}

bool takes(detail::ObjectType program, ShaderStage stage) {
    if (program == detail::ObjectType::Kernel) return stage == ShaderStage::Compute;
    if (program == detail::ObjectType::Traversal) return stage >= ShaderStage::RayGen;
    return stage <= ShaderStage::Fragment || stage == ShaderStage::Task || stage == ShaderStage::Mesh;
}

}  // namespace

void Program::setShader(const Shader& shader, Where where) {
    ProgramObject* program = configurable(object_, where);
    if (!program) return;
    if (!shader) {
        program->fail(shader.error().at(where));
        return;
    }
    detail::Ref<detail::ShaderObject> added(static_cast<detail::ShaderObject*>(shader.object()));
    const ShaderStage stage = added->source.stage;
    if (!takes(program->type(), stage)) {
        program->fail(
            program->problem(where, ErrorCode::InvalidArgument, "program.stage",
                             fmt::format("a {} takes no {} shader", toString(program->type()), toString(stage))));
        return;
    }
    program->addShader(std::move(added));
}

void Program::setConstant(uint32_t id, int32_t value, Where where) {
    glint::setConstant(object_, {{}, id, Type::Int, std::bit_cast<uint32_t>(value)}, where);
}
void Program::setConstant(uint32_t id, uint32_t value, Where where) {
    glint::setConstant(object_, {{}, id, Type::Uint, value}, where);
}
void Program::setConstant(uint32_t id, float value, Where where) {
    glint::setConstant(object_, {{}, id, Type::Float, std::bit_cast<uint32_t>(value)}, where);
}
void Program::setConstant(uint32_t id, bool value, Where where) {
    glint::setConstant(object_, {{}, id, Type::Bool, value}, where);
}
void Program::setConstant(std::string_view name, int32_t value, Where where) {
    glint::setConstant(object_, {std::string(name), 0, Type::Int, std::bit_cast<uint32_t>(value)}, where);
}
void Program::setConstant(std::string_view name, uint32_t value, Where where) {
    glint::setConstant(object_, {std::string(name), 0, Type::Uint, value}, where);
}
void Program::setConstant(std::string_view name, float value, Where where) {
    glint::setConstant(object_, {std::string(name), 0, Type::Float, std::bit_cast<uint32_t>(value)}, where);
}
void Program::setConstant(std::string_view name, bool value, Where where) {
    glint::setConstant(object_, {std::string(name), 0, Type::Bool, value}, where);
}

Status Program::create(Where where) {
    return object_ ? static_cast<ProgramObject*>(object_)->create(where) : error().at(where);
}

void Program::createAsync(Where where) {
    if (object_) static_cast<ProgramObject*>(object_)->createAsync(where);
}

Status Program::wait(Where where) const {
    if (!object_) return error().at(where);
    auto* program = static_cast<ProgramObject*>(object_);
    program->waitCreated();
    if (program->state() == ObjectState::Building) {
        const Error early =
            program->problem(where, ErrorCode::InvalidArgument, "program.not_created", "wait() before create()");
        program->device()->report(early);
        return early;
    }
    return error();
}

Status Program::reload(bool* changed, Where where) {
    bool replaced = false;
    Status status;
    if (!object_) {
        status = error().at(where);
    } else {
        auto* program = static_cast<ProgramObject*>(object_);
        status = program->reload(replaced, where);
        if (!status && program->state() != ObjectState::Failed) program->device()->report(status.error());
    }
    if (changed) *changed = replaced;
    return status;
}

void Program::setUniformMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Uniform, index, 1, mask, where);
}
void Program::setStorageMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Storage, index, 1, mask, where);
}
void Program::setStorageMasks(uint32_t index, uint32_t count, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Storage, index, count, mask, where);
}
void Program::setTextureMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Texture, index, 1, mask, where);
}
void Program::setTextureMasks(uint32_t index, uint32_t count, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Texture, index, count, mask, where);
}
void Program::setSurfaceMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Surface, index, 1, mask, where);
}
void Program::setSamplerMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Sampler, index, 1, mask, where);
}
void Program::setTracingMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Tracing, index, 1, mask, where);
}
void Program::setTexelMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Texel, index, 1, mask, where);
}

void Program::setTableMask(uint32_t index, Shader::Mask mask, Where where) {
    declareSlots(SlotKind::Table, index, 1, mask, where);
}

uint32_t Program::getSlots(SlotKind kind) const {
    const auto& slots = getLayout().slots;
    return kind < SlotKind::Count ? static_cast<uint32_t>(slots[static_cast<size_t>(kind)].size()) : 0;
}

const BindingLayout& Program::getLayout() const {
    static const BindingLayout empty;
    return *this ? static_cast<const ProgramObject*>(object_)->layout : empty;
}

bool Program::load(const Shader& shader, Where where) {
    setShader(shader, where);
    return static_cast<bool>(shader) && state() == ObjectState::Building;
}

void Program::declareSlots(SlotKind kind, uint32_t first, uint32_t count, ShaderMask mask, Where where) {
    ProgramObject* program = configurable(object_, where);
    if (!program) return;
    if (first > detail::max_slots || count > detail::max_slots - first) {
        program->fail(program->problem(where, ErrorCode::OutOfRange, "program.slots",
                                       fmt::format("{} {} slots from {}, at most {} can be declared", count,
                                                   toString(kind), first, detail::max_slots)));
        return;
    }
    // Slots below the first one may still be declared; until then nobody sees them.
    std::vector<ShaderMask>& masks = program->masks[static_cast<size_t>(kind)];
    masks.resize(std::max<size_t>(masks.size(), first + count), 0);
    std::fill_n(masks.begin() + first, count, mask);
    program->declared[static_cast<size_t>(kind)] = static_cast<int32_t>(masks.size());
}

}  // namespace glint

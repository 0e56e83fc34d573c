#include <glint/device/traversal.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>

#include <algorithm>

namespace glint {

namespace detail {

namespace {

using Group = TraversalDesc::Group;

constexpr size_t hit_table = static_cast<size_t>(RayTable::Hit);

const char* toString(RayTable table) {
    switch (table) {
        case RayTable::Generation: return "ray-generation";
        case RayTable::Miss: return "miss";
        case RayTable::Hit: return "hit";
        case RayTable::Callable: return "callable";
        case RayTable::Count: break;
    }
    return "unknown";
}

RayTable tableOf(ShaderStage stage) {
    switch (stage) {
        case ShaderStage::RayGen: return RayTable::Generation;
        case ShaderStage::RayMiss: return RayTable::Miss;
        case ShaderStage::Callable: return RayTable::Callable;
        default: return RayTable::Hit;
    }
}

uint32_t& memberOf(Group& group, ShaderStage stage) {
    switch (stage) {
        case ShaderStage::Closest: return group.closest;
        case ShaderStage::FirstHit: return group.first_hit;
        case ShaderStage::Intersection: return group.intersection;
        default: return group.general;
    }
}

}  // namespace

void TraversalObject::addShader(Ref<ShaderObject> shader) {
    const ShaderStage stage = shader->source.stage;
    std::vector<Group>& table = groups[static_cast<size_t>(tableOf(stage))];
    if (table.empty() || tableOf(stage) != RayTable::Hit || memberOf(table.back(), stage) != none) table.emplace_back();
    memberOf(table.back(), stage) = static_cast<uint32_t>(shaders.size());
    shaders.push_back(std::move(shader));
}

Error TraversalObject::checkRecords(const Stages& stages, Where where) const {
    const auto recordSize = [&](uint32_t shader) {
        return shader == none ? 0 : stages.shaders[shader]->compiled.reflection.record_size;
    };
    for (size_t t = 0; t < ray_tables; t++)
        for (uint32_t i = 0; i < countRecords(static_cast<RayTable>(t)); i++) {
            const Record* const added = records[t].empty() ? nullptr : &records[t][i];
            const uint32_t index = added ? added->group : i;
            const size_t size = added ? added->data.size() : 0;
            const char* table = toString(static_cast<RayTable>(t));
            if (index >= groups[t].size())
                return problem(
                    where, ErrorCode::OutOfRange, "traversal.record_group",
                    fmt::format("{} record {} is of group {}, there are {}", table, i, index, groups[t].size()));
            const Group& group = groups[t][index];
            const uint32_t needed = std::max({recordSize(group.general), recordSize(group.closest),
                                              recordSize(group.first_hit), recordSize(group.intersection)});
            if (size < needed)
                return problem(where, ErrorCode::InvalidArgument, "traversal.record_size",
                               fmt::format("{} record {} has {} bytes of data, the shaders of its group {} read {}",
                                           table, i, size, index, needed));
        }
    return {};
}

/// False for a miss or callable shader that no call can reach: those with a constant name other records.
bool TraversalObject::isCalled(const Stages& stages, uint32_t shader) const {
    const RayTable table = tableOf(stages.shaders[shader]->source.stage);
    if (table != RayTable::Miss && table != RayTable::Callable) return true;
    const std::vector<Group>& all = groups[static_cast<size_t>(table)];
    const std::vector<Record>& added = records[static_cast<size_t>(table)];
    const auto reaches = [&](uint32_t record) {
        if (record == RayCall::unknown) return true;
        if (record >= countRecords(table)) return false;
        return all[added.empty() ? record : added[record].group].general == shader;
    };
    return std::ranges::any_of(stages.shaders, [&](const Ref<ShaderObject>& caller) {
        return std::ranges::any_of(caller->compiled.reflection.ray_calls, [&](const RayCall& call) {
            return call.is_callable == (table == RayTable::Callable) && reaches(call.record);
        });
    });
}

Error TraversalObject::checkVariables(const Stages& stages, Where where) const {
    using Kind = RayVariable::Kind;
    const uint32_t limit = device()->features().maxAttributeSize;
    const auto forEach = [&](auto visit) {
        for (uint32_t i = 0; i < stages.shaders.size(); i++)
            for (const RayVariable& variable : stages.shaders[i]->compiled.reflection.ray_variables)
                visit(i, stages.shaders[i]->source.stage, variable);
    };
    Error error;
    forEach([&](uint32_t index, ShaderStage stage, const RayVariable& variable) {
        if (error) return;
        if (variable.kind == Kind::Attribute && variable.size > limit)
            error = problem(where, ErrorCode::OutOfRange, "traversal.attribute",
                            fmt::format("hit attribute '{}' of the {} shader has {} bytes, the device takes {}",
                                        variable.name, glint::toString(stage), variable.size, limit));
        const bool is_payload = variable.kind == Kind::IncomingPayload;
        if (!is_payload && variable.kind != Kind::IncomingCallable) return;
        if (!isCalled(stages, index)) return;
        // Which caller it is, shaders decide as they run: there has to be one that fits.
        std::string others;
        bool fits = false;
        forEach([&](uint32_t, ShaderStage caller, const RayVariable& sent) {
            if (sent.kind != (is_payload ? Kind::Payload : Kind::Callable)) return;
            fits |= sent.size == variable.size;
            others += fmt::format("{}'{}' of the {} shader with {}", others.empty() ? "" : ", ", sent.name,
                                  glint::toString(caller), sent.size);
        });
        if (fits || others.empty()) return;
        error = problem(where, ErrorCode::InvalidArgument, "traversal.payload",
                        fmt::format("{} '{}' of the {} shader has {} bytes, which no shader sends: there are {}",
                                    glint::toString(variable.kind), variable.name, glint::toString(stage),
                                    variable.size, others));
    });
    return error;
}

Status TraversalObject::check(const Stages& stages, Where where) const {
    if (groups[static_cast<size_t>(RayTable::Generation)].empty())
        return problem(where, ErrorCode::InvalidArgument, "program.stage", "there is no ray-generation shader");
    if (const uint32_t limit = device()->features().recursionDepth; recursion_depth > limit)
        return problem(where, ErrorCode::Unsupported, "traversal.recursion",
                       fmt::format("recursion depth {}, the device's limit is {}", recursion_depth, limit));
    if (constexpr uint32_t limit = Traversal::max_callable_depth; callable_depth > limit)
        return problem(where, ErrorCode::Unsupported, "traversal.callable_depth",
                       fmt::format("callable depth {}, the limit is {}", callable_depth, limit));
    if (device()->joinsTraversals()) {
        // Two sets of Glint's own follow: the joined kernel's blocks, and the software engine's.
        const TracingHeap* const heap = device()->heap();
        const uint32_t most = (heap ? heap->rewrite().set : device()->features().maxSets) - 1;
        if (layout.set_count > most)
            return problem(where, ErrorCode::OutOfRange, "traversal.set",
                           fmt::format("its shaders have resources in set {}, where pipelines are joined the highest "
                                       "is {}",
                                       layout.set_count - 1, most - 1));
    }
    if (Error error = checkRecords(stages, where)) return error;
    if (Error error = checkVariables(stages, where)) return error;
    return {};
}

Expected<std::unique_ptr<Native>> TraversalObject::createNative(const Stages& stages, Where where) {
    if (Status status = check(stages, where); !status) return unexpected(status.error());
    if (device()->joinsTraversals()) {
        if (Status status = join(stages, where); !status) return unexpected(status.error());
        return std::make_unique<NativeTraversal>();
    }
    TraversalDesc desc;
    for (size_t i = 0; i < stages.shaders.size(); i++) desc.stages.push_back(stages.desc(i));
    for (size_t t = 0; t < ray_tables; t++) {
        const auto first = static_cast<uint32_t>(desc.groups.size());
        desc.groups.insert(desc.groups.end(), groups[t].begin(), groups[t].end());
        for (const Record& record : records[t]) desc.tables[t].push_back({first + record.group, record.data});
        if (!records[t].empty()) continue;
        for (uint32_t i = 0; i < groups[t].size(); i++) desc.tables[t].push_back({first + i, {}});
    }
    desc.layout = &layout;
    desc.recursion_depth = recursion_depth;
    desc.callable_depth = callable_depth;
    desc.name = name();
    auto made = device()->backend->createTraversal(desc);
    if (!made) return unexpected(made.error().at(where).named(name()));
    return std::move(*made);
}

}  // namespace detail

namespace {

using detail::RayTable;
using detail::TraversalObject;

TraversalObject* configurable(detail::Object* object, Program::Where where) {
    auto* traversal = static_cast<TraversalObject*>(object);
    return traversal && traversal->configurable(where) ? traversal : nullptr;
}

uint32_t addRecord(detail::Object* object, RayTable table, uint32_t group, const void* data, uint64_t size,
                   Program::Where where) {
    TraversalObject* traversal = configurable(object, where);
    if (!traversal) return 0;
    // Refused at once: nobody wants a copy of what cannot be.
    if (const uint32_t limit = traversal->device()->features().maxRecordSize; size > limit || (size && !data)) {
        traversal->fail(traversal->problem(where, ErrorCode::OutOfRange, "traversal.record_size",
                                           fmt::format("a record has {} bytes of data at {}, the device takes {}", size,
                                                       data ? "an address" : "a null pointer", limit)));
        return 0;
    }
    const auto* bytes = static_cast<const std::byte*>(data);
    auto& records = traversal->records[static_cast<size_t>(table)];
    records.push_back({group, std::vector<std::byte>(bytes, bytes + size)});
    return static_cast<uint32_t>(records.size() - 1);
}

uint32_t countRecords(detail::Object* object, RayTable table) {
    return object ? static_cast<const TraversalObject*>(object)->countRecords(table) : 0;
}

}  // namespace

Traversal& Traversal::addHitGroup(Where where) {
    if (TraversalObject* traversal = configurable(object_, where)) traversal->groups[detail::hit_table].emplace_back();
    return *this;
}

Traversal& Traversal::setRecursionDepth(uint32_t depth, Where where) {
    if (TraversalObject* traversal = configurable(object_, where)) traversal->recursion_depth = depth;
    return *this;
}

Traversal& Traversal::setCallableDepth(uint32_t depth, Where where) {
    if (TraversalObject* traversal = configurable(object_, where)) traversal->callable_depth = depth;
    return *this;
}

uint32_t Traversal::addHitRecord(uint32_t group, const void* data, uint64_t size, Where where) {
    return addRecord(object_, RayTable::Hit, group, data, size, where);
}
uint32_t Traversal::addMissRecord(uint32_t group, const void* data, uint64_t size, Where where) {
    return addRecord(object_, RayTable::Miss, group, data, size, where);
}
uint32_t Traversal::addCallableRecord(uint32_t group, const void* data, uint64_t size, Where where) {
    return addRecord(object_, RayTable::Callable, group, data, size, where);
}

uint32_t Traversal::getGenerations() const { return countRecords(object_, RayTable::Generation); }
uint32_t Traversal::getHitRecords() const { return countRecords(object_, RayTable::Hit); }
uint32_t Traversal::getMissRecords() const { return countRecords(object_, RayTable::Miss); }
uint32_t Traversal::getCallableRecords() const { return countRecords(object_, RayTable::Callable); }
uint32_t Traversal::getHitGroups() const {
    return object_
               ? static_cast<uint32_t>(static_cast<const TraversalObject*>(object_)->groups[detail::hit_table].size())
               : 0;
}
uint32_t Traversal::getRecursionDepth() const {
    return object_ ? static_cast<const TraversalObject*>(object_)->recursion_depth : 0;
}
uint32_t Traversal::getCallableDepth() const {
    return object_ ? static_cast<const TraversalObject*>(object_)->callable_depth : 0;
}

}  // namespace glint

#include "ray_query_linker.h"

#include "ray_query_library.h"

#include <glint/base/format_error.h>

#include <spirv-tools/libspirv.h>
#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <array>

namespace glint::shader {

namespace {

template <class... Args>
[[noreturn]] void unsupported(fmt::format_string<Args...> format, Args&&... args) {
    throw RewriteRefusal{ErrorCode::Unsupported, "shader.tracing_unsupported",
                         fmt::format(format, std::forward<Args>(args)...)};
}

template <class... Args>
[[noreturn]] void internal(fmt::format_string<Args...> format, Args&&... args) {
    throw RewriteRefusal{ErrorCode::Internal, "shader.tracing_internal",
                         fmt::format(format, std::forward<Args>(args)...)};
}

bool isTracingCapability(uint32_t capability) {
    return capability == spv::CapabilityRayQueryKHR || capability == spv::CapabilityRayQueryProvisionalKHR ||
           capability == spv::CapabilityRayTraversalPrimitiveCullingKHR || capability == spv::CapabilityRayTracingKHR ||
           capability == spv::CapabilityRayTracingProvisionalKHR;
}

bool isTracingExtension(std::string_view name) {
    return name == "SPV_KHR_ray_query" || name == "SPV_KHR_ray_tracing" || name == "SPV_KHR_ray_cull_mask";
}

std::string_view nameOf(uint32_t opcode) { return spvOpcodeString(opcode); }

void addIds(std::unordered_set<uint32_t>& set, const Instruction& instruction) {
    for (const uint16_t place : instruction.ids) set.insert(instruction.words[place]);
}

/// What an acceleration structure's type becomes: a reference, or an array of them. Vulkan has one dimension only.
struct StructureType {
    uint32_t length = 0;  ///< of an array: id of a constant, 0 for a runtime array
    uint64_t count = 1;   ///< references, 0 if that is not known here
    uint32_t plain = 0;   ///< the type without layout, for values: a reference's own
    bool is_array = false;
};

/// Where a pointer to acceleration structures leads in the linked module.
struct StructurePointer {
    uint32_t type = 0;           ///< of what it points to
    uint32_t base = 0;           ///< the pointer in the linked module, 0 for a parameter that is a lone reference
    uint32_t storage_class = 0;  ///< of `base`
    bool is_block = false;       ///< `base` is a block, whose only member is meant
    uint32_t value = 0;          ///< parameters: the value that the caller gave
};

class Linker {
public:
    Linker(SpirvModule user, std::string_view entry, uint32_t execution_model, const SpirvModule& library)
        : user_(chooseEntry(std::move(user), entry, execution_model)),
          version_(std::max(user_.version, library.version)),
          library_module_(library),
          builder_(user_.bound + library.bound),
          library_(library, user_.bound, builder_) {
        alias_.resize(user_.bound);
        for (uint32_t i = 0; i < user_.bound; i++) alias_[i] = i;
    }

    SpirvModule run() {
        linkHeader();
        for (const Instruction& instruction : user_.globals) linkGlobal(instruction);
        for (const Instructions& function : user_.functions) linkFunction(function);
        library_.importPending();
        linkNames();
        finish();
        return std::move(builder_.module);
    }

private:
    /// Leaves one entry point and what it needs.
    static SpirvModule chooseEntry(SpirvModule user, std::string_view entry, uint32_t execution_model) {
        const bool several = user.entry_points.size() > 1;
        std::erase_if(user.entry_points, [&](const Instruction& point) {
            return point.operands()[0] != execution_model || point.text(2) != entry;
        });
        if (user.entry_points.size() != 1) internal("there is no entry point '{}'", entry);
        if (!several) return user;

        const uint32_t root = user.entry_points[0].operands()[1];
        std::erase_if(user.modes, [&](const Instruction& mode) { return mode.operands()[0] != root; });
        std::unordered_map<uint32_t, const Instructions*> functions;
        for (const Instructions& function : user.functions) functions[function[0].result()] = &function;
        std::unordered_set<uint32_t> reached = {root};
        std::vector<uint32_t> open = {root};
        while (!open.empty()) {
            const uint32_t id = open.back();
            open.pop_back();
            for (const Instruction& instruction : *functions.at(id))
                if (instruction.opcode == spv::OpFunctionCall && reached.insert(instruction.operands()[0]).second)
                    open.push_back(instruction.operands()[0]);
        }
        std::erase_if(user.functions, [&](const Instructions& code) { return !reached.contains(code[0].result()); });
        // Variables of other stages may be of kinds that this one must not have.
        std::unordered_set<uint32_t> used;
        addIds(used, user.entry_points[0]);
        for (const Instructions& function : user.functions)
            for (const Instruction& instruction : function) addIds(used, instruction);
        std::erase_if(user.globals, [&](const Instruction& item) {
            return item.opcode == spv::OpVariable && !used.contains(item.result());
        });
        return user;
    }

    // Ids of the user's stay, unless something else stands for what they named.

    uint32_t aliased(uint32_t id) const { return id < alias_.size() ? alias_[id] : id; }

    Instruction aliased(Instruction instruction) const {
        for (const uint16_t place : instruction.ids) instruction.words[place] = aliased(instruction.words[place]);
        return instruction;
    }

    void linkHeader() {
        SpirvModule& result = builder_.module;
        std::unordered_set<uint32_t> capabilities;
        std::unordered_set<std::string_view> extensions;
        std::map<std::string_view, uint32_t> imports;
        for (const SpirvModule* module : {&std::as_const(user_), &library_module_}) {
            for (const Instruction& item : module->capabilities)
                if (!isTracingCapability(item.operands()[0]) && capabilities.insert(item.operands()[0]).second)
                    result.capabilities.push_back(item);
            for (const Instruction& item : module->extensions)
                if (!isTracingExtension(item.text(0)) && extensions.insert(item.text(0)).second)
                    result.extensions.push_back(item);
        }
        for (const Instruction& item : library_module_.imports) {
            imports[item.text(0)] = item.result() + user_.bound;
            result.imports.push_back(item);
            result.imports.back().words[1] += user_.bound;
        }
        for (const Instruction& item : user_.imports) {
            const auto same = imports.find(item.text(0));
            if (same != imports.end())
                alias_[item.result()] = same->second;
            else
                result.imports.push_back(item);
        }
        result.memory_model = user_.memory_model;
        const uint32_t addressing = library_module_.memory_model[0].operands()[0];
        if (addressing != spv::AddressingModelLogical) result.memory_model[0].operands()[0] = addressing;
        result.sources = std::move(user_.sources);
        result.processes = std::move(user_.processes);
        for (const Instruction& item : user_.decorations) addIds(decorated_, item);
    }

    void linkGlobal(const Instruction& original) {
        const uint32_t id = original.result();
        Instruction item = aliased(original);
        switch (item.opcode) {
            case spv::OpTypeRayQueryKHR:
                alias_[id] = library_.queryType();
                queries_[alias_[id]] = 1;
                return;
            case spv::OpTypeAccelerationStructureKHR:
                alias_[id] = library_.referenceType();
                structures_[id] = {.plain = alias_[id]};
                return;
            case spv::OpTypeArray:
            case spv::OpTypeRuntimeArray:
                if (structures_.contains(original.operands()[0])) linkArray(item);
                if (queries_.contains(item.operands()[0])) countQueries(item);
                break;
            case spv::OpTypeStruct:
                for (const uint32_t member : item.operands())
                    if (queries_.contains(member)) unsupported("a ray query is a member of a structure");
                break;
            case spv::OpTypePointer:
                if (item.operands()[0] != spv::StorageClassUniformConstant ||
                    !structures_.contains(original.operands()[1]))
                    break;
                structure_pointers_[id] = original.operands()[1];
                return;
            case spv::OpTypeFunction:
                for (uint32_t& type : item.operands())
                    if (const auto found = structure_pointers_.find(type); found != structure_pointers_.end())
                        type = plainType(found->second);
                break;
            case spv::OpVariable:
                if (const auto found = structure_pointers_.find(item.type()); found != structure_pointers_.end())
                    return linkStructure(id, found->second);
                numberQueries(item, global_numbers_);
                break;
            default: break;
        }
        const bool is_address =
            item.opcode == spv::OpTypePointer && item.operands()[0] == spv::StorageClassPhysicalStorageBuffer;
        if (isSharedType(item.opcode) && !decorated_.contains(id) && !is_address) {
            if (const uint32_t found = builder_.find(item)) {
                alias_[id] = found;
                return;
            }
        }
        builder_.addGlobal(std::move(item));
    }

    // Every query has a number, which the entry point or its function writes to its first member.

    void countQueries(const Instruction& array) {
        const std::optional<uint32_t> length =
            array.opcode == spv::OpTypeArray ? builder_.constantValue(array.operands()[1]) : std::nullopt;
        if (!length || queries_.at(array.operands()[0]) != 1)
            unsupported("an array of ray queries has several dimensions or a length that is not fixed");
        queries_[array.result()] = *length;
        query_arrays_.insert(array.result());
    }

    void numberQueries(const Instruction& variable, Instructions& stores) {
        const std::optional<PointerType> pointer = builder_.pointer(variable.type());
        const auto found = pointer ? queries_.find(pointer->pointee) : queries_.end();
        if (found == queries_.end()) return;
        const uint32_t type = builder_.pointerType(pointer->storage_class, builder_.uintType());
        for (uint32_t i = 0; i < found->second; i++) {
            std::vector<uint32_t> chain = {variable.result()};
            if (query_arrays_.contains(found->first)) chain.push_back(builder_.constant(i));
            chain.push_back(builder_.constant(0));
            const uint32_t place = builder_.newId();
            stores.emplace_back(spv::OpAccessChain, type, place, chain);
            stores.emplace_back(spv::OpStore, 0, 0, std::array{place, builder_.constant(next_number_++)});
        }
    }

    void linkArray(const Instruction& array) {
        StructureType type{.count = 0, .is_array = true};
        if (array.opcode == spv::OpTypeArray) {
            type.length = array.operands()[1];
            // A specialisation constant is no OpConstant.
            type.count = builder_.constantValue(type.length).value_or(0);
        }
        builder_.decorate(array.result(), {spv::DecorationArrayStride, 16});
        structures_[array.result()] = type;
    }

    /// Of a structure's type, by the user's id.
    uint32_t plainType(uint32_t type) {
        StructureType& structure = structures_.at(type);
        if (structure.plain) return structure.plain;
        if (!structure.length) unsupported("a table of acceleration structures is passed to a function");
        structure.plain = builder_.newId();
        builder_.addGlobal(
            Instruction(spv::OpTypeArray, 0, structure.plain, std::array{library_.referenceType(), structure.length}));
        return structure.plain;
    }

    void linkStructure(uint32_t variable, uint32_t type) {
        const uint64_t count = structures_.at(type).count;
        const bool storage = count == 0 || count > max_uniform_references;
        const uint32_t storage_class = storage ? spv::StorageClassStorageBuffer : spv::StorageClassUniform;
        const uint32_t block = builder_.newId();
        builder_.addGlobal(Instruction(spv::OpTypeStruct, 0, block, std::array{aliased(type)}));
        builder_.decorate(block, {spv::DecorationBlock});
        builder_.decorateMember(block, 0, {spv::DecorationOffset, 0});
        if (storage) builder_.decorateMember(block, 0, {spv::DecorationNonWritable});
        builder_.addGlobal(Instruction(spv::OpVariable, builder_.pointerType(storage_class, block), variable,
                                       std::array{storage_class}, 0));
        structure_objects_[variable] = {
            .type = type, .base = variable, .storage_class = storage_class, .is_block = true};
    }

    // One function of the user's.

    void linkFunction(const Instructions& function) {
        body_.clear();
        locals_.clear();
        local_pointers_.clear();
        Instructions stores;
        if (function[0].result() == user_.entry_points[0].operands()[1]) stores = global_numbers_;
        size_t first = 0;
        bool in_head = true;
        for (const Instruction& original : function) {
            Instruction item = aliased(original);
            if (item.opcode == spv::OpFunctionParameter && structure_pointers_.contains(item.type())) {
                linkParameter(item, stores);
                continue;
            }
            if (item.opcode == spv::OpLabel && first == 0) {
                body_.push_back(std::move(item));
                first = body_.size();
                continue;
            }
            if (first != 0 && in_head && item.opcode != spv::OpVariable && item.opcode != spv::OpLine &&
                item.opcode != spv::OpNoLine) {
                in_head = false;
                body_.insert(body_.end(), stores.begin(), stores.end());
            }
            if (item.opcode == spv::OpVariable) numberQueries(item, stores);
            linkInstruction(std::move(item));
        }
        body_.insert(body_.begin() + static_cast<ptrdiff_t>(first), locals_.begin(), locals_.end());
        builder_.module.functions.push_back(std::move(body_));
    }

    uint32_t addLocal(uint32_t type) {
        const uint32_t id = builder_.newId();
        const uint32_t storage_class = spv::StorageClassFunction;
        locals_.emplace_back(spv::OpVariable, builder_.pointerType(storage_class, type), id, std::array{storage_class},
                             0);
        builder_.note(locals_.back());
        return id;
    }

    void emitAs(uint32_t opcode, uint32_t type, uint32_t result, std::span<const uint32_t> operands) {
        body_.emplace_back(opcode, type, result, operands);
        builder_.note(body_.back());
    }

    /// Returns the id of the result.
    uint32_t emit(uint32_t opcode, uint32_t type, std::span<const uint32_t> operands) {
        const uint32_t id = builder_.newId();
        emitAs(opcode, type, id, operands);
        return id;
    }

    uint32_t emitLoad(uint32_t type, uint32_t pointer) { return emit(spv::OpLoad, type, std::array{pointer}); }

    void emitStore(uint32_t pointer, uint32_t value) { emitAs(spv::OpStore, 0, 0, std::array{pointer, value}); }

    /// A structure given to a function goes as the reference itself, for a pointer into a block may not be passed.
    void linkParameter(const Instruction& parameter, Instructions& stores) {
        StructurePointer pointer{.type = structure_pointers_.at(parameter.type()), .value = parameter.result()};
        const uint32_t plain = plainType(pointer.type);
        emitAs(spv::OpFunctionParameter, plain, pointer.value, {});
        if (structures_.at(pointer.type).is_array) {
            // Only a variable can be indexed by one.
            pointer.base = addLocal(plain);
            pointer.storage_class = spv::StorageClassFunction;
            stores.emplace_back(spv::OpStore, 0, 0, std::array{pointer.base, pointer.value});
        }
        local_pointers_[pointer.value] = pointer;
    }

    const StructurePointer* structurePointer(uint32_t id) const {
        if (const auto found = local_pointers_.find(id); found != local_pointers_.end()) return &found->second;
        const auto found = structure_objects_.find(id);
        return found == structure_objects_.end() ? nullptr : &found->second;
    }

    /// A pointer to the reference behind a pointer to a structure, or to element `index` of an array.
    void emitChain(uint32_t opcode, uint32_t id, const StructurePointer& pointer, std::span<const uint32_t> index) {
        std::vector<uint32_t> operands = {pointer.base};
        if (pointer.is_block) operands.push_back(builder_.constant(0));
        operands.insert(operands.end(), index.begin(), index.end());
        emitAs(opcode, builder_.pointerType(pointer.storage_class, library_.referenceType()), id, operands);
    }

    /// The references behind a pointer, as one value of the plain type.
    uint32_t loadReferences(const StructurePointer& pointer) {
        if (pointer.value) return pointer.value;
        const StructureType structure = structures_.at(pointer.type);
        const auto load = [&](std::span<const uint32_t> index) {
            if (!pointer.is_block && index.empty()) return emitLoad(library_.referenceType(), pointer.base);
            const uint32_t place = builder_.newId();
            emitChain(spv::OpAccessChain, place, pointer, index);
            return emitLoad(library_.referenceType(), place);
        };
        if (!structure.is_array) return load({});
        if (structure.count == 0)
            unsupported("an array of acceleration structures whose length is not fixed is passed to a function");
        const uint32_t plain = plainType(pointer.type);
        std::vector<uint32_t> references;
        for (uint32_t i = 0; i < structure.count; i++) references.push_back(load(std::array{builder_.constant(i)}));
        return emit(spv::OpCompositeConstruct, plain, references);
    }

    void linkInstruction(Instruction item) {
        if (const char* name = rayQueryFunction(item.opcode)) return linkQuery(item, name);
        if (item.opcode == spv::OpConvertUToAccelerationStructureKHR) return linkConversion(item);

        bool concerned = structure_pointers_.contains(item.type());
        for (const uint32_t place : item.ids) concerned = concerned || structurePointer(item.words[place]);
        if (concerned) {
            if (!linkStructureUse(item)) unsupported("an acceleration structure is used by Op{}", nameOf(item.opcode));
            return;
        }
        if (nameOf(item.opcode).starts_with("RayQuery"))
            unsupported("Op{} has no counterpart in the software engine", nameOf(item.opcode));
        builder_.note(item);
        body_.push_back(std::move(item));
    }

    /// An instruction with a pointer to acceleration structures among its operands; false if it may have none.
    bool linkStructureUse(const Instruction& item) {
        const std::span<const uint32_t> operands = item.operands();
        switch (item.opcode) {
            case spv::OpLoad: {
                const uint32_t value = loadReferences(*structurePointer(operands[0]));
                emitAs(spv::OpCopyObject, builder_.typeOf(value), item.result(), std::array{value});
                return true;
            }
            case spv::OpCopyObject:
                local_pointers_[item.result()] = StructurePointer(*structurePointer(operands[0]));
                return true;
            case spv::OpAccessChain:
            case spv::OpInBoundsAccessChain: {
                const StructurePointer* pointer = structurePointer(operands[0]);
                if (!pointer || !pointer->base) return false;
                emitChain(item.opcode, item.result(), *pointer, operands.subspan(1));
                local_pointers_[item.result()] = {.type = structure_pointers_.at(item.type()),
                                                  .base = item.result(),
                                                  .storage_class = pointer->storage_class};
                return true;
            }
            case spv::OpFunctionCall: {
                std::vector<uint32_t> arguments(operands.begin(), operands.end());
                for (uint32_t& argument : std::span(arguments).subspan(1))
                    if (const StructurePointer* pointer = structurePointer(argument))
                        argument = loadReferences(*pointer);
                emitAs(item.opcode, item.type(), item.result(), arguments);
                return true;
            }
            // Debug information about a parameter that is a pointer no longer.
            case spv::OpExtInst: return true;
            default: return false;
        }
    }

    void linkConversion(const Instruction& item) {
        const uint32_t value = item.operands()[0], reference = library_.referenceType();
        const bool converted = builder_.typeOf(value) == reference;
        emitAs(converted ? spv::OpCopyObject : spv::OpBitcast, reference, item.result(), std::array{value});
    }

    void linkQuery(const Instruction& item, const char* name) {
        const LibraryFunction& function = library_.function(name);
        const std::span<const uint32_t> operands = item.operands();

        // A pointer into something larger may not be passed.
        uint32_t query = operands[0];
        const std::optional<PointerType> pointer = builder_.pointer(builder_.typeOf(query));
        if (!pointer || pointer->pointee != library_.queryType()) unsupported("Op{} has no query", nameOf(item.opcode));
        uint32_t storage_class = pointer->storage_class;
        const bool copied = !builder_.isObject(query);
        if (copied) {
            query = addLocal(library_.queryType());
            storage_class = spv::StorageClassFunction;
            emitStore(query, emitLoad(library_.queryType(), operands[0]));
        }

        std::vector<uint32_t> values(operands.begin() + 1, operands.end());
        if (item.opcode == spv::OpRayQueryInitializeKHR) {
            const uint32_t uint_type = builder_.uintType();
            const uint32_t place = emit(spv::OpAccessChain, builder_.pointerType(storage_class, uint_type),
                                        std::array{query, builder_.constant(0)});
            values.insert(values.begin(), emitLoad(uint_type, place));
        }
        if (function.parameters.size() != values.size() + 1)
            internal("{} has {} parameters, not {}", name, function.parameters.size(), values.size() + 1);
        std::vector<uint32_t> arguments = {library_.import(function, storage_class), query};
        for (size_t i = 0; i < values.size(); i++)
            arguments.push_back(converted(values[i], function.parameters[i + 1]));
        if (!item.has_result) {
            // A call has a result in any case.
            emit(spv::OpFunctionCall, function.return_type, arguments);
        } else if (item.type() == function.return_type) {
            emitAs(spv::OpFunctionCall, item.type(), item.result(), arguments);
        } else {
            const uint32_t value = emit(spv::OpFunctionCall, function.return_type, arguments);
            emitAs(spv::OpBitcast, item.type(), item.result(), std::array{value});
        }
        if (copied) emitStore(operands[0], emitLoad(library_.queryType(), query));
    }

    /// An operand as the library's parameter wants it.
    uint32_t converted(uint32_t value, uint32_t type) {
        const uint32_t from = builder_.typeOf(value);
        if (from == type) return value;
        if (const std::optional<PointerType> pointer = builder_.pointer(type)) {
            // A parameter that is not const: the compiler passes the place of a copy.
            const uint32_t copy = addLocal(pointer->pointee);
            emitStore(copy, converted(value, pointer->pointee));
            return copy;
        }
        if (type == builder_.boolType()) {
            // Which intersection is meant, the committed one or the candidate, is a constant.
            const std::optional<uint32_t> constant = builder_.constantValue(value);
            if (constant) return builder_.shared(*constant ? spv::OpConstantTrue : spv::OpConstantFalse, type, {});
            return emit(spv::OpINotEqual, type, std::array{value, builder_.shared(spv::OpConstant, from, {0}, 0)});
        }
        if (from == library_.referenceType()) {
            body_.emplace_back(spv::OpCompositeExtract, type, builder_.newId(), std::array{value, 0u}, 1);
            builder_.note(body_.back());
            return body_.back().result();
        }
        return emit(spv::OpBitcast, type, std::array{value});
    }

    // What remains.

    void linkNames() {
        SpirvModule& result = builder_.module;
        for (const Instruction& item : user_.names)
            if (aliased(item.operands()[0]) == item.operands()[0]) result.names.push_back(item);
        for (const Instruction& item : user_.decorations)
            if (aliased(item.operands()[0]) == item.operands()[0]) result.decorations.push_back(aliased(item));
        for (const Instruction& item : user_.modes) result.modes.push_back(aliased(item));
    }

    void finish() {
        SpirvModule& result = builder_.module;
        Instruction entry = aliased(user_.entry_points[0]);
        for (const Instruction& variable : library_.sweep()) {
            // Up to SPIR-V 1.3 entry points list inputs and outputs, from 1.4 on all variables.
            const uint32_t storage_class = variable.operands()[0];
            if (version_ < 0x10400 && storage_class != spv::StorageClassInput) continue;
            entry.ids.push_back(static_cast<uint16_t>(entry.words.size()));
            entry.words.push_back(variable.result());
        }
        result.entry_points = {std::move(entry)};

        // What is said about ids that have gone.
        std::unordered_set<uint32_t> defined;
        for (const Instructions* part : {&std::as_const(result.globals), &std::as_const(result.decorations)})
            for (const Instruction& item : *part) defined.insert(item.result());
        for (const Instructions& function : result.functions)
            for (const Instruction& instruction : function) defined.insert(instruction.result());
        const auto lost = [&](const Instruction& item) {
            return !item.has_result && !defined.contains(item.operands()[0]);
        };
        std::erase_if(result.names, lost);
        std::erase_if(result.decorations, lost);
        result.version = version_;
        result.bound = builder_.bound();
    }

    SpirvModule user_;
    const uint32_t version_;
    const SpirvModule& library_module_;
    SpirvBuilder builder_;
    RayQueryLibrary library_;
    std::vector<uint32_t> alias_;             ///< what stands for each of the user's ids
    std::unordered_set<uint32_t> decorated_;  ///< by the user's module

    std::unordered_map<uint32_t, uint32_t> queries_;  ///< types of queries, and how many: more than 1 in arrays
    std::unordered_set<uint32_t> query_arrays_;
    uint32_t next_number_ = 0;
    Instructions global_numbers_;
    std::unordered_map<uint32_t, StructureType> structures_;            ///< by the user's type
    std::unordered_map<uint32_t, uint32_t> structure_pointers_;         ///< type of a pointer to what it points to
    std::unordered_map<uint32_t, StructurePointer> structure_objects_;  ///< variables of the module
    std::unordered_map<uint32_t, StructurePointer> local_pointers_;     ///< of the function that is being linked
    Instructions body_;
    Instructions locals_;
};

}  // namespace

uint32_t countRayQueries(const SpirvModule& module) {
    std::unordered_map<uint32_t, uint32_t> constants, counts;  // of arrays and of what pointers point to, too
    uint32_t sum = 0;
    const auto visit = [&](const Instruction& item) {
        switch (item.opcode) {
            case spv::OpConstant: constants[item.result()] = item.operands()[0]; break;
            case spv::OpTypeRayQueryKHR: counts[item.result()] = 1; break;
            case spv::OpTypeArray:
                if (counts.contains(item.operands()[0])) counts[item.result()] = constants[item.operands()[1]];
                break;
            case spv::OpTypePointer:
                if (counts.contains(item.operands()[1])) counts[item.result()] = counts[item.operands()[1]];
                break;
            case spv::OpVariable:
                if (counts.contains(item.type())) sum += counts[item.type()];
                break;
            default: break;
        }
    };
    for (const Instruction& item : module.globals) visit(item);
    for (const Instructions& function : module.functions)
        for (const Instruction& item : function) visit(item);
    return sum;
}

Expected<SpirvModule> linkRayQueries(SpirvModule user, std::string_view entry, uint32_t execution_model,
                                     const SpirvModule& library) {
    try {
        return Linker(std::move(user), entry, execution_model, library).run();
    } catch (const RewriteRefusal& refusal) {
        return unexpected(makeError(refusal.code, refusal.id, "{}", refusal.message));
    }
}

}  // namespace glint::shader

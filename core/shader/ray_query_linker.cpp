#include "ray_query_linker.h"

#include <glint/base/format_error.h>

#include <spirv-tools/libspirv.h>
#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <string>
#include <unordered_map>
#include <unordered_set>

namespace glint::shader {

namespace {

/// What stops the linking; turned into an error before it leaves this file.
struct Refusal {
    ErrorCode code;
    const char* id;
    std::string message;
};

template <class... Args>
[[noreturn]] void unsupported(fmt::format_string<Args...> format, Args&&... args) {
    throw Refusal{ErrorCode::Unsupported, "shader.tracing_unsupported",
                  fmt::format(format, std::forward<Args>(args)...)};
}

template <class... Args>
[[noreturn]] void internal(fmt::format_string<Args...> format, Args&&... args) {
    throw Refusal{ErrorCode::Internal, "shader.tracing_internal", fmt::format(format, std::forward<Args>(args)...)};
}

/// The library's function for an instruction; its parameters are the instruction's operands. Null for any other.
const char* functionFor(uint16_t opcode) {
    switch (opcode) {
        case spv::OpRayQueryInitializeKHR: return "glintRayQueryInitialize";
        case spv::OpRayQueryTerminateKHR: return "glintRayQueryTerminate";
        case spv::OpRayQueryGenerateIntersectionKHR: return "glintRayQueryGenerateIntersection";
        case spv::OpRayQueryConfirmIntersectionKHR: return "glintRayQueryConfirmIntersection";
        case spv::OpRayQueryProceedKHR: return "glintRayQueryProceed";
        case spv::OpRayQueryGetIntersectionTypeKHR: return "glintRayQueryGetIntersectionType";
        case spv::OpRayQueryGetRayTMinKHR: return "glintRayQueryGetRayTMin";
        case spv::OpRayQueryGetRayFlagsKHR: return "glintRayQueryGetRayFlags";
        case spv::OpRayQueryGetIntersectionTKHR: return "glintRayQueryGetIntersectionT";
        case spv::OpRayQueryGetIntersectionInstanceCustomIndexKHR:
            return "glintRayQueryGetIntersectionInstanceCustomIndex";
        case spv::OpRayQueryGetIntersectionInstanceIdKHR: return "glintRayQueryGetIntersectionInstanceId";
        case spv::OpRayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetKHR:
            return "glintRayQueryGetIntersectionInstanceShaderBindingTableRecordOffset";
        case spv::OpRayQueryGetIntersectionGeometryIndexKHR: return "glintRayQueryGetIntersectionGeometryIndex";
        case spv::OpRayQueryGetIntersectionPrimitiveIndexKHR: return "glintRayQueryGetIntersectionPrimitiveIndex";
        case spv::OpRayQueryGetIntersectionBarycentricsKHR: return "glintRayQueryGetIntersectionBarycentrics";
        case spv::OpRayQueryGetIntersectionFrontFaceKHR: return "glintRayQueryGetIntersectionFrontFace";
        case spv::OpRayQueryGetIntersectionCandidateAABBOpaqueKHR:
            return "glintRayQueryGetIntersectionCandidateAABBOpaque";
        case spv::OpRayQueryGetIntersectionObjectRayDirectionKHR:
            return "glintRayQueryGetIntersectionObjectRayDirection";
        case spv::OpRayQueryGetIntersectionObjectRayOriginKHR: return "glintRayQueryGetIntersectionObjectRayOrigin";
        case spv::OpRayQueryGetWorldRayDirectionKHR: return "glintRayQueryGetWorldRayDirection";
        case spv::OpRayQueryGetWorldRayOriginKHR: return "glintRayQueryGetWorldRayOrigin";
        case spv::OpRayQueryGetIntersectionObjectToWorldKHR: return "glintRayQueryGetIntersectionObjectToWorld";
        case spv::OpRayQueryGetIntersectionWorldToObjectKHR: return "glintRayQueryGetIntersectionWorldToObject";
        default: return nullptr;
    }
}

bool isTracingCapability(uint32_t capability) {
    return capability == spv::CapabilityRayQueryKHR || capability == spv::CapabilityRayQueryProvisionalKHR ||
           capability == spv::CapabilityRayTraversalPrimitiveCullingKHR || capability == spv::CapabilityRayTracingKHR ||
           capability == spv::CapabilityRayTracingProvisionalKHR;
}

bool isTracingExtension(std::string_view name) {
    return name == "SPV_KHR_ray_query" || name == "SPV_KHR_ray_tracing" || name == "SPV_KHR_ray_cull_mask";
}

/// Types of which a module may have one alike only, and those that have to be the same in a call and its callee.
bool isShared(uint16_t opcode) {
    switch (opcode) {
        case spv::OpTypeVoid:
        case spv::OpTypeBool:
        case spv::OpTypeInt:
        case spv::OpTypeFloat:
        case spv::OpTypeVector:
        case spv::OpTypeMatrix:
        case spv::OpTypeImage:
        case spv::OpTypeSampler:
        case spv::OpTypeSampledImage:
        case spv::OpTypePointer:
        case spv::OpTypeFunction: return true;
        default: return false;
    }
}

/// An acceleration structure's type after linking: a reference, or an array of them.
struct StructureType {
    uint32_t element = 0;  ///< of an array
    uint32_t length = 0;   ///< of an array: id of a constant, 0 for a runtime array
    uint64_t count = 1;    ///< references in all, 0 if that is not known here
    uint32_t plain = 0;    ///< the type without layout, for values; the same as the type itself for one reference
};

/// Where a pointer to acceleration structures leads in the linked module.
struct StructurePointer {
    uint32_t type = 0;           ///< of what it points to
    uint32_t base = 0;           ///< the pointer in the linked module, 0 for a parameter that is the reference itself
    uint32_t storage_class = 0;  ///< of `base`
    bool is_block = false;       ///< `base` is a block, whose only member is meant
    uint32_t value = 0;          ///< parameters: the value that the caller gave
};

struct PointerType {
    uint32_t storage_class = 0;
    uint32_t pointee = 0;
};

struct LibraryFunction {
    const Instructions* code = nullptr;
    uint32_t return_type = 0;
    std::vector<uint32_t> parameters;  ///< their types
};

class Linker {
public:
    Linker(SpirvModule user, const SpirvModule& library) : user_(std::move(user)), library_(library) {}

    SpirvModule run(std::string_view entry, uint32_t execution_model) {
        chooseEntry(entry, execution_model);
        next_ = user_.bound + library_.bound;
        alias_.resize(user_.bound);
        for (uint32_t i = 0; i < user_.bound; i++) alias_[i] = i;
        readLibrary();
        linkHeader();
        for (const Instruction& instruction : user_.globals) linkGlobal(instruction);
        for (const Instructions& function : user_.functions) linkFunction(function);
        while (!pending_.empty()) {
            const Import import = pending_.front();
            pending_.pop_front();
            importFunction(import);
        }
        linkNames();
        sweep();
        result_.version = std::max(user_.version, library_.version);
        result_.bound = next_;
        return std::move(result_);
    }

private:
    using Key = std::vector<uint32_t>;

    struct Import {
        uint32_t function = 0;  ///< the library's id
        uint32_t storage_class = 0;
        uint32_t id = 0;  ///< in the linked module
    };

    // The user's entry point, and what belongs to it.

    void chooseEntry(std::string_view entry, uint32_t execution_model) {
        const bool several = user_.entry_points.size() > 1;
        std::erase_if(user_.entry_points, [&](const Instruction& point) {
            return point.operands()[0] != execution_model || point.text(2) != entry;
        });
        if (user_.entry_points.size() != 1) internal("there is no entry point '{}'", entry);
        if (!several) return;

        const uint32_t root = user_.entry_points[0].operands()[1];
        std::erase_if(user_.modes, [&](const Instruction& mode) { return mode.operands()[0] != root; });
        std::unordered_map<uint32_t, const Instructions*> functions;
        for (const Instructions& function : user_.functions) functions[function[0].result()] = &function;
        std::unordered_set<uint32_t> reached = {root};
        std::vector<uint32_t> open = {root};
        while (!open.empty()) {
            const uint32_t id = open.back();
            open.pop_back();
            for (const Instruction& instruction : *functions.at(id))
                if (instruction.opcode == spv::OpFunctionCall && reached.insert(instruction.operands()[0]).second)
                    open.push_back(instruction.operands()[0]);
        }
        std::erase_if(user_.functions, [&](const Instructions& code) { return !reached.contains(code[0].result()); });
        // Variables of other stages may be of kinds that this one must not have.
        std::unordered_set<uint32_t> used;
        for (const Instruction& point : user_.entry_points) addIds(used, point);
        for (const Instructions& function : user_.functions)
            for (const Instruction& instruction : function) addIds(used, instruction);
        std::erase_if(user_.globals, [&](const Instruction& item) {
            return item.opcode == spv::OpVariable && !used.contains(item.result());
        });
    }

    static void addIds(std::unordered_set<uint32_t>& set, const Instruction& instruction) {
        for (const uint16_t place : instruction.ids) set.insert(instruction.words[place]);
    }

    // The library: its ids follow the user's.

    uint32_t moved(uint32_t library_id) const { return library_id + user_.bound; }

    Instruction moved(const Instruction& instruction) const {
        Instruction result = instruction;
        for (const uint16_t place : result.ids) result.words[place] += user_.bound;
        return result;
    }

    void readLibrary() {
        for (const Instruction& name : library_.names)
            if (name.opcode == spv::OpName) {
                const std::string_view text = name.text(1);
                library_names_.emplace(text.substr(0, text.find('(')), name.operands()[0]);
            }
        for (const Instruction& item : library_.decorations) library_notes_[item.operands()[0]].push_back(&item);
        for (const Instruction& item : library_.names) library_notes_[item.operands()[0]].push_back(&item);
        for (const Instructions& code : library_.functions) {
            LibraryFunction& function = library_functions_[code[0].result()];
            function.code = &code;
            function.return_type = moved(code[0].type());
            for (const Instruction& instruction : code)
                if (instruction.opcode == spv::OpFunctionParameter)
                    function.parameters.push_back(moved(instruction.type()));
        }
        for (const Instruction& item : library_.globals) addGlobal(moved(item));
        library_globals_ = result_.globals.size();

        const LibraryFunction& initialize = libraryFunction("glintRayQueryInitialize").second;
        if (initialize.parameters.size() != 8) internal("glintRayQueryInitialize does not have 8 parameters");
        query_type_ = pointers_.contains(initialize.parameters[0]) ? pointers_[initialize.parameters[0]].pointee : 0;
        reference_type_ = initialize.parameters[1];
        if (!query_type_) internal("the first parameter of glintRayQueryInitialize is not inout");
        uint_type_ = shared(spv::OpTypeInt, 0, {32, 0}, 0);
        bool_type_ = shared(spv::OpTypeBool, 0, {});
        if (reference_type_ != shared(spv::OpTypeVector, 0, {uint_type_, 2}, 1))
            internal("the second parameter of glintRayQueryInitialize is not a const uvec2");
    }

    std::pair<uint32_t, const LibraryFunction&> libraryFunction(std::string_view name) const {
        const auto found = library_names_.find(name);
        const auto function =
            found == library_names_.end() ? library_functions_.end() : library_functions_.find(found->second);
        if (function == library_functions_.end()) internal("the library has no function {}", name);
        return {function->first, function->second};
    }

    // Types and constants.

    static Key keyOf(const Instruction& item) {
        Key key = {item.opcode, item.type()};
        key.insert(key.end(), item.operands().begin(), item.operands().end());
        return key;
    }

    void addGlobal(Instruction item) {
        if (isShared(item.opcode) || item.opcode == spv::OpConstant || item.opcode == spv::OpConstantTrue ||
            item.opcode == spv::OpConstantFalse)
            shared_.emplace(keyOf(item), item.result());
        if (item.opcode == spv::OpTypePointer) pointers_[item.result()] = {item.operands()[0], item.operands()[1]};
        if (item.opcode == spv::OpConstant || item.opcode == spv::OpSpecConstant)
            constants_[item.result()] = item.operands()[0];
        if (item.opcode == spv::OpSpecConstant) specialized_.insert(item.result());
        noteResult(item);
        result_.globals.push_back(std::move(item));
    }

    void noteResult(const Instruction& item) {
        if (item.has_type) types_[item.result()] = item.type();
        if (item.opcode == spv::OpVariable || item.opcode == spv::OpFunctionParameter) objects_.insert(item.result());
    }

    /// The type or constant of this description, made if there is none.
    uint32_t sharedOf(uint32_t opcode, uint32_t type, std::span<const uint32_t> operands,
                      size_t literals_from = SIZE_MAX) {
        const Instruction item(opcode, type, next_, operands, literals_from);
        if (const auto found = shared_.find(keyOf(item)); found != shared_.end()) return found->second;
        addGlobal(item);
        return next_++;
    }
    uint32_t shared(uint32_t opcode, uint32_t type, std::initializer_list<uint32_t> operands,
                    size_t literals_from = SIZE_MAX) {
        return sharedOf(opcode, type, std::span(operands.begin(), operands.size()), literals_from);
    }

    uint32_t pointerType(uint32_t storage_class, uint32_t pointee) {
        // The storage class is a literal before an id, which the constructor's rule does not cover.
        Instruction item(spv::OpTypePointer, 0, next_, std::array{storage_class, pointee});
        item.ids = {1, 3};
        if (const auto found = shared_.find(keyOf(item)); found != shared_.end()) return found->second;
        addGlobal(std::move(item));
        return next_++;
    }

    uint32_t constant(uint32_t value) { return shared(spv::OpConstant, uint_type_, {value}, 0); }

    void decorate(uint32_t target, std::initializer_list<uint32_t> words) {
        std::vector<uint32_t> operands = {target};
        operands.insert(operands.end(), words);
        added_decorations_.emplace_back(spv::OpDecorate, 0, 0, operands, 1);
    }

    void decorateMember(uint32_t target, uint32_t member, std::initializer_list<uint32_t> words) {
        std::vector<uint32_t> operands = {target, member};
        operands.insert(operands.end(), words);
        added_decorations_.emplace_back(spv::OpMemberDecorate, 0, 0, operands, 1);
    }

    // The user's module.

    uint32_t aliased(uint32_t id) const { return id < alias_.size() ? alias_[id] : id; }

    Instruction aliased(Instruction instruction) const {
        for (const uint16_t place : instruction.ids) instruction.words[place] = aliased(instruction.words[place]);
        return instruction;
    }

    void linkHeader() {
        std::unordered_set<uint32_t> capabilities;
        std::unordered_set<std::string_view> extensions;
        std::map<std::string_view, uint32_t> imports;
        for (const SpirvModule* module : {&std::as_const(user_), &library_}) {
            for (const Instruction& item : module->capabilities)
                if (!isTracingCapability(item.operands()[0]) && capabilities.insert(item.operands()[0]).second)
                    result_.capabilities.push_back(item);
            for (const Instruction& item : module->extensions)
                if (!isTracingExtension(item.text(0)) && extensions.insert(item.text(0)).second)
                    result_.extensions.push_back(item);
        }
        for (const Instruction& item : library_.imports) {
            imports[item.text(0)] = moved(item.result());
            result_.imports.push_back(moved(item));
        }
        for (const Instruction& item : user_.imports) {
            const auto same = imports.find(item.text(0));
            if (same != imports.end())
                alias_[item.result()] = same->second;
            else
                result_.imports.push_back(item);
        }
        result_.memory_model = user_.memory_model;
        if (library_.memory_model[0].operands()[0] != spv::AddressingModelLogical)
            result_.memory_model[0].operands()[0] = library_.memory_model[0].operands()[0];
        result_.sources = std::move(user_.sources);
        result_.processes = std::move(user_.processes);
        for (const Instruction& item : user_.decorations) addIds(decorated_, item);
    }

    void linkGlobal(const Instruction& original) {
        const uint32_t id = original.result();
        Instruction item = aliased(original);
        switch (item.opcode) {
            case spv::OpTypeRayQueryKHR: alias_[id] = query_type_; return;
            case spv::OpTypeAccelerationStructureKHR:
                alias_[id] = reference_type_;
                structures_[reference_type_] = {.plain = reference_type_};
                user_structures_.insert(id);
                return;
            case spv::OpTypeArray:
            case spv::OpTypeRuntimeArray:
                if (user_structures_.contains(original.operands()[0])) linkArray(item);
                break;
            case spv::OpTypePointer:
                if (item.operands()[0] == spv::StorageClassUniformConstant &&
                    user_structures_.contains(original.operands()[1])) {
                    structure_pointers_[id] = item.operands()[1];
                    return;
                }
                break;
            case spv::OpTypeFunction:
                for (uint32_t& type : item.operands())
                    if (const auto found = structure_pointers_.find(type); found != structure_pointers_.end())
                        type = plainType(found->second);
                break;
            case spv::OpVariable:
                if (const auto found = structure_pointers_.find(item.type()); found != structure_pointers_.end())
                    return linkStructure(item, found->second);
                break;
            default: break;
        }
        if (isShared(item.opcode) && !decorated_.contains(id) &&
            !(item.opcode == spv::OpTypePointer && item.operands()[0] == spv::StorageClassPhysicalStorageBuffer)) {
            if (const auto found = shared_.find(keyOf(item)); found != shared_.end()) {
                alias_[id] = found->second;
                return;
            }
        }
        addGlobal(std::move(item));
    }

    void linkArray(const Instruction& array) {
        const std::span<const uint32_t> operands = array.operands();
        const uint64_t inner = structures_.at(operands[0]).count;
        StructureType type{.element = operands[0]};
        if (inner == 0)
            unsupported("an array of acceleration structures has inner arrays of a length "
                        "that a specialisation constant sets, or none");
        if (array.opcode == spv::OpTypeArray) {
            type.length = operands[1];
            const auto length = constants_.find(type.length);
            const bool fixed = length != constants_.end() && !specialized_.contains(type.length);
            type.count = fixed ? inner * length->second : 0;
        } else {
            type.count = 0;
        }
        decorate(array.result(), {spv::DecorationArrayStride, static_cast<uint32_t>(16 * inner)});
        structures_[array.result()] = type;
        user_structures_.insert(array.result());
    }

    uint32_t plainType(uint32_t type) {
        StructureType& structure = structures_.at(type);
        if (structure.plain) return structure.plain;
        if (!structure.length)
            unsupported("an array of acceleration structures without length is passed to a function");
        const uint32_t element = plainType(structure.element);
        const uint32_t id = next_++;
        addGlobal(Instruction(spv::OpTypeArray, 0, id, std::array{element, structure.length}));
        return structures_.at(type).plain = id;
    }

    void linkStructure(const Instruction& variable, uint32_t type) {
        const uint64_t count = structures_.at(type).count;
        const bool storage = count == 0 || count > max_uniform_references;
        const uint32_t storage_class = storage ? spv::StorageClassStorageBuffer : spv::StorageClassUniform;
        const uint32_t block = next_++;
        addGlobal(Instruction(spv::OpTypeStruct, 0, block, std::array{type}));
        decorate(block, {spv::DecorationBlock});
        decorateMember(block, 0, {spv::DecorationOffset, 0});
        if (storage) decorateMember(block, 0, {spv::DecorationNonWritable});
        const uint32_t id = variable.result();
        addGlobal(Instruction(spv::OpVariable, pointerType(storage_class, block), id, std::array{storage_class}, 0));
        structure_objects_[id] = {.type = type, .base = id, .storage_class = storage_class, .is_block = true};
    }

    // One function of the user's.

    void linkFunction(const Instructions& function) {
        body_.clear();
        locals_.clear();
        Instructions stores;
        local_pointers_.clear();
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
            linkInstruction(std::move(item), original);
        }
        body_.insert(body_.begin() + static_cast<ptrdiff_t>(first), locals_.begin(), locals_.end());
        result_.functions.push_back(std::move(body_));
    }

    uint32_t addLocal(uint32_t type) {
        const uint32_t id = next_++;
        locals_.emplace_back(spv::OpVariable, pointerType(spv::StorageClassFunction, type), id,
                             std::array{uint32_t(spv::StorageClassFunction)}, 0);
        noteResult(locals_.back());
        return id;
    }

    uint32_t emitOf(uint32_t opcode, uint32_t type, std::span<const uint32_t> operands) {
        const uint32_t id = type ? next_++ : 0;
        body_.emplace_back(opcode, type, id, operands);
        noteResult(body_.back());
        return id;
    }
    uint32_t emit(uint32_t opcode, uint32_t type, std::initializer_list<uint32_t> operands) {
        return emitOf(opcode, type, std::span(operands.begin(), operands.size()));
    }

    /// A structure given to a function goes as the reference itself, for a pointer into a block may not be passed.
    void linkParameter(const Instruction& parameter, Instructions& stores) {
        const uint32_t type = structure_pointers_.at(parameter.type());
        const uint32_t id = parameter.result();
        const uint32_t plain = plainType(type);
        body_.emplace_back(spv::OpFunctionParameter, plain, id, std::span<const uint32_t>());
        types_[id] = plain;
        StructurePointer pointer{.type = type, .value = id};
        if (structures_.at(type).element) {
            // Only a variable can be indexed by one.
            pointer.base = addLocal(plain);
            pointer.storage_class = spv::StorageClassFunction;
            stores.emplace_back(spv::OpStore, 0, 0, std::array{pointer.base, id});
        }
        local_pointers_[id] = pointer;
    }

    const StructurePointer* structurePointer(uint32_t id) const {
        if (const auto found = local_pointers_.find(id); found != local_pointers_.end()) return &found->second;
        const auto found = structure_objects_.find(id);
        return found == structure_objects_.end() ? nullptr : &found->second;
    }

    /// What a pointer with this storage class points to for a type: values in functions have no layout.
    uint32_t storedType(uint32_t storage_class, uint32_t type) {
        return storage_class == spv::StorageClassFunction ? plainType(type) : type;
    }

    uint32_t chainTo(const StructurePointer& pointer, std::span<const uint32_t> indices, uint32_t type) {
        std::vector<uint32_t> operands = {pointer.base};
        if (pointer.is_block) operands.push_back(constant(0));
        operands.insert(operands.end(), indices.begin(), indices.end());
        if (operands.size() == 1) return pointer.base;
        return emitOf(spv::OpAccessChain, pointerType(pointer.storage_class, storedType(pointer.storage_class, type)),
                      operands);
    }

    /// The references behind a pointer, as one value of the plain type.
    uint32_t loadReferences(const StructurePointer& pointer, uint32_t type, std::vector<uint32_t>& indices) {
        if (pointer.value && indices.empty()) return pointer.value;
        const StructureType structure = structures_.at(type);
        if (!structure.element) return emit(spv::OpLoad, reference_type_, {chainTo(pointer, indices, type)});
        if (structure.count == 0)
            unsupported("an array of acceleration structures whose length is not constant is passed to a function");
        const uint32_t plain = plainType(type);
        std::vector<uint32_t> parts;
        const uint64_t length = structure.count / structures_.at(structure.element).count;
        for (uint32_t i = 0; i < length; i++) {
            indices.push_back(constant(i));
            parts.push_back(loadReferences(pointer, structure.element, indices));
            indices.pop_back();
        }
        return emitOf(spv::OpCompositeConstruct, plain, parts);
    }

    void linkInstruction(Instruction item, const Instruction& original) {
        if (const char* name = functionFor(item.opcode)) return linkQuery(item, name);
        if (item.opcode == spv::OpConvertUToAccelerationStructureKHR) return linkConversion(item);

        bool concerned = structure_pointers_.contains(item.type());
        for (const uint32_t place : item.ids) concerned = concerned || structurePointer(item.words[place]);
        if (concerned && !linkStructureUse(item, original))
            unsupported("an acceleration structure is used by {}", nameOf(item.opcode));
        if (concerned) return;
        if (nameOf(item.opcode).starts_with("OpRayQuery") || item.opcode == spv::OpTraceRayKHR)
            unsupported("{} has no counterpart in the software engine", nameOf(item.opcode));
        noteResult(item);
        body_.push_back(std::move(item));
    }

    /// An instruction with a pointer to acceleration structures among its operands.
    bool linkStructureUse(Instruction& item, const Instruction& original) {
        const std::span<const uint32_t> operands = item.operands();
        switch (item.opcode) {
            case spv::OpLoad: {
                const StructurePointer& pointer = *structurePointer(operands[0]);
                std::vector<uint32_t> none;
                const uint32_t value = loadReferences(pointer, pointer.type, none);
                body_.emplace_back(spv::OpCopyObject, typeOf(value), item.result(), std::array{value});
                noteResult(body_.back());
                return true;
            }
            case spv::OpCopyObject: alias_[original.result()] = operands[0]; return true;
            case spv::OpAccessChain:
            case spv::OpInBoundsAccessChain: {
                const StructurePointer* found = structurePointer(operands[0]);
                if (!found || !found->base) return false;
                const StructurePointer pointer = *found;
                StructurePointer made{.type = structure_pointers_.at(item.type()), .base = item.result()};
                made.storage_class = pointer.storage_class;
                const uint32_t type = pointerType(made.storage_class, storedType(made.storage_class, made.type));
                std::vector<uint32_t> indices = {pointer.base};
                if (pointer.is_block) indices.push_back(constant(0));
                indices.insert(indices.end(), operands.begin() + 1, operands.end());
                local_pointers_[item.result()] = made;
                body_.emplace_back(item.opcode, type, item.result(), indices);
                return true;
            }
            case spv::OpFunctionCall: {
                std::vector<uint32_t> arguments(operands.begin(), operands.end());
                for (uint32_t& argument : std::span(arguments).subspan(1)) {
                    const StructurePointer* pointer = structurePointer(argument);
                    std::vector<uint32_t> none;
                    if (pointer) argument = loadReferences(StructurePointer(*pointer), pointer->type, none);
                }
                body_.emplace_back(item.opcode, item.type(), item.result(), arguments);
                noteResult(body_.back());
                return true;
            }
            // Debug information about a parameter that is a pointer no longer.
            case spv::OpExtInst: return true;
            default: return false;
        }
    }

    static std::string_view nameOf(uint16_t opcode) { return spvOpcodeString(opcode); }

    uint32_t typeOf(uint32_t id) const {
        const auto found = types_.find(id);
        return found == types_.end() ? 0 : found->second;
    }

    void linkConversion(const Instruction& item) {
        uint32_t value = item.operands()[0];
        if (typeOf(value) != reference_type_) value = emit(spv::OpBitcast, reference_type_, {value});
        body_.emplace_back(spv::OpCopyObject, reference_type_, item.result(), std::array{value});
        noteResult(body_.back());
    }

    // Calls of the library.

    void linkQuery(const Instruction& item, const char* name) {
        const auto [function_id, function] = libraryFunction(name);
        const std::span<const uint32_t> operands = item.operands();
        if (function.parameters.size() != operands.size())
            internal("{} has {} parameters, not {}", name, function.parameters.size(), operands.size());

        // A pointer into something larger may not be passed, nor one of a kind that the query shares with nothing.
        uint32_t query = operands[0];
        const auto pointer = pointers_.find(typeOf(query));
        if (pointer == pointers_.end() || pointer->second.pointee != query_type_)
            unsupported("{} names no ray query", nameOf(item.opcode));
        uint32_t storage_class = pointer->second.storage_class;
        const bool copied = !objects_.contains(query) ||
                            (storage_class != spv::StorageClassFunction && storage_class != spv::StorageClassPrivate);
        if (copied) {
            query = addLocal(query_type_);
            storage_class = spv::StorageClassFunction;
            emit(spv::OpStore, 0, {query, emit(spv::OpLoad, query_type_, {operands[0]})});
        }

        std::vector<uint32_t> arguments = {import(function_id, storage_class), query};
        for (size_t i = 1; i < operands.size(); i++)
            arguments.push_back(converted(operands[i], function.parameters[i], name));
        if (!item.has_result) {
            // A call has a result in any case.
            body_.emplace_back(spv::OpFunctionCall, function.return_type, next_++, arguments);
        } else if (item.type() == function.return_type) {
            body_.emplace_back(spv::OpFunctionCall, item.type(), item.result(), arguments);
        } else {
            const uint32_t value = emitOf(spv::OpFunctionCall, function.return_type, arguments);
            body_.emplace_back(spv::OpBitcast, item.type(), item.result(), std::array{value});
        }
        noteResult(body_.back());
        if (copied) emit(spv::OpStore, 0, {operands[0], emit(spv::OpLoad, query_type_, {query})});
    }

    /// An operand as the library's parameter wants it.
    uint32_t converted(uint32_t value, uint32_t type, const char* name) {
        const uint32_t from = typeOf(value);
        if (from == type) return value;
        if (const auto pointer = pointers_.find(type); pointer != pointers_.end()) {
            // A parameter that is not const: the compiler passes the place of a copy.
            const uint32_t copy = addLocal(pointer->second.pointee);
            emit(spv::OpStore, 0, {copy, converted(value, pointer->second.pointee, name)});
            return copy;
        }
        if (type == bool_type_) {
            // Which intersection is meant, committed or candidate, is a constant.
            const auto constant_value = constants_.find(value);
            if (constant_value == constants_.end() || specialized_.contains(value))
                return emit(spv::OpINotEqual, bool_type_, {value, shared(spv::OpConstant, from, {0}, 0)});
            return shared(constant_value->second ? spv::OpConstantTrue : spv::OpConstantFalse, bool_type_, {});
        }
        if (!from) internal("an operand of {} has no type", name);
        return emit(spv::OpBitcast, type, {value});
    }

    /// The id of a library's function whose query is in this storage class.
    uint32_t import(uint32_t function, uint32_t storage_class) {
        const auto [found, is_new] = imports_.try_emplace({function, storage_class}, 0);
        if (is_new) {
            found->second = storage_class == spv::StorageClassFunction ? moved(function) : next_++;
            pending_.push_back({function, storage_class, found->second});
        }
        return found->second;
    }

    /// Copies a function of the library. Compiled for a query among the variables of functions, it is made to work on
    /// one of another storage class by giving that class to all pointers which come from its first parameter.
    void importFunction(const Import& import_item) {
        const LibraryFunction& function = library_functions_.at(import_item.function);
        const bool as_compiled = import_item.storage_class == spv::StorageClassFunction;
        std::unordered_map<uint32_t, uint32_t> ids;
        std::unordered_set<uint32_t> queries;  // pointers to the query or into it, by the library's ids
        if (!as_compiled)
            for (const Instruction& instruction : *function.code)
                if (instruction.has_result) ids[instruction.result()] = next_++;
        ids[import_item.function] = import_item.id;
        const auto map = [&](uint32_t id) {
            const auto found = ids.find(id);
            return found == ids.end() ? moved(id) : found->second;
        };

        Instructions code;
        for (const Instruction& original : *function.code) {
            Instruction item = original;
            for (const uint16_t place : item.ids) item.words[place] = map(original.words[place]);
            if (!as_compiled) retarget(item, original, import_item, function, queries);
            if (item.opcode == spv::OpFunctionCall) {
                const bool with_query = original.operands().size() > 1 && queries.contains(original.operands()[1]);
                const uint32_t function_class = spv::StorageClassFunction;
                item.operands()[0] =
                    import(original.operands()[0], with_query ? import_item.storage_class : function_class);
            }
            if (item.has_result) {
                const auto notes = library_notes_.find(original.result());
                for (size_t i = 0; notes != library_notes_.end() && i < notes->second.size(); i++) {
                    Instruction note = moved(*notes->second[i]);
                    note.operands()[0] = item.result();
                    (note.opcode == spv::OpName ? added_names_ : added_decorations_).push_back(std::move(note));
                }
            }
            code.push_back(std::move(item));
        }
        result_.functions.push_back(std::move(code));
    }

    void retarget(Instruction& item, const Instruction& original, const Import& import_item,
                  const LibraryFunction& function, std::unordered_set<uint32_t>& queries) {
        switch (item.opcode) {
            case spv::OpFunction: {
                std::vector<uint32_t> operands = {function.return_type};
                operands.insert(operands.end(), function.parameters.begin(), function.parameters.end());
                operands[1] = pointerType(import_item.storage_class, query_type_);
                item.operands()[1] = sharedOf(spv::OpTypeFunction, 0, operands);
                break;
            }
            case spv::OpFunctionParameter:
                if (!queries.empty()) break;
                queries.insert(original.result());
                item.words[1] = pointerType(import_item.storage_class, query_type_);
                break;
            case spv::OpAccessChain:
            case spv::OpInBoundsAccessChain:
            case spv::OpCopyObject:
                if (!queries.contains(original.operands()[0])) break;
                queries.insert(original.result());
                item.words[1] = pointerType(import_item.storage_class, pointers_.at(item.type()).pointee);
                break;
            default: break;
        }
    }

    // What remains.

    void linkNames() {
        for (const Instruction& item : user_.names)
            if (aliased(item.operands()[0]) == item.operands()[0]) result_.names.push_back(item);
        for (const Instruction& item : user_.decorations)
            if (aliased(item.operands()[0]) == item.operands()[0]) result_.decorations.push_back(aliased(item));
        result_.modes = user_.modes;
        for (Instruction& item : result_.modes) item = aliased(item);
        // Notes on the library's globals; those within functions came with them.
        for (const Instruction& item : std::span(result_.globals).first(library_globals_)) {
            const auto notes = library_notes_.find(item.result() - user_.bound);
            if (!item.has_result || notes == library_notes_.end()) continue;
            for (const Instruction* note : notes->second) {
                const bool is_name = note->opcode == spv::OpName || note->opcode == spv::OpMemberName;
                (is_name ? added_names_ : added_decorations_).push_back(moved(*note));
            }
        }
        std::move(added_names_.begin(), added_names_.end(), std::back_inserter(result_.names));
        std::move(added_decorations_.begin(), added_decorations_.end(), std::back_inserter(result_.decorations));
    }

    /// Drops what the library declares and the shader has no use for, and what is said about ids that are not there.
    void sweep() {
        std::unordered_set<uint32_t> used;
        for (const Instructions& function : result_.functions)
            for (const Instruction& instruction : function) addIds(used, instruction);
        for (const Instruction& item : std::span(result_.globals).subspan(library_globals_)) addIds(used, item);
        for (size_t before = 0; before != used.size();) {
            before = used.size();
            for (size_t i = library_globals_; i-- > 0;)
                if (used.contains(result_.globals[i].result())) addIds(used, result_.globals[i]);
        }
        Instructions kept;
        Instruction entry = aliased(user_.entry_points[0]);
        for (size_t i = 0; i < result_.globals.size(); i++) {
            Instruction& item = result_.globals[i];
            if (i < library_globals_ && item.has_result && !used.contains(item.result())) continue;
            if (i < library_globals_ && item.opcode == spv::OpTypeForwardPointer && !used.contains(item.operands()[0]))
                continue;
            if (i < library_globals_ && item.opcode == spv::OpVariable && isInterface(item)) {
                entry.ids.push_back(static_cast<uint16_t>(entry.words.size()));
                entry.words.push_back(item.result());
            }
            kept.push_back(std::move(item));
        }
        result_.globals = std::move(kept);
        result_.entry_points = {std::move(entry)};

        std::unordered_set<uint32_t> defined;
        for (const Instruction& item : result_.globals) defined.insert(item.result());
        for (const Instruction& item : result_.decorations) defined.insert(item.result());
        for (const Instructions& function : result_.functions)
            for (const Instruction& instruction : function) defined.insert(instruction.result());
        const auto lost = [&](const Instruction& item) {
            return !item.has_result && !defined.contains(item.operands()[0]);
        };
        std::erase_if(result_.names, lost);
        std::erase_if(result_.decorations, lost);
    }

    /// Up to SPIR-V 1.3 entry points list inputs and outputs, from 1.4 all variables.
    bool isInterface(const Instruction& variable) const {
        const uint32_t storage_class = variable.operands()[0];
        return std::max(user_.version, library_.version) >= 0x10400 || storage_class == spv::StorageClassInput ||
               storage_class == spv::StorageClassOutput;
    }

    SpirvModule user_;
    const SpirvModule& library_;
    SpirvModule result_;
    uint32_t next_ = 0;            ///< the next free id
    std::vector<uint32_t> alias_;  ///< what stands for each of the user's ids

    std::map<std::string_view, uint32_t> library_names_;
    std::unordered_map<uint32_t, LibraryFunction> library_functions_;
    std::unordered_map<uint32_t, std::vector<const Instruction*>> library_notes_;
    size_t library_globals_ = 0;  ///< the first of the linked globals are the library's
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> imports_;
    std::deque<Import> pending_;

    uint32_t query_type_ = 0;
    uint32_t reference_type_ = 0;
    uint32_t uint_type_ = 0;
    uint32_t bool_type_ = 0;
    std::map<Key, uint32_t> shared_;
    std::unordered_map<uint32_t, PointerType> pointers_;
    std::unordered_map<uint32_t, uint32_t> constants_;  ///< first word of each
    std::unordered_set<uint32_t> specialized_;
    std::unordered_map<uint32_t, uint32_t> types_;  ///< of each result
    std::unordered_set<uint32_t> objects_;          ///< variables and parameters
    std::unordered_set<uint32_t> decorated_;        ///< by the user's module
    Instructions added_names_;
    Instructions added_decorations_;

    std::unordered_set<uint32_t> user_structures_;               ///< types of the user's module that hold structures
    std::unordered_map<uint32_t, StructureType> structures_;     ///< by type in the linked module
    std::unordered_map<uint32_t, uint32_t> structure_pointers_;  ///< type of a pointer to what it points to
    std::unordered_map<uint32_t, StructurePointer> structure_objects_;  ///< variables of the module
    std::unordered_map<uint32_t, StructurePointer> local_pointers_;     ///< of the function that is being linked
    Instructions body_;
    Instructions locals_;
};

}  // namespace

Expected<SpirvModule> linkRayQueries(SpirvModule user, std::string_view entry, uint32_t execution_model,
                                     const SpirvModule& library) {
    try {
        return Linker(std::move(user), library).run(entry, execution_model);
    } catch (const Refusal& refusal) { return unexpected(makeError(refusal.code, refusal.id, "{}", refusal.message)); }
}

}  // namespace glint::shader

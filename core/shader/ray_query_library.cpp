#include "ray_query_library.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>

namespace glint::shader {

namespace {

template <class... Args>
[[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) {
    throw RewriteRefusal{ErrorCode::Internal, "shader.tracing_internal",
                         fmt::format(format, std::forward<Args>(args)...)};
}

void addIds(std::unordered_set<uint32_t>& set, const Instruction& instruction) {
    for (const uint16_t place : instruction.ids) set.insert(instruction.words[place]);
}

}  // namespace

const char* rayQueryFunction(uint32_t opcode) {
    switch (opcode) {
        case spv::OpRayQueryInitializeKHR: return "glintQueryInitialize";
        case spv::OpRayQueryTerminateKHR: return "glintQueryTerminate";
        case spv::OpRayQueryGenerateIntersectionKHR: return "glintQueryGenerate";
        case spv::OpRayQueryConfirmIntersectionKHR: return "glintQueryConfirm";
        case spv::OpRayQueryProceedKHR: return "glintQueryProceed";
        case spv::OpRayQueryGetIntersectionTypeKHR: return "glintQueryType";
        case spv::OpRayQueryGetRayTMinKHR: return "glintQueryTMin";
        case spv::OpRayQueryGetRayFlagsKHR: return "glintQueryFlags";
        case spv::OpRayQueryGetIntersectionTKHR: return "glintQueryT";
        case spv::OpRayQueryGetIntersectionInstanceCustomIndexKHR: return "glintQueryInstanceCustomIndex";
        case spv::OpRayQueryGetIntersectionInstanceIdKHR: return "glintQueryInstanceId";
        case spv::OpRayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetKHR: return "glintQueryInstanceOffset";
        case spv::OpRayQueryGetIntersectionGeometryIndexKHR: return "glintQueryGeometryIndex";
        case spv::OpRayQueryGetIntersectionPrimitiveIndexKHR: return "glintQueryPrimitiveIndex";
        case spv::OpRayQueryGetIntersectionBarycentricsKHR: return "glintQueryBarycentrics";
        case spv::OpRayQueryGetIntersectionFrontFaceKHR: return "glintQueryFrontFace";
        case spv::OpRayQueryGetIntersectionCandidateAABBOpaqueKHR: return "glintQueryCandidateBoxOpaque";
        case spv::OpRayQueryGetIntersectionObjectRayDirectionKHR: return "glintQueryObjectRayDirection";
        case spv::OpRayQueryGetIntersectionObjectRayOriginKHR: return "glintQueryObjectRayOrigin";
        case spv::OpRayQueryGetWorldRayDirectionKHR: return "glintQueryWorldRayDirection";
        case spv::OpRayQueryGetWorldRayOriginKHR: return "glintQueryWorldRayOrigin";
        case spv::OpRayQueryGetIntersectionObjectToWorldKHR: return "glintQueryObjectToWorld";
        case spv::OpRayQueryGetIntersectionWorldToObjectKHR: return "glintQueryWorldToObject";
        default: return nullptr;
    }
}

RayQueryLibrary::RayQueryLibrary(const SpirvModule& library, uint32_t offset, SpirvBuilder& builder)
    : offset_(offset), builder_(builder) {
    for (const Instruction& name : library.names) {
        // "glintQueryProceed(struct-GlintQuery-...;" is how the compiler names a function.
        const std::string_view text = name.opcode == spv::OpName ? name.text(1) : std::string_view();
        names_.emplace(text.substr(0, text.find('(')), name.operands()[0]);
        notes_[name.operands()[0]].push_back(&name);
    }
    for (const Instruction& item : library.decorations) notes_[item.operands()[0]].push_back(&item);
    for (const Instructions& code : library.functions) {
        LibraryFunction& function = functions_[code[0].result()];
        function.id = code[0].result();
        function.code = &code;
        function.return_type = moved(code[0].type());
        for (const Instruction& instruction : code)
            if (instruction.opcode == spv::OpFunctionParameter)
                function.parameters.push_back(moved(instruction.type()));
    }
    for (const Instruction& item : library.globals) builder.addGlobal(moved(item));
    globals_ = builder.module.globals.size();

    const LibraryFunction& initialize = function("glintQueryInitialize");
    if (initialize.parameters.size() != 9) fail("glintQueryInitialize does not have 9 parameters");
    const std::optional<PointerType> query = builder.pointer(initialize.parameters[0]);
    if (!query) fail("the first parameter of glintQueryInitialize is not inout");
    query_type_ = query->pointee;
    reference_type_ = builder.shared(spv::OpTypeVector, 0, {builder.uintType(), 2}, 1);
}

Instruction RayQueryLibrary::moved(const Instruction& instruction) const {
    Instruction result = instruction;
    for (const uint16_t place : result.ids) result.words[place] += offset_;
    return result;
}

const LibraryFunction& RayQueryLibrary::function(std::string_view name) const {
    const auto found = names_.find(name);
    const auto function = found == names_.end() ? functions_.end() : functions_.find(found->second);
    if (function == functions_.end()) fail("the library has no function {}", name);
    return function->second;
}

uint32_t RayQueryLibrary::import(const LibraryFunction& function, uint32_t storage_class) {
    const auto [found, is_new] = imports_.try_emplace({function.id, storage_class}, 0);
    if (is_new) {
        found->second = storage_class == spv::StorageClassFunction ? moved(function.id) : builder_.newId();
        pending_.push_back({&function, storage_class, found->second});
    }
    return found->second;
}

void RayQueryLibrary::importPending() {
    while (!pending_.empty()) {
        const Import item = pending_.front();
        pending_.pop_front();
        importFunction(item);
    }
}

void RayQueryLibrary::copyNotes(uint32_t library_id, uint32_t id) {
    const auto notes = notes_.find(library_id);
    if (notes == notes_.end()) return;
    for (const Instruction* item : notes->second) {
        Instruction note = moved(*item);
        note.operands()[0] = id;
        const bool is_name = note.opcode == spv::OpName || note.opcode == spv::OpMemberName;
        (is_name ? builder_.module.names : builder_.module.decorations).push_back(std::move(note));
    }
}

/// Compiled for a query among the variables of functions, a function is made to work on one of another storage class by
/// giving that class to all pointers which come from its first parameter.
void RayQueryLibrary::importFunction(const Import& import_item) {
    const bool as_compiled = import_item.storage_class == spv::StorageClassFunction;
    const Instructions& code = *import_item.function->code;
    std::unordered_map<uint32_t, uint32_t> ids;
    std::unordered_set<uint32_t> queries;  // pointers to the query or into it, by the library's ids
    if (!as_compiled)
        for (const Instruction& instruction : code)
            if (instruction.has_result) ids[instruction.result()] = builder_.newId();
    ids[import_item.function->id] = import_item.id;

    Instructions result;
    for (const Instruction& original : code) {
        Instruction item = original;
        for (const uint16_t place : item.ids) {
            const auto found = ids.find(original.words[place]);
            item.words[place] = found == ids.end() ? moved(original.words[place]) : found->second;
        }
        if (!as_compiled) retarget(item, original, import_item, queries);
        if (item.opcode == spv::OpFunctionCall) {
            const bool with_query = original.operands().size() > 1 && queries.contains(original.operands()[1]);
            const uint32_t function_class = spv::StorageClassFunction;
            item.operands()[0] =
                import(functions_.at(original.operands()[0]), with_query ? import_item.storage_class : function_class);
        }
        if (item.has_result) copyNotes(original.result(), item.result());
        result.push_back(std::move(item));
    }
    builder_.module.functions.push_back(std::move(result));
}

void RayQueryLibrary::retarget(Instruction& item, const Instruction& original, const Import& import_item,
                               std::unordered_set<uint32_t>& queries) {
    const uint32_t storage_class = import_item.storage_class;
    switch (item.opcode) {
        case spv::OpFunction: {
            std::vector<uint32_t> operands = {import_item.function->return_type};
            operands.insert(operands.end(), import_item.function->parameters.begin(),
                            import_item.function->parameters.end());
            operands[1] = builder_.pointerType(storage_class, query_type_);
            item.operands()[1] = builder_.shared(spv::OpTypeFunction, 0, operands);
            break;
        }
        case spv::OpFunctionParameter:
            if (!queries.empty()) break;
            queries.insert(original.result());
            item.words[1] = builder_.pointerType(storage_class, query_type_);
            break;
        case spv::OpAccessChain:
        case spv::OpInBoundsAccessChain:
        case spv::OpCopyObject:
            if (!queries.contains(original.operands()[0])) break;
            queries.insert(original.result());
            item.words[1] = builder_.pointerType(storage_class, builder_.pointer(item.type())->pointee);
            break;
        default: break;
    }
}

Instructions RayQueryLibrary::sweep() {
    Instructions& globals = builder_.module.globals;
    std::unordered_set<uint32_t> used;
    for (const Instructions& function : builder_.module.functions)
        for (const Instruction& instruction : function) addIds(used, instruction);
    for (size_t i = globals_; i < globals.size(); i++) addIds(used, globals[i]);
    // More than once, for a pointer may be declared before what it points to.
    for (size_t before = 0; before != used.size();) {
        before = used.size();
        for (size_t i = globals_; i-- > 0;)
            if (used.contains(globals[i].result())) addIds(used, globals[i]);
    }
    Instructions kept, variables;
    for (size_t i = 0; i < globals.size(); i++) {
        Instruction& item = globals[i];
        if (i < globals_) {
            if (!used.contains(item.has_result ? item.result() : item.operands()[0])) continue;
            if (item.has_result) copyNotes(item.result() - offset_, item.result());
            if (item.opcode == spv::OpVariable) variables.push_back(item);
        }
        kept.push_back(std::move(item));
    }
    globals = std::move(kept);
    return variables;
}

}  // namespace glint::shader

#include "traversal_cut.h"

#include "spirv_builder.h"
#include "structured_flow.h"
#include "traversal_live.h"

#include <glint/base/format_error.h>

#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

[[noreturn]] void unsupported(std::string_view what, std::string_view line = {}) {
    throw RewriteRefusal{ErrorCode::Unsupported, "shader.traversal_unsupported",
                         fmt::format("{}{}: {}", line.empty() ? "" : ", ", line, what)};
}

class Cutter {
public:
    Cutter(SpirvModule& module, uint32_t entry)
        : module_(module), builder_(module.bound), entry_(entry), flow_(function(), [&] { return builder_.newId(); }) {
        for (Instruction& item : module_.globals) {
            if (item.has_result) types_[item.result()] = item.opcode;
            builder_.addGlobal(std::move(item));
        }
        for (const Instruction& note : module_.decorations) notes_[note.operands()[0]].push_back(note);
        for (const Instruction& variable : flow_.variables) {
            const std::span<const uint32_t> operands = variable.operands();
            addVariable(variable.result(), builder_.pointer(variable.type())->pointee,
                        operands.size() > 1 ? operands[1] : 0);
        }
        for (FlowBlock& block : flow_.blocks)
            for (Instructions* part : {&block.phis, &block.body})
                for (Instruction& item : *part) retype(item);
    }

    StageCut run() {
        const FlowPieces pieces(flow_);
        pieces_ = &pieces;
        // The stage begins with the first block; others follow in the order of the text.
        heads_.assign(pieces.heads().begin(), pieces.heads().end());
        std::ranges::sort(heads_, {}, [&](uint32_t label) { return flow_.place(label); });
        for (size_t i = 0; i < heads_.size(); i++) numbers_[heads_[i]] = static_cast<uint32_t>(i);
        result_.next = builder_.newId();
        addVariable(result_.next, builder_.uintType(), 0);
        result_.pieces.resize(heads_.size());
        for (StagePiece& piece : result_.pieces) piece.function = builder_.newId();
        findDefinitions();
        for (const FlowBlock& block : flow_.blocks)
            if (pieces.headOf(block.label)) findNeeds(block);
        for (const uint32_t id : needed_) {
            variables_[id] = builder_.newId();
            addVariable(variables_[id], builder_.typeOf(id), 0);
        }
        std::vector<PieceExits> exits;
        std::vector<Instructions> functions;
        for (const uint32_t head : heads_) {
            writePiece(head);
            functions.push_back(std::move(out_));
            exits.push_back(std::move(exits_));
        }
        std::erase_if(module_.functions, [&](const Instructions& item) { return item[0].result() == entry_; });
        findLive(builder_.module.globals, module_, functions, exits, result_);
        std::ranges::move(functions, std::back_inserter(module_.functions));
        module_.globals = std::move(builder_.module.globals);
        std::ranges::move(builder_.module.decorations, std::back_inserter(module_.decorations));
        module_.bound = builder_.bound();
        return std::move(result_);
    }

private:
    const Instructions& function() const {
        return *std::ranges::find(module_.functions, entry_, [](const Instructions& item) { return item[0].result(); });
    }

    void addVariable(uint32_t id, uint32_t type, uint32_t initializer) {
        std::vector<uint32_t> operands = {spv::StorageClassPrivate};
        if (initializer) operands.push_back(initializer);
        Instruction item(spv::OpVariable, builder_.pointerType(spv::StorageClassPrivate, type), id, operands, 0);
        if (initializer) item.ids.push_back(4);
        builder_.addGlobal(std::move(item));
        if (const std::optional<PointerType> pointer = builder_.pointer(type);
            pointer && pointer->storage_class == spv::StorageClassPhysicalStorageBuffer)
            builder_.decorate(id, {spv::DecorationAliasedPointer});
    }

    /// Places within variables that were the function's.
    void retype(Instruction& item) {
        if (item.opcode == spv::OpFunctionCall)
            for (const uint32_t argument : item.operands().subspan(1))
                if (const auto pointer = builder_.pointer(builder_.typeOf(argument));
                    pointer && pointer->storage_class == spv::StorageClassPrivate)
                    unsupported("a function that takes a place of a variable cannot be made part of its caller");
        if (item.has_type)
            if (const auto pointer = builder_.pointer(item.type());
                pointer && pointer->storage_class == spv::StorageClassFunction)
                item.words[1] = builder_.pointerType(spv::StorageClassPrivate, pointer->pointee);
        builder_.note(item);
    }

    // Values that pieces take over.

    struct Definition {
        const Instruction* item = nullptr;
        uint32_t head = 0;
    };

    void findDefinitions() {
        for (const FlowBlock& block : flow_.blocks)
            for (const Instructions* part : {&block.phis, &block.body})
                for (const Instruction& item : *part)
                    if (item.has_result) definitions_[item.result()] = {&item, pieces_->headOf(block.label)};
    }

    /// Not kept but made again: what no variable can hold.
    bool isMadeAgain(const Instruction& item) const {
        switch (item.opcode) {
            case spv::OpUndef: return true;
            case spv::OpAccessChain:
            case spv::OpInBoundsAccessChain:
            case spv::OpPtrAccessChain:
            case spv::OpImageTexelPointer:
            case spv::OpSampledImage:
            case spv::OpImage:
            case spv::OpConvertUToAccelerationStructureKHR:
            case spv::OpConvertUToPtr: return true;
            case spv::OpCopyObject:
            case spv::OpLoad: return isOpaque(item.type());
            default: return false;
        }
    }

    bool isOpaque(uint32_t type) const {
        const auto found = types_.find(type);
        if (found == types_.end()) return false;
        if (found->second == spv::OpTypePointer)
            return builder_.pointer(type)->storage_class != spv::StorageClassPhysicalStorageBuffer;
        return found->second == spv::OpTypeImage || found->second == spv::OpTypeSampler ||
               found->second == spv::OpTypeSampledImage || found->second == spv::OpTypeAccelerationStructureKHR;
    }

    /// The value's definition if that is in another piece.
    const Instruction* elsewhere(uint32_t id, uint32_t head) const {
        const auto found = definitions_.find(id);
        return found == definitions_.end() || found->second.head == head ? nullptr : found->second.item;
    }

    void need(uint32_t id, uint32_t head) {
        const Instruction* const item = elsewhere(id, head);
        if (!item) return;
        if (isMadeAgain(*item)) return needOperands(*item, head);
        if (isOpaque(item->type())) unsupported("what a branch before traceRayEXT has chosen is no number", line_);
        needed_.insert(id);
    }

    std::string lineOf(const Instruction& item) const {
        const auto file = std::ranges::find(module_.sources, item.operands()[0], &Instruction::result);
        return fmt::format("{}:{}", file->text(0), item.operands()[1]);
    }

    void needOperands(const Instruction& item, uint32_t head) {
        for (const uint16_t place : item.ids)
            if (place >= item.words.size() - item.operands().size()) need(item.words[place], head);
    }

    void findNeeds(const FlowBlock& block) {
        const uint32_t head = pieces_->headOf(block.label);
        for (const Instruction& phi : block.phis) {
            if (block.label == head) needed_.insert(phi.result());
            for (size_t i = 0; i < phi.operands().size(); i += 2)
                if (const uint32_t from = pieces_->headOf(phi.operands()[i + 1])) need(phi.operands()[i], from);
        }
        line_.clear();
        for (const Instruction& item : block.body) {
            if (item.opcode == spv::OpLine) line_ = lineOf(item);
            needOperands(item, head);
        }
        if (block.end.opcode != spv::OpBranch) needOperands(block.end, head);
    }

    // Writing a piece.

    void emit(uint32_t opcode, std::span<const uint32_t> operands, size_t literals_from = SIZE_MAX) {
        out_.emplace_back(opcode, 0, 0, operands, literals_from);
    }
    void emitLabel(uint32_t label) {
        out_.emplace_back(spv::OpLabel, 0, label, std::span<const uint32_t>());
        label_ = label;
        made_.clear();
    }
    uint32_t emitLoad(uint32_t id) {
        const uint32_t value = builder_.newId();
        out_.emplace_back(spv::OpLoad, builder_.typeOf(id), value, std::array{variables_.at(id)});
        return value;
    }
    void keep(const Instruction& item) {
        if (item.has_result && needed_.contains(item.result()))
            emit(spv::OpStore, std::array{variables_.at(item.result()), item.result()});
    }

    /// The value in this block.
    uint32_t here(uint32_t id) {
        const Instruction* const item = elsewhere(id, head_);
        if (!item) return id;
        if (const auto made = made_.find(id); made != made_.end()) return made->second;
        uint32_t value = 0;
        if (!isMadeAgain(*item)) {
            value = emitLoad(id);
        } else {
            Instruction again = withOperandsHere(*item);
            value = builder_.newId();
            again.words[2] = value;
            out_.push_back(std::move(again));
            for (Instruction note : notes_[id]) {
                note.operands()[0] = value;
                builder_.module.decorations.push_back(std::move(note));
            }
        }
        return made_[id] = value;
    }

    Instruction withOperandsHere(const Instruction& original) {
        Instruction item = original;
        for (const uint16_t place : item.ids)
            if (place >= item.words.size() - item.operands().size()) item.words[place] = here(item.words[place]);
        return item;
    }

    void writePiece(uint32_t head) {
        head_ = head;
        out_.clear();
        exits_.clear();
        edges_.clear();
        phi_values_.clear();
        const uint32_t void_type = builder_.shared(spv::OpTypeVoid, 0, {});
        const uint32_t function_type = builder_.shared(spv::OpTypeFunction, 0, {void_type});
        Instruction begin(spv::OpFunction, void_type, result_.pieces[numbers_.at(head)].function,
                          std::array{0u, function_type});
        begin.ids = {1, 2, 4};  // the control between them is a literal
        out_.push_back(std::move(begin));
        emitLabel(builder_.newId());
        // The head's phis are what other pieces have stored; that of a loop goes on with those of its turns.
        const FlowBlock& first = flow_.at(head);
        const bool is_loop = first.isLoop() && !pieces_->isDissolved(head);
        std::unordered_map<uint32_t, uint32_t> loaded;
        for (const Instruction& phi : first.phis) {
            if (is_loop) {
                loaded[phi.result()] = emitLoad(phi.result());
            } else {
                out_.emplace_back(spv::OpLoad, phi.type(), phi.result(), std::array{variables_.at(phi.result())});
            }
        }
        const uint32_t entrance = label_;
        emit(spv::OpBranch, std::array{head});
        std::vector<size_t> phis;
        for (const FlowBlock& block : flow_.blocks) {
            if (pieces_->headOf(block.label) != head) continue;
            emitLabel(block.label);
            if (block.label != head || is_loop) {
                for (const Instruction& phi : block.phis) {
                    phis.push_back(out_.size());
                    std::vector<uint32_t> operands;
                    if (block.label == head) operands = {loaded.at(phi.result()), entrance};
                    for (size_t i = 0; i < phi.operands().size(); i += 2)
                        if (pieces_->headOf(phi.operands()[i + 1]) == head)
                            operands.insert(operands.end(), {phi.operands()[i], phi.operands()[i + 1]});
                    out_.emplace_back(spv::OpPhi, phi.type(), phi.result(), operands);
                }
                for (const Instruction& phi : block.phis) keep(phi);
            }
            for (const Instruction& item : block.body) {
                out_.push_back(withOperandsHere(item));
                keep(item);
            }
            writeEnd(block);
        }
        out_.emplace_back(spv::OpFunctionEnd, 0, 0, std::span<const uint32_t>());
        for (const size_t place : phis) finishPhi(out_[place]);
    }

    void finishPhi(Instruction& phi) {
        const std::span<uint32_t> operands = phi.operands();
        for (size_t i = 0; i < operands.size(); i += 2) {
            const uint32_t from = operands[i + 1];
            if (const auto value = phi_values_.find({from, phi.result()}); value != phi_values_.end())
                operands[i] = value->second;
            if (const auto edge = edges_.find(from); edge != edges_.end()) operands[i + 1] = edge->second;
        }
    }

    // Ends of blocks.

    void leaveTo(uint32_t number) {
        emit(spv::OpStore, std::array{result_.next, builder_.constant(number)});
        exits_[label_].push_back(number);
        out_.emplace_back(spv::OpReturn, 0, 0, std::span<const uint32_t>());
    }

    /// The end of a block that goes on in another piece, from the block `from` of the stage.
    void leave(uint32_t from, uint32_t to) {
        std::vector<std::array<uint32_t, 2>> stores;
        for (const Instruction& phi : flow_.at(to).phis)
            for (size_t i = 0; i < phi.operands().size(); i += 2)
                if (phi.operands()[i + 1] == from)
                    stores.push_back({variables_.at(phi.result()), here(phi.operands()[i])});
        for (const auto& store : stores) emit(spv::OpStore, store);
        leaveTo(numbers_.at(to));
    }

    void writeEnd(const FlowBlock& block) {
        // Values of the phis that this block leads to.
        for (const uint32_t next : block.targets) {
            if (pieces_->leaves(block.label, next)) continue;
            for (const Instruction& phi : flow_.at(next).phis)
                for (size_t i = 0; i < phi.operands().size(); i += 2)
                    if (phi.operands()[i + 1] == block.label)
                        phi_values_[{block.label, phi.result()}] = here(phi.operands()[i]);
        }
        switch (block.end.opcode) {
            case spv::OpTraceRayKHR: {
                out_.push_back(withOperandsHere(block.end));
                const uint32_t number = numbers_.at(block.targets[0]);
                result_.pieces[numbers_.at(head_)].after = number;
                StagePiece& after = result_.pieces[number];
                after.payload = block.end.operands()[10];
                for (const Instruction& item : block.body)
                    if (item.opcode == spv::OpLine) after.line = lineOf(item);
                return leave(block.label, block.targets[0]);
            }
            case spv::OpReturn: return leaveTo(static_cast<uint32_t>(heads_.size()));
            case spv::OpBranch:
                if (pieces_->leaves(block.label, block.targets[0])) return leave(block.label, block.targets[0]);
                [[fallthrough]];
            default:
                if (block.end.opcode == spv::OpBranchConditional || block.end.opcode == spv::OpSwitch)
                    return writeBranch(block);
                if (block.merge.opcode && !pieces_->isDissolved(block.label)) out_.push_back(block.merge);
                out_.push_back(block.end);
        }
    }

    void writeBranch(const FlowBlock& block) {
        Instruction end = block.end;
        const size_t labels = 1;  // after the condition
        end.words[end.ids[0]] = here(end.words[end.ids[0]]);
        const bool is_header = block.isHeader() && !pieces_->isDissolved(block.label);
        std::map<uint32_t, uint32_t> stubs;  // blocks that leave the piece, by what they lead to
        uint32_t stays = 0;
        for (size_t i = labels; i < end.ids.size(); i++) {
            const uint32_t target = end.words[end.ids[i]];
            if (pieces_->leaves(block.label, target)) {
                uint32_t& stub = stubs[target];
                if (!stub) stub = builder_.newId();
            } else {
                stays = target;
            }
        }
        if (!stays && end.opcode == spv::OpBranchConditional && !is_header && chooseNext(block, end)) return;
        uint32_t fresh = 0;
        if (is_header) {
            out_.push_back(block.merge);
        } else if (!stubs.empty()) {
            // What was a way out of a loop or a switch that is dissolved is a choice of its own now.
            fresh = builder_.newId();
            emit(spv::OpSelectionMerge, std::array{fresh, 0u}, 1);
        }
        for (size_t i = labels; i < end.ids.size(); i++) {
            uint32_t& label = end.words[end.ids[i]];
            if (const auto stub = stubs.find(label); stub != stubs.end())
                label = stub->second;
            else if (fresh)
                label = fresh;
        }
        out_.push_back(std::move(end));
        for (const auto& [target, stub] : stubs) {
            emitLabel(stub);
            leave(block.label, target);
        }
        if (!fresh) return;
        emitLabel(fresh);
        if (stays) {
            emit(spv::OpBranch, std::array{stays});
            edges_[block.label] = fresh;
        } else {
            out_.emplace_back(spv::OpUnreachable, 0, 0, std::span<const uint32_t>());
        }
    }

    /// Both ways lead to other pieces, with no values on them: a branch is not needed.
    bool chooseNext(const FlowBlock& block, const Instruction& end) {
        const uint32_t yes = end.operands()[1], no = end.operands()[2];
        if (!flow_.at(yes).phis.empty() || !flow_.at(no).phis.empty()) return false;
        const uint32_t chosen = builder_.newId();
        const std::array operands = {end.operands()[0], builder_.constant(numbers_.at(yes)),
                                     builder_.constant(numbers_.at(no))};
        out_.emplace_back(spv::OpSelect, builder_.uintType(), chosen, operands);
        emit(spv::OpStore, std::array{result_.next, chosen});
        exits_[block.label] = {numbers_.at(yes), numbers_.at(no)};
        out_.emplace_back(spv::OpReturn, 0, 0, std::span<const uint32_t>());
        return true;
    }

    SpirvModule& module_;
    SpirvBuilder builder_;
    const uint32_t entry_;
    StructuredFlow flow_;
    const FlowPieces* pieces_ = nullptr;
    std::vector<uint32_t> heads_;
    std::unordered_map<uint32_t, uint32_t> numbers_;  ///< of pieces, by their heads
    std::unordered_map<uint32_t, uint32_t> types_;    ///< opcodes
    std::unordered_map<uint32_t, Instructions> notes_;
    std::unordered_map<uint32_t, Definition> definitions_;
    std::string line_;                                  ///< in which values are looked at
    std::set<uint32_t> needed_;                         ///< values that have a variable
    std::unordered_map<uint32_t, uint32_t> variables_;  ///< theirs
    StageCut result_;

    // Of the piece in the making.
    uint32_t head_ = 0;
    uint32_t label_ = 0;
    Instructions out_;
    PieceExits exits_;
    std::unordered_map<uint32_t, uint32_t> made_;   ///< values made again in this block
    std::unordered_map<uint32_t, uint32_t> edges_;  ///< the block in between, by the block that leads to it
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> phi_values_;  ///< by the block they come from and the phi
};

}  // namespace

bool traces(const SpirvModule& module, uint32_t entry) {
    std::vector<uint32_t> reached = {entry};
    for (size_t i = 0; i < reached.size(); i++) {
        const auto function =
            std::ranges::find(module.functions, reached[i], [](const Instructions& item) { return item[0].result(); });
        for (const Instruction& item : *function) {
            if (item.opcode == spv::OpTraceRayKHR) return true;
            if (item.opcode == spv::OpFunctionCall && std::ranges::count(reached, item.operands()[0]) == 0)
                reached.push_back(item.operands()[0]);
        }
    }
    return false;
}

StageCut cutAtTraces(SpirvModule& module, uint32_t entry) {
    for (const Instructions& function : module.functions)
        for (const Instruction& item : function)
            if (item.opcode == spv::OpFunctionCall && traces(module, item.operands()[0]))
                unsupported("a function that calls traceRayEXT cannot be made part of its caller");
    return Cutter(module, entry).run();
}

}  // namespace glint::shader

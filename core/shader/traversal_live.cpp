#include "traversal_live.h"

#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <set>
#include <unordered_map>
#include <unordered_set>

namespace glint::shader {

namespace {

using Variables = std::vector<bool>;

/// Storage of the stage's own that another call of it overwrites with something else.
bool isKept(uint32_t storage_class) {
    switch (storage_class) {
        case spv::StorageClassRayPayloadKHR:
        case spv::StorageClassIncomingRayPayloadKHR:
        case spv::StorageClassCallableDataKHR:
        case spv::StorageClassHitAttributeKHR:
        case spv::StorageClassShaderRecordBufferKHR:
        case spv::StorageClassInput:
        case spv::StorageClassPrivate: return true;
        default: return false;
    }
}

class Liveness {
public:
    Liveness(const Instructions& globals, const SpirvModule& module, const StageCut& cut) : next_(cut.next) {
        std::unordered_set<uint32_t> same;  // in all calls of the stage
        for (const Instruction& note : module.decorations)
            if (note.opcode == spv::OpDecorate && note.operands()[1] == spv::DecorationBuiltIn &&
                (note.operands()[2] == spv::BuiltInLaunchIdKHR || note.operands()[2] == spv::BuiltInLaunchSizeKHR))
                same.insert(note.operands()[0]);
        for (const Instruction& item : globals) {
            if (item.opcode != spv::OpVariable || !isKept(item.operands()[0])) continue;
            if (item.result() == next_ || same.contains(item.result())) continue;
            numbers_[item.result()] = ids_.size();
            ids_.push_back(item.result());
        }
        end_.resize(ids_.size());
        called_.resize(ids_.size());
        for (const Instruction& item : globals)
            if (item.opcode == spv::OpVariable && item.operands()[0] == spv::StorageClassIncomingRayPayloadKHR)
                end_[numbers_.at(item.result())] = true;
        // A function that the stage calls may use what it names.
        for (const Instructions& function : module.functions)
            for (const Instruction& item : function)
                for (const uint16_t place : item.ids)
                    if (const auto found = numbers_.find(item.words[place]); found != numbers_.end())
                        called_[found->second] = true;
    }

    void addPiece(const Instructions& function, const PieceExits& exits, const StageCut& cut, uint32_t number) {
        const size_t first = blocks_.size();
        std::unordered_map<uint32_t, size_t> places;
        for (const Instruction& item : function)
            if (item.opcode == spv::OpLabel) {
                places[item.result()] = blocks_.size();
                blocks_.push_back({Variables(ids_.size()), Variables(ids_.size()), Variables(ids_.size()), {}, {}});
            }
        begins_.push_back(first);
        payloads_.push_back(cut.pieces[number].payload);
        size_t at = first;
        for (const Instruction& item : function) {
            if (item.opcode == spv::OpLabel) {
                at = places.at(item.result());
                if (const auto found = exits.find(item.result()); found != exits.end())
                    blocks_[at].exits = found->second;
                continue;
            }
            for (const uint16_t place : item.ids)
                if (const auto block = places.find(item.words[place]); block != places.end())
                    blocks_[at].next.push_back(block->second);
            addUse(blocks_[at], item);
        }
    }

    void run(StageCut& cut) {
        for (bool changed = true; changed;) {
            changed = false;
            for (size_t i = blocks_.size(); i-- > 0;) {
                Block& block = blocks_[i];
                Variables live(ids_.size());
                const auto join = [&](const Variables& more, uint32_t except) {
                    for (size_t k = 0; k < live.size(); k++)
                        if (more[k] && ids_[k] != except) live[k] = true;
                };
                for (const size_t next : block.next) join(blocks_[next].live, 0);
                for (const uint32_t piece : block.exits) {
                    if (piece < begins_.size())
                        join(blocks_[begins_[piece]].live, payloads_[piece]);
                    else
                        join(end_, 0);
                }
                for (size_t k = 0; k < live.size(); k++) live[k] = block.reads[k] || (live[k] && !block.writes[k]);
                changed = changed || live != block.live;
                block.live = std::move(live);
            }
        }
        for (size_t i = 0; i < begins_.size(); i++) {
            if (!payloads_[i]) continue;
            for (size_t k = 0; k < ids_.size(); k++)
                if (blocks_[begins_[i]].live[k] && ids_[k] != payloads_[i]) cut.pieces[i].live.push_back(ids_[k]);
        }
    }

private:
    struct Block {
        Variables reads;   ///< before it writes to them
        Variables writes;  ///< as a whole
        Variables live;    ///< where it begins
        std::vector<size_t> next;
        std::vector<uint32_t> exits;
    };

    /// The variable that an id is, or a place in.
    const size_t* find(uint32_t id) {
        if (const auto chain = chains_.find(id); chain != chains_.end()) id = chain->second;
        const auto found = numbers_.find(id);
        return found == numbers_.end() ? nullptr : &found->second;
    }

    void addUse(Block& block, const Instruction& item) {
        const auto read = [&](size_t variable) {
            if (!block.writes[variable]) block.reads[variable] = true;
        };
        const std::span<const uint32_t> operands = item.operands();
        switch (item.opcode) {
            case spv::OpAccessChain:
            case spv::OpInBoundsAccessChain:
            case spv::OpCopyObject:
                if (const size_t* variable = find(operands[0])) chains_[item.result()] = ids_[*variable];
                return;
            case spv::OpStore:
                if (const auto whole = numbers_.find(operands[0]); whole != numbers_.end())
                    block.writes[whole->second] = true;
                return;
            case spv::OpFunctionCall:
                for (size_t k = 0; k < called_.size(); k++)
                    if (called_[k]) read(k);
                break;
            default: break;
        }
        for (const uint16_t place : item.ids)
            if (const size_t* variable = find(item.words[place])) read(*variable);
    }

    const uint32_t next_;
    std::vector<uint32_t> ids_;
    std::unordered_map<uint32_t, size_t> numbers_;
    std::unordered_map<uint32_t, uint32_t> chains_;
    Variables end_;     ///< what is read after the stage's own code
    Variables called_;  ///< what functions use
    std::vector<Block> blocks_;
    std::vector<size_t> begins_;      ///< first block of each piece
    std::vector<uint32_t> payloads_;  ///< set where a piece begins
};

}  // namespace

void findLive(const Instructions& globals, const SpirvModule& module, const std::vector<Instructions>& pieces,
              const std::vector<PieceExits>& exits, StageCut& cut) {
    Liveness liveness(globals, module, cut);
    for (uint32_t i = 0; i < pieces.size(); i++) liveness.addPiece(pieces[i], exits[i], cut, i);
    liveness.run(cut);
}

}  // namespace glint::shader
